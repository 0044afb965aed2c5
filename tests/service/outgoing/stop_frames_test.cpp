// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/stop_frames.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "wire/websocket/frame_parser.hpp"

namespace stop_frames_test {
namespace {

using rowe::service::stop_frames;
namespace wire = rowe::wire;

// What a peer reads of the bytes that were taken, in order.
class reader {
 public:
  reader() : buffer_(8192) {
    parser_.reset(wire::role::client, {.message_bytes_max = 8000, .fragments_max = 1}, buffer_);
  }
  void read(std::span<const std::byte> bytes) {
    std::vector<std::byte> copy(bytes.begin(), bytes.end());
    std::span<std::byte> rest{copy};
    while (!rest.empty()) {
      const auto step = parser_.next(rest);
      rest = rest.subspan(step.consumed);
      ASSERT_NE(step.event, wire::frame_event::violation) << step.reason;
      if (step.event == wire::frame_event::text)
        texts.emplace_back(reinterpret_cast<const char*>(step.payload.data()), step.payload.size());
    }
  }
  std::vector<std::string> texts;

 private:
  std::vector<std::byte> buffer_;
  wire::frame_parser parser_;
};

bool answer(stop_frames& to, const std::string& text) { return to.add_answer(text, nullptr); }
bool state(stop_frames& to, const std::string& text) { return to.add_state(text, nullptr); }

void take(stop_frames& from, reader& by, std::size_t bytes_max) {
  const std::size_t bytes = std::min(bytes_max, from.rest().size());
  by.read(from.rest().first(bytes));
  from.advance(bytes);
}

TEST(stop_frames, keep_answers_in_order_and_of_states_the_newest) {
  stop_frames frames;
  reader peer;
  EXPECT_TRUE(answer(frames, "one"));
  EXPECT_TRUE(state(frames, "old"));
  EXPECT_TRUE(answer(frames, "two"));
  EXPECT_TRUE(state(frames, "new"));
  take(frames, peer, SIZE_MAX);
  EXPECT_EQ(peer.texts, (std::vector<std::string>{"one", "two", "new"}));
  EXPECT_TRUE(frames.rest().empty());
}

TEST(stop_frames, do_not_take_back_a_state_that_was_begun) {
  stop_frames frames;
  reader peer;
  EXPECT_TRUE(state(frames, "old"));
  take(frames, peer, 1);
  EXPECT_TRUE(frames.begun());
  EXPECT_TRUE(state(frames, "new"));
  take(frames, peer, SIZE_MAX);
  EXPECT_EQ(peer.texts, (std::vector<std::string>{"old", "new"}));
  EXPECT_FALSE(frames.begun());
}

TEST(stop_frames, give_a_states_room_to_an_answer) {
  stop_frames frames;
  reader peer;
  EXPECT_TRUE(state(frames, std::string(4000, 's')));
  EXPECT_TRUE(answer(frames, std::string(3000, 'a')));
  EXPECT_FALSE(answer(frames, std::string(3000, 'b'))); // who does not read gets no more
  EXPECT_FALSE(state(frames, std::string(3000, 'c')));
  take(frames, peer, SIZE_MAX);
  EXPECT_EQ(peer.texts, (std::vector<std::string>{std::string(3000, 'a')}));
}

TEST(stop_frames, lose_no_answer_they_took_however_the_socket_takes_the_bytes) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random{seed};
    stop_frames frames;
    reader peer;
    std::vector<std::string> taken;
    std::string newest;
    for (int i = 0; i < 300; ++i) {
      const std::string text = std::to_string(i) + std::string(random() % 900, 'x');
      switch (random() % 3) {
      case 0:
        if (answer(frames, "a" + text)) taken.push_back("a" + text);
        break;
      case 1:
        if (state(frames, "s" + text)) newest = "s" + text;
        break;
      default: take(frames, peer, random() % 1500);
      }
    }
    take(frames, peer, SIZE_MAX);
    std::vector<std::string> answers;
    std::string last_state;
    for (const std::string& text : peer.texts)
      text[0] == 'a' ? answers.push_back(text) : void(last_state = text);
    ASSERT_EQ(answers, taken) << seed;
  }
}

} // namespace
} // namespace stop_frames_test
