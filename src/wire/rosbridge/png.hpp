// SPDX-License-Identifier: Apache-2.0
// A text as the pixels of a PNG, as rosbridge's clients read it: a square of RGB whose bytes are the text's,
// filled up with newlines. Nothing is compressed (stored blocks of RFC 1951), since that would take the
// service thread's time. Pure functions; nothing waits or allocates.
#pragma once
#include <span>
#include <string_view>

#include "json/writing/writer.hpp"

namespace rowe::wire {

// Writes the PNG in base64. The text, which may come in pieces cut between characters, is UTF-8 and JSON;
// what is not ASCII is escaped, because browsers read each byte as a character. Takes time in proportion to
// the text, about 1.4 times as many bytes, and 200 more.
void write_png(json::writer& out, std::span<const std::string_view> pieces) noexcept;

} // namespace rowe::wire
