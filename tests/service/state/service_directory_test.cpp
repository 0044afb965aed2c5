// SPDX-License-Identifier: Apache-2.0
#include "service/state/service_directory.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace service_directory_test {
namespace {

using rowe::service::connection_id;
using rowe::service::pair_index;
using rowe::service::service_directory;
using rowe::service::service_index;
using refusal = rowe::service::service_directory::refusal;

struct service_directory_test : testing::Test {
  rowe::limits bounds{.topic_bytes_max = 16, .services_max = 4};
  rowe::rt::arena memory{service_directory::footprint_bytes(bounds), rowe::rt::page_lock::none};
  service_directory directory{memory, bounds};

  service_directory::added add(std::string_view name, std::string_view type = {}) {
    return directory.add(name, type, {}, connection_id{0, 1});
  }
  // There is no place left.
  void fill() {
    for (std::uint32_t i = directory.count(); i < bounds.services_max; ++i)
      ASSERT_EQ(add("/s" + std::to_string(i)).why, refusal::none);
  }
};

TEST_F(service_directory_test, takes_no_more_memory_than_it_says) {
  EXPECT_EQ(memory.bytes_used(), service_directory::footprint_bytes(bounds));
}

TEST_F(service_directory_test, has_one_provider_for_both_spellings_of_a_name) {
  const service_index index = add("/add").index;
  EXPECT_EQ(directory.find("add"), index);
  EXPECT_EQ(add("add").why, refusal::taken);
  EXPECT_EQ(directory.add("/add", {}, pair_index{0}, {}).why, refusal::taken) << "a handle is no exception";
  EXPECT_EQ(directory.name(index), "/add");
  EXPECT_EQ(directory.count(), 1U);
}

TEST_F(service_directory_test, gives_numbers_again_that_nothing_has_and_never_one_of_the_endpoints_own) {
  rowe::rt::arena more{service_directory::footprint_bytes(bounds), rowe::rt::page_lock::none};
  service_directory late{more, bounds, UINT32_MAX - 3};
  const auto number = [&](std::string_view name) {
    return late.at(late.add(name, {}, {}, connection_id{0, 1}).index).number;
  };
  EXPECT_EQ(number("/a"), UINT32_MAX - 2);
  EXPECT_EQ(number("/b"), UINT32_MAX - 1) << "the last one that means something";
  EXPECT_EQ(number("/c"), rowe::service::first_service_number);
  late.remove(late.find("/b"));
  EXPECT_EQ(number("/b"), rowe::service::first_service_number + 1);
}

TEST_F(service_directory_test, says_no_room_only_of_a_name_that_is_not_there) {
  fill();
  EXPECT_EQ(add("/more").why, refusal::no_room);
  EXPECT_EQ(add("/s0").why, refusal::taken);
  EXPECT_EQ(directory.count(), 4U);
  EXPECT_FALSE(directory.find("/more"));
}

TEST_F(service_directory_test, gives_a_free_place_to_another_name) {
  fill();
  const service_index freed = directory.find("/s2");
  directory.remove(freed);
  EXPECT_FALSE(directory.find("/s2"));
  EXPECT_EQ(add("/new").index, freed);
  EXPECT_FALSE(directory.find("/s2"));
  EXPECT_EQ(directory.find("/new"), freed);
}

TEST_F(service_directory_test, keeps_apart_names_and_types_that_are_as_long_as_they_may_be) {
  std::vector<service_index> all;
  for (const char first : {'a', 'b', 'c', 'd'})
    all.push_back(add(std::string(16, first), std::string(16, static_cast<char>(first + 4))).index);
  for (std::uint32_t i = 0; i < 4; ++i) {
    EXPECT_EQ(directory.name(all[i]), std::string(16, static_cast<char>('a' + i)));
    EXPECT_EQ(directory.type(all[i]), std::string(16, static_cast<char>('e' + i)));
  }
}

// A peer that was told a number may use it late.
TEST_F(service_directory_test, gives_no_number_twice) {
  std::set<std::uint32_t> numbers;
  for (int i = 0; i < 20; ++i) {
    const service_index index = add("/add").index;
    const std::uint32_t number = directory.at(index).number;
    EXPECT_GE(number, rowe::service::first_service_number);
    EXPECT_TRUE(numbers.insert(number).second) << number;
    EXPECT_EQ(directory.find_number(number), index);
    directory.remove(index);
    EXPECT_FALSE(directory.find_number(number));
  }
}

TEST_F(service_directory_test, finds_no_free_place_by_the_number_that_free_places_have) {
  EXPECT_FALSE(directory.find_number(0));
}

TEST_F(service_directory_test, counts_what_peers_provide_apart_from_what_handles_do) {
  const service_index of_peer = add("/p").index;
  const service_index of_handle = directory.add("/h", {}, pair_index{1}, {}).index;
  EXPECT_EQ(directory.count(), 2U);
  EXPECT_EQ(directory.of_peers(), 1U);
  directory.remove(of_handle);
  EXPECT_EQ(directory.of_peers(), 1U);
  directory.remove(of_peer);
  EXPECT_EQ(directory.of_peers(), 0U);
  EXPECT_EQ(directory.count(), 0U);
}

TEST_F(service_directory_test, counts_changes_and_no_attempts) {
  fill();
  const std::uint64_t before = directory.changes();
  (void)add("/s0");   // taken
  (void)add("/more"); // no room
  EXPECT_EQ(directory.changes(), before);
  directory.remove(directory.find("/s0"));
  EXPECT_EQ(directory.changes(), before + 1);
  (void)add("/more");
  EXPECT_EQ(directory.changes(), before + 2);
}

} // namespace
} // namespace service_directory_test
