// SPDX-License-Identifier: Apache-2.0
// Recordings of whole endpoints.
#include <rowe/recording.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "api/endpoints.hpp"
#include "recording/folder.hpp"

namespace {

using namespace endpoints;
using recording_test::all_of;
using recording_test::folder;
using recording_test::heard;

struct record_test_pose {
  double x = 0;
  double y = 0;
};

} // namespace
template <>
inline constexpr auto rowe::schema<record_test_pose> =
    rowe::fields<&record_test_pose::x, &record_test_pose::y>{}.type("nav/Pose");
namespace {

rowe::recorder begun(rowe::endpoint& of, const rowe::record_options& options) {
  std::string why;
  auto made = of.record(options, &why);
  EXPECT_TRUE(made) << why;
  return std::move(made).value();
}

std::vector<heard> of_topic(const std::string& path, std::string_view topic) {
  auto all = all_of(path);
  std::erase_if(all, [&](const heard& one) { return one.topic != topic; });
  return all;
}

TEST(record, has_what_the_program_publishes_with_types_and_times) {
  const folder in;
  auto robot = rowe::endpoint::listen(0, quick()).value();
  auto poses = robot.advertise<record_test_pose>("/pose", {.depth = 64}).value();
  EXPECT_EQ(poses.publish({}, rowe::rt::monotonic_clock::now()).code(), rowe::errc::no_peer);
  const auto latch = robot.stop_latch().value();
  const std::int64_t before_ns = rowe::wall_clock_ns();
  auto records = begun(robot, {.file = {.path = in / "run.mcap"}});
  for (int i = 0; i < 50; ++i)
    ASSERT_TRUE(poses.publish({static_cast<double>(i), 0}, rowe::rt::monotonic_clock::now()));
  EXPECT_TRUE(eventually([&] { return records.flush(timeout) && records.figures().messages >= 50; }));
  std::string why;
  EXPECT_TRUE(records.close(&why)) << why;
  EXPECT_TRUE(records.close());
  EXPECT_EQ(poses.publish({}, rowe::rt::monotonic_clock::now()).code(), rowe::errc::no_peer);

  auto file = rowe::recording_reader::open(in / "run.mcap").value();
  const auto& topics = file.topics();
  const auto pose = std::ranges::find(topics, "/pose", &rowe::recorded_topic::name);
  ASSERT_NE(pose, topics.end());
  EXPECT_EQ(pose->type, "nav/Pose");
  EXPECT_EQ(pose->encoding, "json");
  EXPECT_EQ(pose->schema_encoding, "jsonschema");
  EXPECT_NE(pose->schema.find(R"("y")"), std::string::npos);
  EXPECT_FALSE(file.metadata().front().values.at("name").empty());
  const auto all = of_topic(in / "run.mcap", "/pose");
  ASSERT_EQ(all.size(), 50U);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].data, "{\"x\":" + std::to_string(i) + ",\"y\":0}");
    EXPECT_EQ(all[i].sequence, i);
    EXPECT_GE(all[i].published_ns, before_ns);
    EXPECT_GE(all[i].logged_ns, all[i].published_ns);
    EXPECT_LE(all[i].logged_ns, rowe::wall_clock_ns());
  }
  EXPECT_FALSE(of_topic(in / "run.mcap", "/rowe/stop/state").empty()); // the endpoint's own, as it was
}

TEST(record, has_the_topics_that_are_wanted_also_those_of_peers_and_later_ones) {
  const folder in;
  auto robot = rowe::endpoint::listen(0, quick()).value();
  auto records = begun(
      robot, {.file = {.path = in / "run.mcap"}, .topics = {"/arm/**", "/odom"}, .exclude = {"/arm/*/raw"}});
  auto peer = connected(robot);
  std::vector<rowe::publisher<rowe::json_text>> all;
  for (const char* const name : {"/odom", "/arm/left/joints", "/arm/left/raw", "/scan"})
    all.push_back(peer.advertise<rowe::json_text>(name, {.latched = true, .type = "a/B"}).value());
  for (auto& one : all) ASSERT_TRUE(one.publish(R"({"a":1})", rowe::rt::monotonic_clock::now()));
  EXPECT_TRUE(eventually([&] { return records.flush(timeout) && records.figures().messages >= 2; }));
  ASSERT_TRUE(records.close());
  std::vector<std::string> names;
  for (const heard& one : all_of(in / "run.mcap")) names.push_back(one.topic);
  std::ranges::sort(names);
  EXPECT_EQ(names, (std::vector<std::string>{"/arm/left/joints", "/odom"}));
}

// In a hub, of a topic to which nobody subscribes; and its publisher leaves while it is recorded.
TEST(record, of_a_hub_has_what_peers_publish_to_nobody) {
  const folder in;
  auto options = quick();
  options.relay = true;
  auto hub = rowe::endpoint::listen(0, options).value();
  auto records = begun(hub, {.file = {.path = in / "run.mcap"}});
  for (int i = 0; i < 3; ++i) {
    auto peer = connected(hub);
    auto said = peer.advertise<rowe::json_text>("/made/" + std::to_string(i)).value();
    EXPECT_TRUE(eventually([&] {
      (void)said.publish("{}", rowe::rt::monotonic_clock::now());
      return records.flush(timeout) && records.figures().messages > static_cast<std::uint64_t>(i);
    }));
  }
  EXPECT_TRUE(eventually([&] { return hub.peers() == 0; }));
  ASSERT_TRUE(records.close());
  for (int i = 0; i < 3; ++i)
    EXPECT_FALSE(of_topic(in / "run.mcap", "/made/" + std::to_string(i)).empty()) << i;
}

TEST(record, begins_with_what_is_retained_and_has_long_messages) {
  const folder in;
  auto options = quick();
  options.limits.handle_bytes = 64 * 1024 * 1024;
  auto robot = rowe::endpoint::listen(0, options).value();
  const std::string map = R"({"data":")" + std::string(500'000, 'x') + R"("})";
  auto maps =
      robot.advertise<rowe::json_text>("/map", {.depth = 4, .latched = true, .text_bytes_max = 1'000'000})
          .value();
  ASSERT_TRUE(maps.publish(map, rowe::rt::monotonic_clock::now()));
  EXPECT_TRUE(eventually([&] { // it is retained
    auto reads = robot.subscribe<rowe::json_text>("/map", {.text_bytes_max = 1'000'000});
    return reads && reads->take(100ms);
  }));
  auto one = begun(robot, {.file = {.path = in / "one.mcap"}, .topics = {"/map"}});
  auto two = begun(robot, {.file = {.path = in / "two.mcap"}, .topics = {"/map"}});
  ASSERT_TRUE(maps.publish("{}", rowe::rt::monotonic_clock::now()));
  EXPECT_TRUE(eventually([&] {
    return one.flush(timeout) && two.flush(timeout) && one.figures().messages >= 2 &&
           two.figures().messages >= 2;
  }));
  ASSERT_TRUE(one.close());
  ASSERT_TRUE(two.close());
  for (const char* const name : {"one.mcap", "two.mcap"}) {
    const auto all = all_of(in / name);
    ASSERT_EQ(all.size(), 2U) << name;
    EXPECT_TRUE(std::ranges::any_of(all, [&](const heard& h) { return h.data == map; }));
    EXPECT_TRUE(std::ranges::any_of(all, [&](const heard& h) { return h.data == "{}"; }));
  }
}

TEST(record, of_an_endpoint_that_connects_has_what_it_subscribes_to) {
  const folder in;
  auto robot = rowe::endpoint::listen(0, quick()).value();
  auto odom = robot.advertise<record_test_pose>("/odom", {.depth = 64}).value();
  auto other = robot.advertise<record_test_pose>("/other", {.depth = 64}).value();
  const auto latch = robot.stop_latch().value();
  auto station = connected(robot);
  auto records = begun(station, {.file = {.path = in / "run.mcap"}, .exclude = {"/other"}});
  ASSERT_TRUE(records.subscribe("/odom"));
  ASSERT_TRUE(records.subscribe("/rowe/stop/state"));
  ASSERT_TRUE(records.subscribe("/other")); // which is excluded
  int published = 0;
  EXPECT_TRUE(eventually([&] {
    published += odom.publish({1, 2}, rowe::rt::monotonic_clock::now()) ? 1 : 0;
    EXPECT_FALSE(other.publish({1, 2}, rowe::rt::monotonic_clock::now()));
    return records.flush(timeout) && records.figures().messages >= 20;
  }));
  ASSERT_TRUE(records.close());
  EXPECT_GE(of_topic(in / "run.mcap", "/odom").size(), 10U);
  EXPECT_EQ(of_topic(in / "run.mcap", "/rowe/stop/state").size(), 1U);
  EXPECT_EQ(records.subscribe("/odom").code(), rowe::errc::misuse);
}

TEST(record, says_why_it_cannot_begin_and_how_many_there_may_be) {
  const folder in;
  auto robot = rowe::endpoint::listen(0, quick()).value();
  std::string why;
  EXPECT_EQ(robot.record({.file = {.path = "/nowhere/run.mcap"}}, &why).code(), rowe::errc::bad_recording);
  EXPECT_EQ(why, "/nowhere/run.mcap: No such file or directory");
  std::vector<rowe::recorder> all;
  for (int i = 0; i < 6; ++i)
    all.push_back(begun(robot, {.file = {.path = in / (std::to_string(i) + ".mcap")}}));
  EXPECT_EQ(robot.record({.file = {.path = in / "8.mcap"}}).code(), rowe::errc::too_many_recordings);
  all.pop_back();
  EXPECT_TRUE(robot.record({.file = {.path = in / "9.mcap"}}));
  EXPECT_EQ(rowe::recorder{}.flush(0ms).code(), rowe::errc::misuse);
  EXPECT_TRUE(rowe::recorder{}.close());
}

TEST(record, of_a_black_box_begins_when_the_robot_is_stopped) {
  const folder in;
  auto options = quick();
  options.stop.unguarded = true;
  auto robot = rowe::endpoint::listen(0, options).value();
  auto poses = robot.advertise<record_test_pose>("/pose", {.depth = 64}).value();
  auto latch = robot.stop_latch({.loop_timeout = 10s}).value();
  auto box =
      begun(robot, {.file = {.path = in.path(), .name = "ang", .black_box = {.before = 30s, .after = 50ms}},
                    .topics = {"/pose"}});
  std::atomic<bool> ends{false};
  std::thread loop{[&] {
    while (!ends) {
      const auto now = rowe::rt::monotonic_clock::now();
      if (latch.engaged(now)) latch.acknowledge(now);
      (void)poses.publish({}, now);
      std::this_thread::yield();
    }
  }};
  EXPECT_TRUE(robot.reset_emergency_stop({}, timeout));
  EXPECT_TRUE(eventually([&] { return box.flush(timeout) && box.figures().retained > 500; }));
  EXPECT_EQ(box.figures().files, 0U);
  EXPECT_TRUE(robot.emergency_stop({.source = "a button"}, timeout));
  EXPECT_TRUE(eventually([&] { return box.figures().files == 1; }));
  ends = true;
  loop.join();
  EXPECT_TRUE(box.snapshot("and more"));
  std::string why;
  EXPECT_TRUE(box.close(&why)) << why;
  EXPECT_TRUE(in.files().front().starts_with("ang-stop_"));
  EXPECT_FALSE(of_topic(in / in.files().front(), "/pose").empty());
  auto plain = begun(robot, {.file = {.path = in / "run.mcap"}});
  EXPECT_EQ(plain.snapshot().code(), rowe::errc::misuse);
}

TEST(record, of_a_black_box_is_written_when_a_peer_asks) {
  const folder in;
  auto robot = rowe::endpoint::listen(0, quick()).value();
  auto asks = robot.client<rowe::json_text, rowe::json_text>("/rowe/record", {}).value();
  auto plain = begun(robot, {.file = {.path = in / "run.mcap"}});
  EXPECT_EQ(asks.call("{}", timeout).value().value(), R"({"black_boxes":0})");
  auto poses = robot.advertise<record_test_pose>("/pose", {}).value();
  auto box = begun(
      robot,
      {.file = {.path = in.path() + "/box/", .name = "ang", .black_box = {.before = 30s, .after = 0s}}});
  EXPECT_TRUE(poses.publish({}));
  EXPECT_TRUE(eventually([&] { return box.flush(timeout) && box.figures().retained != 0; }));
  EXPECT_EQ(asks.call(R"({"cause":"it shakes"})", timeout).value().value(), R"({"black_boxes":1})");
  EXPECT_TRUE(eventually([&] { return box.figures().files == 1; }));
  EXPECT_TRUE(box.close());
  const std::string path = box.figures().path;
  EXPECT_NE(path.find("/ang-asked_"), path.npos) << path;
  EXPECT_FALSE(of_topic(path, "/pose").empty());
  const auto notes = rowe::recording_reader::open(path).value().metadata();
  EXPECT_TRUE(std::ranges::any_of(notes, [](const rowe::recording_notes& one) {
    return std::ranges::any_of(one.values, [](const auto& pair) { return pair.second == "it shakes"; });
  }));
}

TEST(record, is_whole_when_its_endpoint_closes_first) {
  const folder in;
  rowe::recorder records;
  {
    auto robot = rowe::endpoint::listen(0, quick()).value();
    auto poses = robot.advertise<record_test_pose>("/pose", {.depth = 64}).value();
    records = begun(robot, {.file = {.path = in / "run.mcap"}, .topics = {"/pose"}});
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(poses.publish({}, rowe::rt::monotonic_clock::now()));
    ASSERT_TRUE(robot.close(timeout));
  }
  EXPECT_EQ(all_of(in / "run.mcap").size(), 20U); // also before it is ended
  EXPECT_TRUE(records.close());
  EXPECT_TRUE(rowe::recording_reader::open(in / "run.mcap")->is_ended());
}

} // namespace
