// SPDX-License-Identifier: Apache-2.0
#include "memory_file.hpp"

#include <gtest/gtest.h>

#include "mcap/record_writer.hpp"

namespace reader_test {
namespace {

using namespace memory_file;

struct reader : testing::TestWithParam<mcap::compression> {};

TEST_P(reader, gives_back_what_was_written) {
  file made = recording(95, GetParam());
  mcap::reader reads{made};
  ASSERT_TRUE(reads.open()) << reads.wrong();
  EXPECT_TRUE(reads.has_summary());
  EXPECT_EQ(reads.head().program, "rowe");
  EXPECT_EQ(all_of(reads), expected(95));
  EXPECT_EQ(reads.all().channels.at(2).topic, "/even");
  EXPECT_EQ(reads.all().channels.at(2).metadata.at("latched"), "true");
  EXPECT_EQ(reads.all().schemas.at(1).name, "test/Number");
  ASSERT_EQ(reads.all().metadata.size(), 1U);
  EXPECT_EQ(reads.all().metadata[0].name, "robot");
}

TEST_P(reader, needs_no_summary) {
  file made = recording(95, GetParam(), false);
  mcap::reader reads{made};
  ASSERT_TRUE(reads.open());
  EXPECT_FALSE(reads.has_summary());
  auto all = expected(90); // the last five were gathered only
  EXPECT_EQ(all_of(reads), all);
}

INSTANTIATE_TEST_SUITE_P(all, reader,
                         testing::Values(mcap::compression::none, mcap::compression::lz4,
                                         mcap::compression::zstd));

TEST(selection, is_by_time_and_by_channel) {
  file made = recording(100);
  mcap::reader reads{made};
  ASSERT_TRUE(reads.open());
  reads.select({.begin_ns = 25'000'000, .end_ns = 30'000'000, .channels = {}});
  auto some = all_of(reads);
  ASSERT_EQ(some.size(), 6U);
  EXPECT_EQ(some.front().logged_ns, 25'000'000U);
  EXPECT_EQ(some.back().logged_ns, 30'000'000U);
  reads.select({.channels = {1}});
  some = all_of(reads);
  EXPECT_EQ(some.size(), 50U);
  for (const heard& one : some) EXPECT_EQ(one.channel, 1);
  reads.select({.begin_ns = 1'000'000'000});
  EXPECT_EQ(reads.next(), nullptr);
  reads.select({});
  EXPECT_EQ(all_of(reads), expected(100)) << "from the begin again";
}

// A clock that was set back, and topics that come late.
TEST(order, is_that_of_time_over_chunks_that_overlap) {
  file made;
  mcap::writer into{made, {}};
  const auto channel = *into.add_channel(0, "/a", "json");
  for (const std::uint64_t ns : {50U, 10U, 30U}) into.add({.channel = channel, .logged_ns = ns, .data = "1"});
  into.end_chunk();
  for (const std::uint64_t ns : {20U, 30U, 60U, 5U})
    into.add({.channel = channel, .logged_ns = ns, .data = "2"});
  into.end();
  std::vector<std::pair<std::uint64_t, std::string>> got;
  for (const heard& one : all_of(made)) got.emplace_back(one.logged_ns, one.data);
  EXPECT_EQ(got, (std::vector<std::pair<std::uint64_t, std::string>>{
                     {5, "2"}, {10, "1"}, {20, "2"}, {30, "1"}, {30, "2"}, {50, "1"}, {60, "2"}}));
}

TEST(order, of_chunks_that_overlap_takes_no_more_memory_than_it_may) {
  file made;
  mcap::writer into{made, {}};
  const auto channel = *into.add_channel(0, "/a", "json");
  const std::string data(10'000, 'x');
  for (int chunk = 0; chunk < 10; ++chunk) {
    for (const std::uint64_t ns : {0U, 1000U}) into.add({.channel = channel, .logged_ns = ns, .data = data});
    into.end_chunk();
  }
  into.end();
  mcap::reader reads{made, 50'000};
  ASSERT_TRUE(reads.open()) << reads.wrong();
  EXPECT_EQ(all_of(reads).size(), 4U) << "of two chunks";
  ASSERT_EQ(reads.damaged().size(), 8U);
  EXPECT_EQ(reads.damaged()[0].why, "more chunks overlap in time than fit into memory");
}

TEST(messages, may_lie_outside_of_chunks) {
  file made;
  made.bytes_written.assign(mcap::magic);
  mcap::record_writer into{made.bytes_written};
  mcap::write_header(into, "", "another program");
  mcap::write(into, mcap::channel{.id = 7, .topic = "/a", .encoding = "json"});
  for (const std::uint64_t ns : {3U, 1U, 2U})
    mcap::write(into, mcap::message{.channel = 7, .logged_ns = ns, .data = "{}"});
  mcap::write_data_end(into);
  into.begin(mcap::opcode::footer);
  for (int i = 0; i < 2; ++i) into.number(std::uint64_t{0});
  into.number(std::uint32_t{0});
  into.end();
  into.bytes(mcap::magic);
  const auto all = all_of(made);
  ASSERT_EQ(all.size(), 3U);
  for (std::uint64_t i = 0; i < 3; ++i) EXPECT_EQ(all[static_cast<std::size_t>(i)].logged_ns, i + 1);
}

TEST(damage, to_a_chunk_is_said_and_the_next_one_is_read) {
  file made = recording(100);
  mcap::reader first{made};
  ASSERT_TRUE(first.open());
  const auto& third = first.all().chunks[2];
  made.bytes_written[static_cast<std::size_t>(third.offset + third.bytes - 5)] ^= 1;
  mcap::reader reads{made};
  ASSERT_TRUE(reads.open());
  auto all = expected(100);
  all.erase(all.begin() + 20, all.begin() + 30);
  EXPECT_EQ(all_of(reads), all);
  ASSERT_EQ(reads.damaged().size(), 1U);
  EXPECT_EQ(reads.damaged()[0].offset, third.offset);
}

TEST(damage, to_the_summary_has_the_file_looked_through) {
  file made = recording(100);
  made.bytes_written[made.bytes_written.size() - 60] ^= 1;
  mcap::reader reads{made};
  ASSERT_TRUE(reads.open());
  EXPECT_FALSE(reads.has_summary());
  EXPECT_EQ(all_of(reads), expected(100));
}

// As writers leave it that are told to leave something out.
TEST(summary, that_does_not_say_all_has_the_file_looked_through) {
  const std::vector<void (*)(mcap::summary&)> without{
      [](mcap::summary& all) { all.channels.erase(2); },
      [](mcap::summary& all) { all.schemas.clear(); },
      [](mcap::summary& all) { all.chunks.pop_back(); },
      [](mcap::summary& all) { all.metadata.clear(); },
      [](mcap::summary& all) { all.counts.attachments = 1; },
  };
  for (std::size_t i = 0; i < without.size(); ++i) {
    file made = recording(40, mcap::compression::none, false);
    mcap::summary all = mcap::scan(made).all;
    without[i](all);
    std::string end;
    mcap::write_end(end, made.bytes(), all);
    made.write(end);
    mcap::reader reads{made};
    ASSERT_TRUE(reads.open()) << i;
    EXPECT_FALSE(reads.has_summary()) << i;
    EXPECT_EQ(all_of(reads), expected(40)) << i;
    EXPECT_EQ(reads.all().channels.at(2).topic, "/even") << i;
    EXPECT_EQ(reads.all().schemas.size(), 1U) << i;
    EXPECT_EQ(reads.all().metadata.size(), 1U) << i;
  }
}

// As a writer leaves it that appends them to a file of chunks.
TEST(summary, that_does_not_list_messages_behind_chunks_has_the_file_looked_through) {
  file made = recording(40, mcap::compression::none, false);
  mcap::summary all = mcap::scan(made).all;
  const std::string text = body(40);
  std::string more;
  mcap::record_writer into{more};
  mcap::write(into, mcap::message{.channel = 2, .logged_ns = 40'000'000, .data = text});
  made.write(more);
  ++all.counts.messages;
  ++all.counts.messages_of[2];
  std::string end;
  mcap::write_end(end, made.bytes(), all);
  made.write(end);
  mcap::reader reads{made};
  ASSERT_TRUE(reads.open());
  EXPECT_FALSE(reads.has_summary());
  EXPECT_EQ(all_of(reads), expected(41));
}

TEST(other_files, are_refused) {
  file empty;
  file text;
  text.bytes_written = "time,x,y\n1,2,3\n";
  for (file* one : {&empty, &text}) {
    mcap::reader reads{*one};
    EXPECT_FALSE(reads.open());
    EXPECT_NE(reads.wrong().find("does not begin as a recording"), std::string::npos) << reads.wrong();
  }
}

} // namespace
} // namespace reader_test
