// SPDX-License-Identifier: Apache-2.0
// However a stream is cut into reads, the frame parser reports the same events.
#include "wire/websocket/frame_parser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "wire/frames.hpp"

namespace rowe::wire::test {
namespace frame_reads_test {
namespace {

std::string long_dialogue(role ours) {
  const bool masked = ours == role::server;
  std::vector<frame> frames{{.payload = "{\"op\":\"subscribe\"}"},
                            {.payload = "caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80", .final = false},
                            {.opcode = ping_frame, .payload = std::string(125, 'p')},
                            {.opcode = continuation, .payload = "", .final = false},
                            {.opcode = continuation, .payload = "\xed\x9f\xbf"},
                            {.opcode = binary_frame, .payload = std::string(126, '\xfe')},
                            {.opcode = pong_frame},
                            {.payload = std::string(300, 'x')},
                            {.payload = ""},
                            {.opcode = close_frame,
                             .payload = "\x0f\xa0"
                                        "bye"},
                            {.payload = "ignored"}};
  for (frame& f : frames) f.masked = masked;
  return bytes_of(frames);
}

TEST(frame_parser, gives_the_same_events_for_random_streams_in_random_reads) {
  const std::uint32_t seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random{seed};
  const auto below = [&random](std::size_t bound) { return random() % bound; };
  for (int round = 0; round < 3000; ++round) {
    const role ours = below(2) == 0 ? role::server : role::client;
    std::string stream;
    bool open = false;
    for (std::size_t i = 0; i < 1 + below(8); ++i) {
      static constexpr unsigned control[] = {ping_frame, pong_frame, close_frame};
      frame f{.masked = ours == role::server};
      for (char& c : f.key) c = static_cast<char>(random() & 0xff);
      if (below(4) == 0) {
        f.opcode = below(10) == 0 ? control[2] : control[below(2)];
        f.payload = std::string(below(126), 'c');
      } else {
        f.opcode = open ? continuation : below(2) == 0 ? text_frame : binary_frame;
        f.final = below(2) == 0;
        open = !f.final;
        f.payload = std::string(below(3) == 0 ? below(3000) : below(20), 'd');
        if (below(3) == 0) f.payload += "\xe2\x82\xac";
      }
      if (below(40) == 0) f.opcode = static_cast<unsigned>(below(16));
      stream += bytes_of(f);
    }
    if (below(4) == 0) stream[below(stream.size())] ^= static_cast<char>(1U << below(8));
    receiver whole{ours};
    const auto expected = whole.feed(stream);
    receiver cut{ours};
    const std::size_t most = 1 + below(64);
    ASSERT_EQ(cut.feed_in_pieces(stream, [&](std::size_t left) { return std::min(left, 1 + below(most)); }),
              expected);
    ASSERT_TRUE(whole.consistent() && cut.consistent());
  }
}

} // namespace
} // namespace frame_reads_test
} // namespace rowe::wire::test
