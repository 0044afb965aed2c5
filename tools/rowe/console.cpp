// SPDX-License-Identifier: Apache-2.0
#include "console.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "output.hpp"
#include "text/json_values.hpp"

namespace rowe::tools {
namespace {

void append_code_point(std::string& to, unsigned code) {
  constexpr std::string_view digits = "0123456789abcdef";
  to.append("\\u00");
  to += digits[code >> 4 & 0xf];
  to += digits[code & 0xf];
}

// Of the character in front of a text in UTF-8; 0 where there is none, as in a text that was cut.
std::size_t bytes_of_character(std::string_view text) noexcept {
  const auto at = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const unsigned lead = at(0);
  if (lead < 0x80) return 1;
  const std::size_t bytes = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  const unsigned least = lead == 0xe0 ? 0xa0 : lead == 0xf0 ? 0x90 : 0x80; // less has a shorter form
  const unsigned most = lead == 0xed ? 0x9f : lead == 0xf4 ? 0x8f : 0xbf;  // more is a surrogate, or no code
  if (lead < 0xc2 || lead > 0xf4 || at(1) < least || at(1) > most) return 0;
  for (std::size_t i = 2; i < bytes; ++i)
    if ((at(i) & 0xc0) != 0x80) return 0;
  return bytes;
}

std::string_view name_of(severity how) noexcept {
  switch (how) {
  case severity::error: return "error";
  case severity::warning: return "warning";
  case severity::notice: return "notice";
  case severity::info: break;
  }
  return "info";
}

// RFC 3339, UTC, milliseconds.
std::string time_of_day() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  tm parts{};
  ::gmtime_r(&now.tv_sec, &parts);
  std::array<char, 40> text;
  const std::size_t bytes = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  std::snprintf(text.data() + bytes, text.size() - bytes, ".%03ldZ", now.tv_nsec / 1'000'000);
  return text.data();
}

} // namespace

void part::append_to(std::string& text) const {
  switch (kind_) {
  case kind::text: text.append(text_); break;
  case kind::signed_number: text.append(std::to_string(static_cast<std::int64_t>(number_))); break;
  case kind::unsigned_number: text.append(std::to_string(number_)); break;
  }
}

std::string joined_parts(std::span<const part> parts) {
  std::string text;
  for (const part& one : parts) one.append_to(text);
  return text;
}

// journald names its stream "DEVICE:INODE". Whoever redirects stderr inherits the name, so it is compared.
bool journal_reads_stderr() {
  const char* const named = std::getenv("JOURNAL_STREAM");
  struct stat is {};
  return named != nullptr && ::fstat(STDERR_FILENO, &is) == 0 &&
         joined(static_cast<std::uint64_t>(is.st_dev), ":", static_cast<std::uint64_t>(is.st_ino)) == named;
}

// A line is one write, and so is not mixed with those of other programs.
void console::say(severity how, std::string_view message, std::string_view members) const {
  if (quiet_ && how > severity::warning) return;
  std::string line = style_.priorities ? joined("<", static_cast<int>(how), ">") : std::string{};
  if (style_.json) {
    line.append(joined("{\"time\":\"", time_of_day(), "\",\"severity\":\"", name_of(how),
                       "\",\"program\":", json_string_of(verb_), ",\"message\":", json_string_of(message)));
    if (!members.empty()) line.append(joined(",", members));
    line.append("}\n");
  } else {
    line.append(joined(verb_, ": ", message, "\n"));
  }
  write_to_stderr(line);
}

std::string sentence_of(const event& happened) {
  const std::string_view peer = happened.peer;
  const std::string_view what = happened.what;
  const std::string_view remedy = happened.remedy;
  std::string line;
  if (what.find(peer) == std::string_view::npos)
    line.append(peer).append(": "); // some sentences name it already
  line.append(what);
  if (!remedy.empty()) line.append(" (").append(remedy).append(")");
  return printable(line);
}

std::string printable(std::string_view text) {
  std::string shown;
  shown.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0U;
    if (byte < 0x20 || byte == 0x7f) {
      append_code_point(shown, byte);
    } else if (byte == 0xc2 && next >= 0x80 && next < 0xa0) {
      append_code_point(shown, next);
      ++i;
    } else if (const std::size_t bytes = bytes_of_character(text.substr(i)); bytes != 0) {
      shown.append(text.substr(i, bytes));
      i += bytes - 1;
    } else {
      shown.append("\ufffd");
    }
  }
  return shown;
}

std::string quoted(std::string_view text) { return joined("'", printable(text), "'"); }

std::string seconds_text(rt::duration time) {
  std::array<char, 40> buffer;
  const int length =
      std::snprintf(buffer.data(), buffer.size(), "%.3f s", std::chrono::duration<double>(time).count());
  return {buffer.data(), static_cast<std::size_t>(length)};
}

} // namespace rowe::tools
