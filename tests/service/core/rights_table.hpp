// SPDX-License-Identifier: Apache-2.0
// What the table of rights is tried with: who asks, for which names, and in each codec all the ways to say
// what is asked. A verb that the service gets does not compile here until it is said what it looks like.
#pragma once
#include "access_fixture.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/parameter.hpp>

#include "access/policy.hpp"
#include "service/graph/numbers_lists.hpp"
#include "service/stop/stop_gate.hpp"
#include "wire/codec/request.hpp"

namespace rights_table {

using namespace access_fixture;
using rowe::access::right;
using rowe::service::stop_verb;
using rowe::wire::verb;

// ---- who asks

struct asker {
  char sign; // in the table
  std::string_view role;
  bool stop_only = false; // comes on the stop's path
  bool has_token = true;
  bool roles = true; // the endpoint has identities
  std::string_view address = far;
};
inline constexpr asker askers[] = {
    {'o', "observer"},
    {'d', "driver"},
    {'s', "supervisor"},
    {'p', "peer"},
    {'a', "arm"},                                                           // has patterns
    {'g', "guard"},                                                         // may guard, and nothing else
    {'n', "idle"},                                                          // has no right at all
    {.sign = 'x', .role = "nobody", .stop_only = true, .has_token = false}, // anonymous
    {.sign = 'b', .role = "driver", .stop_only = true},                     // a button
    {.sign = 'e', .role = "nobody", .has_token = false, .roles = false},    // everyone, without identities
    {.sign = 'l', .role = "nobody", .has_token = false, .roles = false, .address = here},
};
inline constexpr std::string_view everyone = "odspagnxbel";

inline rowe::endpoint_options options_for(const asker& who) {
  auto options = with_roles();
  options.limits.connections_max = 6; // small, since each cell has a core of its own
  options.limits.handles_max = 1;
  options.limits.handle_bytes = 64 * 1024;
  options.limits.large_slots = 2;
  if (!who.roles) {
    options.access = {};
    return options;
  }
  options.access.roles = {{.name = "arm",
                           .subscribe = {"/arm/**"},
                           .publish = {"/arm/*"},
                           .advertise = {"/arm/*", "/arm/left/*"},
                           .call = {"/arm/*", "/rosapi/set_param"},
                           .provide = {"arm/*"},
                           .set = {"arm/*"}},
                          {.name = "guard", .guard = true},
                          {.name = "idle"}};
  options.access.identities.push_back({"idle", "idle", rowe::hash_token(token_of("idle"))});
  options.access.anonymous_may_stop = true;
  return options;
}

// ---- for what

inline constexpr std::string_view own = "/arm/joint";       // a name that the patterns of `arm` have
inline constexpr std::string_view deep = "/arm/left/joint"; // some of its rights have it
inline constexpr std::string_view outside = "/cmd_vel";     // none has it
inline constexpr std::string_view near = "/armx/joint";     // nor this

enum class spelling : std::uint8_t { plain, no_slash, escaped };

// As it stands in JSON; what is read is said_name().
inline std::string spelled(std::string_view name, spelling how) {
  if (name.empty() || how == spelling::plain) return std::string{name};
  if (how == spelling::no_slash) return std::string{name.substr(1)};
  return R"(\u002f)" + std::string{name.substr(1)};
}
inline std::string_view said_name(std::string_view name, spelling how) {
  return how == spelling::no_slash && !name.empty() ? name.substr(1) : name;
}

// ---- in which words

enum class codec : std::uint8_t { rosbridge, rowe_v1, hop, hop_2014, numbers, foxglove };
// Foxglove's is tried with what it alone has words for.
inline constexpr codec codecs[] = {codec::rosbridge, codec::rowe_v1, codec::hop, codec::hop_2014,
                                   codec::numbers};

inline std::string_view subprotocol_of(codec in) {
  if (in == codec::numbers) return numbers::subprotocol;
  if (in == codec::foxglove) return "foxglove.websocket.v1";
  return in == codec::rowe_v1 ? std::string_view{"rowe.v1"} : std::string_view{};
}
inline rowe::websocket_profile profile_of(codec in) {
  if (in == codec::hop) return rowe::websocket_profile::hop;
  return in == codec::hop_2014 ? rowe::websocket_profile::hop_2014 : rowe::websocket_profile::standard;
}

struct frame {
  std::string bytes;
  bool binary = false;
};

// What a saying needs to know.
struct about {
  std::string name;          // as it is spelled
  std::string id = "0";      // of the call that is answered, as JSON
  std::uint32_t topic = 0;   // by numbers: that of the topic,
  std::uint32_t service = 0; // and of the service
};

inline constexpr std::string_view mark = "7654321";     // what the request says, to be found elsewhere
inline constexpr std::string_view call_id = "id-of-it"; // and its id, in codecs of JSON

inline std::vector<frame> said_in_json(verb what, const about& of) {
  const std::string name = '"' + of.name + '"';
  const std::string body = R"({"mark":)" + std::string{mark} + "}";
  const std::string id = '"' + std::string{call_id} + '"';
  const std::string named = of.name.empty() ? "" : R"("service":)" + name + ",";
  switch (what) {
  case verb::message:
    return {{body}, {R"({"ttl_ms":500,"service":"/arm/joint","mark":)" + std::string{mark} + "}"}};
  case verb::publish:
    return {{R"({"op":"publish","topic":)" + name + R"(,"msg":)" + body + "}"},
            {R"({"op":"publish","latch":true,"topic":)" + name + R"(,"type":"a/B","msg":)" + body + "}"}};
  case verb::subscribe: return {{R"({"op":"subscribe","id":"s","topic":)" + name + "}"}};
  case verb::unsubscribe: return {{R"({"op":"unsubscribe","topic":)" + name + "}"}};
  case verb::advertise: return {{R"({"op":"advertise","type":"a/B","topic":)" + name + "}"}};
  case verb::unadvertise: return {{R"({"op":"unadvertise","topic":)" + name + "}"}};
  case verb::call: {
    const frame plain{R"({"mark":)" + std::string{mark} + "," + named + R"("message_id":)" + id + "}"};
    if (of.name.empty()) return {plain};
    return {plain, {R"({"op":"call_service","id":)" + id + "," + named + R"("args":)" + body + "}"}};
  }
  case verb::reply:
    return {{R"({"op":"service_response","result":true,"id":)" + of.id + "," + named + R"("values":)" + body +
             "}"},
            {R"({"in_reply_to":)" + of.id + R"(,"mark":)" + std::string{mark} + "}"}};
  case verb::advertise_service:
    return {{R"({"op":"advertise_service","type":"a/B","service":)" + name + "}"}};
  case verb::unadvertise_service: return {{R"({"op":"unadvertise_service","service":)" + name + "}"}};
  case verb::advertise_action: return {{R"({"op":"advertise_action","type":"a/B","action":)" + name + "}"}};
  case verb::unadvertise_action: return {{R"({"op":"unadvertise_action","action":)" + name + "}"}};
  case verb::send_goal:
    return {{R"({"op":"send_action_goal","id":)" + id + R"(,"action":)" + name + R"(,"args":)" + body + "}"}};
  case verb::cancel_goal:
    return {{R"({"op":"cancel_action_goal","id":)" + of.id + R"(,"action":)" + name + "}"},
            {R"({"op":"cancel_action_goal","id":"w","action":)" + name + "}"}};
  case verb::goal_feedback:
    return {
        {R"({"op":"action_feedback","id":)" + of.id + R"(,"action":)" + name + R"(,"values":)" + body + "}"}};
  case verb::goal_result:
    return {{R"({"op":"action_result","status":4,"result":true,"id":)" + of.id + R"(,"action":)" + name +
             R"(,"values":)" + body + "}"}};
  case verb::status: return {{R"({"op":"status","level":"info","msg":"fine"})"}};
  case verb::set_level: return {{R"({"op":"set_level","level":"error"})"}};
  case verb::fragment: return {{R"({"op":"fragment","id":"f","data":"{","num":0,"total":2})"}};
  case verb::unsupported: return {{R"({"op":"auth","mac":"x"})"}};
  case verb::unknown: return {{R"({"op":"rewire","topic":)" + name + "}"}};
  case verb::get_parameters:
  case verb::set_parameters:
  case verb::subscribe_parameters:
  case verb::unsubscribe_parameters:
  case verb::subscribe_graph:
  case verb::unsubscribe_graph: break;
  }
  return {};
}

// Nothing where the codec has no such verb. What a peer publishes on or gives back, it has offered before.
inline std::vector<frame> said_by_numbers(verb what, const about& of) {
  const std::string body = R"({"mark":)" + std::string{mark} + "}";
  switch (what) {
  case verb::message: return {{"x" + body, true}};
  case verb::publish: return {{"p" + numbers::four(5) + body, true}};
  case verb::subscribe: return {{R"({"want":[[9,)" + std::to_string(of.topic) + "]]}"}};
  case verb::unsubscribe: return {{R"({"drop":[9]})"}};
  case verb::advertise: return {{R"({"offer":[[5,")" + of.name + R"("]]})"}};
  case verb::unadvertise: return {{R"({"keep":[5]})"}};
  case verb::call:
    if (of.name.empty()) break;
    return {{"c" + numbers::four(of.service) + numbers::four(77) + body, true}};
  case verb::unknown: return {{"?", true}, {R"({"rewire":[]})"}};
  default: break; // it has no words for them
  }
  return {};
}

inline std::vector<frame> said(codec in, verb what, const about& of) {
  return in == codec::numbers ? said_by_numbers(what, of) : said_in_json(what, of);
}

// The same for the stop; `args` are members, and each of them ends in a comma.
inline std::vector<frame> said_to_stop(codec in, stop_verb which, std::string_view args,
                                       std::uint32_t number) {
  const std::string name{which == stop_verb::none ? "" : rowe::service::stop_gate::name_of(which)};
  const std::string members{args};
  if (in == codec::numbers) {
    std::string object = "{" + members;
    if (object.ends_with(',')) object.pop_back();
    return {{"c" + numbers::four(number) + numbers::four(77) + object + "}", true}};
  }
  const std::string service = R"("service":")" + name + '"';
  const std::string inner = members.empty() ? "" : members.substr(0, members.size() - 1);
  std::vector<frame> all{{R"({"op":"call_service","id":"r",)" + service + R"(,"args":{)" + inner + "}}"},
                         {"{" + members + service + R"(,"message_id":"r"})"}};
  if (which != stop_verb::stop) return all;
  all.push_back({R"({"op":"publish","topic":"/rowe/stop","msg":{}})"});
  all.push_back({R"({"op":"publish","topic":"/rowe/stop","msg":7,"latch":"no"})"}); // refused
  all.push_back({R"({"service":"/rowe/stop"})"});                                   // a plain message
  return all;
}

// ---- where

// A core with whoever asks, a peer that has everything, and a supervisor.
struct scene {
  using change = void (*)(rowe::endpoint_options&);
  scene(const asker& asks, codec in, change to = nullptr)
      : who{asks},
        words{in},
        on{options_in(asks, in, to), rowe::service::side::server, 1, rowe::rt::time_point{1000s},
           in == codec::numbers ? &numbers::protocols() : nullptr},
        host{on, rowe::service::side::server, far, "/", "", token_of("peer")},
        other{on, rowe::service::side::server, here, "/", "", token_of("supervisor")},
        subject{on,
                rowe::service::side::server,
                asks.address,
                asks.stop_only ? rowe::service::stop_path : std::string_view{"/"},
                subprotocol_of(in),
                asks.has_token ? token_of(asks.role) : std::string{}} {
    (void)on.inbox.try_receive(on.now); // somebody takes plain messages
    on.cycle();
  }
  ~scene() { EXPECT_TRUE(on.core.check()); }

  static rowe::endpoint_options options_in(const asker& asks, codec in, change to) {
    auto options = options_for(asks);
    options.profile = profile_of(in);
    if (to != nullptr) to(options);
    return options;
  }
  static std::string all_of(peer& one) {
    std::string all;
    for (const std::string& text : one.hear()) all += text + "\n";
    return all;
  }
  void say(const frame& what) {
    subject.send(what.binary ? rowe::wire::opcode::binary : rowe::wire::opcode::text, what.bytes);
    on.cycles(3);
    told = all_of(subject);
  }
  std::string answer_to(peer& of, std::string_view text) {
    (void)of.hear();
    return access_fixture::answer_to(on, of, text);
  }
  // The numbers that a topic and a service have, whether or not whoever asks was told.
  about with_numbers(about of) {
    if (words != codec::numbers) return of;
    peer spy{on, rowe::service::side::server, here, "/", numbers::subprotocol, token_of("supervisor")};
    on.cycles(6);
    const auto lists = spy.hear();
    auto topics = numbers::list_of(lists, 'T');
    auto services = numbers::list_of(lists, 'S');
    of.topic = topics.contains(of.name) ? topics[of.name] : 999;
    of.service = services.contains(of.name) ? services[of.name] : 999;
    spy.leave();
    on.cycle();
    return of;
  }
  // Events of denials, and whether a status came.
  void read_events() {
    denials.clear();
    statuses = 0;
    while (const auto one = on.shared.try_event()) {
      if (one->what_kind == rowe::event::kind::denied)
        denials.push_back(std::string{one->peer} + ": " + std::string{one->what});
      statuses += one->what_kind == rowe::event::kind::status_from_peer;
    }
  }
  std::string inbox() {
    std::string all;
    while (const auto slot = on.inbox.try_receive(on.now)) {
      all += on.inbox.text(*slot);
      (void)on.inbox.release(*slot);
    }
    return all;
  }

  const asker& who;
  codec words;
  core_harness on;
  peer host;
  peer other;
  peer subject;
  std::string told; // to whoever asks
  std::vector<std::string> denials;
  int statuses = 0;
};

inline bool is_among(char sign, std::string_view signs) { return signs.find(sign) != signs.npos; }

} // namespace rights_table
