// SPDX-License-Identifier: Apache-2.0
// Recordings of which the end is missing, or a part is wrong, in files.
#include "mcap/repair.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "memory_file.hpp"

namespace repair_test {
namespace {

using namespace memory_file;

struct repair : testing::Test {
  std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("rowe-repair-" + std::to_string(::getpid()));
  std::string path = (folder / "a.mcap").string();

  void SetUp() override { std::filesystem::create_directories(folder); }
  void TearDown() override { std::filesystem::remove_all(folder); }
  void put(std::string_view bytes) const {
    std::ofstream{path, std::ios::binary}.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  static file load(const std::string& from) {
    file made;
    std::ifstream in{from, std::ios::binary};
    made.bytes_written.assign(std::istreambuf_iterator<char>{in}, {});
    return made;
  }
};

TEST_F(repair, of_a_whole_file_changes_nothing) {
  const file whole = recording(40);
  put(whole.bytes_written);
  const auto done = mcap::repair(path);
  EXPECT_TRUE(done.wrong.empty()) << done.wrong;
  EXPECT_TRUE(done.was_whole);
  EXPECT_EQ(load(path).bytes_written, whole.bytes_written);
}

TEST_F(repair, of_a_file_that_was_cut_off_anywhere_gives_it_its_end) {
  const file whole = recording(40);
  for (auto bytes = static_cast<std::size_t>(whole.ends[0]); bytes < whole.bytes_written.size(); ++bytes) {
    put(std::string_view{whole.bytes_written}.substr(0, bytes));
    const auto done = mcap::repair(path);
    ASSERT_TRUE(done.wrong.empty()) << bytes << ": " << done.wrong;
    ASSERT_TRUE(done.in_place) << bytes;
    file repaired = load(path);
    mcap::reader reads{repaired};
    ASSERT_TRUE(reads.open() && reads.has_summary()) << bytes;
    EXPECT_EQ(all_of(reads), expected(done.messages)) << bytes;
    for (const auto& one : reads.all().chunks) EXPECT_EQ(one.indexes.size(), 2U) << bytes;
    EXPECT_TRUE(mcap::repair(path).was_whole) << bytes;
  }
}

TEST_F(repair, of_a_damaged_chunk_saves_all_others_into_another_file) {
  file made = recording(40);
  const mcap::findings whole = mcap::scan(made);
  const auto& second = whole.all.chunks[1];
  made.bytes_written[static_cast<std::size_t>(second.offset + second.bytes - 1)] ^= 1;
  put(made.bytes_written);
  const auto done = mcap::repair(path);
  ASSERT_TRUE(done.wrong.empty()) << done.wrong;
  EXPECT_FALSE(done.in_place);
  EXPECT_EQ(done.messages, 30U);
  EXPECT_EQ(done.path, (folder / "a.repaired.mcap").string());
  EXPECT_EQ(load(path).bytes_written, made.bytes_written) << "the damaged file stays as it is";
  file repaired = load(done.path);
  auto all = expected(40);
  all.erase(all.begin() + 10, all.begin() + 20);
  mcap::reader reads{repaired};
  ASSERT_TRUE(reads.open() && reads.has_summary());
  EXPECT_EQ(all_of(reads), all);
  EXPECT_EQ(reads.all().metadata.size(), 1U);
  EXPECT_EQ(reads.head().program, "rowe");
}

TEST_F(repair, of_a_file_without_its_header_makes_another_file) {
  const file whole = recording(40);
  put(std::string_view{whole.bytes_written}.substr(0, whole.ends[0] - 1));
  const auto done = mcap::repair(path);
  ASSERT_TRUE(done.wrong.empty()) << done.wrong;
  EXPECT_EQ(done.messages, 0U);
  file repaired = load(done.path);
  EXPECT_TRUE(mcap::scan(repaired).has_head);
}

TEST_F(repair, of_what_is_no_recording_is_refused) {
  put("no recording");
  EXPECT_NE(mcap::repair(path).wrong.find("does not begin as a recording"), std::string::npos);
  EXPECT_FALSE(mcap::repair((folder / "none.mcap").string()).wrong.empty());
  EXPECT_FALSE(mcap::repair(folder.string()).wrong.empty());
}

} // namespace
} // namespace repair_test
