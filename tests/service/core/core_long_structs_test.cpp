// SPDX-License-Identifier: Apache-2.0
// Publishers of structs whose text may be longer than message_bytes_max: all subscribers get them, in order,
// and one cycle encodes only a part.
#include <rowe/bounded_array.hpp>

#include "long_fixtures.hpp"

#include "service/base/service_limits.hpp"
#include "json/structs/encoder.hpp"

namespace core_long_structs_test {

struct scan {
  std::int32_t number;
  rowe::bounded_array<double, 6000> ranges;
};

} // namespace core_long_structs_test
template <>
inline constexpr auto rowe::schema<core_long_structs_test::scan> =
    rowe::fields<&core_long_structs_test::scan::number, &core_long_structs_test::scan::ranges>{}.type(
        "sim/Scan");

namespace core_long_structs_test {
namespace {

using namespace harness;
using rowe::detail::pair_kind;

struct long_structs : testing::Test {
  core_harness on{long_fixtures::options_with(96 * 1024)};

  rowe::detail::queue_pair& advertise(const rowe::topic_options& how = {.depth = 4}) {
    return on.offer_now(pair_kind::publish_value, "/scan", sizeof(scan), how, &rowe::describe<scan>(),
                        "sim/Scan");
  }
  static std::unique_ptr<scan> scan_of(std::int32_t number, std::size_t count) {
    auto made = std::make_unique<scan>();
    made->number = number;
    for (std::size_t i = 0; i < count; ++i)
      EXPECT_TRUE(made->ranges.push_back(1.0 / static_cast<double>(i + 3)));
    return made;
  }
  void publish(rowe::detail::queue_pair& pair, const scan& value) {
    auto& out = pair.user.out;
    const auto slot = out.free_ring->try_take();
    ASSERT_TRUE(slot);
    std::memcpy(out.memory.value(*slot), &value, sizeof value);
    *out.memory.header(*slot) = {.stamped_ns = rowe::rt::nanoseconds_of(on.now),
                                 .expires_ns = rowe::rt::nanoseconds_of(rowe::rt::never),
                                 .bytes = sizeof value};
    ASSERT_TRUE(out.ring->try_push(*slot));
  }
  static std::string text_of(const scan& value) {
    const auto encoder = rowe::json::encoder::compile(rowe::describe<scan>()).value();
    std::string text(encoder.bytes_max(), ' ');
    rowe::json::writer out{text};
    encoder.encode(&value, out);
    return std::string{out.text()};
  }
  static std::string published(const scan& value) {
    return R"({"op":"publish","topic":"/scan","msg":)" + text_of(value) + "}";
  }
  void TearDown() override { EXPECT_EQ(on.core.inconsistency(), ""); }
};

TEST_F(long_structs, reach_subscribers_of_every_codec_in_order_with_short_ones) {
  auto& pair = advertise();
  peer browser{on}, studio{on, rowe::service::side::server, "127.0.0.1:2", "/", "foxglove.websocket.v1"};
  peer late{on};
  browser.tell(R"({"op":"subscribe","topic":"/scan"})");
  on.cycles(4);
  std::string channel;
  for (const std::string& one : studio.hear()) {
    const std::size_t name = one.find(R"(,"topic":"/scan")");
    if (name != std::string::npos)
      channel = std::to_string(std::stoul(one.substr(one.rfind(R"("id":)", name) + 5)));
  }
  ASSERT_FALSE(channel.empty());
  studio.tell(R"({"op":"subscribe","subscriptions":[{"id":3,"channelId":)" + channel + "}]}", 2);
  texts expected, to_studio;
  int number = 0;
  for (const std::size_t count : {4000U, 2U, 5U, 3500U}) {
    const auto value = scan_of(++number, count);
    publish(pair, *value);
    expected.push_back(published(*value));
    to_studio.push_back(text_of(*value));
  }
  ASSERT_GT(expected[0].size(), 8U * 1024);
  texts heard, of_browser;
  for (int i = 0; i < 400; ++i) {
    on.cycle();
    for (std::string& one : browser.hear()) of_browser.push_back(std::move(one));
    for (const std::string& one : studio.hear()) {
      if (one.size() > 13 && one[0] == 1) heard.push_back(one.substr(13));
    }
  }
  EXPECT_EQ(of_browser, expected);
  EXPECT_EQ(heard, to_studio);
  EXPECT_EQ(on.core.inconsistency(), "");
}

TEST_F(long_structs, are_encoded_some_of_them_in_a_cycle) {
  auto& pair = advertise();
  peer browser = subscriber(on, "/scan");
  const auto value = scan_of(1, 4000);
  const std::size_t least = text_of(*value).size() / rowe::service::long_encode_bytes;
  publish(pair, *value);
  std::size_t cycles = 0;
  for (; browser.hear().empty() && cycles < 1000; ++cycles) on.cycle();
  EXPECT_GE(cycles, least);
  EXPECT_LT(cycles, 1000U);
}

TEST_F(long_structs, of_the_newest_kind_go_too_and_are_latched) {
  auto& pair = advertise({.keep = rowe::keep::newest, .latched = true});
  const auto value = scan_of(1, 4000);
  const std::uint32_t slot = pair.user.out.newest->begin_write();
  std::memcpy(pair.user.out.memory.value(slot), value.get(), sizeof *value);
  *pair.user.out.memory.header(slot) = {.stamped_ns = rowe::rt::nanoseconds_of(on.now),
                                        .expires_ns = rowe::rt::nanoseconds_of(rowe::rt::never),
                                        .bytes = sizeof *value};
  pair.user.out.newest->end_write(slot);
  on.cycles(50);
  peer late{on};
  late.say(R"({"op":"subscribe","topic":"/scan"})");
  EXPECT_EQ(late.hear_during(200), texts{published(*value)});
}

TEST_F(long_structs, cost_nothing_where_nobody_listens) {
  auto& pair = advertise();
  publish(pair, *scan_of(1, 4000));
  on.cycles(3);
  EXPECT_EQ(on.count(counter::no_peer), 1U);
  EXPECT_EQ(on.count(counter::no_chunks) + on.count(counter::too_big), 0U);
}

TEST_F(long_structs, that_are_too_long_are_counted_and_those_behind_them_go_on) {
  auto& pair = advertise();
  peer browser = subscriber(on, "/scan");
  const auto fits = scan_of(2, 3);
  publish(pair, *scan_of(1, 6000)); // some 120 kB
  publish(pair, *fits);
  EXPECT_EQ(browser.hear_during(200), texts{published(*fits)});
  EXPECT_EQ(on.count(counter::too_big), 1U);
}

TEST_F(long_structs, that_are_too_long_are_told_to_the_program_once_a_second) {
  auto& pair = advertise();
  peer browser = subscriber(on, "/scan");
  const auto told = [&] {
    int count = 0;
    while (const auto one = on.shared.try_event()) {
      if (one->what_kind != rowe::event::kind::warning) continue;
      ++count;
      const std::string_view what{one->what};
      EXPECT_TRUE(has(what, "/scan"));
      EXPECT_TRUE(has(what, ": a value of "));
      EXPECT_TRUE(has(what, " is not sent; the limit is "));
      EXPECT_EQ(std::string_view{one->remedy}, "raise the limit long_message_bytes_max");
    }
    return count;
  };
  for (int i = 0; i < 3; ++i) publish(pair, *scan_of(1, 6000));
  on.cycles(100);
  EXPECT_EQ(told(), 1);
  on.now += std::chrono::seconds{1};
  publish(pair, *scan_of(1, 6000));
  on.cycles(100);
  EXPECT_EQ(told(), 1);
  EXPECT_EQ(on.count(counter::too_big), 4U);
}

} // namespace
} // namespace core_long_structs_test
