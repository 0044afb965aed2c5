// SPDX-License-Identifier: Apache-2.0
#include <rowe/recording.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <utility>

#include "recording/folder.hpp"

namespace {

using namespace std::chrono_literals;
using recording_test::all_of;
using recording_test::folder;

struct pose {
  double x = 0;
  double y = 0;
};

} // namespace
template <>
inline constexpr auto rowe::schema<pose> = rowe::fields<&pose::x, &pose::y>{}.type("nav/Pose");
namespace {

std::string body(int i) { return R"({"x":)" + std::to_string(i) + "}"; }

rowe::recording_writer begun(const rowe::recording_options& options) {
  std::string why;
  auto made = rowe::recording_writer::create(options, &why);
  EXPECT_TRUE(made) << why;
  return std::move(made).value();
}

TEST(recording_writer, writes_what_a_reader_reads) {
  const folder in;
  const std::string path = in / "run.mcap";
  {
    auto file = begun({.path = path, .name = "ang-01", .metadata = {{"site", "lab"}}});
    const auto odom = file.add_topic<pose>("/odom").value();
    const auto raw = file.add_topic("/raw").value();
    const auto named = file.add_topic("/named", "std_msgs/String").value();
    for (int i = 0; i < 1000; ++i) ASSERT_TRUE(file.add(odom, body(i), 1'000'000 + i, 500'000 + i));
    ASSERT_TRUE(file.add(raw, "{}", 2'000'000));
    ASSERT_TRUE(file.add(named, "{}", 2'000'001));
    ASSERT_TRUE(file.flush(10s));
    EXPECT_EQ(file.figures().messages, 1002U);
    EXPECT_EQ(file.figures().path, path);
    std::string why;
    EXPECT_TRUE(file.close(&why)) << why;
    EXPECT_EQ(file.add(raw, "{}", 3).code(), rowe::errc::closed);
    EXPECT_EQ(file.add_topic("/late").code(), rowe::errc::closed);
  }
  auto file = rowe::recording_reader::open(path);
  ASSERT_TRUE(file);
  EXPECT_TRUE(file->is_ended());
  EXPECT_EQ(file->messages(), 1002U);
  EXPECT_EQ(file->begin_ns(), 1'000'000);
  EXPECT_EQ(file->end_ns(), 2'000'001);
  ASSERT_EQ(file->topics().size(), 3U);
  EXPECT_EQ(file->topics()[0].name, "/odom");
  EXPECT_EQ(file->topics()[0].type, "nav/Pose");
  EXPECT_EQ(file->topics()[0].messages, 1000U);
  EXPECT_NE(file->topics()[0].schema.find(R"("x")"), std::string::npos);
  EXPECT_EQ(file->topics()[1].schema_encoding, "");
  EXPECT_EQ(file->topics()[2].type, "std_msgs/String");
  ASSERT_EQ(file->metadata().size(), 1U);
  EXPECT_EQ(file->metadata()[0].values, (rowe::recording_metadata{{"name", "ang-01"}, {"site", "lab"}}));
  const auto all = all_of(path);
  ASSERT_EQ(all.size(), 1002U);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(all[static_cast<std::size_t>(i)].data, body(i));
    EXPECT_EQ(all[static_cast<std::size_t>(i)].sequence, static_cast<std::uint32_t>(i));
    EXPECT_EQ(all[static_cast<std::size_t>(i)].published_ns, 500'000 + i);
  }
  EXPECT_EQ(all.back().published_ns, all.back().logged_ns);

  file->select({.from_ns = 1'000'010, .until_ns = 1'000'012});
  EXPECT_EQ(file->next()->data, body(10));
  EXPECT_EQ(file->next()->data, body(11));
  EXPECT_EQ(file->next(), nullptr);
  file->select({.topics = {1}});
  EXPECT_EQ(file->next()->logged_ns, 2'000'000);
  EXPECT_EQ(file->next(), nullptr);
}

TEST(recording_writer, is_whole_in_each_compression) {
  for (const auto packed : {rowe::compression::none, rowe::compression::lz4, rowe::compression::zstd}) {
    const folder in;
    auto file = begun({.path = in / "run.mcap", .packed = packed, .sync = true});
    const auto topic = file.add_topic("/x").value();
    for (int i = 0; i < 20'000; ++i) ASSERT_TRUE(file.add(topic, body(i), i));
    ASSERT_TRUE(file.close());
    EXPECT_EQ(all_of(in / "run.mcap").size(), 20'000U);
  }
}

TEST(recording_writer, begins_another_file_after_so_many_bytes) {
  const folder in;
  auto file = begun({.path = in / "run.mcap", .packed = rowe::compression::none, .split_bytes = 1 << 20});
  const auto topic = file.add_topic("/x", "a/B").value();
  const std::string text = R"({"x":")" + std::string(1000, 'x') + R"("})";
  for (int i = 0; i < 5000; ++i) {
    ASSERT_TRUE(file.wait_room(text.size(), 10s));
    ASSERT_TRUE(file.add(topic, text, i));
  }
  ASSERT_TRUE(file.close());
  EXPECT_EQ(file.figures().lost, 0U);
  std::size_t messages = 0;
  const auto names = in.files();
  EXPECT_GE(names.size(), 3U);
  EXPECT_EQ(names.size(), file.figures().files);
  for (const std::string& name : names) messages += all_of(in / name).size();
  EXPECT_EQ(messages, 5000U);
  EXPECT_EQ(names[0], "run.mcap");
  EXPECT_EQ(names[1], "run_2.mcap");
}

TEST(recording_writer, begins_another_file_after_a_time_and_deletes_the_oldest) {
  const folder in;
  auto file = begun({.path = in.path(),
                     .name = "ang",
                     .packed = rowe::compression::none,
                     .split_time = 10ms,
                     .total_bytes = 100'000});
  const auto topic = file.add_topic("/x").value();
  const std::string text = R"({"x":")" + std::string(1000, 'x') + R"("})";
  int added = 0;
  while (file.figures().deleted == 0) {
    ASSERT_TRUE(file.add(topic, text, added++));
    ASSERT_TRUE(file.flush(10s));
  }
  ASSERT_TRUE(file.close());
  const auto figures = file.figures();
  EXPECT_EQ(figures.messages, static_cast<std::uint64_t>(added));
  EXPECT_EQ(in.files().size(), figures.files - figures.deleted);
  std::int64_t latest_ns = 0;
  for (const std::string& name : in.files()) {
    const auto all = all_of(in / name);
    if (!all.empty()) latest_ns = std::max(latest_ns, all.back().logged_ns);
  }
  EXPECT_EQ(latest_ns, added - 1);
}

TEST(recording_writer, says_why_it_cannot_begin) {
  const folder in;
  std::ofstream{in / "there.mcap"} << "mine";
  std::string why;
  EXPECT_EQ(rowe::recording_writer::create({.path = in / "there.mcap"}, &why).code(),
            rowe::errc::bad_recording);
  EXPECT_EQ(why, in / "there.mcap: File exists");
  EXPECT_EQ(rowe::recording_writer::create({.path = in / "no/where.mcap"}, &why).code(),
            rowe::errc::bad_recording);
  EXPECT_EQ(why, in / "no/where.mcap: No such file or directory");
  EXPECT_EQ(rowe::recording_writer::create({.path = in / "x.mcap", .buffer_bytes = 1000}).code(),
            rowe::errc::bad_argument);
  EXPECT_EQ(in.files().size(), 1U);
}

TEST(recording_writer, writes_what_was_lost_before_it_into_the_file) {
  const folder in;
  auto file = begun({.path = in / "run.mcap"});
  const auto topic = file.add_topic("/a \"b\"").value();
  ASSERT_TRUE(file.add(topic, "{}", 1));
  file.add_lost(topic, 5);
  ASSERT_TRUE(file.add(topic, "{}", 2));
  EXPECT_EQ(file.add(topic, std::string(64 << 20, ' '), 3).code(), rowe::errc::too_big);
  EXPECT_EQ(file.add(topic + 1, "{}", 3).code(), rowe::errc::bad_argument);
  ASSERT_TRUE(file.close());
  EXPECT_EQ(file.figures().lost, 6U);
  const auto all = all_of(in / "run.mcap");
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(all[1].topic, "/rowe/record/lost");
  EXPECT_EQ(all[1].data, R"({"topic":"/a \"b\"","messages":5})");
  EXPECT_EQ(all[3].data, R"({"topic":"/a \"b\"","messages":1})");
}

TEST(recording_writer, takes_so_many_topics_and_no_more) {
  const folder in;
  auto file = begun({.path = in / "run.mcap"});
  for (int i = 0; i < 4096; ++i) {
    ASSERT_TRUE(file.wait_room(100, 10s));
    const auto topic = file.add_topic("/t" + std::to_string(i), "a/T" + std::to_string(i));
    ASSERT_TRUE(topic);
    ASSERT_TRUE(file.add(*topic, "{}", i));
  }
  EXPECT_EQ(file.add_topic("/one").code(), rowe::errc::too_many_topics);
  EXPECT_EQ(file.add_topic("/one", "", std::string(300'000, ' ')).code(), rowe::errc::too_many_topics);
  ASSERT_TRUE(file.close());
  EXPECT_EQ(all_of(in / "run.mcap").size(), 4096U);
}

} // namespace
