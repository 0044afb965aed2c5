// SPDX-License-Identifier: Apache-2.0
// A folder for the files of one test, and what is read back from them.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <unistd.h>

#include <rowe/recording.hpp>

namespace recording_test {

class folder {
 public:
  folder() { std::filesystem::create_directories(path_); }
  ~folder() { std::filesystem::remove_all(path_); }
  folder(const folder&) = delete;
  folder& operator=(const folder&) = delete;
  std::string path() const { return path_.string() + "/"; }
  std::string operator/(const std::string& file) const { return (path_ / file).string(); }
  std::vector<std::string> files() const { // their names, in order
    std::vector<std::string> all;
    for (const auto& one : std::filesystem::directory_iterator{path_})
      all.push_back(one.path().filename().string());
    std::ranges::sort(all);
    return all;
  }

 private:
  std::filesystem::path path_ = std::filesystem::path{testing::TempDir()} /
                                ("rowe-recording-" + std::to_string(::getpid()) + "-" +
                                 testing::UnitTest::GetInstance()->current_test_info()->name());
};

struct heard {
  std::string topic;
  std::string data;
  std::uint32_t sequence;
  std::int64_t logged_ns;
  std::int64_t published_ns;
};

inline std::vector<heard> all_of(const std::string& path) {
  std::string why;
  auto file = rowe::recording_reader::open(path, &why);
  EXPECT_TRUE(file) << why;
  std::vector<heard> all;
  if (!file) return all;
  while (const rowe::recorded_message* one = file->next())
    all.push_back({file->topics()[one->topic].name, std::string{one->data}, one->sequence, one->logged_ns,
                   one->published_ns});
  EXPECT_TRUE(file->damaged().empty());
  return all;
}

} // namespace recording_test
