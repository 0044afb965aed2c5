// SPDX-License-Identifier: Apache-2.0
// A server that is given by name. The look-up may take as long as it likes, and nobody waits for it. The
// program brings a getaddrinfo() of its own, which waits until it is told to go on, and then does what the
// system's does.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <poll.h>
#include <pthread.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <string>

#include <rowe/rowe.hpp>

#include "api/seen.hpp"

namespace {

std::atomic<bool> held{false};
std::atomic<int> looked_up{0};
std::atomic<bool> by_the_helper{true};

} // namespace

extern "C" int getaddrinfo(const char* host, const char* service, const addrinfo* hints, addrinfo** into) {
  using look_up = int(const char*, const char*, const addrinfo*, addrinfo**);
  static look_up* const system = reinterpret_cast<look_up*>(::dlsym(RTLD_NEXT, "getaddrinfo"));
  const bool numeric = hints != nullptr && (hints->ai_flags & AI_NUMERICHOST) != 0; // takes no time
  if (!numeric && std::strcmp(host, "localhost") == 0) {
    char name[16] = "";
    ::pthread_getname_np(::pthread_self(), name, sizeof name);
    if (std::strcmp(name, "rowe-resolver") != 0) by_the_helper.store(false);
    ++looked_up;
    while (held.load()) (void)::poll(nullptr, 0, 1);
  }
  return system(host, service, hints, into);
}

namespace {

using namespace std::chrono_literals;
using rowe::endpoint;
using rowe::tests::count_of;

constexpr auto timeout = 60s;

bool is_looked_up() {
  return rowe::tests::eventually([] { return looked_up.load() == 1; }, timeout, 1ms);
}

TEST(server_by_name, is_looked_up_beside_the_service_thread) {
  held.store(true);
  looked_up.store(0);
  auto there = endpoint::listen(0).value();
  auto here = endpoint::connect("ws://localhost:" + std::to_string(there.port())).value();
  ASSERT_TRUE(is_looked_up());
  // In the middle of the look-up the endpoint lives: it turns, and serves its handles.
  const std::uint64_t before = count_of(here, "cycles");
  EXPECT_TRUE(rowe::tests::eventually([&] { return count_of(here, "cycles") > before + 10; }, timeout, 1ms));
  EXPECT_EQ(here.send("{}", 5ms).code(), rowe::errc::expired);
  auto lane = here.open_lane();
  ASSERT_TRUE(lane) << lane.error().name();
  EXPECT_EQ(lane->invoke(rowe::message("service", "/x"), 5ms).code(), rowe::errc::timed_out);
  EXPECT_EQ(here.peers(), 0U);
  held.store(false);
  EXPECT_TRUE(here.wait_peer(timeout));
  EXPECT_TRUE(by_the_helper.load());
}

TEST(server_by_name, does_not_hold_up_closing) {
  held.store(true);
  looked_up.store(0);
  {
    auto here = endpoint::connect("ws://localhost:1").value();
    ASSERT_TRUE(is_looked_up());
    EXPECT_TRUE(here.close());
  }
  held.store(false); // only now: had closing waited for it, the test would hang
}

} // namespace
