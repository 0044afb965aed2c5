// SPDX-License-Identifier: Apache-2.0
#include "console.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <iterator>

#include "output.hpp"
#include "text/json_values.hpp"

namespace rowe::tools {
namespace {

// As JSON has it: beyond U+FFFF two of them.
void append_code_point(std::string& to, char32_t code) {
  if (code > 0xffff) {
    append_code_point(to, 0xd800 + ((code - 0x10000) >> 10U));
    code = 0xdc00 + (code & 0x3ff);
  }
  std::array<char, 8> text;
  std::snprintf(text.data(), text.size(), "\\u%04x", static_cast<unsigned>(code));
  to.append(text.data());
}

// Controls; what ends a line; what has no width, or no ink, or says in which direction is written (UAX 9,
// UTS 39).
bool misleads(char32_t code) noexcept {
  struct range {
    char32_t first, last;
  };
  constexpr range ranges[] = {{0, 0x1f},         {0x7f, 0xa0},     {0xad, 0xad},     {0x61c, 0x61c},
                              {0x115f, 0x1160},  {0x1680, 0x1680}, {0x180e, 0x180e}, {0x2000, 0x200f},
                              {0x2028, 0x202f},  {0x205f, 0x206f}, {0x2800, 0x2800}, {0x3000, 0x3000},
                              {0x3164, 0x3164},  {0xfeff, 0xfeff}, {0xffa0, 0xffa0}, {0xfff9, 0xfffb},
                              {0xe0000, 0xe007f}};
  return std::any_of(std::begin(ranges), std::end(ranges),
                     [code](const range& one) { return code >= one.first && code <= one.last; });
}

// In quotes that the text itself cannot end.
std::string words_of_peer(std::string_view text) {
  std::string escaped{text};
  for (std::size_t at = 0; (at = escaped.find_first_of("'\\", at)) != escaped.npos; at += 2)
    escaped.insert(at, 1, '\\');
  return joined("'", printable(escaped), "'");
}

// Of one whole character in UTF-8.
char32_t code_point_of(std::string_view character) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(character[i]); };
  if (character.size() == 1) return byte(0);
  char32_t code = byte(0) & (0xffU >> (character.size() + 1));
  for (std::size_t i = 1; i < character.size(); ++i) code = code << 6U | (byte(i) & 0x3fU);
  return code;
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

std::string sentence_of(const event& happened, with_kind kind) {
  using of = event::kind;
  constexpr std::array<std::string_view, 10> words{"came", "left",  "refused", "cannot connect", "refused",
                                                   "says", "limit", "warning", "stop",           "denied"};
  static_assert(words.size() == static_cast<std::size_t>(of::denied) + 1);
  std::string line;
  const std::string_view what = happened.what;
  // What our own attempt ran into names the server.
  const bool named = happened.what_kind == of::cannot_connect && what.find(happened.peer) != what.npos;
  if (kind == with_kind::yes || !named)
    for (const std::string_view who : {std::string_view{happened.peer}, std::string_view{happened.identity}})
      if (!who.empty()) line.append(printable(who)).append(": ");
  if (kind == with_kind::yes) line.append(words[static_cast<std::size_t>(happened.what_kind)]).append(": ");
  const std::string_view remedy = happened.remedy;
  line.append(happened.what_kind == of::status_from_peer ? words_of_peer(what) : printable(what));
  if (!remedy.empty()) line.append(" (").append(printable(remedy)).append(")");
  return line;
}

std::string printable(std::string_view text) {
  std::string shown;
  shown.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t bytes = bytes_of_character(text.substr(i));
    if (bytes == 0) {
      shown.append("\ufffd");
      ++i;
      continue;
    }
    const std::string_view character = text.substr(i, bytes);
    const char32_t code = code_point_of(character);
    if (misleads(code))
      append_code_point(shown, code);
    else
      shown.append(character);
    i += bytes;
  }
  return shown;
}

std::optional<std::size_t> not_utf8_at(std::string_view text) noexcept {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t bytes = bytes_of_character(text.substr(at));
    if (bytes == 0) return at;
    at += bytes;
  }
  return std::nullopt;
}

std::string quoted(std::string_view text) { return joined("'", printable(text), "'"); }

std::string seconds_text(rt::duration time) {
  std::array<char, 40> buffer;
  const int length =
      std::snprintf(buffer.data(), buffer.size(), "%.3f s", std::chrono::duration<double>(time).count());
  return {buffer.data(), static_cast<std::size_t>(length)};
}

} // namespace rowe::tools
