// SPDX-License-Identifier: Apache-2.0
#include "memory_file.hpp"

#include <gtest/gtest.h>

namespace writer_test {
namespace {

using namespace memory_file;

TEST(writer, knows_what_is_described_already) {
  file to;
  mcap::writer into{to, {}};
  const auto a = into.add_schema("a", "jsonschema", "{}");
  EXPECT_EQ(a, 1);
  EXPECT_EQ(into.add_schema("a", "jsonschema", "{}"), a);
  EXPECT_EQ(into.add_schema("a", "jsonschema", "true"), 2);
  const auto one = into.add_channel(*a, "/a", "json");
  EXPECT_EQ(into.add_channel(*a, "/a", "json"), one);
  EXPECT_NE(into.add_channel(*a, "/a", "json", {{"x", "y"}}), one);
  EXPECT_EQ(to.ends.size(), 1U + 2U + 2U) << "each is written at once, once";
}

TEST(writer, writes_a_chunk_with_its_index_by_one_call) {
  file to;
  mcap::writer into{to, {.chunk_bytes = 1000}};
  const std::size_t before = to.ends.size();
  fill(into, 9);
  EXPECT_EQ(to.ends.size(), before + 3) << "a schema and two channels";
  EXPECT_GT(into.gathered_bytes(), 500U);
  EXPECT_EQ(into.messages(), 9U);
  into.end_chunk();
  EXPECT_EQ(to.ends.size(), before + 4);
  EXPECT_EQ(into.gathered_bytes(), 0U);
  into.end_chunk();
  EXPECT_EQ(to.ends.size(), before + 4) << "there is nothing to write";
}

TEST(writer, ends_a_chunk_that_is_full) {
  file to;
  mcap::writer into{to, {.chunk_bytes = 256}};
  fill(into, 8);
  EXPECT_EQ(into.written().chunks.size(), 2U);
  into.end();
  EXPECT_EQ(all_of(to), expected(8));
}

TEST(writer, says_what_is_whole_when_its_sink_is_full) {
  const file whole = recording(100);
  for (std::uint64_t room = 0; room < whole.bytes_written.size(); room += 7) {
    file to;
    to.room = room;
    mcap::writer into{to, {.program = "rowe"}};
    fill(into, 100);
    into.add_metadata("robot", {{"name", "crawler"}});
    into.end();
    ASSERT_FALSE(into.writes());
    ASSERT_LE(into.whole_bytes(), room);
    const std::uint64_t messages = into.written().counts.messages;
    if (into.whole_bytes() == 0) continue; // not even the begin
    to.bytes_written.resize(static_cast<std::size_t>(into.whole_bytes()));
    mcap::reader reads{to};
    ASSERT_TRUE(reads.open()) << reads.wrong();
    EXPECT_EQ(all_of(reads), expected(messages)) << room;
    EXPECT_TRUE(reads.damaged().empty()) << room;
  }
}

TEST(writer, counts_all_that_it_wrote) {
  file made = recording(95);
  mcap::reader reads{made};
  ASSERT_TRUE(reads.open());
  const mcap::statistics& counts = reads.all().counts;
  EXPECT_EQ(counts.messages, 95U);
  EXPECT_EQ(counts.chunks, 10U);
  EXPECT_EQ(counts.metadata, 1U);
  EXPECT_EQ(counts.times.earliest_ns, 0U);
  EXPECT_EQ(counts.times.latest_ns, 94'000'000U);
  EXPECT_EQ(counts.messages_of, (std::map<mcap::channel_number, std::uint64_t>{{1, 47}, {2, 48}}));
}

TEST(writer, has_no_more_numbers_than_there_are) {
  file to;
  mcap::writer into{to, {}};
  for (int i = 1; i <= 65535; ++i) ASSERT_EQ(into.add_channel(0, "/" + std::to_string(i), "json"), i);
  EXPECT_FALSE(into.add_channel(0, "/one-too-many", "json"));
  EXPECT_EQ(into.add_channel(0, "/7", "json"), 7);
}

} // namespace
} // namespace writer_test
