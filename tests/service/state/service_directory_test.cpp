// SPDX-License-Identifier: Apache-2.0
#include "service/state/service_directory.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace service_directory_test {
namespace {

using rowe::service::connection_id;
using rowe::service::pair_index;
using rowe::service::service_directory;
using rowe::service::service_index;

struct service_directory_test : testing::Test {
  rowe::limits bounds{.topic_bytes_max = 16, .services_max = 4};
  rowe::rt::arena memory{service_directory::footprint_bytes(bounds), rowe::rt::page_lock::none};
  service_directory directory{memory, bounds};

  service_directory::added add(std::string_view name, std::string_view type = {}) {
    return directory.add(name, type, {}, connection_id{0, 1});
  }
};

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

TEST_F(service_directory_test, keeps_apart_names_and_types_that_are_as_long_as_they_may_be) {
  std::vector<service_index> all;
  for (const char first : {'a', 'b', 'c', 'd'})
    all.push_back(add(std::string(16, first), std::string(16, static_cast<char>(first + 4))).index);
  for (std::uint32_t i = 0; i < 4; ++i) {
    EXPECT_EQ(directory.name(all[i]), std::string(16, static_cast<char>('a' + i)));
    EXPECT_EQ(directory.type(all[i]), std::string(16, static_cast<char>('e' + i)));
  }
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

} // namespace
} // namespace service_directory_test
