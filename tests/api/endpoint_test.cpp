// SPDX-License-Identifier: Apache-2.0
// Endpoints as a program uses them: real sockets on loopback, real service threads.
#include <rowe/rowe.hpp>

#include <gtest/gtest.h>

#include <array>

#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "endpoints.hpp"
#include "every_call.hpp"
#include "net/own_address.hpp"
#include "rt/watchdog.hpp"

struct pose {
  double x, y;
};
template <>
inline constexpr auto rowe::schema<pose> = rowe::fields<&pose::x, &pose::y>{}.type("test/Pose");

namespace endpoint_test {
namespace {

using namespace endpoints;
using rowe::endpoint;
using rowe::errc;
using rowe::json_text;

rowe::endpoint_options hub() {
  rowe::endpoint_options options = quick();
  options.relay = true;
  return options;
}

std::string numbered(int n) { return R"({"n":)" + std::to_string(n) + "}"; }

// Publishes until `heard` says that it has come through: a subscription takes effect a moment after it is
// made.
template <class Publish, class Heard>
bool publish_until(Publish&& publish, Heard&& heard) {
  return eventually([&] {
    publish();
    return heard();
  });
}

std::optional<rowe::event> wait_event(endpoint& of, rowe::event::kind kind) {
  std::optional<rowe::event> what;
  return eventually([&] { return (what = of.try_event()) && what->what_kind == kind; }) ? what : std::nullopt;
}

// A mistake, and not one that may cost other handles anything.
TEST(endpoint, leaves_its_memory_to_a_view_that_outlives_its_handle) {
  rowe::endpoint_options one_lane = hub();
  one_lane.limits.handle_bytes = 128 * 1024;
  auto robot = endpoint::listen(0, one_lane).value();
  auto talker = endpoint::connect(url_of(robot), hub()).value();
  auto says = talker.advertise<json_text>("/words").value();
  ASSERT_TRUE(talker.wait_peer(timeout));
  const rowe::topic_options how{.depth = 16, .text_bytes_max = 4096};
  std::optional seen{robot.subscribe<json_text>("/words", how).value()};
  std::optional<rowe::message_view> view;
  EXPECT_TRUE(publish_until([&] { (void)says.publish(R"({"n":1})"); },
                            [&] {
                              if (auto message = seen->try_take()) view.emplace(std::move(*message));
                              return view.has_value();
                            }));
  seen.reset();
  EXPECT_EQ(robot.subscribe<json_text>("/words", how).code(),
            errc::handle_memory); // there is no other memory
  EXPECT_EQ(view->value(), R"({"n":1})");
  view.reset();
  // Once the service thread has seen that it is gone.
  EXPECT_TRUE(eventually([&] { return robot.subscribe<json_text>("/words", how).has_value(); }));
}

TEST(endpoint, leaves_its_memory_to_a_view_that_outlives_it) {
  std::optional<rowe::message_view> view;
  {
    auto robot = endpoint::listen(0, hub()).value();
    auto talker = endpoint::connect(url_of(robot), hub()).value();
    auto says = talker.advertise<json_text>("/words").value();
    auto seen = robot.subscribe<json_text>("/words").value();
    EXPECT_TRUE(publish_until([&] { (void)says.publish(R"({"n":1})"); },
                              [&] {
                                if (auto message = seen.try_take()) view.emplace(std::move(*message));
                                return view.has_value();
                              }));
  }
  EXPECT_EQ(view->value(), R"({"n":1})");
  view.reset();
}

TEST(endpoint, relays_between_two_clients_in_order_without_loss) {
  auto server = endpoint::listen(0, hub()).value();
  auto talker = endpoint::connect(url_of(server), hub()).value();
  auto listener = endpoint::connect(url_of(server), hub()).value();
  auto heard = listener.subscribe<json_text>("/count", {.depth = 256}).value();
  auto said = talker.advertise<json_text>("/count", {.depth = 16}).value();
  ASSERT_TRUE(talker.wait_peer(timeout));
  ASSERT_TRUE(listener.wait_peer(timeout));
  // Until the newest of these has come, and so none of them is on its way any more.
  int newest = 0;
  ASSERT_TRUE(publish_until(
      [&] {
        if (said.publish(numbered(newest - 1))) --newest;
      },
      [&] {
        while (const auto message = heard.take(10ms)) {
          if (message->value() == numbered(newest)) return true;
        }
        return false;
      }));
  std::atomic<int> next = 0;
  std::thread taker{[&] {
    while (next < 5000) {
      const auto message = heard.take(timeout);
      ASSERT_TRUE(message) << next.load() << " " << message.error().name();
      ASSERT_EQ(message->value(), numbered(next.load()));
      ++next;
    }
  }};
  for (int i = 0; i < 5000; ++i) {
    for (;;) {
      const auto done = said.publish(numbered(i));
      if (done) break;
      ASSERT_EQ(done.code(), errc::full);
      std::this_thread::yield();
    }
    // What is on its way never exceeds the smallest queue, so nothing may be lost.
    if (i % 100 == 99) {
      (void)eventually([&] { return next >= i; });
    }
  }
  taker.join();
  EXPECT_EQ(next, 5000);
}

TEST(endpoint, gives_the_newest_message_and_frees_the_older_ones) {
  auto robot = endpoint::listen(0).value();
  auto odom = robot.advertise<pose>("/odom").value();
  auto seen = robot.subscribe<json_text>("/odom", {.depth = 8}).value();
  for (int round = 0; round < 4; ++round) {
    for (int i = 0; i < 8; ++i) ASSERT_TRUE(odom.publish({1.0 * i, 0}));
    EXPECT_TRUE(eventually([&] {
      const auto message = seen.latest();
      return message && message->value() == R"({"x":7,"y":0})";
    }));
  }
  EXPECT_EQ(count_of(robot, "inbox_full"), 0U);
}

TEST(endpoint, writes_what_was_published_before_it_closes) {
  auto server = endpoint::listen(0, hub()).value();
  auto heard = server.subscribe<json_text>("/last", {.depth = 256}).value();
  {
    auto talker = endpoint::connect(url_of(server), hub()).value();
    auto said = talker.advertise<json_text>("/last", {.depth = 128}).value();
    ASSERT_TRUE(talker.wait_peer(timeout));
    ASSERT_TRUE(
        publish_until([&] { (void)said.publish(numbered(0)); }, [&] { return said.published() > 0; }));
    const auto before = said.published();
    for (int i = 1; i <= 100; ++i) {
      while (!said.publish(numbered(i))) std::this_thread::yield();
    }
    EXPECT_EQ(said.published(), before + 100);
    EXPECT_TRUE(talker.close(timeout));
  }
  int last = 0;
  while (last != 100) {
    const auto message = heard.take(timeout);
    ASSERT_TRUE(message) << "after " << last;
    last = std::stoi(std::string{message->value().substr(5)});
  }
}

TEST(endpoint, sends_what_a_handle_published_before_it_was_destroyed) {
  auto server = endpoint::listen(0, hub()).value();
  auto heard = server.subscribe<json_text>("/burst", {.depth = 2048, .text_bytes_max = 64}).value();
  auto talker = endpoint::connect(url_of(server), hub()).value();
  ASSERT_TRUE(talker.wait_peer(timeout));
  constexpr int burst = 1500;
  {
    auto said = talker.advertise<json_text>("/burst", {.depth = 2048, .text_bytes_max = 64}).value();
    for (int i = 0; i < burst; ++i) ASSERT_TRUE(said.publish(numbered(i))) << i;
  }
  for (int i = 0; i < burst; ++i) {
    const auto message = heard.take(timeout);
    ASSERT_TRUE(message) << i;
    ASSERT_EQ(message->value(), numbered(i));
  }
}

TEST(endpoint, counts_what_was_published_and_not_taken_when_it_closes) {
  rowe::endpoint_options slow;
  slow.poll_period = 10ms;
  auto robot = endpoint::listen(0, slow).value();
  auto seen = robot.subscribe<json_text>("/a", {.depth = 64, .text_bytes_max = 64}).value();
  auto said = robot.advertise<json_text>("/a", {.depth = 1024, .text_bytes_max = 16}).value();
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(said.publish(numbered(i % 10)));
  (void)robot.close();
  std::uint64_t taken = 0;
  while (seen.try_take()) ++taken;
  EXPECT_EQ(taken + count_of(robot, "inbox_full") + count_of(robot, "lost_at_close"), 1000U);
}

TEST(endpoint, publishes_messages_as_they_are_composed_but_not_one_that_outgrew_its_room) {
  auto robot = endpoint::listen(0).value();
  auto seen = robot.subscribe<json_text>("/a").value();
  auto said = robot.advertise<json_text>("/a").value();
  ASSERT_TRUE(said.publish(rowe::message{"n", 1}));
  const auto message = seen.take(timeout);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->value(), R"({"n":1})");
  const rowe::message_of<16> outgrown{"name", "longer than sixteen"};
  EXPECT_EQ(said.publish(outgrown).error(), (rowe::error{errc::too_big, 17, 16}));
  EXPECT_EQ(count_of(robot, "too_big"), 1U);
}

TEST(endpoint, says_closed_to_handles_that_outlive_it) {
  rowe::publisher<pose> odom;
  rowe::subscriber<json_text> seen;
  {
    auto robot = endpoint::listen(0).value();
    odom = robot.advertise<pose>("/odom").value();
    seen = robot.subscribe<json_text>("/odom").value();
  }
  EXPECT_EQ(odom.publish({1, 2}).code(), errc::closed);
  EXPECT_EQ(seen.try_take().code(), errc::closed);
  EXPECT_EQ(seen.take(timeout).code(), errc::closed);
  EXPECT_FALSE(odom.wanted());
}

TEST(endpoint, wakes_a_subscriber_that_waits_when_it_closes) {
  auto robot = endpoint::listen(0).value();
  auto seen = robot.subscribe<json_text>("/never").value();
  errc why = errc::misuse;
  std::thread waiter{[&] { why = seen.take(-1ns).code(); }};
  EXPECT_TRUE(robot.close());
  waiter.join();
  EXPECT_EQ(why, errc::closed);
}

TEST(endpoint, times_out_where_nothing_comes) {
  auto robot = endpoint::listen(0).value();
  auto seen = robot.subscribe<json_text>("/never").value();
  EXPECT_EQ(seen.try_take().code(), errc::empty);
  const auto began = rowe::rt::monotonic_clock::now();
  const auto nothing = seen.take(30ms);
  EXPECT_EQ(nothing.code(), errc::timed_out);
  EXPECT_EQ(nothing.error().limit, 30'000'000);
  EXPECT_GE(rowe::rt::monotonic_clock::now() - began, 30ms);
  EXPECT_EQ(robot.wait_peer(1ms).code(), errc::timed_out);
}

TEST(endpoint, connects_again_after_its_server_was_away) {
  rowe::endpoint_options options = hub();
  options.address = rowe::tests::own_address();
  options.allow_hosts = {options.address};
  std::optional<endpoint> server{endpoint::listen(0, options).value()};
  const std::uint16_t port = server->port();
  auto viewer = endpoint::connect("ws://" + options.address + ":" + std::to_string(port), hub()).value();
  auto seen = viewer.subscribe<json_text>("/odom").value();
  ASSERT_TRUE(viewer.wait_peer(timeout));
  server.reset();
  ASSERT_TRUE(wait_event(viewer, rowe::event::kind::peer_left));
  ASSERT_TRUE(wait_event(viewer, rowe::event::kind::cannot_connect));
  server.emplace(endpoint::listen(port, options).value());
  auto odom = server->advertise<pose>("/odom").value();
  EXPECT_TRUE(publish_until([&] { (void)odom.publish({1, 2}); }, [&] { return seen.take(1ms).has_value(); }));
}

TEST(endpoint, counts_what_its_handshakes_take_and_that_messages_take_nothing) {
  auto robot = endpoint::listen(0, hub()).value();
  auto commands = robot.subscribe<json_text>("/cmd").value();
  auto viewer = endpoint::connect(url_of(robot), hub()).value();
  auto command = viewer.advertise<json_text>("/cmd").value();
  ASSERT_TRUE(viewer.wait_peer(timeout));
  const auto publish_one = [&] { (void)command.publish(R"({"n":1})"); };
  ASSERT_TRUE(publish_until(publish_one, [&] { return static_cast<bool>(commands.try_take()); }));
  // A cycle counts what its handshakes took when it ends, and a message of it may arrive before.
  const auto of_robot = count_of(robot, "cycles");
  const auto of_viewer = count_of(viewer, "cycles");
  ASSERT_TRUE(publish_until(publish_one, [&] {
    (void)commands.try_take();
    return count_of(robot, "cycles") > of_robot && count_of(viewer, "cycles") > of_viewer;
  }));
  const auto used = count_of(robot, "handshake_bytes_used");
  EXPECT_GT(used, 4096U);
  EXPECT_GT(count_of(robot, "handshake_bytes_peak"), used);
  EXPECT_EQ(count_of(robot, "handshakes_starved"), 0U);
  const auto allocations = [&] {
    return count_of(robot, "handshake_allocations") + count_of(viewer, "handshake_allocations");
  };
  const auto before = allocations();
  EXPECT_GT(before, 20U);
  for (int i = 0; i < 1000; ++i) {
    (void)command.publish(numbered(i)); // what is full arrives with a later one
    (void)commands.try_take();
  }
  EXPECT_EQ(allocations(), before);
  EXPECT_EQ(count_of(robot, "handshake_bytes_used"), used);
}

// ---- every error, by the one who causes it

TEST(endpoint_errors, name_an_option_out_of_its_range) {
  rowe::endpoint_options options;
  options.poll_period = 1us;
  EXPECT_EQ(endpoint::listen(0, options).error(),
            (rowe::error{errc::bad_argument, 1000, 50'000, rowe::argument::poll_period}));
  options = {};
  options.limits.connections_max = 0;
  EXPECT_EQ(endpoint::listen(0, options).code(), errc::bad_argument);
  options = {};
  options.limits.handles_max = 5000;
  EXPECT_EQ(endpoint::listen(0, options).error().limit, 1024);
}

TEST(endpoint_errors, name_every_limit_that_is_out_of_its_range) {
  const auto refused = [](auto member, auto value) {
    rowe::endpoint_options options;
    options.limits.*member = value;
    return endpoint::listen(0, options).code() == errc::bad_argument;
  };
  EXPECT_TRUE(refused(&rowe::limits::advertisements_per_connection_max, 1U << 26));
  EXPECT_TRUE(refused(&rowe::limits::subscriptions_per_connection_max, 1U << 26));
  EXPECT_TRUE(refused(&rowe::limits::handle_bytes, SIZE_MAX - 4096));
  EXPECT_TRUE(refused(&rowe::limits::handshakes_max, 0U));
  EXPECT_TRUE(refused(&rowe::limits::handshake_bytes, std::size_t{65535}));
  EXPECT_TRUE(refused(&rowe::limits::depth_max, 5000U));
  EXPECT_TRUE(refused(&rowe::limits::services_max, 0U));
  EXPECT_TRUE(refused(&rowe::limits::calls_max, 0U));
  EXPECT_TRUE(refused(&rowe::limits::calls_max, 65537U));
  EXPECT_TRUE(refused(&rowe::limits::calls_per_connection_max, 0U));
  EXPECT_TRUE(refused(&rowe::limits::door_slots, 0U));
  EXPECT_TRUE(refused(&rowe::limits::door_slots, 4097U));
  EXPECT_TRUE(refused(&rowe::limits::door_slot_bytes, 127U));
}

TEST(endpoint_errors, name_the_options_of_messages_that_are_out_of_their_range) {
  rowe::endpoint_options options;
  options.inbound_ttl = 0ns;
  const auto ttl = endpoint::listen(0, options);
  EXPECT_EQ(ttl.error(), (rowe::error{errc::bad_argument, 0, 1'000'000, rowe::argument::inbound_ttl}));
  options = {};
  options.profile = static_cast<rowe::websocket_profile>(3);
  EXPECT_EQ(endpoint::listen(0, options).error(),
            (rowe::error{errc::bad_argument, 3, 2, rowe::argument::profile}));
}

TEST(endpoint_errors, say_which_option_is_meant) {
  rowe::endpoint_options options;
  options.poll_period = 1s;
  EXPECT_EQ(endpoint::listen(0, options).error().message(),
            "the argument poll_period is out of range: 1000000000 (limit 10000000)");
  options = {};
  options.limits.handle_bytes = std::size_t{1} << 40;
  EXPECT_EQ(endpoint::listen(0, options).error().message(),
            "the argument handle_bytes is out of range: 1099511627776 (limit 1073741824)");
  EXPECT_EQ((rowe::error{errc::bad_argument, 7, 5}).message(), "the argument is out of range: 7 (limit 5)");
  EXPECT_EQ((rowe::error{errc::bad_argument, 200, 128, rowe::argument::name}).message(),
            "the argument name has 200 bytes; it may have 128 at most");
  EXPECT_EQ((rowe::error{errc::bad_argument, 0, 1, rowe::argument::name}).message(),
            "the argument name has 0 bytes; it needs 1 at least");
}

// The machine has no such core.
TEST(endpoint_events, tell_what_the_service_thread_was_not_granted_and_why) {
  rowe::endpoint_options options;
  options.service_cpu = 1023;
  auto robot = endpoint::listen(0, options).value();
  std::array<char, 256> buffer;
  auto told = wait_event(robot, rowe::event::kind::warning);
  if (told && std::string_view{told->what}.starts_with("reading the clock"))
    told = wait_event(robot, rowe::event::kind::warning); // of some machines
  ASSERT_TRUE(told);
  EXPECT_EQ(std::string_view{told->what}, "the service thread was not granted all options: " +
                                              std::string{robot.service_grants().text(buffer)});
  EXPECT_NE(std::string_view{told->what}.find("cpu 1023 does not exist or is not allowed to this process"),
            std::string_view::npos);
  EXPECT_FALSE(std::string_view{told->remedy}.empty());
}

TEST(endpoint_events, tell_nothing_of_settings_that_nobody_asked_for) {
  auto robot = endpoint::listen(0).value();
  while (count_of(robot, "cycles") == 0) std::this_thread::yield();
  while (const auto told = robot.try_event())
    EXPECT_EQ(std::string_view{told->what}.find("service thread"), std::string_view::npos);
}

TEST(endpoint_errors, name_what_is_wrong_with_a_url) {
  EXPECT_EQ(endpoint::connect("http://robot").code(), errc::bad_url);
  EXPECT_EQ(endpoint::connect("ws://robot:99999").code(), errc::bad_url);
  EXPECT_EQ(endpoint::connect("127.0.0.1:8080").error().message(),
            "missing ws://: the URL must read ws[s]://HOST[:PORT][/PATH]");
  EXPECT_EQ(endpoint::connect("ws://robot:99999").error().message(),
            "the URL must read ws[s]://HOST[:PORT][/PATH]; this one does not from byte 11 on");
}

TEST(endpoint_errors, of_topics_name_the_option_and_its_limit) {
  auto robot = endpoint::listen(0).value();
  EXPECT_EQ(robot.advertise<pose>("").code(), errc::bad_argument);
  EXPECT_EQ(robot.advertise<pose>("/a\n").code(), errc::control_character); // as peers' names are refused
  const auto latin = robot.advertise<pose>("/\xc3\xa4/\xe4");
  EXPECT_EQ(latin.error(), (rowe::error{errc::not_utf8, 4, 0, rowe::argument::name}));
  EXPECT_EQ(latin.error().message(), "the argument name is not UTF-8 (at byte 4)");
  EXPECT_EQ(robot.advertise<pose>("/a\xc3").error().value, 2); // a character that is cut
  EXPECT_EQ(robot.advertise<pose>("/a", {.type = "\xff"}).error().message(),
            "the argument type is not UTF-8 (at byte 0)");
  const auto long_name = robot.advertise<pose>(std::string(200, 'x'));
  EXPECT_EQ(long_name.code(), errc::bad_argument);
  EXPECT_EQ(long_name.error().limit, 128);
  EXPECT_EQ(robot.advertise<pose>("/rowe/mine").code(), errc::reserved_topic);
  EXPECT_EQ(robot.advertise<pose>("/a", {.depth = 5000}).error().limit, 4096);
  const auto short_ttl = robot.advertise<pose>("/a", {.ttl = 100us});
  EXPECT_EQ(short_ttl.code(), errc::bad_argument);
  EXPECT_EQ(short_ttl.error().limit, 250'000);
  EXPECT_TRUE(robot.advertise<pose>("/a", {.ttl = 0ns}));
  EXPECT_EQ(robot.advertise<pose>("/a", {.period = 99us}).error(),
            (rowe::error{errc::bad_argument, 99'000, 100'000, rowe::argument::period}));
  EXPECT_EQ(robot.advertise<pose>("/a", {.period = -1ns}).code(), errc::bad_argument);
  EXPECT_EQ(robot.advertise<pose>("/a", {.period = 2h}).code(), errc::bad_argument);
  EXPECT_EQ(robot.subscribe<pose>("/a", {.lease = 19ms}).error(),
            (rowe::error{errc::bad_argument, 19'000'000, 20'000'000, rowe::argument::lease}));
  EXPECT_EQ(robot.subscribe<pose>("/a", {.lease = 11s}).error().limit, 10'000'000'000);
  EXPECT_EQ(robot.subscribe<pose>("/a", {.lease = -1ns}).code(), errc::bad_argument);
  EXPECT_EQ(robot.subscribe<rowe::json_text>("/a", {.lease = 300ms}).error().about, rowe::argument::lease);
  EXPECT_EQ(robot.subscribe<pose>("/rowe/mine", {.lease = 300ms}).code(), errc::reserved_topic);
}

TEST(endpoint_handles, leave_their_memory_whole_behind_them) {
  rowe::endpoint_options few;
  few.limits.handles_max = 8;
  few.limits.handle_bytes = 64 * 1024;
  auto robot = endpoint::listen(0, few).value();
  for (int round = 0; round < 3; ++round) {
    {
      std::vector<rowe::publisher<pose>> small;
      for (int i = 0; i < 8; ++i) small.push_back(robot.advertise<pose>("/a", {.depth = 4}).value());
    }
    const auto large = robot.subscribe<json_text>("/a", {.depth = 8, .text_bytes_max = 6 * 1024});
    EXPECT_TRUE(large) << large.error().name();
  }
}

TEST(endpoint_errors, tell_a_text_that_is_too_long) {
  auto robot = endpoint::listen(0).value();
  auto said = robot.advertise<json_text>("/a", {.text_bytes_max = 10}).value();
  auto seen = robot.subscribe<json_text>("/a").value();
  EXPECT_EQ(said.publish("12345678901").error(), (rowe::error{errc::too_big, 11, 10}));
  EXPECT_TRUE(said.publish("1234567890"));
}

TEST(endpoint_errors, of_set_up_after_close) {
  auto robot = endpoint::listen(0).value();
  EXPECT_TRUE(robot.close());
  EXPECT_EQ(robot.advertise<pose>("/a").code(), errc::closed);
  EXPECT_TRUE(robot.close());
}

TEST(endpoint_errors, tell_what_could_not_be_written_in_time) {
  auto server = endpoint::listen(0, hub()).value();
  auto talker = endpoint::connect(url_of(server), hub()).value();
  auto said = talker.advertise<json_text>("/big", {.depth = 2048, .text_bytes_max = 16}).value();
  ASSERT_TRUE(talker.wait_peer(timeout));
  ASSERT_TRUE(publish_until([&] { (void)said.publish(numbered(0)); }, [&] { return said.published() > 0; }));
  for (int i = 0; i < 2000; ++i) (void)said.publish(numbered(1)); // full at some point: enough is waiting
  const auto closed = talker.close(0ns);
  if (!closed) {
    EXPECT_EQ(closed.code(), errc::timed_out);
  }
}

// Under idle::wake nothing looks at the lanes by itself: were no wake-up to come, each of these would wait
// for a quarter of a second, and all of them for the watchdog.
TEST(waking, brings_every_value_and_every_call_without_looking_for_them) {
  const rowe::tests::watchdog guard{"handles that wake the service thread", std::chrono::seconds{60}};
  rowe::endpoint_options options = hub();
  options.idle_policy = rowe::idle::wake;
  auto robot = endpoint::listen(0, options).value();
  auto viewer = endpoint::connect(url_of(robot), options).value();
  ASSERT_TRUE(viewer.wait_peer(timeout));
  auto odom = robot.advertise<pose>("/odom").value();
  auto newest = robot.advertise<pose>("/newest", {.keep = rowe::keep::newest}).value();
  auto seen = viewer.subscribe<pose>("/odom").value();
  auto newest_seen = viewer.subscribe<pose>("/newest").value();
  auto answers = robot.serve<pose, pose>("/same").value();
  auto asks = viewer.client<pose, pose>("/same").value();
  while (!odom.wanted() || !newest.wanted()) std::this_thread::yield();
  const auto expect_next = [](auto& from, double x) {
    const auto came = from.take(timeout);
    ASSERT_TRUE(came);
    EXPECT_EQ(came->value().x, x);
  };
  for (int i = 0; i < 300; ++i) {
    const double x = i;
    ASSERT_TRUE(odom.publish({x, 0}));
    expect_next(seen, x);
    ASSERT_TRUE(newest.publish({x, 1}));
    expect_next(newest_seen, x);
    ASSERT_TRUE(asks.start({x, 2}, timeout, rowe::rt::monotonic_clock::now()));
    auto asked = answers.next(timeout);
    ASSERT_TRUE(asked);
    ASSERT_TRUE(answers.reply(*asked, asked->value()));
    auto ended = asks.try_finish();
    for (; ended.code() == errc::empty; ended = asks.try_finish()) std::this_thread::yield();
    ASSERT_TRUE(ended && ended->reply);
    EXPECT_EQ(ended->reply->x, x);
  }
  EXPECT_LT(count_of(robot, "cycles"), 100'000u) << "nor by turning all the time";
}

TEST(phase, brings_every_value_and_watches_for_those_that_come_by_their_period) {
  const rowe::tests::watchdog guard{"a service thread in phase with a loop", std::chrono::seconds{60}};
  rowe::endpoint_options options = hub();
  options.idle_policy = rowe::idle::phase;
  auto robot = endpoint::listen(0, options).value();
  auto viewer = endpoint::connect(url_of(robot), options).value();
  ASSERT_TRUE(viewer.wait_peer(timeout));
  auto odom = robot.advertise<pose>("/odom", {.period = 2ms}).value();
  auto odd = robot.advertise<pose>("/odd").value(); // of no known period
  auto seen = viewer.subscribe<pose>("/odom").value();
  auto odd_seen = viewer.subscribe<pose>("/odd").value();
  while (!odom.wanted() || !odd.wanted()) std::this_thread::yield();
  rowe::rt::periodic loop{2ms};
  double x = 0;
  // On a busy machine the loop is not on time for long: then until it was.
  while (x < 100 || count_of(robot, "phase_hits") == 0) {
    const auto now = loop.wait();
    ASSERT_TRUE(now);
    ASSERT_TRUE(odom.publish({++x, 0}, *now));
    ASSERT_TRUE(odd.publish({x, 1}, *now));
    const auto came = seen.take(timeout);
    const auto odd_came = odd_seen.take(timeout);
    ASSERT_TRUE(came && odd_came);
    EXPECT_EQ(came->value().x, x);
    EXPECT_EQ(odd_came->value().x, x);
  }
  EXPECT_GT(count_of(robot, "phase_watched_ns"), 0u);
  EXPECT_GE(count_of(robot, "phase_misses"), 8u) << "it learned";
}

TEST(phase, counts_nothing_under_other_policies) {
  auto robot = endpoint::listen(0, hub()).value();
  auto odom = robot.advertise<pose>("/odom", {.latched = true, .period = 1ms}).value();
  while (!odom.wanted()) std::this_thread::yield();
  rowe::rt::periodic loop{1ms, {.cycles_max = 20}};
  while (const auto now = loop.wait()) (void)odom.publish({1, 2}, *now); // what is full is no matter here
  EXPECT_EQ(count_of(robot, "phase_hits") + count_of(robot, "phase_misses"), 0u);
  EXPECT_EQ(count_of(robot, "phase_watched_ns"), 0u);
}

TEST(endpoint, that_was_moved_from_answers_every_call) {
  auto opened = endpoint::listen(0, hub()).value();
  const endpoint kept = std::move(opened);
  endpoint& gone = opened; // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(calls_without(errc::misuse, gone), "");
  EXPECT_NE(kept.port(), 0);
}

TEST(handles, that_are_empty_answer_every_call) {
  handles nothing;
  EXPECT_EQ(calls_without(errc::misuse, nothing), "");
  const rowe::lane& lane = nothing.lane;
  EXPECT_EQ(lane.sent() + lane.dropped_full() + lane.dropped_too_big() + lane.expired(), 0U);
}

} // namespace
} // namespace endpoint_test
