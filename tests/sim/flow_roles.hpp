// SPDX-License-Identifier: Apache-2.0
// A hub whose peers have roles. They come and go with all kinds of tokens, and ask for what is their right
// and for what is not, in both codecs, while the policy changes. What it allows is written once more, by hand
// (flow_policies.hpp), so the policy is not compared with itself. What is denied must leave no trace: nobody
// hears it, and it changes neither who provides a service nor the stop. What they are told that they may do
// is that, however they ask (flow_rights.hpp).
#pragma once
#include <algorithm>
#include <array>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/access.hpp>
#include <rowe/stop_latch.hpp>

#include "json/reading/reader.hpp"

#include "flow.hpp"
#include "flow_policies.hpp"
#include "flow_rights.hpp"
#include "flow_roles_texts.hpp"

namespace flow {

class roles final : public world {
 public:
  roles(std::uint64_t seed, swarm::coverage& seen, const std::set<std::string>& without, bool trace)
      : world{seed, options(seed), seen, without, trace},
        policy_{seed},
        asking_{seed},
        loop_{on_.offer(rowe::detail::latch_request({.name = "loop", .loop_timeout = 10s}))} {
    cycle(1ms);
    latch_.emplace(harness::core_harness::handle_of(loop_));
    (void)on_.inbox.try_receive(on_.now); // somebody takes plain messages
    watcher_ = &come(supervisor);
    guest& provider = come(peer_role);
    for (const char* const topic : topics) watcher_->link->say(subscribe(topic));
    for (const char* const service : services) provider.link->say(provide(service));
    settle();
  }

  void finish(std::uint64_t number) override {
    world::finish(number);
    settle();
    for (guest& one : guests_) one.link->leave();
    for (int i = 0; i < 5; ++i) cycle(20ms);
    if (!broken() && on_.core.peers() != 0) fail("end", std::to_string(on_.core.peers()) + " peers are left");
  }

 private:
  static constexpr const char* topics[] = {"/cmd", "/arm/a", "/arm/b/c", "/odom"};
  static constexpr const char* services[] = {"/go", "/arm/open", "/arm/b/close"};
  static constexpr std::size_t guests_max = 6; // besides the two that stay
  struct guest : ticket {
    std::unique_ptr<harness::peer> link;
  };

  static std::string name_of(const guest& one) {
    return std::string{one.is == nobody ? std::string_view{"nobody"} : role_names[one.is]};
  }
  static rowe::endpoint_options options(std::uint64_t seed) {
    auto chosen = harness::small_options();
    chosen.limits.connections_max = 16;
    chosen.limits.refusals_per_second_max = 0;
    chosen.limits.messages_per_second_max = 0;
    chosen.limits.advertisements_per_connection_max = 8;
    chosen.relay = true;
    chosen.stop.unguarded = true;
    chosen.access = policies{seed}.options();
    return chosen;
  }

  // ---- who comes

  struct visit {
    ticket by;
    std::string token;
    std::string_view address;
    bool in = false; // it is let in
  };
  visit some_visit() {
    const bool local = random_.one_in(3);
    visit made{.by = {.stop_only = random_.one_in(3)},
               .token = {},
               .address = local ? "127.0.0.1:50000" : "10.0.0.7:50000"};
    made.in = made.by.stop_only && policy_.anonymous_may_stop();
    switch (random_.below(4)) {
    case 0: // none
      if (local && policy_.local() != nobody) {
        made.by.is = policy_.local();
        made.in = true;
      }
      break;
    case 1: made.token = "nobody-has-this-token"; break;
    default:
      const auto which = static_cast<role>(random_.below(role_names.size()));
      made.token = policy_.token_of(which);
      if (policy_.number_of_token(which) == 0) break; // it was taken away
      made.by.is = which;
      made.by.token = policy_.number_of_token(which);
      made.in = true;
    }
    return made;
  }
  std::unique_ptr<harness::peer> link(const visit& made) {
    return std::make_unique<harness::peer>(on_, rowe::service::side::server, made.address, path_of(made), "",
                                           made.token);
  }
  static std::string_view path_of(const visit& made) {
    return made.by.stop_only ? rowe::service::stop_path : std::string_view{"/"};
  }
  void come_or_not() {
    const visit made = some_visit();
    const std::uint32_t before = on_.core.peers();
    guests_.push_back({made.by, link(made)});
    cycle(1ms);
    const bool in = on_.core.peers() > before;
    say(made.token + " at " + std::string{path_of(made)} + (in ? " is in" : " is not let in"));
    if (in != made.in)
      fail("admitted", "a peer with the token `" + made.token + "` from " + std::string{made.address} +
                           " on " + std::string{path_of(made)} + (in ? " is let in" : " is not let in"));
    seen_.add(in ? (made.by.token == 0 ? flow_event::role_without_token : flow_event::role_by_token)
                 : flow_event::role_not_admitted);
    if (!in) guests_.pop_back();
  }
  guest& come(role who) {
    const visit made{
        .by = {.is = who, .token = 1}, .token = policy_.token_of(who), .address = "10.0.0.7:50000"};
    guests_.push_back({made.by, link(made)});
    cycle(1ms);
    return guests_.back();
  }

  // ---- the policy changes

  void change() {
    settle();
    std::optional<harness::peer> late; // asked who it is by the old policy, and connected under the new one
    if (random_.one_in(3)) {
      on_.net.handshakes_last(1);
      late.emplace(on_, rowe::service::side::server, "10.0.0.7:50000", "/", "", policy_.token_of(supervisor));
      cycle(1ms);
      on_.net.handshakes_last(0);
    }
    policy_.change(random_);
    on_.offer_access(policy_.options());
    for (guest& one : guests_) // read in the cycle in which the rights are taken
      if (one.is == arm && !one.stop_only) one.link->say(R"({"op":"publish","topic":"/cmd","msg":{"n":0}})");
    cycle(1ms);
    const auto heard_before = on_.count(counter::denied);
    for (guest& one : guests_) expect_judged(one);
    say("the policy has changed; " + std::to_string(on_.count(counter::denied) - heard_before) + " denied");
    std::erase_if(guests_, [](const guest& one) { return one.link->close_code != 0; });
    settle();
    if (late) {
      (void)late->hear();
      if (late->close_code != 1013) fail("revoked", "a peer that the old policy let in is connected");
      seen_.add(flow_event::role_late);
    }
  }
  void expect_judged(guest& one) {
    const policies::outcome expected = policy_.judge(one);
    for (std::string& text : one.link->hear()) heard_.push_back(std::move(text));
    if (one.link->close_reason != expected.closed)
      fail("revoked", name_of(one) + (expected.closed.empty() ? " was closed: " : " was not closed: ") +
                          (expected.closed.empty() ? one.link->close_reason : std::string{expected.closed}));
    seen_.add(expected.closed.empty() ? flow_event::role_kept : flow_event::role_revoked);
    one.is = expected.is;
    if (expected.closed.empty() && expected.is == nobody) one.token = 0;
  }
  // What a peer is shown is what it may subscribe to.
  void look() {
    guest& by = some_guest();
    if (by.stop_only || (by.is != arm && by.is != observer)) return;
    by.link->say(R"({"op":"call_service","id":"k","service":"/rosapi/topics"})");
    settle();
    const auto listed = std::find_if(heard_.begin(), heard_.end(), [](const std::string& one) {
      return one.find(R"("id":"k")") != std::string::npos && one.find(R"("topics":[)") != std::string::npos;
    });
    if (listed == heard_.end()) return fail("seen", name_of(by) + " is told no list");
    for (const char* const topic : topics) {
      const bool shown = listed->find('"' + std::string{topic} + '"') != std::string::npos;
      if (shown != policy_.may(by.is, verb::subscribe, topic))
        fail("seen", name_of(by) + (shown ? " sees " : " does not see ") + topic);
    }
    seen_.add(flow_event::role_looks);
  }

  // ---- what they say

  void ask() {
    guest& by = some_guest();
    if (by.stop_only) return;
    const auto what = static_cast<verb>(random_.below(6));
    std::string_view name;
    if (what == verb::call || what == verb::provide)
      name = services[random_.below(std::size(services))];
    else if (what != verb::plain)
      name = topics[random_.below(std::size(topics))];
    if (what == verb::subscribe && random_.one_in(4)) name = "/rowe/stats";
    const bool allowed = policy_.may(by.is, what, what == verb::provide && by.is == arm ? "/new" : name);
    const std::int64_t number = ++number_;
    const std::string text = text_of(what, name, number, random_);
    const auto denied_before = on_.count(counter::denied);
    say(name_of(by) + " says " + text);
    by.link->say(text);
    settle();
    const bool was_denied = on_.count(counter::denied) != denied_before;
    if (was_denied == allowed)
      fail("denied", name_of(by) + (allowed ? " was denied: " : " was allowed: ") + text);
    seen_.add(allowed ? flow_event::role_allowed : denied(what));
    const bool leaves_trace = what == verb::publish || what == verb::call || what == verb::plain;
    if (leaves_trace && has_number(heard_, number) != allowed)
      fail("denied",
           name_of(by) + (allowed ? " said in vain: " : " was heard, though it had no right: ") + text);
    if (what != verb::provide) return;
    if (!allowed && provides(by, "/new" + std::string{name}))
      fail("denied", "a peer without that right provides a service: " + text);
  }
  static flow_event denied(verb what) {
    return static_cast<flow_event>(static_cast<std::size_t>(flow_event::role_denied_subscribe) +
                                   static_cast<std::size_t>(what));
  }
  // Whether calls of the service reach this peer.
  bool provides(guest& one, const std::string& service) {
    watcher_->link->say(R"({"op":"call_service","id":"w","service":")" + service + R"(","args":{}})");
    cycle(1ms);
    cycle(1ms);
    const auto asked = one.link->hear();
    return std::any_of(asked.begin(), asked.end(), [&](const std::string& text) {
      return text.find("call_service") != std::string::npos && text.find(service) != std::string::npos;
    });
  }

  void ask_for_rights() {
    std::vector<guest*> all;
    for (guest& one : guests_)
      if (!one.stop_only) all.push_back(&one);
    guest& by = *all[asking_.below(all.size())];
    const auto asked = asking_.ask(on_.options.limits);
    if (!asked) return;
    settle();
    const auto denied_before = on_.count(counter::denied);
    say(name_of(by) + " asks " + swarm::shortened(asked->text));
    by.link->say(asked->text);
    std::vector<std::string> heard;
    for (int i = 0; i < 2; ++i) {
      cycle(1ms);
      for (std::string& text : by.link->hear()) {
        answer(by, text);
        heard.push_back(std::move(text));
      }
    }
    if (on_.count(counter::denied) != denied_before) fail("rights", name_of(by) + " is denied an answer");
    const std::string identity = by.token == 0 ? std::string{} : name_of(by);
    const auto [wrong, answered] = rights_questions::judge(
        *asked, heard, name_of(by), identity,
        [&](std::string_view right, std::string_view name) { return policy_.is_told(by.is, right, name); });
    if (!wrong.empty()) fail("rights", name_of(by) + wrong + swarm::shortened(asked->text));
    if (!answered) return seen_.add(flow_event::rights_refused);
    seen_.add(static_cast<flow_event>(static_cast<std::size_t>(flow_event::rights_of_observer) +
                                      static_cast<std::size_t>(by.is)));
    if (by.token == 0) seen_.add(flow_event::rights_by_address);
  }

  // ---- the stop

  bool moves() {
    const bool engaged = latch_->engaged(on_.now);
    if (engaged) latch_->acknowledge(on_.now);
    cycle(1ms);
    return !engaged;
  }
  void stop() {
    guest& by = some_guest();
    say("a stop");
    by.link->say(random_.one_in(2) ? R"({"op":"call_service","id":"s","service":"/rowe/stop"})"
                                   : R"({"service":"/rowe/stop","message_id":1})");
    settle();
    if (moves()) fail("stop", "a peer that is let in said stop, and the loop moves");
    seen_.add(flow_event::role_stopped);
  }
  std::string member_of_state(std::string_view name) {
    (void)watcher_->link->hear();
    watcher_->link->say(R"({"op":"call_service","service":"/rowe/stop/state"})");
    cycle(1ms);
    for (const std::string& one : watcher_->link->hear()) {
      const auto values = rowe::json::find(rowe::json::root(one).raw, "values");
      const auto found = values ? rowe::json::find(values->raw, name) : std::nullopt;
      if (found) return std::string{found->raw};
    }
    return "0";
  }
  void reset() {
    guest& by = random_.one_in(3) ? *watcher_ : some_guest();
    if (by.stop_only || moves()) return;
    (void)moves(); // it acknowledges
    const std::string number = member_of_state("number");
    by.link->say(R"({"op":"call_service","service":"/rowe/stop/reset","args":{"number":)" + number +
                 R"(,"tick":)" + member_of_state("tick") + "}}");
    cycle(1ms);
    const bool let_go = moves();
    say(name_of(by) + (let_go ? " let go" : " did not let go"));
    if (let_go && by.is != supervisor) fail("reset", "a role that may not reset let the loop go");
    seen_.add(let_go ? flow_event::role_reset : flow_event::role_not_reset);
    settle();
  }
  // With a tick that is too old, so that it fails in any case: what counts is for which reason.
  void heartbeat() {
    guest& by = random_.one_in(3) ? *watcher_ : some_guest();
    if (by.stop_only) return;
    const bool resigns = random_.one_in(2);
    by.link->say(R"({"op":"call_service","id":"l","service":"/rowe/stop/guard",)"
                 R"("args":{"guard":"panel","tick":1)" +
                 std::string{resigns ? R"(,"resign":true)" : ""} + "}}");
    settle();
    const bool refused = std::any_of(heard_.begin(), heard_.end(), [](const std::string& one) {
      return one.find(R"("refused":"role")") != std::string::npos;
    });
    const bool allowed = by.is == supervisor || (by.is == guard && !resigns);
    if (refused == allowed)
      fail("guard",
           name_of(by) + (resigns ? " ends a guard" : " guards") + (allowed ? ": refused" : ": allowed"));
    seen_.add(allowed ? flow_event::role_guards : flow_event::role_guards_not);
  }

  // ---- steps

  void act() override {
    for (int i = 0; i < 4 && !broken(); ++i) {
      switch (random_.below(14)) {
      case 0: leave(); break;
      case 1:
      case 2:
        if (guests_.size() < guests_max + 2) come_or_not();
        break;
      case 3: stop(); break;
      case 4:
      case 5: reset(); break;
      case 6: heartbeat(); break;
      case 7: look(); break;
      case 8: change(); break;
      default: ask(); break;
      }
    }
    if (!broken()) ask_for_rights();
  }
  guest& some_guest() { return *std::next(guests_.begin(), static_cast<int>(random_.below(guests_.size()))); }
  void leave() {
    if (guests_.size() <= 2) return;
    const auto which = std::next(guests_.begin(), 2 + static_cast<int>(random_.below(guests_.size() - 2)));
    which->link->leave();
    cycle(1ms);
    guests_.erase(which);
  }
  // Until all that was said has arrived; the provider answers what it is asked.
  void settle() {
    heard_.clear();
    for (int i = 0; i < 3; ++i) {
      cycle(1ms);
      while (const auto slot = on_.inbox.try_receive(on_.now)) {
        heard_.emplace_back(on_.inbox.text(*slot));
        (void)on_.inbox.release(*slot);
      }
      for (guest& one : guests_) {
        for (const std::string& text : one.link->hear()) {
          heard_.push_back(text);
          answer(one, text);
        }
      }
    }
  }
  void answer(guest& one, const std::string& text) {
    const auto id = rowe::json::find(rowe::json::root(text).raw, "id");
    const auto service = rowe::json::find(rowe::json::root(text).raw, "service");
    const auto op = rowe::json::find(rowe::json::root(text).raw, "op");
    if (!id || !service || !op || op->raw != "\"call_service\"") return;
    one.link->say(R"({"op":"service_response","id":)" + std::string{id->raw} + R"(,"service":)" +
                  std::string{service->raw} + R"(,"values":{},"result":true})");
  }

  policies policy_;
  rights_questions asking_;
  rowe::detail::queue_pair& loop_;
  std::optional<rowe::stop_latch> latch_;
  std::list<guest> guests_; // the first two stay
  guest* watcher_ = nullptr;
  std::int64_t number_ = 0;
  std::vector<std::string> heard_;
};

} // namespace flow
