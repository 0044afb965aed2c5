// SPDX-License-Identifier: Apache-2.0
// Files that were cut off anywhere, and in which any byte is wrong.
#include "mcap/scan.hpp"

#include <gtest/gtest.h>

#include "memory_file.hpp"

namespace scan_test {
namespace {

using namespace memory_file;

// How many of the messages of the whole recording are there; none may be another.
std::uint64_t whole_messages(file& of, std::uint64_t count) {
  const auto known = expected(count);
  std::uint64_t found = 0;
  for (const heard& one : all_of(of)) {
    EXPECT_NE(std::find(known.begin(), known.end(), one), known.end()) << one.data;
    ++found;
  }
  return found;
}

TEST(scan, of_a_file_that_is_cut_off_has_every_whole_chunk) {
  const file whole = recording(40);
  for (std::size_t bytes = mcap::magic.size(); bytes < whole.bytes_written.size(); ++bytes) {
    file cut;
    cut.bytes_written = whole.bytes_written.substr(0, bytes);
    const mcap::findings found = mcap::scan(cut);
    ASSERT_TRUE(found.wrong.empty()) << found.wrong;
    std::uint64_t chunks = 0;
    for (const mcap::chunk_index& one : found.all.chunks) chunks += one.offset + one.bytes <= bytes ? 1 : 0;
    EXPECT_EQ(found.all.counts.messages, 10 * chunks) << bytes;
    EXPECT_FALSE(found.ended);
    EXPECT_EQ(whole_messages(cut, 40), found.all.counts.messages);
  }
}

// One byte in a chunk costs that chunk at most; nothing is taken for what it is not.
TEST(scan, of_a_file_with_a_wrong_byte_has_all_other_chunks) {
  for (const auto how : {mcap::compression::none, mcap::compression::lz4}) {
    const file whole = recording(40, how);
    mcap::reader reads{const_cast<file&>(whole)};
    ASSERT_TRUE(reads.open());
    const auto chunks = reads.all().chunks;
    for (std::size_t at = static_cast<std::size_t>(chunks[0].offset); at < chunks[3].offset + chunks[3].bytes;
         ++at) {
      for (const int bit : {0, 3, 7}) {
        file wrong = whole;
        wrong.bytes_written[at] = static_cast<char>(wrong.bytes_written[at] ^ (1 << bit));
        const mcap::findings found = mcap::scan(wrong);
        EXPECT_GE(found.all.counts.messages, 30U) << "byte " << at << ", bit " << bit;
        if (found.all.counts.messages != 40) {
          EXPECT_FALSE(found.damaged.empty()) << at;
        }
      }
    }
  }
}

TEST(scan, says_what_is_damaged_and_where) {
  file made = recording(40);
  const mcap::findings whole = mcap::scan(made);
  EXPECT_TRUE(whole.damaged.empty());
  EXPECT_TRUE(whole.ended);
  const mcap::chunk_index& second = whole.all.chunks[1];
  made.bytes_written[static_cast<std::size_t>(second.offset + second.bytes - 1)] ^= 1;
  const mcap::findings found = mcap::scan(made);
  ASSERT_EQ(found.damaged.size(), 1U);
  EXPECT_EQ(found.damaged[0].offset, second.offset);
  EXPECT_EQ(found.damaged[0].bytes, second.bytes);
  EXPECT_FALSE(found.damaged[0].why.empty());
  EXPECT_EQ(found.all.counts.messages, 30U);
}

TEST(scan, goes_through_garbage_to_the_next_chunk) {
  file made = recording(40);
  const mcap::findings whole = mcap::scan(made);
  const auto at = static_cast<std::size_t>(whole.all.chunks[2].offset);
  made.bytes_written.insert(at, std::string(100'000, '\x06'));
  const mcap::findings found = mcap::scan(made);
  EXPECT_EQ(found.all.counts.messages, 40U);
  ASSERT_EQ(found.damaged.size(), 1U);
  EXPECT_EQ(found.damaged[0].bytes, 100'000U);
}

TEST(scan, counts_messages_that_nothing_describes) {
  file made;
  mcap::writer into{made, {}};
  into.add({.channel = 9, .logged_ns = 1, .data = "{}"});
  into.end();
  EXPECT_EQ(mcap::scan(made).unknown_messages, 1U);
}

} // namespace
} // namespace scan_test
