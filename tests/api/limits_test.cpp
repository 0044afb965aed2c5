// SPDX-License-Identifier: Apache-2.0
// Limits: what the defaults hold, and how programs let their users choose.
#include <rowe/limits.hpp>

#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <rowe/ros.hpp>
#include <rowe/rowe.hpp>

#include "rt/sanitized.hpp"
#include "variable.hpp"

namespace limits_test {

struct scan {
  std::uint64_t stamp = 0;
  std::array<float, 1080> ranges{};
};
struct image {
  std::array<std::uint8_t, 640 * 480> pixels{};
};

} // namespace limits_test

template <>
inline constexpr auto rowe::schema<limits_test::scan> =
    rowe::fields<&limits_test::scan::stamp, &limits_test::scan::ranges>{};
template <>
inline constexpr auto rowe::schema<limits_test::image> = rowe::fields<&limits_test::image::pixels>{};

namespace limits_test {
namespace {

using rowe::endpoint;
using rowe::errc;
using rowe::json_text;
using rowe::limits;
namespace ros = rowe::ros;

// What a robot with some sensors opens.
struct ordinary_robot {
  explicit ordinary_robot(endpoint& robot) {
    const auto each = [](int count, auto&& open) {
      for (int i = 0; i < count; ++i) open(std::to_string(i));
    };
    const auto keep = [this](auto& in, auto&& opened) {
      if (opened)
        in.push_back(std::move(opened).value());
      else
        faults.push_back(opened.error().message());
    };
    each(8, [&](const std::string& i) { keep(scans, robot.advertise<scan>("/scan/" + i)); });
    each(2, [&](const std::string& i) { keep(images, robot.advertise<image>("/image/" + i)); });
    each(10, [&](const std::string& i) { keep(odometry, robot.advertise<ros::odometry>("/odom/" + i)); });
    each(5, [&](const std::string& i) { keep(twists, robot.advertise<ros::twist>("/speed/" + i)); });
    each(5, [&](const std::string& i) { keep(texts, robot.advertise<json_text>("/text/" + i)); });
    each(8, [&](const std::string& i) { keep(heard, robot.subscribe<ros::twist>("/cmd/" + i)); });
    each(2, [&](const std::string& i) { keep(goals, robot.subscribe<ros::odometry>("/goal/" + i)); });
    each(10, [&](const std::string& i) { keep(serves, robot.serve<ros::twist, ros::pose>("/do/" + i)); });
    each(2, [&](const std::string& i) { keep(calls, robot.client<json_text, json_text>("/ask/" + i)); });
    each(2, [&](const std::string&) { keep(lanes, robot.open_lane()); });
    each(2, [&](const std::string&) { keep(latches, robot.stop_latch()); });
    each(10, [&](const std::string& i) { keep(parameters, robot.parameter<double>("gain" + i, 1.0)); });
  }
  std::vector<std::string> faults;
  std::vector<rowe::publisher<scan>> scans;
  std::vector<rowe::publisher<image>> images;
  std::vector<rowe::publisher<ros::odometry>> odometry;
  std::vector<rowe::publisher<ros::twist>> twists;
  std::vector<rowe::publisher<json_text>> texts;
  std::vector<rowe::subscriber<ros::twist>> heard;
  std::vector<rowe::subscriber<ros::odometry>> goals;
  std::vector<rowe::responder<ros::twist, ros::pose>> serves;
  std::vector<rowe::caller<json_text, json_text>> calls;
  std::vector<rowe::lane> lanes;
  std::vector<rowe::stop_latch> latches;
  std::vector<rowe::parameter<double>> parameters;
};

TEST(default_limits, hold_an_ordinary_robot) {
  auto robot = endpoint::listen(0).value();
  const ordinary_robot opened{robot};
  EXPECT_EQ(opened.faults, std::vector<std::string>{});
}

// As an ordinary user of Debian, who may lock 8 MiB: what is opened first is locked.
TEST(default_limits, hold_an_ordinary_robot_where_not_all_of_it_can_be_locked) {
#ifdef ROWE_TEST_SANITIZED
  GTEST_SKIP() << "the sanitizers replace mlock by a function that does nothing";
#endif
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    constexpr rlim_t of_debian = rlim_t{8} << 20U;
    const rlimit some{of_debian, of_debian};
    if (::setrlimit(RLIMIT_MEMLOCK, &some) != 0) ::_exit(2);
    if (::geteuid() == 0 && ::setresuid(65534, 65534, 65534) != 0) ::_exit(3); // leaves CAP_IPC_LOCK behind
    auto robot = endpoint::listen(0);
    if (!robot || !robot->memory_locked()) ::_exit(4);
    auto first = robot->advertise<ros::odometry>("/odom");
    if (!first || !robot->memory_locked()) ::_exit(5);
    const ordinary_robot opened{*robot};
    if (!opened.faults.empty()) ::_exit(6);
    if (robot->memory_locked() || robot->memory_unlocked_bytes() == 0) ::_exit(7);
    ::_exit(robot->memory_unlocked_bytes() < limits{}.handle_bytes ? 0 : 8);
  }
  int outcome = 0;
  ASSERT_EQ(::waitpid(child, &outcome, 0), child);
  EXPECT_TRUE(WIFEXITED(outcome));
  EXPECT_EQ(WEXITSTATUS(outcome), 0);
}

TEST(handle_memory, that_is_too_small_is_told_with_what_is_wanted_what_is_left_and_the_limit) {
  rowe::endpoint_options few;
  few.limits.handle_bytes = 200'000;
  auto robot = endpoint::listen(0, few).value();
  const auto first = robot.open_lane();
  ASSERT_TRUE(first) << first.error().name();
  const auto second = robot.open_lane();
  ASSERT_EQ(second.code(), errc::handle_memory);
  EXPECT_EQ(second.error().about, rowe::argument::handle_bytes);
  EXPECT_EQ(second.error().whole, 200'000U);
  EXPECT_GT(second.error().value, second.error().limit);
  EXPECT_GT(second.error().limit, 0);
  const std::string expected = std::to_string(second.error().value) + " bytes of handle memory are needed, " +
                               std::to_string(second.error().limit) +
                               " of 200000 are left: raise `handle_bytes`";
  EXPECT_EQ(second.error().message(), expected);
}

// ---- by their names

TEST(handle_memory, of_nothing_is_a_limit_as_any) {
  rowe::endpoint_options options;
  options.limits.handle_bytes = 0;
  auto opened = endpoint::listen(0, options);
  ASSERT_TRUE(opened) << opened.error().message();
  EXPECT_EQ(opened->advertise<json_text>("/a").code(), errc::handle_memory);
}

TEST(limits_by_name, are_all_there_and_keep_what_they_are_set_to) {
  for (const std::string_view name : limits::names()) {
    limits bounds;
    std::string why;
    EXPECT_FALSE(bounds.set(name, "18446744073709551615", &why));
    EXPECT_TRUE(why.starts_with(std::string{name} + " is out of range: 18446744073709551615 (")) << why;
    EXPECT_TRUE(bounds.set(name, "128", &why) || bounds.set(name, "65536", &why)) << why;
  }
  limits bounds;
  EXPECT_TRUE(bounds.set("topics_max", "256"));
  EXPECT_TRUE(bounds.set("handle_bytes", "5000000"));
  EXPECT_EQ(bounds.topics_max, 256U);
  EXPECT_EQ(bounds.handle_bytes, 5'000'000U);
}

TEST(limits_by_name, say_what_is_wrong_and_change_nothing) {
  limits bounds;
  std::string why;
  const auto below = bounds.set("calls_max", "0", &why);
  EXPECT_EQ(below.error(), (rowe::error{errc::bad_argument, 0, 1, rowe::argument::calls_max}));
  EXPECT_EQ(why, "calls_max is out of range: 0 (1 to 65536)");
  EXPECT_EQ(bounds.set("calls_max", "65537").error(),
            (rowe::error{errc::bad_argument, 65537, 65536, rowe::argument::calls_max}));
  for (const std::string_view none : {"", "x", "1x", " 1", "1.5", "0x10"}) {
    EXPECT_EQ(bounds.set("calls_max", none, &why).code(), errc::bad_argument);
    EXPECT_EQ(why, "calls_max needs a whole number, not \"" + std::string{none} + "\" (1 to 65536)");
  }
  EXPECT_EQ(bounds.set("topics", "5", &why).code(), errc::bad_argument);
  EXPECT_TRUE(why.starts_with("there is no limit topics; there are connections_max, ")) << why;
  EXPECT_EQ(bounds.calls_max, limits{}.calls_max);
}

TEST(limits_by_name, come_from_the_environment_where_that_is_asked_for) {
  const variable topics{"ROWE_LIMITS_TOPICS_MAX", "256"};
  const variable handles{"ROWE_LIMITS_HANDLE_BYTES", "3000000"};
  limits few;
  few.calls_max = 7;
  const auto made = few.with_environment();
  ASSERT_TRUE(made);
  EXPECT_EQ(made->topics_max, 256U);
  EXPECT_EQ(made->handle_bytes, 3'000'000U);
  EXPECT_EQ(made->calls_max, 7U);
  EXPECT_EQ(few.topics_max, limits{}.topics_max); // and only there
}

TEST(limits_by_name, name_the_variable_that_is_wrong) {
  std::string why;
  {
    const variable calls{"ROWE_LIMITS_CALLS_MAX", "many"};
    EXPECT_EQ(limits{}.with_environment(&why).code(), errc::bad_argument);
    EXPECT_EQ(why, "ROWE_LIMITS_CALLS_MAX needs a whole number, not \"many\" (1 to 65536)");
  }
  const variable unknown{"ROWE_LIMITS_TOPICS", "5"};
  EXPECT_EQ(limits{}.with_environment(&why).code(), errc::bad_argument);
  EXPECT_TRUE(why.starts_with("there is no variable ROWE_LIMITS_TOPICS; there are ROWE_LIMITS_CONN")) << why;
}

} // namespace
} // namespace limits_test
