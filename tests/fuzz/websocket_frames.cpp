// SPDX-License-Identifier: Apache-2.0
// The frame parser under arbitrary bytes. Input: one byte of set-up (bit 0 the role, bits 1 and 2 the limits,
// of which one is lax about masks and one has long messages, the rest a seed for the sizes of reads), then
// the stream. What is required: whole, byte by byte and in random reads the stream gives the same events; the
// parser's state stays one of its own; texts are UTF-8 by a decoder that shares nothing with it; what was
// delivered, written as a frame, is delivered again; nothing follows a close or a violation.
#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "fuzz/require.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "wire/websocket/websocket.hpp"

namespace {

using namespace rowe::wire;
using rowe::fuzz::require;

struct event {
  frame_event what;
  std::uint16_t code;
  std::string payload;
  std::string reason;
  friend bool operator==(const event&, const event&) = default;
};

struct setup {
  role ours;
  frame_limits limits;
};

std::vector<event> events_of(std::span<const std::uint8_t> stream, const setup& s, auto next_read) {
  std::vector<std::byte> assembly(s.limits.message_bytes_max);
  frame_parser parser;
  parser.reset(s.ours, s.limits, assembly);
  std::vector<event> events;
  std::string pieces; // of a long message, so far
  while (!stream.empty()) {
    const std::size_t count = next_read(stream.size());
    std::vector<std::byte> read(count); // exactly as long: a step beyond it is seen
    std::transform(stream.begin(), stream.begin() + static_cast<std::ptrdiff_t>(count), read.begin(),
                   [](std::uint8_t b) { return std::byte{b}; });
    stream = stream.subspan(count);
    for (std::span<std::byte> rest{read}; !rest.empty();) {
      const frame_step step = parser.next(rest);
      require(parser.check(), "the parser's state is one of its own");
      require(step.consumed <= rest.size(), "no more is consumed than there is");
      require(step.event != frame_event::need_more || step.consumed == rest.size(),
              "all is consumed or an event comes");
      const std::size_t most = step.in_pieces ? frame_parser::piece_bytes_max : s.limits.message_bytes_max;
      require(step.payload.size() <= std::max(most, control_bytes_max), "the limit holds");
      rest = rest.subspan(step.consumed);
      if (step.event == frame_event::need_more) continue;
      std::string payload{reinterpret_cast<const char*>(step.payload.data()), step.payload.size()};
      if (step.in_pieces) {
        pieces += payload;
        require(pieces.size() <= step.known_bytes && step.known_bytes <= s.limits.long_bytes_max,
                "it is as long as was said, and within its limit");
        const std::span<const std::byte> front = parser.front();
        const std::string begins{reinterpret_cast<const char*>(front.data()), front.size()};
        const std::size_t both = std::min(begins.size(), pieces.size());
        require(begins.substr(0, both) == pieces.substr(0, both), "it begins like its pieces");
        const std::size_t kept = std::min(frame_parser::front_bytes_max, s.limits.message_bytes_max);
        require(begins.size() >= std::min(pieces.size(), kept), "its beginning is kept");
        if (step.event == frame_event::piece) continue;
        payload = std::exchange(pieces, {});
        require(payload.size() == step.known_bytes && payload.size() > s.limits.message_bytes_max,
                "a message in pieces is long");
      }
      require(events.empty() || events.back().what < frame_event::close, "nothing follows the end");
      events.push_back({step.event, step.close_code, std::move(payload), std::string{step.reason}});
    }
  }
  return events;
}

// Decodes code points one by one, the slow way.
bool decodes_as_utf8(const std::string& text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto first = static_cast<std::uint8_t>(text[i]);
    const std::size_t bytes = first < 0x80       ? 1
                              : first >> 5 == 6  ? 2
                              : first >> 4 == 14 ? 3
                              : first >> 3 == 30 ? 4
                                                 : 0;
    if (bytes == 0 || text.size() - i < bytes) return false;
    std::uint32_t c = bytes == 1 ? first : first & (0xffU >> (bytes + 1));
    for (std::size_t k = 1; k < bytes; ++k) {
      const auto next = static_cast<std::uint8_t>(text[i + k]);
      if (next >> 6 != 2) return false;
      c = c << 6 | (next & 0x3fU);
    }
    static constexpr std::uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
    if (c < least[bytes] || c > 0x10ffff || (c >= 0xd800 && c <= 0xdfff)) return false;
    i += bytes;
  }
  return true;
}

std::vector<std::uint8_t> written_again(const event& e, role ours) {
  static constexpr opcode codes[] = {opcode::text, opcode::text, opcode::binary, opcode::text,
                                     opcode::ping, opcode::pong, opcode::close};
  std::vector<std::byte> frame(frame_headroom_bytes + e.payload.size());
  std::byte* const payload = frame.data() + frame_headroom_bytes;
  std::transform(e.payload.begin(), e.payload.end(), payload,
                 [](char c) { return static_cast<std::byte>(c); });
  constexpr mask_key key{std::byte{0x01}, std::byte{0x80}, std::byte{0xff}, std::byte{0x5a}};
  const auto masked = ours == role::server ? std::optional{key} : std::nullopt;
  const opcode what = codes[static_cast<std::size_t>(e.what)];
  const std::byte* const start = write_frame_header_before(payload, what, e.payload.size(), masked);
  if (masked) mask({payload, e.payload.size()}, key);
  std::vector<std::uint8_t> out;
  for (const std::byte* at = start; at != frame.data() + frame.size(); ++at)
    out.push_back(std::to_integer<std::uint8_t>(*at));
  return out;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static constexpr frame_limits limits[] = {
      {.message_bytes_max = 64, .fragments_max = 3},
      {.message_bytes_max = 300, .unmasked_accepted = true},
      {.message_bytes_max = 50, .long_bytes_max = 70'000, .fragments_max = 4},
      {.fragments_max = 0}};
  const setup s{.ours = (data[0] & 1) != 0 ? role::client : role::server, .limits = limits[data[0] >> 1 & 3]};
  const std::span<const std::uint8_t> stream{data + 1, size - 1};
  const auto whole = events_of(stream, s, [](std::size_t left) { return left; });
  require(whole == events_of(stream, s, [](std::size_t) { return std::size_t{1}; }),
          "byte by byte it is the same");
  std::minstd_rand random{data[0]};
  const auto piece = [&random](std::size_t left) { return std::min<std::size_t>(left, 1 + random() % 23); };
  require(whole == events_of(stream, s, piece), "in random reads it is the same");
  for (const event& e : whole) {
    if (e.what == frame_event::violation) {
      require(close_code_is_valid(e.code) && !e.reason.empty(), "a violation says why, with a code to send");
      continue;
    }
    require(e.what != frame_event::text || decodes_as_utf8(e.payload), "a text is UTF-8");
    require(decodes_as_utf8(e.reason), "a reason is UTF-8");
    const auto again = events_of(written_again(e, s.ours), s, [](std::size_t left) { return left; });
    require(again.size() == 1 && again[0] == e, "what was delivered is delivered again");
  }
  return 0;
}
