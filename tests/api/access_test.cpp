// SPDX-License-Identifier: Apache-2.0
// Rights that change at a whole endpoint: real sockets, a real service thread.
#include "endpoints.hpp"

#include <rowe/access.hpp>

namespace access_test {
namespace {

using namespace endpoints;

rowe::access_options with(std::string_view name) {
  rowe::access_options access;
  access.identities.push_back(
      {std::string{name}, "driver", rowe::hash_token(std::string{name} + "-shows-this-token")});
  return access;
}

TEST(access, that_wants_tokens_now_closes_who_has_shown_none) {
  auto hub = rowe::endpoint::listen(0, quick()).value();
  auto visitor = connected(hub);
  EXPECT_TRUE(hub.set_access(with("alice")));
  // The rights hold when the call returns. Peers are judged, and counted, in the same cycle, which may go on.
  EXPECT_TRUE(eventually([&] { return count_of(hub, "revoked_peers") == 1; }));
  EXPECT_TRUE(eventually([&] { return hub.peers() == 0; }));
  EXPECT_TRUE(eventually([&] { return count_of(hub, "refused_handshakes") != 0; })); // it tries again
}

TEST(access, changes_as_often_as_it_is_asked_to_under_every_idle_policy) {
  for (const rowe::idle policy : {rowe::idle::poll, rowe::idle::wake, rowe::idle::phase, rowe::idle::spin}) {
    auto options = quick();
    options.idle_policy = policy;
    auto hub = rowe::endpoint::listen(0, options).value();
    const auto begin = rowe::rt::monotonic_clock::now();
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(hub.set_access(with(i % 2 == 0 ? "alice" : "bob")));
    EXPECT_LT(rowe::rt::monotonic_clock::now() - begin, timeout);
  }
}

TEST(access, changes_by_several_threads_one_after_the_other) {
  auto hub = rowe::endpoint::listen(0, quick()).value();
  std::atomic<int> done = 0;
  const auto change = [&](std::string_view name) {
    for (int i = 0; i < 50; ++i) done += hub.set_access(with(name)) ? 1 : 0;
  };
  std::thread other{change, "bob"};
  change("alice");
  other.join();
  EXPECT_EQ(done, 100);
}

TEST(access, says_what_is_wrong_and_changes_nothing) {
  auto hub = rowe::endpoint::listen(0, quick()).value();
  std::string why;
  auto wrong = with("alice");
  wrong.local_role = "pilot";
  EXPECT_EQ(hub.set_access(wrong, &why).error().code, rowe::errc::bad_access);
  EXPECT_NE(why.find("there is no role `pilot`"), std::string::npos) << why;
  auto visitor = connected(hub); // still without a token
  EXPECT_TRUE(hub.set_access(with("alice"), &why));
  EXPECT_EQ(hub.set_access({}, &why).error().code, rowe::errc::bad_access);
  EXPECT_NE(why.find("no identity is left"), std::string::npos) << why;
  EXPECT_EQ(visitor.set_access(with("alice")).error().code, rowe::errc::misuse);
  ASSERT_TRUE(hub.close(0s));
  EXPECT_EQ(hub.set_access(with("alice")).error().code, rowe::errc::closed);
}

TEST(access, by_a_certificate_alone_takes_roots_that_vouch_for_it) {
  rowe::endpoint_options options = quick();
  options.access.identities = {{.name = "arm", .role = "driver", .certificate = "arm-1"}};
  EXPECT_EQ(rowe::endpoint::listen(0, options).error().code, rowe::errc::bad_access);
  options.access.identities[0].token_sha256 = rowe::hash_token("the-arm-has-a-token-too");
  EXPECT_TRUE(rowe::endpoint::listen(0, options));
}

} // namespace
} // namespace access_test
