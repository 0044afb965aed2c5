// SPDX-License-Identifier: Apache-2.0
// The core under arbitrary scripts of peers that have roles: raw texts, and what the simulation's grammar has
// for peers of each codec. Input: one byte that says which roles may come at all (a bit each), then commands.
// What is required, whatever is said: nothing that a role does not allow takes effect. A peer is told of no
// topic, and asked of no service, that is not its own; what nobody who came may publish, call or provide is
// heard, asked or provided by nobody; a loop that nobody may let go does not move, and is not driven by who
// may not publish. Which role has which right is written here once more.
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/access.hpp>
#include <rowe/stop_latch.hpp>
#include <rowe/subscriber.hpp>

#include "access/meaning.hpp"
#include "fuzz/require.hpp"
#include "fuzz/script.hpp"
#include "service/core/core_harness.hpp"
#include "sim/swarm_context.hpp"
#include "sim/swarm_grammar.hpp"
#include "wire/codec/own_names.hpp"
#include "json/reading/reader.hpp"

namespace {

struct motion { // as the grammar commands it
  std::int64_t n;
  double x;
};

} // namespace

template <>
inline constexpr auto rowe::schema<motion> = rowe::fields<&motion::n, &motion::x>{};

namespace {

using namespace std::chrono_literals;
using rowe::fuzz::input_choices;
using rowe::fuzz::require;
using rowe::fuzz::script;
using rowe::service::counter;
using rowe::service::side;
using rowe::wire::without_slash;

// ---- roles

enum class may : std::uint8_t { subscribe, publish, advertise, call, provide };
struct rights {
  std::string_view role;
  std::array<std::vector<std::string>, 5> lists; // by `may`
  bool resets = false;
};
// What each has at first, and after a change: two lose something, one wins.
const std::vector<rights>& all_roles(bool changed) {
  using list = std::vector<std::string>;
  const auto make = [](bool other) {
    return std::vector<rights>{
        {"reader", {list{"/t*", "/own*", "/rowe/*"}, {}, {}, {"/rosapi/**"}, {}}},
        {"half",
         {other ? list{"/t0"} : list{"/t0", "/t1"},
          {"/t0", "/t2"},
          {"/t0", "/t2"},
          {"/s0", "/rosapi/topics"},
          {"s1"}}},
        {"talker", {list{}, {"**"}, {"**"}, {"**"}, {}}},
        {"giver", {list{}, {}, {}, {}, other ? list{"/s0", "/s2"} : list{"/s0"}}},
        {"boss", {list{"**"}, {"**"}, {"**"}, {"**"}, {}}, true},
        {"idle", {}},
        {"thrower", {list{"/t3"}, {"/t*"}, other ? list{} : list{"/t*"}, {"/rowe/*"}, {}}},
    };
  };
  static const std::vector<rights> first = make(false), second = make(true);
  return changed ? second : first;
}

bool allows(std::size_t role, may what, std::string_view name) {
  for (const bool changed : {false, true}) { // what was allowed may still be on its way
    for (const std::string& pattern : all_roles(changed)[role].lists[static_cast<std::size_t>(what)]) {
      if (access_meaning::means(without_slash(pattern), without_slash(name))) return true;
    }
  }
  return false;
}

std::string token_of(std::string_view role) { return std::string{role} + "-shows-this-token"; }

rowe::access_options access_of(bool changed) {
  rowe::access_options options{.anonymous_may_stop = true};
  for (const rights& one : all_roles(changed)) {
    const std::string name{one.role};
    const auto& lists = one.lists;
    options.roles.push_back({.name = name,
                             .subscribe = lists[0],
                             .publish = lists[1],
                             .advertise = lists[2],
                             .call = lists[3],
                             .provide = lists[4],
                             .reset = one.resets,
                             .guard = one.resets});
    options.identities.push_back({name, name, rowe::hash_token(token_of(name))});
  }
  return options;
}

rowe::endpoint_options options_of() {
  auto options = harness::small_options();
  options.relay = true;
  options.limits.handles_max = 2; // small, since each input has a core of its own
  options.limits.handle_bytes = 64 * 1024;
  options.stop.unguarded = true;
  options.access = access_of(false);
  return options;
}

// ---- one script

struct guest {
  std::size_t role = 0;
  bool stop_only = false;
  bool by_numbers = false;
  std::unique_ptr<harness::peer> link;
  swarm::number_lists told;
};

class script_run {
 public:
  explicit script_run(std::uint8_t roles) : roles_{roles} {
    latch_ = rowe::stop_latch{
        harness::core_harness::handle_of(on_.offer(rowe::detail::latch_request({.name = "loop"})))};
    driven_ = rowe::subscriber<motion>{harness::core_harness::handle_of(
        on_.offer(rowe::detail::subscribe_request<motion>(swarm::driven_topic, {.lease = 300ms})))};
    (void)on_.inbox.try_receive(on_.now); // somebody takes plain messages
    cycle(1ms);
    known_.bounds = on_.options.limits;
  }

  void act(script& s) {
    const std::uint8_t what = s.byte();
    const std::size_t which = what >> 4;
    switch (what % 16) {
    case 0:
    case 1: come(s.byte(), which); break;
    case 2:
      if (guest* const one = some(which)) leave(*one);
      break;
    case 3:
    case 4:
      if (guest* const one = some(which)) one->link->say(s.text());
      break;
    case 5:
      if (guest* const one = some(which)) one->link->send(rowe::wire::opcode::binary, s.text());
      break;
    case 6: change(); break;
    case 7: answer(which); break;
    case 8: reset(which); break;
    case 9: cycle(s.byte() * 1ms); return;
    default: speak(s, which); break;
    }
    cycle(100us);
    hear_all();
  }

  void end() {
    for (int i = 0; i < 5; ++i) {
      cycle(20ms);
      hear_all();
    }
    for (guest& one : guests_) one.link->leave(rowe::service::close_cause::reset);
    for (int i = 0; i < 60 && on_.core.peers() != 0; ++i) { // a peer is gone when its backlog was processed
      cycle(5ms);
      hear_inbox();
    }
    require(on_.core.peers() == 0, "all are gone");
    const auto denied = on_.count(counter::denied);
    require(denied >= denials_, "each denial that is told of is counted");
  }

 private:
  void cycle(rowe::duration later) {
    if (latch_.engaged(on_.now)) {
      latch_.acknowledge(on_.now);
    } else {
      require(came(boss), "a loop that nobody may let go does not move");
    }
    on_.cycle(later);
    require(on_.core.check(), "the core's structures agree");
    if (driven_.latest_within(on_.now))
      require(anybody_may(may::publish, swarm::driven_topic), "what drives is of whoever may publish it");
    while (const auto one = on_.shared.try_event()) {
      if (one->what_kind != rowe::event::kind::denied) continue;
      ++denials_;
      require(std::string_view{one->what}.find("no right to ") != std::string_view::npos,
              "a denial names the right");
    }
  }

  // ---- who is there

  static constexpr std::size_t boss = 4;
  bool came(std::size_t role) const { return (came_ >> role & 1) != 0; }
  bool anybody_may(may what, std::string_view name) const {
    for (std::size_t role = 0; role < all_roles(false).size(); ++role) {
      if (came(role) && allows(role, what, name)) return true;
    }
    return false;
  }
  void come(std::uint8_t how, std::size_t role) {
    role %= all_roles(false).size();
    if (guests_.size() >= 5 || (roles_ >> role & 1) == 0) return;
    const bool stranger = (how & 3) == 3;
    const bool stop_only = (how & 4) != 0;
    const bool by_numbers = (how & 8) != 0 && !stop_only;
    const std::string token = stranger ? "nobody-has-this-token" : token_of(all_roles(false)[role].role);
    const std::uint32_t before = on_.core.peers();
    guest one{.role = role,
              .stop_only = stop_only,
              .by_numbers = by_numbers,
              .link = std::make_unique<harness::peer>(
                  on_, side::server, "10.0.0.7:50000",
                  stop_only ? rowe::service::stop_path : std::string_view{"/"},
                  by_numbers ? numbers::subprotocol : std::string_view{}, token),
              .told = {}};
    cycle(100us);
    const bool in = on_.core.peers() > before;
    require(!in || !stranger || stop_only, "who has no token that is known does not come in");
    if (!in) return one.link->leave(); // or another one has gone meanwhile
    if (!stranger && !stop_only) came_ |= 1U << role;
    guests_.push_back(std::move(one));
  }
  void leave(guest& one) {
    one.link->leave();
    std::erase_if(guests_, [&](const guest& other) { return &other == &one; });
  }
  guest* some(std::size_t which) { return guests_.empty() ? nullptr : &guests_[which % guests_.size()]; }

  void change() {
    changed_ = !changed_;
    on_.set_access(access_of(changed_));
    hear_all();
  }

  // ---- what they say

  void speak(script& s, std::size_t which) {
    guest* const one = some(which);
    if (one == nullptr) return;
    input_choices from{s};
    const std::size_t operation = from.below(swarm::operations().size());
    const swarm::form goes = swarm::operations()[operation].goes;
    if (swarm::speaker_of(goes) == swarm::speaker::thread) return;
    known_.listed = one->told;
    const swarm::recipe what = swarm::choose_recipe(from, all_, operation, 4);
    const swarm::saying said = swarm::render(from, what, known_);
    if (swarm::is_binary(goes)) return one->link->send(rowe::wire::opcode::binary, said.text);
    if (swarm::is_message(goes)) one->link->say(said.text);
  }
  // Answers what this one, or another one, was asked.
  void answer(std::size_t which) {
    guest* const one = some(which);
    if (one == nullptr || asked_.empty()) return;
    one->link->say(R"({"op":"service_response","service":"x","result":true,"values":{"a":1},"id":)" +
                   asked_[which % asked_.size()] + "}");
  }
  // As whoever knows the stop's number and tick would: with those that anybody was told.
  void reset(std::size_t which) {
    guest* const one = some(which);
    if (one == nullptr) return;
    one->link->say(R"({"op":"call_service","service":"/rowe/stop/state"})");
    cycle(1ms);
    hear_all();
    if (number_.empty() || some(which) == nullptr) return;
    some(which)->link->say(R"({"op":"call_service","service":"/rowe/stop/reset","args":{"number":)" +
                           number_ + R"(,"tick":)" + tick_ + "}}");
  }

  // ---- what is heard

  void hear_all() {
    for (guest& one : guests_) {
      for (const std::string& text : one.link->hear()) hear(one, text);
      require(one.link->violated.empty(), "a peer is sent WebSocket frames");
    }
    std::erase_if(guests_, [](const guest& one) {
      const bool closed = one.link->close_code != 0 || one.link->cut();
      if (closed) one.link->leave();
      return closed;
    });
    hear_inbox();
  }
  void hear_inbox() {
    while (const auto slot = on_.inbox.try_receive(on_.now)) {
      if (on_.inbox.header(*slot).what == rowe::detail::entry::message) {
        require(anybody_may(may::publish, ""), "plain messages are of whoever may publish everything");
      } else { // nobody provides it
        const std::string text{on_.inbox.text(*slot)};
        const auto named = rowe::json::find(rowe::json::root(text).raw, "service");
        const bool is_text = named && named->type == rowe::json::kind::string;
        require(anybody_may(may::call, is_text ? text_of(*named) : ""),
                "and a call is of whoever may call it");
      }
      (void)on_.inbox.release(*slot);
    }
  }
  static std::string text_of(const rowe::json::value& from) {
    std::array<char, 512> buffer;
    return std::string{rowe::json::to_string(from, buffer).value_or(std::string_view{})};
  }
  void hear(guest& one, const std::string& frame) {
    if (one.by_numbers) return hear_numbers(one, frame);
    const std::string_view object = rowe::json::root(frame).raw;
    known_.control_tick = std::max(known_.control_tick, swarm::integer_after(frame, R"("tick":)"));
    const auto op = rowe::json::find(object, "op");
    if (!op) return;
    const auto member = [&](std::string_view name) {
      const auto found = rowe::json::find(object, name);
      return found ? text_of(*found) : std::string{};
    };
    const std::string what = text_of(*op);
    if (what == "publish") return hear_topic(one, member("topic"));
    if (what == "call_service") {
      const std::string service = member("service");
      require(allows(one.role, may::provide, service) && !one.stop_only, "who is asked may provide that");
      require(anybody_may(may::call, service), "and somebody may call it");
      if (const auto id = rowe::json::find(object, "id")) asked_.emplace_back(id->raw);
      if (asked_.size() > 8) asked_.erase(asked_.begin());
    }
    if (what == "service_response") hear_answer(one, object);
  }
  void hear_topic(const guest& one, std::string_view topic) {
    if (without_slash(topic) == "rowe/stop/state") return; // is for everyone
    require(!one.stop_only, "who may only stop hears nothing else");
    require(allows(one.role, may::subscribe, topic), "who hears a topic may subscribe to it");
    if (without_slash(topic) == "rowe/stats") return require(one.role == boss, "only whoever sees all");
    require(anybody_may(may::publish, topic), "and somebody may publish on it");
  }
  void hear_answer(const guest& one, std::string_view object) {
    const auto values = rowe::json::find(object, "values");
    if (!values || values->type != rowe::json::kind::object) return;
    if (const auto number = rowe::json::find(values->raw, "number")) number_ = number->raw;
    if (const auto tick = rowe::json::find(values->raw, "tick")) tick_ = tick->raw;
    const auto each = [&](std::string_view list, auto&& claim) {
      const auto found = rowe::json::find(values->raw, list);
      if (!found || found->type != rowe::json::kind::array) return;
      rowe::json::array_walk walk{found->raw};
      for (rowe::json::value name; walk.next(name);) {
        const bool is_row = name.type == rowe::json::kind::object; // of the statistics
        const auto within = is_row ? rowe::json::find(name.raw, "topic") : name;
        if (within) claim(text_of(*within));
      }
    };
    each("topics",
         [&](const std::string& name) { require(sees_topic(one, name), "a list shows what one may see"); });
    each("services",
         [&](const std::string& name) { require(sees_service(one, name), "and what one may call"); });
  }
  static bool sees_topic(const guest& one, std::string_view name) {
    return allows(one.role, may::subscribe, name) || without_slash(name) == "rowe/stop/state";
  }
  static bool sees_service(const guest& one, std::string_view name) {
    return allows(one.role, may::call, name) || without_slash(name).starts_with("rowe/stop");
  }
  void hear_numbers(guest& one, const std::string& frame) {
    if (frame.starts_with('m')) require(!one.told.topics.names().empty(), "a topic's message was asked for");
    if (!swarm::number_lists::is_list(frame)) return;
    require(one.told.take(frame).empty(), "a peer is told of each topic and service once");
    for (const auto& [number, name] : one.told.topics.names())
      require(sees_topic(one, name), "a list by number shows what one may see");
    for (const auto& [number, name] : one.told.services.names())
      require(sees_service(one, name), "and what one may call");
  }

  const std::uint8_t roles_;
  harness::core_harness on_{options_of(), side::server, 1, rowe::rt::time_point{1000s},
                            &numbers::protocols()};
  rowe::stop_latch latch_;
  rowe::subscriber<motion> driven_;
  std::vector<guest> guests_;
  std::vector<std::string> asked_; // ids
  std::string number_, tick_;      // of the stop, as somebody was told last
  std::uint32_t came_ = 0;         // a bit for each role that has been there
  bool changed_ = false;
  std::uint64_t denials_ = 0;
  swarm::weights all_{swarm::rows().size()};
  swarm::knowledge known_;
};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return rowe::fuzz::run<script_run>(data, size, 2048);
}
