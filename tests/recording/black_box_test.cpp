// SPDX-License-Identifier: Apache-2.0
#include "recording/black_box.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include <malloc.h>

#include "recording/folder.hpp"
#include "recording/triggers.hpp"

namespace {

using namespace std::chrono_literals;
using recording_test::all_of;
using recording_test::folder;
using rowe::recording::black_box;
using rowe::recording::triggers;

std::string state(std::string_view is) { return R"({"state":")" + std::string{is} + R"(","number":1})"; }
std::string control(std::string_view driver, int age_ms) {
  return R"({"topics":[{"topic":"/cmd_vel","lease_ms":300,"driver":)" + std::string{driver} +
         R"(,"age_ms":)" + std::to_string(age_ms) + "}]}";
}

TEST(triggers, see_a_stop_once_and_none_in_what_was_there_before) {
  triggers seen;
  EXPECT_FALSE(seen.in(triggers::stop_topic, state("stopped")));
  EXPECT_FALSE(seen.in(triggers::stop_topic, state("running")));
  EXPECT_FALSE(seen.in("/other", state("stopped")));
  EXPECT_FALSE(seen.in(triggers::stop_topic, "{"));
  EXPECT_EQ(seen.in(triggers::stop_topic, state("stopped")), "stop");
  EXPECT_FALSE(seen.in(triggers::stop_topic, state("resetting")));
  EXPECT_FALSE(seen.in(triggers::stop_topic, state("running")));
  EXPECT_EQ(seen.in(triggers::stop_topic, state("stopped")), "stop");
}

TEST(triggers, see_a_driver_fall_silent_and_not_one_that_lets_go) {
  triggers seen;
  EXPECT_FALSE(seen.in(triggers::control_topic, control("null", 0)));
  EXPECT_FALSE(seen.in(triggers::control_topic, control("\"ann\"", 20)));
  EXPECT_FALSE(seen.in(triggers::control_topic, control("null", 20))); // let go
  EXPECT_FALSE(seen.in(triggers::control_topic, control("\"ann\"", 20)));
  EXPECT_EQ(seen.in(triggers::control_topic, control("\"ann\"", 320)), "lease");
  EXPECT_FALSE(seen.in(triggers::control_topic, control("\"ann\"", 370)));
  EXPECT_FALSE(seen.in(triggers::control_topic, "[]"));
}

// A box that is told the time, 1 ms for each message of /odom.
class boxed : public testing::Test {
 protected:
  static constexpr std::int64_t start_ns = 1'000'000'000'000;

  void begin(rowe::black_box_options options) {
    box_.emplace(rowe::recording_options{.path = in_.path(), .name = "ang", .black_box = options});
    ASSERT_TRUE(box_->begin(now())) << box_->fault();
    box_->set_topic(0, "/odom", "a/Odom", "");
    box_->set_topic(1, std::string{triggers::stop_topic}, "rowe/StopState", "");
    box_->add(1, state("running"), wall(), 0);
  }
  void pass(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) {
      box_->add(0, R"({"n":)" + std::to_string(ms_) + "}", wall(), 0);
      ++ms_;
      if (ms_ % 10 == 0) box_->tend(now(), true);
    }
  }
  rowe::rt::time_point now() const { return rowe::rt::time_point{1h + std::chrono::milliseconds{ms_}}; }
  std::int64_t wall() const { return start_ns + std::int64_t{ms_} * 1'000'000; }
  rowe::recording_figures figures() const {
    rowe::recording_figures all;
    box_->describe(all);
    return all;
  }
  // The first and the last number of /odom in the file; all between are there.
  std::pair<int, int> numbers(const std::string& name) const {
    int first = -1;
    int last = -1;
    for (const auto& one : all_of(in_ / name)) {
      if (one.topic != "/odom") continue;
      const int n = std::stoi(one.data.substr(5));
      if (first < 0) first = n;
      EXPECT_TRUE(last < 0 || n == last + 1);
      last = n;
    }
    return {first, last};
  }

  folder in_;
  int ms_ = 0;
  std::optional<black_box> box_;
};

TEST_F(boxed, writes_what_led_to_a_stop_and_what_followed) {
  begin({.before = 2s, .after = 1s});
  pass(5000);
  EXPECT_TRUE(in_.files().empty());
  EXPECT_GT(figures().retained, 0U);
  box_->add(1, state("stopped"), wall(), 0);
  pass(3000);
  ASSERT_EQ(in_.files().size(), 1U);
  EXPECT_TRUE(in_.files()[0].starts_with("ang-stop_"));
  const auto [first, last] = numbers(in_.files()[0]);
  EXPECT_LE(first, 3000);
  EXPECT_GE(first, 2500); // no more than a chunk before
  EXPECT_GE(last, 5990);
  EXPECT_LE(last, 6200);
  auto file = rowe::recording_reader::open(in_ / in_.files()[0]).value();
  EXPECT_TRUE(file.is_ended());
  EXPECT_EQ(file.metadata().front().values.at("happened"), "stop");
  EXPECT_EQ(file.metadata().front().values.at("cause"), state("stopped"));
  EXPECT_EQ(figures().messages, file.messages());
  EXPECT_EQ(figures().files, 1U);
}

TEST_F(boxed, goes_on_where_more_happens_and_is_whole_when_it_is_closed) {
  begin({.before = 1s, .after = 1s});
  pass(1500);
  box_->snapshot("I want it");
  pass(800);
  box_->add(1, state("stopped"), wall(), 0);
  pass(800);
  EXPECT_TRUE(box_->close());
  ASSERT_EQ(in_.files().size(), 1U);
  EXPECT_TRUE(in_.files()[0].starts_with("ang-stop_"));
  EXPECT_EQ(numbers(in_.files()[0]).second, ms_ - 1);
  auto file = rowe::recording_reader::open(in_ / in_.files()[0]).value();
  ASSERT_EQ(file.metadata().size(), 2U);
  EXPECT_EQ(file.metadata()[0].values.at("cause"), "I want it");
}

TEST_F(boxed, holds_no_more_than_it_may) {
  begin({.before = 1h, .bytes = 1 << 20});
  box_->set_topic(2, "/noise", "", "");
  unsigned seed = 1;
  for (int i = 0; i < 3000; ++i) {
    std::string noise(1000, ' ');
    for (char& c : noise) c = static_cast<char>('0' + (seed = seed * 1103515245 + 12345) / 65536 % 64);
    box_->add(2, noise, wall(), 0);
    pass(1);
    EXPECT_LE(figures().retained, (1U << 20) + (2U << 20));
  }
  box_->snapshot("");
  EXPECT_TRUE(box_->close());
  EXPECT_LT(std::filesystem::file_size(in_ / in_.files()[0]), 2U << 20);
  EXPECT_EQ(numbers(in_.files()[0]).second, ms_ - 1);
}

// What compresses well takes room while it is compressed, and no more than its own afterwards.
TEST_F(boxed, holds_no_more_than_it_says_of_what_compresses_well) {
  begin({.before = 1h, .bytes = 1 << 20});
  box_->set_topic(2, "/padded", "", "");
  const std::string padded = R"({"x":")" + std::string(200'000, ' ') + R"("})";
  const std::size_t before = ::mallinfo2().uordblks;
  for (int i = 0; i < 1000; ++i) {
    box_->add(2, padded, wall(), 0);
    pass(10);
  }
  const std::size_t after = ::mallinfo2().uordblks;
  EXPECT_LT(after - std::min(before, after), 6U << 20);
}

TEST_F(boxed, calls_a_file_by_a_stop_that_comes_while_it_is_written) {
  begin({.before = 1s, .after = 1s});
  box_->snapshot("a lease, say");
  pass(300);
  box_->add(1, state("stopped"), wall(), 0);
  pass(100);
  ASSERT_EQ(in_.files().size(), 1U);
  EXPECT_TRUE(in_.files()[0].starts_with("ang-stop_")) << in_.files()[0];
  EXPECT_TRUE(box_->close());
  EXPECT_EQ(numbers(in_.files()[0]).second, ms_ - 1);
}

TEST_F(boxed, ends_a_file_whatever_goes_on_happening) {
  begin({.before = 1s, .after = 100ms});
  for (int i = 0; i < 50; ++i) {
    box_->snapshot("again");
    pass(50);
  }
  EXPECT_GE(in_.files().size(), 2U);
}

TEST_F(boxed, takes_no_more_for_a_topic_that_comes_again) {
  begin({.before = 1s, .after = 1s});
  for (int i = 0; i < 70'000; ++i) {
    box_->set_topic(2, i % 2 == 0 ? "/one" : "/other", "a/B", "");
    box_->add(2, "{}", wall(), 0);
  }
  EXPECT_EQ(figures().lost, 0U);
}

TEST_F(boxed, deletes_the_oldest_of_the_same_cause_alone) {
  begin({.before = 1s, .after = 10ms, .files_max = 3});
  box_->add(1, state("stopped"), wall(), 0);
  pass(100);
  for (int i = 0; i < 6; ++i) {
    box_->snapshot("again");
    pass(100);
  }
  EXPECT_TRUE(box_->close());
  EXPECT_EQ(in_.files().size(), 4U);
  EXPECT_EQ(std::ranges::count_if(in_.files(), [](const auto& n) { return n.starts_with("ang-stop_"); }), 1);
  EXPECT_EQ(figures().deleted, 3U);
  EXPECT_EQ(figures().files, 7U);
}

// A peer can make up topics, 65 536 of them and more: what they are called has its share.
TEST_F(boxed, begins_anew_when_there_were_more_topics_than_a_file_can_have) {
  begin({.before = 1s, .after = 1s});
  for (int i = 0; i < 66'000; ++i) {
    box_->set_topic(2, "/made_up/" + std::to_string(i), "a/B", "");
    box_->add(2, "{}", wall(), 0);
  }
  pass(100);
  box_->snapshot("");
  EXPECT_TRUE(box_->close());
  EXPECT_EQ(numbers(in_.files()[0]).second, ms_ - 1);
}

TEST_F(boxed, has_what_followed_a_stop_whoever_asks_meanwhile) {
  begin({.before = 1s, .after = 100ms});
  for (int i = 0; i < 23; ++i) {
    box_->snapshot("again");
    pass(50);
  }
  const int at = ms_; // the file that was asked for must end within 50 ms
  box_->add(1, state("stopped"), wall(), 0);
  pass(300);
  EXPECT_TRUE(box_->close());
  const auto files = in_.files();
  const auto stop = std::ranges::find_if(files, [](const auto& n) { return n.starts_with("ang-stop_"); });
  ASSERT_NE(stop, files.end());
  EXPECT_GE(numbers(*stop).second, at + 90);
  EXPECT_LE(numbers(*stop).first, at - 900);
}

TEST_F(boxed, notes_a_stop_however_often_it_was_asked) {
  begin({.before = 1s, .after = 1s});
  for (int i = 0; i < 150; ++i) box_->snapshot("again");
  box_->add(1, state("stopped"), wall(), 0);
  EXPECT_TRUE(box_->close());
  const auto notes = rowe::recording_reader::open(in_ / in_.files()[0]).value().metadata();
  EXPECT_LT(notes.size(), 100U);
  EXPECT_TRUE(
      std::ranges::any_of(notes, [](const auto& one) { return one.values.at("happened") == "stop"; }));
}

TEST_F(boxed, deletes_the_oldest_of_those_that_were_renamed) {
  begin({.before = 1s, .after = 10ms, .files_max = 3});
  for (int i = 0; i < 6; ++i) {
    box_->snapshot("again");
    box_->add(1, state("stopped"), wall(), 0);
    pass(100);
    box_->add(1, state("running"), wall(), 0);
  }
  EXPECT_TRUE(box_->close());
  EXPECT_EQ(in_.files().size(), 3U);
  EXPECT_EQ(figures().deleted, 3U);
}

TEST_F(boxed, ends_no_file_while_messages_wait_that_came_before) {
  begin({.before = 1s, .after = 1s});
  pass(100);
  box_->add(1, state("stopped"), wall(), 0);
  const int at = ms_;
  ms_ += 5000; // the thread was kept waiting; what came meanwhile waits
  box_->tend(now(), false);
  ms_ = at;
  for (int i = 0; i < 900; ++i) {
    box_->add(0, R"({"n":)" + std::to_string(ms_) + "}", wall(), 0);
    ++ms_;
  }
  ms_ = at + 5000;
  box_->tend(now(), true);
  ASSERT_EQ(in_.files().size(), 1U);
  EXPECT_EQ(numbers(in_.files()[0]).second, at + 899);
}

TEST_F(boxed, tries_again_to_write_what_led_to_a_stop) {
  begin({.before = 5s, .after = 100ms});
  pass(1000);
  const std::filesystem::path here = std::filesystem::path{in_.path()}.parent_path(),
                              away{here.string() + ".away"};
  std::filesystem::rename(here, away);
  box_->add(1, state("stopped"), wall(), 0);
  pass(500);
  EXPECT_FALSE(box_->fault().empty());
  std::filesystem::rename(away, here);
  pass(1500);
  EXPECT_TRUE(box_->fault().empty()) << box_->fault();
  ASSERT_EQ(in_.files().size(), 1U);
  EXPECT_TRUE(in_.files()[0].starts_with("ang-stop_"));
  EXPECT_LE(numbers(in_.files()[0]).first, 10);
}

TEST(black_box, says_why_it_cannot_begin) {
  black_box tried{{.path = "/proc/nowhere", .black_box = {.before = 1s}}};
  EXPECT_FALSE(tried.begin({}));
  EXPECT_TRUE(tried.fault().starts_with("/proc/nowhere/: ")) << tried.fault();
}

} // namespace
