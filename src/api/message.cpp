// SPDX-License-Identifier: Apache-2.0
// Writes messages by json::writer, piece by piece, so the public header does not include it.
#include <rowe/message.hpp>

#include <span>

#include "json/writing/writer.hpp"

namespace rowe::detail {

// Each piece has its own writer on the bytes that are left, so this file writes the commas.
template <class Write>
void message_writer::with_writer(Write&& write) noexcept {
  if (overflowed_) return;
  json::writer into{std::span<char>{buffer_ + used_, buffer_bytes_ - used_}};
  write(into);
  overflowed_ = into.overflowed();
  if (!overflowed_) used_ += into.bytes();
}

void message_writer::begin(char bracket) noexcept {
  with_writer([&](json::writer& into) { into.append({&bracket, 1}); });
}
void message_writer::end(char bracket) noexcept { begin(bracket); }
void message_writer::comma() noexcept { begin(','); }

void message_writer::key(std::string_view name) noexcept {
  with_writer([&](json::writer& into) { into.key(name); });
}
void message_writer::string(std::string_view utf8) noexcept {
  with_writer([&](json::writer& into) { into.string(utf8); });
}
void message_writer::number(double x) noexcept {
  with_writer([&](json::writer& into) { into.number(x); });
}
void message_writer::number(float x) noexcept {
  with_writer([&](json::writer& into) { into.number(x); });
}
void message_writer::number(std::int64_t x) noexcept {
  with_writer([&](json::writer& into) { into.number(x); });
}
void message_writer::number(std::uint64_t x) noexcept {
  with_writer([&](json::writer& into) { into.number(x); });
}
void message_writer::raw(std::string_view json) noexcept {
  with_writer([&](json::writer& into) { into.raw(json); });
}

} // namespace rowe::detail
