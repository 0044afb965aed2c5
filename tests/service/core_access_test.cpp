// SPDX-License-Identifier: Apache-2.0
// Roles: who is let in, and what takes effect of what each peer asks for.
#include "core_fixtures.hpp"

#include <rowe/access.hpp>
#include <rowe/stop_latch.hpp>

#include <optional>

namespace core_access_test {
namespace {

using namespace harness;

constexpr std::string_view far = "10.0.0.7:50000";
constexpr std::string_view here = "127.0.0.1:50000";

std::string token_of(std::string_view name) { return std::string{name} + "-shows-this-token"; }

rowe::endpoint_options with_roles() {
  rowe::endpoint_options options = small_options();
  options.relay = true;
  options.stop.unguarded = true;
  options.access.roles = {{.name = "arm",
                           .subscribe = {"/arm/**"},
                           .publish = {"/*", "/arm/*"},
                           .advertise = {"/arm/*"},
                           .call = {"/*", "/arm/*"},
                           .provide = {"/arm/*"}},
                          {.name = "guard", .guard = true}};
  for (const char* const role : {"observer", "driver", "supervisor", "peer", "arm", "guard"})
    options.access.identities.push_back({role, role, rowe::hash_token(token_of(role))});
  return options;
}

struct access : core_test {
  explicit access(const rowe::endpoint_options& options = with_roles()) : core_test{options} {}

  peer& comes(std::string_view who, std::string_view address = far, std::string_view path = "/") {
    const std::string token = who.empty() ? "" : token_of(who);
    peer& one = peers.emplace_back(on, rowe::service::side::server, address, path, "", token);
    on.cycle();
    return one;
  }
  bool is_in(peer& one) { return on.core.peers() == peers.size() && !on.net.closed_by_us(one.id()); }
  // What a peer is told when it says this.
  std::string answer_to(peer& of, std::string_view text) {
    of.say(text);
    on.cycles(2);
    std::string all;
    for (const std::string& one : of.hear()) all += one;
    return all;
  }
  std::string events() {
    std::string all;
    while (const auto one = on.shared.try_event()) all += std::string{one->what} + "\n";
    return all;
  }
  std::deque<peer> peers;
};

TEST_F(access, lets_nobody_in_without_a_token_that_is_known) {
  EXPECT_FALSE(is_in(comes("")));
  peers.clear();
  EXPECT_FALSE(is_in(comes("", here))); // an address is no role
  peers.clear();
  EXPECT_FALSE(is_in(comes("mallory")));
  peers.clear();
  EXPECT_FALSE(is_in(comes("", far, rowe::service::stop_path)));
  peers.clear();
  EXPECT_TRUE(is_in(comes("observer")));
}

struct local_access : access {
  local_access()
      : access{[] {
          auto options = with_roles();
          options.access.local_role = "supervisor";
          options.access.anonymous_may_stop = true;
          return options;
        }()} {}
};

TEST_F(local_access, gives_peers_of_this_machine_the_role_that_is_chosen_for_them) {
  peer& p = comes("", here);
  ASSERT_TRUE(is_in(p));
  EXPECT_EQ(answer_to(p, R"({"op":"publish","topic":"/x","msg":{}})"), "");
  EXPECT_EQ(on.count(counter::denied), 0U);
}

TEST_F(local_access, lets_anybody_come_to_stop_and_to_do_nothing_else) {
  EXPECT_TRUE(is_in(comes("", far, rowe::service::stop_path)));
  peer& p = peers.back();
  EXPECT_NE(answer_to(p, R"({"op":"subscribe","topic":"/odom"})").find("may only stop"), std::string::npos);
}

// Each verb, for a name that is the role's own and for one that is not, in each codec.
TEST_F(access, decides_by_verb_role_and_name) {
  struct row {
    const char* says;
    const char* needs;
    bool observer, driver, supervisor, peer, arm_foreign, arm_own;
  };
  const row rows[] = {
      {R"({"op":"subscribe","topic":"NAME"})", "subscribe", true, true, true, true, false, true},
      {R"({"op":"publish","topic":"NAME","msg":{}})", "publish", false, true, true, true, false, true},
      {R"({"op":"advertise","topic":"NAME","type":"a/B"})", "advertise", false, true, true, true, false,
       true},
      {R"({"op":"call_service","id":"1","service":"NAME"})", "call", false, true, true, true, false, true},
      {R"({"op":"advertise_service","service":"NAME","type":"a/B"})", "provide", false, false, false, true,
       false, true},
      {R"({"service":"NAME","message_id":1})", "call", false, true, true, true, false, true},
      {R"({"message_id":1})", "call", false, true, true, true, false, false},
      {R"({"some":"plain message"})", "publish", false, true, true, true, false, false},
  };
  for (const row& each : rows) {
    const auto tries = [&](std::string_view role, std::string_view name, bool allowed) {
      std::string says = each.says;
      if (const auto at = says.find("NAME"); at != std::string::npos) says.replace(at, 4, name);
      core_harness fresh{with_roles()};
      peer p{fresh, rowe::service::side::server, far, "/", "", token_of(role)};
      fresh.cycle();
      p.say(says);
      fresh.cycles(2);
      std::string told;
      for (const std::string& one : p.hear()) told += one;
      const std::string refused = "role " + std::string{role} + ", has no right to " + each.needs;
      EXPECT_EQ(fresh.count(counter::denied), allowed ? 0U : 1U) << role << ": " << says;
      EXPECT_EQ(told.find(refused) != std::string::npos, !allowed) << role << ": " << says << "\n" << told;
    };
    tries("observer", "/any/thing", each.observer);
    tries("driver", "/any/thing", each.driver);
    tries("supervisor", "/any/thing", each.supervisor);
    tries("peer", "/any/thing", each.peer);
    tries("arm", "/any/thing", each.arm_foreign);
    tries("arm", "/arm/own", each.arm_own);
    tries("arm", "arm/own", each.arm_own);
  }
}

TEST_F(access, lets_nothing_that_is_denied_take_effect) {
  peer& watcher = comes("supervisor");
  peer& observer = comes("observer");
  watcher.say(R"({"op":"subscribe","topic":"/cmd_vel"})");
  on.cycle();
  EXPECT_NE(answer_to(observer, R"({"op":"publish","topic":"/cmd_vel","msg":{"x":1}})").find("has no right"),
            std::string::npos);
  EXPECT_TRUE(watcher.hear().empty());
  EXPECT_NE(answer_to(observer, R"({"op":"advertise_service","service":"/mine"})").find("has no right"),
            std::string::npos);
  const std::string call = R"({"op":"call_service","id":"1","service":"/mine"})";
  EXPECT_NE(answer_to(watcher, call).find(R"("result":false)"), std::string::npos);
}

TEST_F(access, tells_who_was_denied_what) {
  peer& observer = comes("observer");
  (void)events();
  const std::string told = answer_to(observer, R"({"op":"publish","id":"7","topic":"/cmd_vel","msg":{}})");
  const std::string why = "observer, role observer, has no right to publish /cmd_vel";
  EXPECT_NE(told.find(why), std::string::npos);
  EXPECT_NE(told.find(R"("id":"7")"), std::string::npos);
  EXPECT_EQ(events(), why + "\n");
}

TEST_F(access, leaves_room_for_other_events_however_much_is_denied) {
  for (int i = 0; i < 2000; ++i) { // more peers come, are denied and go than there are places for events
    peer& one = comes("observer");
    (void)answer_to(one, R"({"op":"publish","topic":"/cmd_vel","msg":{}})");
    one.leave();
    on.cycle();
    peers.clear();
  }
  EXPECT_GT(on.count(counter::events_lost), 0U);
  const auto lost = on.count(counter::events_lost);
  rowe::event own;
  own.what_kind = rowe::event::kind::warning;
  on.shared.post(own);
  EXPECT_EQ(on.count(counter::events_lost), lost);
}

// A loop that can be stopped, and a supervisor who lets it go.
struct stop_access : local_access {
  stop_access() {
    rowe::detail::queue_pair& pair = on.offer(rowe::detail::latch_request({.name = "base"}));
    on.cycle();
    latch.emplace(core_harness::handle_of(pair));
  }
  bool moves() {
    const bool engaged = latch->engaged(on.now);
    if (engaged) latch->acknowledge(on.now);
    on.cycle();
    return !engaged;
  }
  std::string reset(peer& by) {
    (void)moves();
    const std::string state = answer_to(by, R"({"op":"call_service","service":"/rowe/stop/state"})");
    const auto member = [&](std::string_view name) {
      const auto values = rowe::json::find(rowe::json::root(state).raw, "values");
      return std::string{rowe::json::find(values->raw, name)->raw};
    };
    return answer_to(by, R"({"op":"call_service","service":"/rowe/stop/reset","args":{"number":)" +
                             member("number") + R"(,"tick":)" + member("tick") + "}}");
  }
  std::string lease(peer& by, std::string_view more) {
    const std::string state = answer_to(by, R"({"op":"call_service","service":"/rowe/stop/state"})");
    const auto values = rowe::json::find(rowe::json::root(state).raw, "values");
    const std::string tick{rowe::json::find(values->raw, "tick")->raw};
    return answer_to(by, R"({"op":"call_service","service":"/rowe/stop/lease","args":{"guard":"panel",)"
                         R"("tick":)" +
                             tick + std::string{more} + "}}");
  }
  std::optional<rowe::stop_latch> latch;
};

TEST_F(stop_access, lets_supervisors_reset_and_everyone_stop) {
  for (const char* const role : {"observer", "driver", "peer", "arm"}) {
    peer& one = comes(role);
    EXPECT_NE(reset(one).find("\"role\""), std::string::npos) << role;
    EXPECT_FALSE(moves()) << role;
    peer& boss = comes("supervisor");
    (void)reset(boss);
    EXPECT_TRUE(moves()) << role;
    (void)answer_to(one, R"({"op":"call_service","id":"1","service":"/rowe/stop"})");
    EXPECT_FALSE(moves()) << role;
    one.leave();
    boss.leave();
    on.cycle();
  }
  peer& stranger = comes("", far, rowe::service::stop_path);
  peer& boss = comes("", here);
  (void)reset(boss);
  ASSERT_TRUE(moves());
  (void)answer_to(stranger, R"({"op":"call_service","id":"1","service":"/rowe/stop"})");
  EXPECT_FALSE(moves());
}

TEST_F(stop_access, lets_supervisors_only_guard) {
  peer& boss = comes("supervisor");
  EXPECT_EQ(lease(boss, "").find("\"role\""), std::string::npos);
  peer& driver = comes("driver");
  EXPECT_NE(lease(driver, "").find("\"role\""), std::string::npos);
}

TEST_F(stop_access, lets_nobody_take_the_guard_of_others_who_may_not_reset) {
  peer& boss = comes("supervisor");
  (void)lease(boss, "");
  peer& guard = comes("guard");
  EXPECT_NE(lease(guard, R"(,"resign":true)").find("\"role\""), std::string::npos);
  EXPECT_EQ(lease(boss, R"(,"resign":true)").find("\"role\""), std::string::npos);
}

TEST_F(stop_access, lets_somebody_whose_token_is_not_known_any_more_stop) {
  EXPECT_TRUE(is_in(comes("mallory", far, rowe::service::stop_path)));
}

TEST(access_of_a_client, does_not_ask_its_server_for_a_role) {
  auto options = with_roles();
  core_harness on{options, rowe::service::side::client};
  on.cycle();
  peer server{on, rowe::service::side::client, "10.0.0.1:9090"};
  on.cycle();
  server.say(R"({"op":"publish","topic":"/odom","msg":{}})");
  on.cycles(2);
  EXPECT_EQ(on.count(counter::denied), 0U);
}

} // namespace
} // namespace core_access_test
