// SPDX-License-Identifier: Apache-2.0
// Rights that change while peers are connected, and what each peer may see.
#include "access_fixture.hpp"

#include <algorithm>
#include <tuple>
#include <vector>

#include "service/graph/numbers_lists.hpp"

namespace core_rights_test {
namespace {

using namespace access_fixture;

struct rights : access {
  explicit rights(const rowe::endpoint_options& options = with_roles()) : access{options} {}

  rowe::access_options now = on.options.access;

  rowe::role& role_named(std::string_view name) {
    return *std::find_if(now.roles.begin(), now.roles.end(), [&](auto& one) { return one.name == name; });
  }
  rowe::identity& identity_of(std::string_view name) {
    return *std::find_if(now.identities.begin(), now.identities.end(),
                         [&](auto& one) { return one.name == name; });
  }
  void revoke(std::string_view name) {
    std::erase_if(now.identities, [&](const auto& one) { return one.name == name; });
  }
  // The close reason of a peer; empty while it is connected.
  std::string closed(peer& one) {
    (void)one.hear();
    EXPECT_TRUE(one.close_code == 0 || one.close_code == 1008 || one.close_code == 1013) << one.close_code;
    return one.close_reason;
  }
};

TEST_F(rights, are_gone_with_the_token_within_one_cycle) {
  peer& driver = comes("driver");
  peer& observer = comes("observer");
  revoke("driver");
  driver.say(R"({"op":"publish","topic":"/cmd_vel","msg":{}})"); // read in the cycle that takes the rights
  observer.say(R"({"op":"subscribe","topic":"/cmd_vel"})");
  on.set_access(now);
  EXPECT_EQ(closed(driver), "token revoked");
  EXPECT_EQ(driver.close_code, 1008);
  EXPECT_EQ(on.count(counter::revoked_peers), 1U);
  on.cycle();
  EXPECT_EQ(closed(observer), "");
  EXPECT_TRUE(observer.hear().empty());
  peers.pop_front();
  EXPECT_FALSE(is_in(comes("driver")));
}

TEST_F(rights, of_a_new_identity_hold_at_once) {
  EXPECT_FALSE(is_in(comes("alice")));
  peers.clear();
  now.identities.push_back({"alice", "driver", rowe::hash_token(token_of("alice"))});
  on.set_access(now);
  peer& alice = comes("alice");
  ASSERT_TRUE(is_in(alice));
  EXPECT_EQ(answer_to(alice, R"({"op":"publish","topic":"/x","msg":{}})"), "");
}

TEST_F(rights, that_a_role_has_lost_close_its_peers_and_no_others) {
  peer& arm = comes("arm");
  peer& driver = comes("driver");
  role_named("arm").subscribe = {"/arm/a"};
  on.set_access(now);
  EXPECT_EQ(closed(arm), "role changed");
  EXPECT_EQ(closed(driver), "");
  peer& again = comes("arm");
  EXPECT_TRUE(has(answer_to(again, R"({"op":"subscribe","topic":"/arm/b"})"), "has no right"));
}

TEST_F(rights, that_a_role_was_given_hold_for_those_who_are_there) {
  peer& arm = comes("arm");
  const std::string call = R"({"op":"call_service","id":"1","service":"/rosapi/topics"})";
  EXPECT_TRUE(has(answer_to(arm, call), "has no right"));
  role_named("arm").call.emplace_back("/rosapi/*");
  on.set_access(now);
  EXPECT_EQ(closed(arm), "");
  EXPECT_TRUE(has(answer_to(arm, call), "\"topics\""));
}

TEST_F(rights, go_with_a_new_token_another_name_or_another_role) {
  peer& driver = comes("driver");
  peer& observer = comes("observer");
  peer& arm = comes("arm");
  peer& boss = comes("supervisor");
  identity_of("driver").token_sha256 = rowe::hash_token(token_of("new"));
  identity_of("observer").name = "visitor";
  identity_of("arm").role = "observer";
  identity_of("supervisor").token_in_url = true;
  on.set_access(now);
  EXPECT_EQ(closed(driver), "token revoked");
  EXPECT_EQ(closed(observer), "token revoked");
  EXPECT_EQ(closed(arm), "role changed");
  EXPECT_EQ(closed(boss), "");
  now.identities.back().token_in_url = false;
  identity_of("supervisor").token_in_url = false; // it may have come by a URL
  on.set_access(now);
  EXPECT_EQ(closed(boss), "role changed");
}

TEST_F(rights, keep_their_peer_wherever_it_stands_in_the_options) {
  peer& arm = comes("arm");
  peer& boss = comes("supervisor");
  std::reverse(now.roles.begin(), now.roles.end());
  std::reverse(now.identities.begin(), now.identities.end());
  now.roles.insert(now.roles.begin(), rowe::role{.name = "other"});
  on.set_access(now);
  EXPECT_EQ(closed(arm) + closed(boss), "");
  EXPECT_EQ(answer_to(boss, R"({"op":"publish","topic":"/x","msg":{}})"), "");
  EXPECT_TRUE(has(answer_to(arm, R"({"op":"subscribe","topic":"/odom"})"), "arm, role arm, has no right"));
}

struct local_rights : rights {
  local_rights()
      : rights{with_roles([](rowe::access_options& to) {
          to.local_role = "driver";
          to.anonymous_may_stop = true;
        })} {}
};

TEST_F(local_rights, go_with_the_role_of_this_machine_and_with_what_strangers_may) {
  peer& local = comes("", here);
  peer& stranger = comes("", far, rowe::service::stop_path);
  now.local_role = "supervisor";
  on.set_access(now);
  EXPECT_EQ(closed(local) + closed(stranger), ""); // it has won a right
  now.local_role = "observer";
  on.set_access(now);
  EXPECT_EQ(closed(local), "role changed");
  EXPECT_EQ(closed(stranger), "");
  now.anonymous_may_stop = false;
  on.set_access(now);
  EXPECT_EQ(closed(stranger), "token revoked");
}

TEST_F(local_rights, let_a_button_whose_token_is_gone_stop) {
  peer& button = comes("observer", far, rowe::service::stop_path);
  peer& other = comes("driver", far, rowe::service::stop_path);
  revoke("observer");
  identity_of("driver").role = "observer"; // to stop needs no role
  on.set_access(now);
  EXPECT_EQ(closed(button) + closed(other), "");
  now.anonymous_may_stop = false;
  on.set_access(now);
  EXPECT_EQ(closed(button), "token revoked");
  EXPECT_EQ(closed(other), "");
}

struct no_rights : rights {
  no_rights() : rights{with_roles([](rowe::access_options& to) { to = {}; })} {}
};

TEST_F(no_rights, end_with_the_first_identity) {
  peer& somebody = comes("");
  peer& button = comes("", far, rowe::service::stop_path);
  now = with_roles().access;
  now.anonymous_may_stop = true;
  on.set_access(now);
  EXPECT_EQ(closed(somebody), "token revoked");
  EXPECT_EQ(closed(button), "");
  EXPECT_TRUE(is_in(comes("driver")) || on.core.peers() == 2);
}

// More than are closed in one cycle: all count as closed at once, and each is closed in one of the next.
struct many_rights : rights {
  many_rights() : rights{with_limits(with_roles(), &limits::connections_max, 40)} {}
};

TEST_F(many_rights, are_gone_at_once_however_many_peers_had_them) {
  constexpr auto once = static_cast<std::ptrdiff_t>(rowe::service::closes_per_cycle);
  for (int i = 0; i < 40; ++i) (void)comes("driver");
  revoke("driver");
  for (peer& one : peers) one.say(R"({"op":"subscribe","topic":"/odom"})");
  const auto before = on.count(counter::messages_in);
  on.set_access(now);
  EXPECT_EQ(on.count(counter::revoked_peers), 40U);
  EXPECT_EQ(on.next_wake, on.now); // the others want to be closed now
  const auto are_closed = [&] {
    return std::count_if(peers.begin(), peers.end(), [&](peer& one) { return !closed(one).empty(); });
  };
  EXPECT_EQ(are_closed(), once);
  on.cycle();
  EXPECT_EQ(are_closed(), 2 * once);
  on.cycle();
  EXPECT_EQ(are_closed(), 40);
  EXPECT_EQ(on.count(counter::messages_in), before);
}

TEST_F(rights, by_which_an_upgrade_was_judged_must_hold_when_it_is_done) {
  on.net.handshakes_last(2);
  peer& arm = comes("arm");
  on.set_access(now);
  on.cycle();
  EXPECT_EQ(closed(arm), "the rights have just changed: connect again");
  EXPECT_EQ(arm.close_code, 1013);
}

struct guarded_rights : rights {
  using rights::rights;
  void let_go(peer& by) {
    (void)loop.moves();
    (void)call_stop(on, by, "reset", "");
    ASSERT_TRUE(loop.moves());
  }
  stoppable_loop loop{on};
};

TEST_F(guarded_rights, stop_the_robot_when_they_are_taken_from_its_guard) {
  peer& boss = comes("supervisor");
  peer& guard = comes("guard");
  EXPECT_FALSE(has(call_stop(on, guard, "guard", R"("guard":"panel",)"), "\"role\""));
  let_go(boss);
  revoke("guard");
  on.set_access(now);
  EXPECT_TRUE(loop.is_stopped()); // in the same cycle
  EXPECT_EQ(closed(guard), "token revoked");
}

// ---- who a peer is

TEST_F(rights, tell_who_comes_and_goes_and_who_is_there) {
  peer& driver = comes("driver");
  EXPECT_EQ(on.shared.connections().at(0).identity, "driver");
  EXPECT_TRUE(has(answer_to(driver, R"({"op":"call_service","id":"1","service":"/rowe/stats"})"),
                  R"("address":"10.0.0.7:50000","identity":"driver")"));
  revoke("driver");
  on.set_access(now);
  on.cycle();
  EXPECT_EQ(events(), "connected\ntoken revoked\n");
}

TEST_F(guarded_rights, tell_who_has_stopped_the_robot) {
  peer& boss = comes("supervisor");
  let_go(boss);
  std::string who;
  while (const auto one = on.shared.try_event())
    if (one->what_kind == rowe::event::kind::stop) who = one->peer;
  EXPECT_EQ(who, "10.0.0.7:50000"); // who has reset it
  peer& driver = comes("driver");
  (void)answer_to(driver, R"({"op":"call_service","id":"1","service":"/rowe/stop"})");
  EXPECT_TRUE(
      has(answer_to(boss, R"({"op":"call_service","service":"/rowe/stop/state"})"), R"("source":"driver")"));
}

TEST_F(rights, are_not_what_a_stop_wants_where_there_is_none) {
  const std::string call = R"({"op":"call_service","id":"1","service":"/rowe/stop"})";
  for (const char* const who : {"observer", "driver"}) {
    peer& one = comes(who);
    EXPECT_TRUE(has(answer_to(one, call), "Service /rowe/stop does not exist")) << who;
    EXPECT_TRUE(has(answer_to(one, R"({"service":"/rowe/stop","message_id":2})"), "no_service")) << who;
  }
  EXPECT_EQ(on.count(counter::denied), 0U);
  EXPECT_EQ(on.count(counter::calls_refused), 4U);
}

// A peer may say that it is anybody.
struct claims : guarded_rights {
  claims()
      : guarded_rights{with_roles([](rowe::access_options& to) {
          to.anonymous_may_stop = true;
          to.identities.push_back({std::string(64, 'n'), "observer", rowe::hash_token(token_of("long"))});
        })} {}
  // Who has stopped, as everybody is told.
  std::string source(peer& one) { return std::string{rowe::json::find(stop_state(on, one), "source")->raw}; }
};

TEST_F(claims, of_who_stops_stand_behind_who_that_is) {
  const std::string stop = R"({"op":"publish","topic":"/rowe/stop","msg":{"source":"supervisor"}})";
  const std::string longest(64, 'n');
  for (const auto& [who, path, shown] :
       std::initializer_list<std::tuple<const char*, const char*, std::string>>{
           {"observer", "/", "observer (supervisor)"},
           {"", "/rowe/stop", "10.0.0.7:50000 (supervisor)"},
           {"long", "/", longest}}) {
    peer& one = comes(who, far, path);
    (void)answer_to(one, stop);
    EXPECT_EQ(source(one), '"' + shown + '"');
  }
}

TEST_F(claims, do_not_end_the_quotes_around_them) {
  peer& boss = comes("supervisor");
  peer& observer = comes("observer");
  let_go(boss);
  (void)answer_to(observer, R"({"service":"/rowe/stop","source":"a', 'b","reason":"c', by 'd"})");
  std::string told;
  while (const auto one = on.shared.try_event())
    if (one->what_kind == rowe::event::kind::stop) told = std::string{one->what};
  EXPECT_EQ(told, R"(stopped: request, by 'observer (a\', \'b)', 'c\', by \'d')");
}

TEST_F(claims, of_who_stops_do_not_hide_in_the_log_who_that_is) {
  peer& boss = comes("supervisor");
  peer& observer = comes("observer");
  let_go(boss);
  (void)answer_to(observer, R"({"service":"/rowe/stop","source":"supervisor"})");
  const auto told = [](const rowe::event& one) {
    return std::string{one.peer} + ", " + std::string{one.identity} + ", " + std::string{one.what};
  };
  EXPECT_EQ(events(rowe::event::kind::stop, told),
            "10.0.0.7:50000, supervisor, reset: loops may move\n"
            "10.0.0.7:50000, observer, stopped: request, by 'observer (supervisor)'\n");
}

// Whatever a peer calls a topic, the line about it is no other line.
TEST_F(rights, are_denied_with_a_name_in_quotes_unless_it_is_plain) {
  peer& observer = comes("observer");
  for (const char* const name :
       {"/plain_1", "/a b", "/a\xE3\x85\xA4 10.9.9.9:4444: supervisor: reset", "/it's"})
    (void)answer_to(observer, R"({"op":"publish","msg":{},"topic":")" + std::string{name} + R"("})");
  const auto told = [](const rowe::event& one) {
    return std::string{std::string_view{one.what}.substr(std::string_view{one.what}.find("publish"))};
  };
  EXPECT_EQ(events(rowe::event::kind::denied, told),
            "publish /plain_1\npublish '/a b'\n"
            "publish '/a\xE3\x85\xA4 10.9.9.9:4444: supervisor: reset'\npublish '/it\\'s'\n");
}

TEST_F(rights, are_denied_with_the_identity_beside_the_address) {
  peer& observer = comes("observer");
  (void)answer_to(observer, R"({"op":"publish","topic":"/x","msg":{}})");
  const auto told = [](const rowe::event& one) {
    return std::string{one.peer} + ", " + std::string{one.identity};
  };
  EXPECT_EQ(events(rowe::event::kind::denied, told), "10.0.0.7:50000, observer\n");
}

TEST_F(rights, are_not_asked_about_wrong_tokens_but_those_are_counted) {
  on.core.on_rejected(
      {.http_status = rowe::service::rejection::slowed, .peer = {}, .what = "slow", .remedy = {}});
  on.core.on_rejected({.http_status = 401, .peer = {}, .what = "prompt", .remedy = {}});
  EXPECT_EQ(on.count(counter::slowed_handshakes), 1U);
  EXPECT_EQ(on.count(counter::refused_handshakes), 2U);
}

// ---- what a peer may see

// Some of which are the arm's, and some not.
void advertise_topics_and_services(peer& provider) {
  for (const char* const topic : {"/arm/joints", "/secret/place"})
    provider.say(R"({"op":"advertise","type":"a/B","topic":")" + std::string{topic} + "\"}");
  for (const char* const service : {"/arm/open", "/secret/door"})
    provider.say(R"({"op":"advertise_service","type":"c/D","service":")" + std::string{service} + "\"}");
}

struct seen : rights {
  seen()
      : rights{with_roles([](rowe::access_options& to) {
          to.roles[0].call = {"/arm/*", "/rosapi/*", "/rowe/stats"};
        })} {
    advertise_topics_and_services(comes("peer"));
    on.cycles(2);
  }
};

TEST_F(seen, are_only_the_topics_and_services_that_the_role_may_use) {
  peer& arm = comes("arm");
  peer& observer = comes("observer");
  EXPECT_TRUE(has(call(arm, "/rosapi/topics"), R"("topics":["/arm/joints"],"types":["a/B"])"));
  EXPECT_TRUE(has(call(arm, "/rosapi/services"), R"("services":["/arm/open",)"));
  EXPECT_TRUE(has(call(arm, "/rosapi/topic_type", R"({"topic":"/arm/joints"})"), "a/B"));
  EXPECT_TRUE(has(call(arm, "/rosapi/topic_type", R"({"topic":"/secret/place"})"), R"("type":"")"));
  EXPECT_TRUE(has(call(arm, "/rosapi/publishers", R"({"topic":"/arm/joints"})"), far));
  EXPECT_TRUE(has(call(arm, "/rosapi/publishers", R"({"topic":"/secret/place"})"), R"("publishers":[])"));
  EXPECT_TRUE(has(call(arm, "/rosapi/service_type", R"({"service":"/arm/open"})"), "c/D"));
  EXPECT_TRUE(has(call(arm, "/rosapi/service_type", R"({"service":"/secret/door"})"), R"("type":"")"));
  EXPECT_TRUE(has(call(observer, "/rosapi/topics"), "/secret/place"));
  EXPECT_TRUE(has(call(observer, "/rosapi/services"), R"("services":["/rowe/stats",)")); // of others, none
}

TEST_F(seen, are_in_the_statistics_only_what_the_role_may_read_and_its_own_connection) {
  peer& arm = comes("arm");
  const std::string stats = call(arm, "/rowe/stats");
  EXPECT_TRUE(has(stats, "/arm/joints"));
  EXPECT_FALSE(has(stats, "/secret/place"));
  const std::size_t first = stats.find("\"address\"");
  EXPECT_NE(first, std::string::npos);
  EXPECT_EQ(stats.find("\"address\"", first + 1), std::string::npos);
  peer& driver = comes("driver");
  EXPECT_TRUE(has(call(driver, "/rowe/stats"), "/secret/place"));
}

TEST_F(seen, are_the_published_statistics_only_by_roles_that_see_everything_or_name_them) {
  const std::string subscribe = R"({"op":"subscribe","topic":"/rowe/stats"})";
  now.roles[0].subscribe = {"/rowe/*", "/*/*"};
  on.set_access(now);
  EXPECT_TRUE(has(answer_to(comes("arm"), subscribe), "has no right to subscribe /rowe/stats"));
  EXPECT_FALSE(has(answer_to(comes("observer"), subscribe), "no right"));
  now.roles[0].subscribe.emplace_back("rowe/stats");
  on.set_access(now);
  EXPECT_FALSE(has(answer_to(comes("arm"), subscribe), "no right"));
}

TEST(seen_by_number, is_only_what_the_role_may_use_and_more_when_it_grows) {
  auto options = with_roles();
  options.access.roles[0].call = {"/arm/*"};
  core_harness on{options, rowe::service::side::server, 1, rowe::rt::time_point{1000s},
                  &numbers::protocols()};
  peer provider{on, rowe::service::side::server, far, "/", "", token_of("peer")};
  on.cycle();
  advertise_topics_and_services(provider);
  on.cycles(2);
  peer arm{on, rowe::service::side::server, far, "/", numbers::subprotocol, token_of("arm")};
  const auto heard = arm.hear_after(6);
  const numbers::numbered topics = numbers::list_of(heard, 'T');
  const numbers::numbered services = numbers::list_of(heard, 'S');
  EXPECT_TRUE(topics.contains("/arm/joints"));
  EXPECT_FALSE(topics.contains("/secret/place"));
  EXPECT_FALSE(topics.contains("/rowe/stats"));
  EXPECT_TRUE(services.contains("/arm/open"));
  EXPECT_FALSE(services.contains("/secret/door"));

  // The number of what it may not see is the number of nothing: its name is not told, either.
  for (std::uint32_t number = 0; number < 64; ++number)
    arm.say(R"({"want":[[)" + std::to_string(100 + number) + "," + std::to_string(number) + "]]}");
  on.cycles(40);
  for (const std::string& text : arm.hear()) EXPECT_FALSE(has(text, "secret"));

  // What goes was not told, so it is not told that it goes.
  provider.tell(R"({"op":"unadvertise","topic":"/secret/place"})", 300);
  EXPECT_TRUE(numbers::gone_of(arm.hear(), 't').empty());
  provider.tell(R"({"op":"advertise","type":"a/B","topic":"/secret/place"})", 300);
  EXPECT_FALSE(numbers::list_of(arm.hear(), 'T').contains("/secret/place"));

  auto more = options.access;
  more.roles[0].subscribe = {"**", "/arm/**"};
  on.set_access(more);
  const numbers::numbered grown = numbers::list_of(arm.hear_after(2), 'T');
  EXPECT_TRUE(grown.contains("/secret/place"));
  EXPECT_FALSE(grown.contains("/arm/joints")); // that it knows
}

} // namespace
} // namespace core_rights_test
