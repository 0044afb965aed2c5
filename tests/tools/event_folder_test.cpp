// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/event_folder.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace rowe::tools {
namespace event_folder_test {
namespace {

using namespace std::chrono_literals;

event refusal(std::string_view peer, std::string_view what, event::kind kind = event::kind::refused_handshake,
              std::string_view identity = {}) {
  event made;
  made.identity = identity;
  made.what_kind = kind;
  made.peer = peer;
  made.what = what;
  return made;
}

struct event_folder : testing::Test {
  using texts = std::vector<std::string>;
  tools::event_folder folder{
      [this](const event& e, std::uint64_t more) {
        lines.push_back(std::string{std::string_view{e.peer}} + " " + std::string{std::string_view{e.what}} +
                        (more == 0 ? "" : " +" + std::to_string(more)));
      },
      [this](std::uint64_t left) { lines.push_back("left out " + std::to_string(left)); }};
  texts lines;
  rt::time_point now{1000s};

  texts taken() { return std::exchange(lines, {}); }
  texts later(rt::duration by = tools::event_folder::period) {
    folder.flush(now += by);
    return taken();
  }
};

TEST_F(event_folder, writes_an_event_at_once) {
  folder.take(refusal("10.0.0.7:1", "no"), now);
  EXPECT_EQ(taken(), texts{"10.0.0.7:1 no"});
  EXPECT_EQ(later(), texts{});
}

TEST_F(event_folder, writes_what_repeats_once_a_second_with_its_count) {
  for (int port = 1; port <= 1000; ++port)
    folder.take(refusal("10.0.0.7:" + std::to_string(port), "no"), now);
  EXPECT_EQ(taken(), texts{"10.0.0.7:1 no"});
  EXPECT_EQ(later(999ms), texts{});
  EXPECT_EQ(later(1ms), texts{"10.0.0.7:1000 no +998"});
  EXPECT_EQ(later(), texts{}); // it is over
  folder.take(refusal("10.0.0.7:1", "no"), now);
  EXPECT_EQ(taken(), texts{"10.0.0.7:1 no"});
}

TEST_F(event_folder, writes_a_second_one_as_itself) {
  folder.take(refusal("10.0.0.7:1", "no"), now);
  folder.take(refusal("10.0.0.7:2", "no"), now);
  EXPECT_EQ(taken(), texts{"10.0.0.7:1 no"});
  EXPECT_EQ(later(), texts{"10.0.0.7:2 no"});
}

TEST_F(event_folder, takes_a_port_within_the_words_for_the_same) {
  folder.take(refusal("[::1]:1", "[::1]:1 said no"), now);
  folder.take(refusal("[::1]:2", "[::1]:2 said no"), now);
  EXPECT_EQ(taken().size(), 1U);
}

TEST_F(event_folder, keeps_other_kinds_peers_and_words_apart) {
  folder.take(refusal("10.0.0.7:1", "no"), now);
  folder.take(refusal("10.0.0.8:1", "no"), now);
  folder.take(refusal("10.0.0.7:1", "never"), now);
  folder.take(refusal("10.0.0.7:1", "no", event::kind::denied), now);
  EXPECT_EQ(taken().size(), 4U);
}

TEST_F(event_folder, keeps_identities_of_one_address_apart) {
  for (const std::string_view who : {"anna", "bob", "anna"})
    folder.take(refusal("10.0.0.7:1", "no", event::kind::denied, who), now);
  EXPECT_EQ(taken().size(), 2U);
}

// Ten thousand events a second for a minute, each like none before or like one of a hundred.
TEST_F(event_folder, writes_a_bounded_number_of_lines_and_counts_the_rest) {
  for (const int kinds : {1 << 30, 100, 11}) {
    std::uint64_t told = 0;
    const auto count = [&] {
      for (const std::string& line : taken()) {
        const auto number = line.find_last_of(" +");
        if (line.starts_with("left out")) {
          told += std::stoull(line.substr(number));
        } else {
          told += 1 + (line[number] == '+' ? std::stoull(line.substr(number)) : 0);
        }
      }
    };
    constexpr int a_second = 10'000;
    for (int i = 0; i < 60 * a_second; ++i) {
      folder.take(refusal("10.0.0.7:1", "no " + std::to_string(i % kinds)), now += 1s / a_second);
      if (i % a_second != a_second - 1) continue;
      EXPECT_LE(lines.size(), tools::event_folder::lines_per_second_max);
      count();
    }
    folder.finish();
    count();
    EXPECT_EQ(told, 60U * a_second) << kinds;
  }
}

TEST_F(event_folder, writes_at_the_end_what_it_held_back) {
  for (int i = 0; i < 5; ++i) folder.take(refusal("10.0.0.7:1", "no"), now);
  for (int i = 0; i < 20; ++i) folder.take(refusal("10.0.0.7:1", std::to_string(i)), now);
  (void)taken();
  folder.finish();
  EXPECT_EQ(taken(), (texts{"10.0.0.7:1 no +3", "left out 11"}));
  folder.finish();
  EXPECT_EQ(taken(), texts{});
}

} // namespace
} // namespace event_folder_test
} // namespace rowe::tools
