// SPDX-License-Identifier: Apache-2.0
// Frames for tests, written bit by bit from RFC 6455 5.2 and not by the code under test, so that they can be
// wrong in every way; and what a parser makes of a stream that comes in pieces.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "wire/websocket/frame_parser.hpp"

namespace rowe::wire::test {

// Opcodes as RFC 6455 5.2 numbers them.
inline constexpr unsigned continuation = 0;
inline constexpr unsigned text_frame = 1;
inline constexpr unsigned binary_frame = 2;
inline constexpr unsigned close_frame = 8;
inline constexpr unsigned ping_frame = 9;
inline constexpr unsigned pong_frame = 10;

// How a length is written: in the shortest form, or in the form named.
enum class length_form : std::uint8_t { shortest, two_bytes, eight_bytes };

struct frame {
  unsigned opcode = 1;
  std::string payload = {};
  bool final = true;
  bool masked = true;
  std::string key = "\x12\x34\x56\x78";
  length_form form = length_form::shortest;
};

inline std::string header_of(const frame& f, std::uint64_t length) {
  std::string out;
  out += static_cast<char>((f.final ? 0x80U : 0U) | f.opcode);
  const unsigned mask = f.masked ? 0x80U : 0U;
  std::size_t count = 0;
  if (f.form == length_form::eight_bytes || (f.form == length_form::shortest && length > 65535)) {
    count = 8;
    out += static_cast<char>(mask | 127U);
  } else if (f.form == length_form::two_bytes || length > 125) {
    count = 2;
    out += static_cast<char>(mask | 126U);
  } else {
    out += static_cast<char>(mask | length);
  }
  for (std::size_t i = count; i-- > 0;) out += static_cast<char>(length >> (8 * i) & 0xffU);
  if (f.masked) out += f.key;
  return out;
}

inline std::string bytes_of(const frame& f) {
  std::string out = header_of(f, f.payload.size());
  for (std::size_t i = 0; i < f.payload.size(); ++i) {
    out += f.masked ? static_cast<char>(f.payload[i] ^ f.key[i % 4]) : f.payload[i];
  }
  return out;
}

inline std::string bytes_of(const std::vector<frame>& frames) {
  std::string out;
  for (const frame& f : frames) out += bytes_of(f);
  return out;
}

// An event, with copies of what the parser only lends.
struct event {
  frame_event what = frame_event::need_more;
  std::string payload;
  std::uint16_t code = 0;
  std::string reason;

  friend bool operator==(const event&, const event&) = default;
  friend std::ostream& operator<<(std::ostream& out, const event& e) {
    static constexpr std::string_view names[] = {"need_more", "text",  "binary",   "ping",
                                                 "pong",      "close", "violation"};
    return out << names[static_cast<unsigned>(e.what)] << '(' << e.payload.substr(0, 40) << ", "
               << e.payload.size() << " bytes, " << e.code << ", " << e.reason << ')';
  }
};

inline event text(std::string payload) { return {frame_event::text, std::move(payload), 0, {}}; }
inline event binary(std::string payload) { return {frame_event::binary, std::move(payload), 0, {}}; }
inline event ping(std::string payload) { return {frame_event::ping, std::move(payload), 0, {}}; }

// A connection's end as a test sees it: a parser with memory of its own, exactly as much as the limits say.
class receiver {
 public:
  explicit receiver(role ours = role::server,
                    frame_limits limits = {.message_bytes_max = 4096, .fragments_max = 16})
      : assembly_(limits.message_bytes_max) {
    parser_.reset(ours, limits, assembly_);
  }

  // Feeds one read's bytes and returns what they caused. The bytes lie in a block of exactly their size, so
  // that the address sanitizer sees a step beyond it.
  std::vector<event> feed(std::string_view bytes) {
    std::vector<std::byte> read(bytes.size());
    for (std::size_t i = 0; i < bytes.size(); ++i) read[i] = static_cast<std::byte>(bytes[i]);
    std::vector<event> events;
    std::span<std::byte> rest{read};
    do {
      const frame_step step = parser_.next(rest);
      consistent_ = consistent_ && parser_.check() && step.consumed <= rest.size() &&
                    (step.event != frame_event::need_more || step.consumed == rest.size());
      if (step.event != frame_event::need_more) {
        events.push_back({step.event,
                          {reinterpret_cast<const char*>(step.payload.data()), step.payload.size()},
                          step.close_code,
                          std::string{step.reason}});
      }
      rest = rest.subspan(step.consumed);
    } while (!rest.empty());
    return events;
  }

  // Feeds `bytes` in pieces; `piece(left)` says how many bytes the next read has.
  std::vector<event> feed_in_pieces(std::string_view bytes,
                                    const std::function<std::size_t(std::size_t)>& piece) {
    std::vector<event> events;
    while (!bytes.empty()) {
      const std::size_t count = piece(bytes.size());
      for (event& e : feed(bytes.substr(0, count))) events.push_back(std::move(e));
      bytes.remove_prefix(count);
    }
    return events;
  }

  frame_parser& parser() { return parser_; }
  bool consistent() const {
    return consistent_;
  } // check() held after every step, and consumed kept its promise

 private:
  std::vector<std::byte> assembly_;
  frame_parser parser_;
  bool consistent_ = true;
};

} // namespace rowe::wire::test
