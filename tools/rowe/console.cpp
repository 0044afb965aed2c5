// SPDX-License-Identifier: Apache-2.0
#include "console.hpp"

#include <array>
#include <cstddef>
#include <cstdio>

namespace rowe::tools {
namespace {

void append_code_point(std::string& to, unsigned code) {
  constexpr std::string_view digits = "0123456789abcdef";
  to.append("\\u00");
  to += digits[code >> 4 & 0xf];
  to += digits[code & 0xf];
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

// stderr is not buffered, so a line made first is one write and is not mixed with those of other programs.
void console::write(std::string_view line) const {
  const std::string whole = joined(prefix_, line, "\n");
  std::fwrite(whole.data(), 1, whole.size(), stderr);
}

bool emit(std::string_view text) {
  return std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
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
    } else {
      shown += text[i];
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
