// SPDX-License-Identifier: Apache-2.0
#include "recording/file_names.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "recording/folder.hpp"

namespace {

using rowe::recording::file_names;

constexpr std::int64_t some_time = 1'796'011'798'000'000'000; // 2026-11-30T04:09:58Z

std::vector<std::string> names_of(const file_names& all) {
  std::vector<std::string> names;
  for (const auto& one : all.there()) names.push_back(one.path.substr(one.path.rfind('/') + 1));
  return names;
}

TEST(file_names, of_a_path_are_numbered) {
  const file_names of{"/var/data/run.mcap", "ang-01"};
  EXPECT_FALSE(of.in_folder());
  EXPECT_EQ(of.name(some_time, 0), "/var/data/run.mcap");
  EXPECT_EQ(of.name(some_time, 1), "/var/data/run_2.mcap");
  EXPECT_EQ((file_names{"run", ""}.name(some_time, 0)), "run.mcap");
}

TEST(file_names, in_a_folder_have_the_robot_and_the_time) {
  const file_names of{"/var/data/", "ang 01/x"};
  EXPECT_TRUE(of.in_folder());
  EXPECT_EQ(of.name(some_time, 0), "/var/data/ang-01-x_2026-11-30T04-09-58Z.mcap");
  EXPECT_EQ(of.name(some_time, 1), "/var/data/ang-01-x_2026-11-30T04-09-58Z_2.mcap");
  EXPECT_EQ((file_names{"/var/data/", "../.."}.name(some_time, 0)),
            "/var/data/rowe..-.._2026-11-30T04-09-58Z.mcap");
}

TEST(file_names, finds_its_own_files_only_and_the_oldest_first) {
  const recording_test::folder in;
  for (const char* const name :
       {"ang_2026-11-30T04-09-58Z_10.mcap", "ang_2026-11-30T04-09-58Z_2.mcap",
        "ang_2026-11-30T04-09-58Z.mcap", "ang_2026-11-29T23-00-00Z.mcap", "ang_2026-11-30T04-09-58Z_1.mcap",
        "ang_2026-11-30.mcap", "ang_2026-11-30T04-09-58Z.mcap.bak", "bee_2026-11-30T04-09-58Z.mcap",
        "ang_notes.mcap", "run.mcap", "run_3.mcap", "run_12.mcap", "run_x.mcap", "run2.mcap"})
    std::ofstream{in / name} << "x";
  EXPECT_EQ(
      names_of(file_names{in.path(), "ang"}),
      (std::vector<std::string>{"ang_2026-11-29T23-00-00Z.mcap", "ang_2026-11-30T04-09-58Z.mcap",
                                "ang_2026-11-30T04-09-58Z_2.mcap", "ang_2026-11-30T04-09-58Z_10.mcap"}));
  EXPECT_EQ(names_of(file_names{in / "run.mcap", ""}),
            (std::vector<std::string>{"run.mcap", "run_3.mcap", "run_12.mcap"}));
}

} // namespace
