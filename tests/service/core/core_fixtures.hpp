// SPDX-License-Identifier: Apache-2.0
// What the tests of the core as a server share: a pose that is published, and a fixture that checks the
// core's structures at the end of each test.
#pragma once
#include "service/core/core.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "core_harness.hpp"

struct pose {
  double x, y;
};
template <>
inline constexpr auto rowe::schema<pose> = rowe::fields<&pose::x, &pose::y>{}.type("test/Pose");

namespace harness {

using namespace std::chrono_literals;
using rowe::service::counter;
using texts = std::vector<std::string>;

inline rowe::detail::queue_pair& advertise_pose(core_harness& on, rowe::topic_options how = {}) {
  return on.offer(rowe::detail::pair_kind::publish_value, "/pose", sizeof(pose), how, &rowe::describe<pose>(),
                  "test/Pose");
}

inline rowe::detail::queue_pair& advertise_pose_now(core_harness& on, rowe::topic_options how = {}) {
  rowe::detail::queue_pair& made = advertise_pose(on, how);
  on.cycle();
  return made;
}

// A service /echo of poses.
inline rowe::detail::pair_request echo_request() {
  return {.kind = rowe::detail::pair_kind::respond_value,
          .name = "/echo",
          .type = "test/Echo",
          .out_depth = 4,
          .in_depth = 4,
          .out_bytes = 192,
          .in_bytes = sizeof(pose),
          .encoded = &rowe::describe<pose>(),
          .decoded = &rowe::describe<pose>()};
}

// A lane with so many slots of so many bytes each way.
inline rowe::detail::pair_request lane_request(std::uint32_t depth, std::size_t bytes, bool receives = true) {
  return {.kind = rowe::detail::pair_kind::talk,
          .receives = receives,
          .out_depth = depth,
          .in_depth = depth,
          .completions_depth = depth,
          .out_bytes = bytes,
          .in_bytes = bytes,
          .completions_bytes = bytes};
}

inline rowe::status publish(core_harness& on, rowe::detail::queue_pair& pair, const pose& value) {
  return rowe::detail::publish_into(pair, sizeof value, on.now,
                                    [&](std::byte* slot) { std::memcpy(slot, &value, sizeof value); });
}

inline rowe::status publish_text(core_harness& on, rowe::detail::queue_pair& pair, std::string_view text) {
  return rowe::detail::publish_into(pair, text.size(), on.now, [&](std::byte* slot) {
    text.copy(reinterpret_cast<char*>(slot), text.size());
  });
}

// Publishes, and the core takes it in its next cycle.
inline rowe::status publish_now(core_harness& on, rowe::detail::queue_pair& pair, const pose& value) {
  const rowe::status done = publish(on, pair, value);
  on.cycle();
  return done;
}
inline rowe::status publish_text_now(core_harness& on, rowe::detail::queue_pair& pair,
                                     std::string_view text) {
  const rowe::status done = publish_text(on, pair, text);
  on.cycle();
  return done;
}

inline rowe::result<std::string> take(rowe::detail::queue_pair& pair) {
  const auto slot = pair.user.in.ring->try_pop();
  if (!slot) return rowe::errc::empty;
  std::string text{reinterpret_cast<const char*>(pair.user.in.memory.value(*slot)),
                   pair.user.in.memory.header(*slot)->bytes};
  pair.user.in.free_ring->release(*slot);
  return text;
}

inline texts take_all(rowe::detail::queue_pair& pair) {
  texts all;
  while (auto text = take(pair)) all.push_back(std::move(*text));
  return all;
}

// What became of what a thread submitted, which waits for it.
inline std::string outcome_of(core_harness& on, std::uint32_t slot) {
  EXPECT_TRUE(on.submissions.wait(slot, rowe::rt::never));
  const auto done = on.submissions.outcome(slot);
  on.submissions.release(slot);
  return done ? "sent" : std::string{done.error().name()};
}

// All that a peer is told before it has said anything.
inline texts greeting_of(core_harness& on, peer& by) {
  on.cycle();
  texts all = by.hear();
  for (texts more = all; !more.empty(); all.insert(all.end(), more.begin(), more.end()))
    more = by.hear_after(2);
  return all;
}

// The one text that was heard.
inline std::string only(const texts& heard) {
  std::string all;
  for (const std::string& one : heard) all += one + '\n';
  EXPECT_EQ(heard.size(), 1U) << all;
  return heard.size() == 1 ? heard[0] : "";
}

// Whether a text has this part; what is there instead if not.
inline testing::AssertionResult has(std::string_view text, std::string_view part) {
  const bool found = text.find(part) != text.npos;
  return (found ? testing::AssertionSuccess() : testing::AssertionFailure()) << text;
}
// Of so many texts.
inline std::size_t count_of(const texts& all, std::string_view part) {
  return static_cast<std::size_t>(std::count_if(
      all.begin(), all.end(), [&](const std::string& one) { return one.find(part) != one.npos; }));
}
inline testing::AssertionResult has(const texts& all, std::string_view part) {
  testing::AssertionResult found = testing::AssertionResult{count_of(all, part) != 0};
  for (const std::string& one : all) found << one << '\n';
  return found;
}

// A member's value as it stands in a JSON object; empty: there is none.
inline std::string member(std::string_view object, std::string_view name) {
  const auto found = rowe::json::find(rowe::json::root(object).raw, name);
  return found ? std::string{found->raw} : "";
}

inline std::string published(std::string_view topic, std::string_view msg) {
  return R"({"op":"publish","topic":")" + std::string{topic} + R"(","msg":)" + std::string{msg} + "}";
}

// A number as Foxglove's binary messages have it.
inline std::string four(std::uint32_t number) {
  std::string bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(number >> shift);
  return bytes;
}

// A peer that has said this.
inline peer peer_saying(core_harness& on, std::string_view text, int cycles = 1) {
  peer made{on};
  made.tell(text, cycles);
  return made;
}
inline peer subscriber(core_harness& on, std::string_view topic) {
  return peer_saying(on, R"({"op":"subscribe","topic":")" + std::string{topic} + "\"}");
}

// What a peer hears of a pose at (x, 0).
inline std::string message(int x) {
  return R"({"op":"publish","topic":"/pose","msg":{"x":)" + std::to_string(x) + R"(,"y":0}})";
}

struct core_test : testing::Test {
  explicit core_test(const rowe::endpoint_options& options = small_options(),
                     rowe::service::side ours = rowe::service::side::server,
                     const rowe::wire::protocol_set* protocols = nullptr)
      : on{options, ours, 1, rowe::rt::time_point{1000s}, protocols} {}
  ~core_test() override { EXPECT_EQ(on.core.inconsistency(), ""); }
  core_harness on;
};

} // namespace harness
