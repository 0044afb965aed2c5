// SPDX-License-Identifier: Apache-2.0
// What becomes of an endpoint when one call fails: there is no memory, no descriptor, no thread, no place in
// an epoll. Allowed are: an error as a value; a peer that is refused, or loses its connection if the call was
// made for that connection; and success. The next attempt succeeds. Everything else is not allowed
// (trial.hpp), nor that another connection notices.
#include <rowe/rowe.hpp>

#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <string>

#include "api/seen.hpp"
#include "failures/peer.hpp"
#include "failures/trial.hpp"

struct pose {
  double x, y;
};
template <>
inline constexpr auto rowe::schema<pose> = rowe::fields<&pose::x, &pose::y>{}.type("test/Pose");

namespace failures {
namespace {

using namespace std::chrono_literals;
using rowe::endpoint;
using rowe::errc;
using rowe::tests::url_of;

constexpr std::chrono::milliseconds time_max = 10s;

rowe::endpoint_options make_small() {
  rowe::endpoint_options options;
  options.relay = true;
  options.retry_min = 5ms;
  options.retry_max = 20ms;
  // Hashing here sets libcrypto up. Version 3.0 crashes if memory fails meanwhile: it takes locks that it
  // could not make.
  options.access.identities = {{.name = "arm",
                                .role = "driver",
                                .token_sha256 = rowe::hash_token("a-token-of-an-arm"),
                                .token_in_url = false}};
  options.access.local_role = "supervisor";
  options.limits = {.connections_max = 8,
                    .message_bytes_max = 4096,
                    .topics_max = 16,
                    .subscriptions_max = 32,
                    .subscriptions_per_connection_max = 16,
                    .advertisements_per_connection_max = 16,
                    .small_slots = 64,
                    .small_slot_bytes = 1024,
                    .large_slots = 4,
                    .queued_max = 1024,
                    .services_max = 16,
                    .calls_max = 16,
                    .calls_per_connection_max = 16,
                    .handles_max = 8};
  return options;
}
// Made before any call fails.
const rowe::endpoint_options small = make_small();

bool is_clean(errc code) {
  return code == errc::no_memory || code == errc::no_thread || code == errc::bad_address ||
         code == errc::address_in_use;
}

// A new peer is served everything.
void expect_in_order(trial& t, const endpoint& server) {
  peer newcomer{server.port()};
  t.expect(newcomer.upgrade() == answer::right, "a new peer was not accepted afterwards");
  t.expect(newcomer.echo("afterwards") == answer::right, "a new peer received nothing afterwards");
  peer reader{server.port()};
  t.expect(reader.get("/") == answer::right, "the page was not served afterwards");
}

void open_a_server(trial& t) {
  t.begin();
  std::optional<rowe::result<endpoint>> made;
  {
    const in_the_library here;
    made.emplace(endpoint::listen(0, small));
  }
  t.end();
  if (!*made) {
    t.expect(t.failed() && is_clean(made->code()), "not opened: " + std::string{made->error().name()});
    made.emplace(endpoint::listen(0, small));
  }
  if (t.expect(made->has_value(), "not even opened afterwards")) expect_in_order(t, **made);
}

template <class Open>
void open_a_handle(trial& t, Open&& open) {
  auto made = [&] {
    const in_the_library here;
    return open();
  }();
  if (!made) t.expect(made.code() == errc::no_memory, "no handle: " + std::string{made.error().name()});
}

void open_handles(trial& t) {
  auto server = endpoint::listen(0, small).value();
  const auto all = [&] {
    open_a_handle(t, [&] { return server.advertise<pose>("/pose"); });
    open_a_handle(t, [&] { return server.subscribe<pose>("/pose"); });
    open_a_handle(t, [&] { return server.subscribe<rowe::json_text>("/text"); });
    open_a_handle(t, [&] { return server.serve<pose, pose>("/turn"); });
    open_a_handle(t, [&] { return server.client<rowe::json_text, rowe::json_text>("/turn"); });
    open_a_handle(t, [&] { return server.open_lane({.depth = 4, .inbox_depth = 4, .calls = 4}); });
  };
  t.begin();
  all();
  t.end();
  auto after = server.advertise<pose>("/pose");
  t.expect(after.has_value(), "no handle afterwards");
  expect_in_order(t, server);
}

// Whether a client reaches its server. Its first attempt may fail, and those that follow must not, unless the
// C library cannot look up names any more.
bool reaches(const trial& t, endpoint& client) {
  constexpr auto step = 100ms;
  for (auto left = time_max; left > 0ms; left -= t.unrecoverable() ? 10 * step : step) {
    if (client.wait_peer(step)) return true;
  }
  return t.unrecoverable();
}

void open_a_client(trial& t, const std::string& host) {
  auto server = endpoint::listen(0, small).value();
  peer other{server.port()};
  t.expect(other.upgrade() == answer::right && other.echo("before") == answer::right,
           "it does not even begin");
  spare_connection_of(other.port());
  const std::string url = "ws://" + host + ":" + std::to_string(server.port());
  t.begin();
  std::optional<rowe::result<endpoint>> made;
  {
    const in_the_library here;
    made.emplace(endpoint::connect(url, small));
    if (*made) t.expect(reaches(t, **made), "it never connects");
  }
  t.end();
  if (!*made) {
    t.expect(t.failed() && is_clean(made->code()), "not opened: " + std::string{made->error().name()});
    made.emplace(endpoint::connect(url, small));
    if (t.expect(made->has_value(), "not even opened afterwards"))
      t.expect(reaches(t, **made), "it never connects afterwards");
  }
  t.expect(other.echo("meanwhile") == answer::right, "another connection is lost");
  expect_in_order(t, server);
}
void open_a_client_by_name(trial& t) { open_a_client(t, "localhost"); }

// Connect, upgrade, echo, and a page, by peers outside; a connection that was there before stays.
void accept_peers(trial& t) {
  auto server = endpoint::listen(0, small).value();
  peer other{server.port()};
  t.expect(other.upgrade() == answer::right && other.echo("before") == answer::right,
           "it does not even begin");
  spare_connection_of(other.port());
  t.begin();
  {
    peer newcomer{server.port()};
    answer got = newcomer.upgrade();
    if (got == answer::right) got = newcomer.echo("visit");
    t.expect(got != answer::none, "a new peer waits in vain");
    peer reader{server.port()};
    got = reader.get("/");
    t.expect(got != answer::none, "a page is waited for in vain");
  }
  t.end();
  t.expect(other.echo("meanwhile") == answer::right, "another connection is lost");
  expect_in_order(t, server);
}

// A client reaches its server; both ends of the handshake may fail.
void be_reached_again(trial& t) {
  auto options = small;
  options.address = "127.0.0.1";
  std::optional<endpoint> server{endpoint::listen(0, options).value()};
  const std::uint16_t port = server->port();
  auto client = endpoint::connect(url_of(*server), small).value();
  t.expect(client.wait_peer(time_max).has_value(), "it does not even begin");
  server.reset();
  t.begin();
  auto again = endpoint::listen(port, options);
  if (!t.expect(again.has_value(), "the port is not free again")) return;
  t.expect(again->wait_peer(time_max).has_value() && client.wait_peer(time_max).has_value(),
           "it is never reached again");
  t.end();
  expect_in_order(t, *again);
}

// Values from one endpoint to another, through all that is between them.
void exchange_messages(trial& t) {
  auto server = endpoint::listen(0, small).value();
  auto client = endpoint::connect(url_of(server), small).value();
  auto here = server.subscribe<pose>("/pose").value();
  auto there = client.advertise<pose>("/pose").value();
  double sent = 0;
  double heard = -1;
  const auto publish_until_received = [&] {
    const auto until = rowe::rt::monotonic_clock::now() + time_max;
    ++sent;
    while (heard != sent && rowe::rt::monotonic_clock::now() < until) {
      (void)there.publish({sent, 0}); // full or without a peer: published again below
      if (auto value = here.take(1ms)) heard = value->value().x;
    }
    return heard == sent;
  };
  for (int i = 0; i < 20; ++i) t.expect(publish_until_received(), "it does not even begin");
  t.begin();
  {
    const in_the_library all;
    for (int i = 0; i < 100; ++i)
      t.expect(publish_until_received(), "what is published is not received any more");
  }
  t.end();
  t.expect(publish_until_received(), "what is published is not received any more");
}

// ---- memory

#if defined(ROWE_HEAP_FAILS)
TEST(no_memory, is_an_error_of_opening_a_server) { EXPECT_GT(fail_each(kind::heap, open_a_server), 30U); }
TEST(no_memory, is_an_error_of_opening_a_handle) { EXPECT_GT(fail_each(kind::heap, open_handles), 3U); }
TEST(no_memory, is_an_error_of_opening_a_client_or_of_an_attempt) {
  EXPECT_GT(fail_each(kind::heap, [](trial& t) { open_a_client(t, "127.0.0.1"); }), 25U);
}
TEST(no_memory, is_an_error_of_a_look_up) { EXPECT_GT(fail_each(kind::heap, open_a_client_by_name), 40U); }
TEST(no_memory, is_nothing_that_new_peers_need) { EXPECT_EQ(fail_each(kind::heap, accept_peers), 0U); }
TEST(no_memory, is_nothing_that_messages_need) { EXPECT_EQ(fail_each(kind::heap, exchange_messages), 0U); }
#endif

// ---- libwebsockets' memory. Not while an endpoint opens: there always is enough then
// (tests/net/memory_test.cpp), and 4.1.6 does not check all its allocations.

TEST(no_memory_for_libwebsockets, refuses_a_peer) {
  watch_libwebsockets();
  EXPECT_GT(fail_each(kind::libwebsockets, accept_peers), 8U);
}
TEST(no_memory_for_libwebsockets, ends_an_attempt) {
  watch_libwebsockets();
  EXPECT_GT(fail_each(kind::libwebsockets, be_reached_again), 8U);
}
TEST(no_memory_for_libwebsockets, is_nothing_that_messages_need) {
  watch_libwebsockets();
  EXPECT_EQ(fail_each(kind::libwebsockets, exchange_messages), 0U);
}

// ---- the kernel

TEST(a_failing_system_call, is_an_error_of_opening_a_server) {
  EXPECT_GT(fail_each(kind::system_calls, open_a_server), 15U);
}
TEST(a_failing_system_call, does_not_concern_handles) {
  (void)fail_each(kind::system_calls, open_handles); // the service thread's calls, of which there may be few
}
TEST(a_failing_system_call, is_an_error_of_opening_a_client_or_of_an_attempt) {
  EXPECT_GT(fail_each(kind::system_calls, open_a_client_by_name), 20U);
}
TEST(a_failing_system_call, refuses_a_peer) { EXPECT_GT(fail_each(kind::system_calls, accept_peers), 20U); }
TEST(a_failing_system_call, ends_an_attempt) {
  EXPECT_GT(fail_each(kind::system_calls, be_reached_again), 20U);
}
TEST(a_failing_system_call, interrupts_messages) {
  EXPECT_GT(fail_each(kind::system_calls, exchange_messages), 100U);
}

} // namespace
} // namespace failures
