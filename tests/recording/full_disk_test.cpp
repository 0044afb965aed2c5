// SPDX-License-Identifier: Apache-2.0
// A disk that takes no more, as a limit on the size of files: what was whole stays readable, and what the
// disk did not take is counted.
#include <rowe/recording.hpp>

#include <gtest/gtest.h>

#include <csignal>
#include <random>
#include <string>

#include <sys/resource.h>

#include "recording/folder.hpp"

namespace {

using namespace std::chrono_literals;

class file_size_limit {
 public:
  explicit file_size_limit(rlim_t bytes) {
    before_ = ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &limit_);
    rlimit lower = limit_;
    lower.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &lower);
  }
  ~file_size_limit() {
    ::setrlimit(RLIMIT_FSIZE, &limit_);
    ::signal(SIGXFSZ, before_);
  }
  file_size_limit(const file_size_limit&) = delete;
  file_size_limit& operator=(const file_size_limit&) = delete;

 private:
  rlimit limit_{};
  void (*before_)(int);
};

std::string noise(std::mt19937& by, std::size_t bytes) {
  std::string text(bytes, '\0');
  for (char& c : text) c = static_cast<char>('0' + by() % 64);
  return text;
}

// Adds until the disk takes no more, and looks at what came of it. How many files there are.
std::size_t fill(rowe::recording_writer& file, const recording_test::folder& in, int messages) {
  std::mt19937 by{1};
  const auto topic = file.add_topic("/x", "a/B").value();
  int added = 0;
  for (; added < messages; ++added) {
    if (!file.wait_room(1000, 10s)) break;
    (void)file.add(topic, noise(by, 1000), added);
    if (added % 100 == 0) (void)file.flush(10s);
  }
  (void)file.close();
  const auto figures = file.figures();
  std::uint64_t found = 0;
  for (const std::string& name : in.files()) found += recording_test::all_of(in / name).size();
  EXPECT_EQ(found, figures.messages);
  EXPECT_EQ(figures.messages + figures.lost, static_cast<std::uint64_t>(added));
  return in.files().size();
}

TEST(full_disk, keeps_what_is_whole_and_says_so) {
  for (const rlim_t bytes : {2'000U, 100'000U, 150'000U, 333'333U, 1'000'000U}) {
    const recording_test::folder in;
    const file_size_limit small{bytes};
    std::string why;
    auto file = rowe::recording_writer::create({.path = in / "run.mcap"}, &why);
    ASSERT_TRUE(file) << why;
    EXPECT_EQ(fill(*file, in, 2000), 1U);
    EXPECT_EQ(file->figures().fault, in / "run.mcap: File too large");
    EXPECT_GT(file->figures().lost, 0U);
    EXPECT_EQ(file->close(&why).code(), rowe::errc::bad_recording);
  }
}

TEST(full_disk, ends_the_file_if_there_is_room_for_that) {
  const recording_test::folder in;
  const file_size_limit small{500'000};
  auto file = rowe::recording_writer::create({.path = in / "run.mcap"});
  ASSERT_TRUE(file);
  (void)fill(*file, in, 2000);
  EXPECT_TRUE(rowe::recording_reader::open(in / "run.mcap")->is_ended());
}

} // namespace
