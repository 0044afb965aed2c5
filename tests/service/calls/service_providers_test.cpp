// SPDX-License-Identifier: Apache-2.0
#include "service/calls/service_providers.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/calls/call_parts.hpp"

namespace service_providers_test {
namespace {

using namespace call_parts;

struct service_providers_test : call_parts::call_parts {
  rowe::service::service_directory directory{memory, bounds};
  rowe::service::service_providers providers{
      memory, {.state_ = state, .service_directory_ = directory, .refusals_ = refused}};

  static rowe::wire::request of(std::string_view service) {
    rowe::wire::request asked;
    asked.service = service;
    asked.verb_text = "advertise_service";
    return asked;
  }
  void TearDown() override {
    EXPECT_TRUE(providers.check());
    call_parts::TearDown();
  }
};

TEST_F(service_providers_test, lets_a_peer_say_again_what_it_provides_and_refuses_another) {
  connection& first = join(0);
  connection& second = join(1);
  providers.advertise(first, of("/add"));
  providers.advertise(first, of("add")); // the same name
  EXPECT_EQ(directory.of_peers(), 1U);
  EXPECT_TRUE(replies(first).empty());
  providers.advertise(second, of("/add"));
  ASSERT_EQ(replies(second).size(), 1U);
  EXPECT_NE(replies(second)[0].find("/add is provided already"), std::string::npos);
  providers.unadvertise(second, of("/add"));
  EXPECT_EQ(replies(second).size(), 2U);
  EXPECT_EQ(directory.of_peers(), 1U);
  providers.unadvertise(first, of("/add"));
  EXPECT_EQ(directory.of_peers(), 0U);
}

TEST_F(service_providers_test, keeps_places_for_peers_that_come_late) {
  connection& greedy = join(0);
  for (int i = 0; i < 20; ++i) providers.advertise(greedy, of("/s" + std::to_string(i)));
  EXPECT_LT(directory.of_peers(), rowe::service::services_of_peers(bounds));
  EXPECT_FALSE(replies(greedy).empty());
  connection& late = join(1);
  providers.advertise(late, of("/late"));
  EXPECT_TRUE(directory.find("/late"));
}

TEST_F(service_providers_test, gives_back_what_a_peer_that_is_gone_provided) {
  connection& gone = join(0);
  providers.advertise(gone, of("/a"));
  providers.advertise(gone, of("/b"));
  providers.advertise(join(1), of("/c"));
  providers.forget(gone.id);
  EXPECT_EQ(directory.count(), 1U);
  EXPECT_TRUE(directory.find("/c"));
}

TEST_F(service_providers_test, tells_the_peer_whose_service_a_handle_provides_now) {
  connection& before = join(0);
  providers.advertise(before, of("/add"));
  providers.take_from_peer(directory.find("/add"));
  EXPECT_FALSE(directory.find("/add"));
  ASSERT_EQ(replies(before).size(), 1U);
  EXPECT_NE(replies(before)[0].find("this process provides /add now"), std::string::npos);
}

} // namespace
} // namespace service_providers_test
