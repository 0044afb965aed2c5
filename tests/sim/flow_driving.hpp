// SPDX-License-Identifier: Apache-2.0
// A robot that is driven: loops with leases and a stop latch, and drivers of all kinds
// (flow_driving_peers.hpp) whose links are slow, stall, and break. An operator stops and resets. Both the
// service thread and the loops are late at times. What is true is known (flow_driving_oracle.hpp), so at each
// look of a loop it is checked that the command in force is not too old, is that of who drives, and was sent
// after the newest stop.
#pragma once
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "flow.hpp"
#include "flow_driving_peers.hpp"
#include "flow_driving_robot.hpp"

namespace flow {

class driving final : public world {
 public:
  driving(std::uint64_t seed, swarm::coverage& seen, const std::set<std::string>& without, bool trace)
      : world{seed, options(seed), seen, without, trace},
        roles_{seed % 3 == 0},
        oracle_{on_.now,
                [this](std::string_view invariant, const std::string& what) { fail(invariant, what); }},
        robot_{{on_, oracle_, random_}},
        watcher_{on_, rowe::service::side::server, "127.0.0.1:9", "/", "", token_of("operator")} {
    for (const char* const topic : {"/rowe/control/state", "/rowe/stop/state"})
      watcher_.say(R"({"op":"subscribe","topic":")" + std::string{topic} + "\"}");
    constexpr duration periods[] = {500us, 1ms, 2ms, 5ms};
    period_ = random_.one_of(periods);
    const std::size_t count = 2 + random_.below(5);
    for (std::size_t i = 0; i < count; ++i) add_person(i);
    run(5ms);
    for (auto& one : people_) one->connect(some_latency());
  }

  void finish(std::uint64_t number) override {
    world::finish(number);
    if (!broken()) stand_still();
    if (!broken()) drive_alone();
    for (auto& one : people_) leave(*one, true);
    watcher_.leave();
    for (int i = 0; i < 100 && on_.core.peers() != 0; ++i) cycle(20ms); // what is held comes, too
    if (!broken() && on_.core.peers() != 0) fail("end", std::to_string(on_.core.peers()) + " peers are left");
  }

 private:
  using author = driving_oracle::author;
  using kind = driving_peer::kind;
  using event = swarm::flow_event;
  static std::string token_of(const std::string& who) { return who + "-shows-this-token"; }
  static rowe::endpoint_options options(std::uint64_t seed) {
    auto chosen = harness::small_options();
    chosen.limits.connections_max = 24;
    chosen.limits.handles_max = 14;
    chosen.limits.subscriptions_max = 64;
    if (seed % 2 == 0) chosen.limits.messages_per_second_max = 0;
    chosen.relay = seed % 5 < 3;
    chosen.stop.unguarded = true;
    chosen.stop.service_timeout = 60ms;
    if (seed % 3 != 0) return chosen;
    chosen.access.roles = {
        {.name = "worker", .subscribe = {"/**"}, .publish = {"/**"}, .advertise = {"/**"}, .call = {"/**"}}};
    for (std::size_t i = 0; i < people_max; ++i) {
      const std::string who = "p" + std::to_string(i);
      chosen.access.identities.push_back(
          {who, i % 2 == 0 ? "worker" : "driver", rowe::hash_token(token_of(who))});
    }
    chosen.access.identities.push_back({"operator", "supervisor", rowe::hash_token(token_of("operator"))});
    return chosen;
  }
  static constexpr std::size_t people_max = 8;

  // ---- who is there

  void add_person(std::size_t i) {
    constexpr kind kinds[] = {kind::honest, kind::honest,  kind::old_client, kind::old_client,
                              kind::silent, kind::flooder, kind::usurper,    kind::forger};
    const std::string n = std::to_string(i);
    driving_peer::person who{.is = i == 0 ? kind::honest : random_.one_of(kinds),
                             .topic = robot_.some_topic(),
                             .address = "10.0.0." + n};
    if (who.is != kind::old_client && random_.one_in(2))
      who.name = random_.one_in(3) ? "phone" : "phone-" + n;
    if (roles_) who.token = token_of(who.identity = "p" + n);
    people_.push_back(std::make_unique<driving_peer>(place(), std::move(who)));
    if (people_.back()->is().is == kind::silent && random_.one_in(2)) people_.back()->answer_pings(false);
  }
  driving_peer::place place() { return {on_, oracle_, random_, seen_}; }
  driving_peer& some_peer() { return *people_[random_.below(people_.size())]; }
  duration some_latency() {
    constexpr duration latencies[] = {0ms, 0ms, 1ms, 3ms, 10ms, 40ms, 150ms};
    return random_.one_of(latencies);
  }

  // ---- steps

  void act() override {
    driving_peer& one = some_peer();
    switch (random_.below(20)) {
    case 0: one.connected() ? leave(one, !random_.one_in(3)) : one.connect(some_latency()); break;
    case 1:
    case 2:
    case 3:
      if (!one.connected()) one.connect(some_latency());
      break;
    case 4:
    case 5: stall(one); break;
    case 6:
      if (one.connected()) one.link()->latency = some_latency();
      break;
    case 7:
    case 8: one.drive(!one.drives()); break;
    case 9: stop(); break;
    case 10: drives_itself_ = random_.one_in(3); break;
    case 11: service_late_until_ = on_.now + 5ms + some_of(random_.one_in(4) ? 120ms : 45ms); break;
    case 12: robot_.be_late(some_of(150ms)); break;
    case 13:
      if (random_.one_in(4)) one.answer_pings(random_.one_in(2));
      break;
    case 14:
      if (random_.one_in(6)) stand_still();
      break;
    case 15:
      if (random_.one_in(8)) drive_alone();
      break;
    default: break;
    }
    run(10ms + some_of(30ms));
    check_structures();
  }

  void leave(driving_peer& one, bool told) {
    if (!one.connected()) return;
    say("connection " + std::to_string(one.who()) + (told ? " is over" : " is left open"));
    left_.push_back(one.cut(told));
    left_.back()->over = told ? on_.now : on_.now + some_of(3000ms);
  }
  void stall(driving_peer& one) {
    if (!one.connected() || on_.now < one.link()->held_until) return;
    one.link()->held_until = on_.now + 10ms + some_of(random_.one_in(3) ? 1500ms : 300ms);
    if (oracle_.driver(one.is().topic) == one.who()) seen_.add(event::drive_stalled);
    say("connection " + std::to_string(one.who()) + " is held");
  }
  void stop() {
    driving_peer& one = some_peer();
    say("a stop");
    constexpr std::string_view text = R"({"op":"call_service","id":"s","service":"/rowe/stop"})";
    random_.one_in(2) && one.connected() ? one.link()->peer.say(text) : watcher_.say(text);
    resets_at_ = on_.now + some_of(500ms);
  }
  void reset_if_due() {
    if (!oracle_.stopped() || on_.now < resets_at_ || stop_number_ < 0) return;
    resets_at_ = on_.now + 20ms;
    watcher_.say(R"({"op":"call_service","id":"r","service":"/rowe/stop/reset","args":{"number":)" +
                 std::to_string(stop_number_) + R"(,"tick":)" + std::to_string(stop_tick_) + "}}");
  }

  // ---- time

  void run(duration time) {
    for (const time_point end = on_.now + time; on_.now < end && !broken();) moment();
  }
  // A moment of everybody's: what they say, a cycle of the core if it is due, and looks of the loops.
  void moment() {
    on_.now += 100us * (1 + random_.below(10));
    if (!quiet_) {
      for (auto& one : people_) one->act();
      publish_if_due();
    }
    if (alone_) alone_->act();
    reset_if_due();
    if (on_.now >= next_cycle_ && on_.now >= service_late_until_) core_cycle();
    robot_.look([this](std::int64_t n) { note_obeyed(oracle_.author_of(n)); });
  }
  void core_cycle() {
    next_cycle_ = on_.now + period_;
    const bool was_stopped = oracle_.stopped();
    (void)on_.core.cycle(on_.now);
    oracle_.note_permit(on_.shared.permit.read(), on_.now);
    if (was_stopped && !oracle_.stopped()) note_reset();
    for (const std::string& text : watcher_.hear()) take(text);
    for (auto& one : people_) {
      if (!one->read()) lose(*one);
    }
    if (alone_ && !alone_->read()) fail("drive_alone", "an honest driver was disconnected");
    for (auto& one : left_) {
      if (one->over <= on_.now && !std::exchange(one->told, true))
        one->peer.leave(rowe::service::close_cause::reset);
      if (on_.net.closed_by_us(one->peer.id())) oracle_.note_gone(one->author, on_.now);
    }
    std::erase_if(left_, [this](const auto& one) { return oracle_.gone(one->author); });
    robot_.check_cycle();
    check_rights();
    note_events();
  }
  // The core has closed it.
  void lose(driving_peer& one) {
    oracle_.note_gone(one.who(), on_.now);
    (void)one.cut(false);
  }
  void publish_if_due() {
    if (!drives_itself_ || on_.now < own_next_) return;
    own_next_ = on_.now + 5ms + some_of(100ms);
    robot_.publish();
  }

  // ---- what the core says

  void take(const std::string& text) {
    if (text.find(R"("topic":"/rowe/stop/state")") != std::string::npos) {
      stop_number_ = swarm::integer_after(text, R"("number":)");
      stop_tick_ = swarm::integer_after(text, R"("tick":)");
    }
    if (text.find(R"("topic":"/rowe/control/state")") == std::string::npos) return;
    oracle_.note_tick(swarm::integer_after(text, R"("tick":)"), on_.now);
    for (const std::string& topic : robot_.topics()) {
      const auto at = text.find(R"("topic":")" + topic + R"(","lease_ms")");
      if (at == std::string::npos) continue;
      const std::string_view row = std::string_view{text}.substr(at);
      const auto driver = row.find(R"("driver":)") + 9;
      const auto number = swarm::integer_after(row, R"("number":)");
      const author before = oracle_.driver(topic);
      const std::string name{row.substr(driver, row.find(R"(,"number")") - driver)};
      if (number != oracle_.number(topic)) {
        say(topic + ": " + name + " drives under number " + std::to_string(number));
        given_.push_back({topic, name});
      }
      oracle_.note_state(topic, number, name, on_.now);
      if (before != driving_oracle::nobody && !oracle_.driven(topic)) note_end(topic, before);
    }
  }
  void note_end(const std::string& topic, author who) {
    say(topic + ": nobody drives");
    if (!oracle_.gone(who) && on_.now - oracle_.newest(who, topic) >= oracle_.hold(topic))
      seen_.add(event::drive_lost);
  }
  // Who has been given control since the last cycle: p0, p2 and so on may not take over.
  void check_rights() {
    for (const auto& [topic, name] : given_) {
      if (!oracle_.took_over(topic)) continue;
      const bool may = !roles_ || !name.starts_with("\"p") || (name[2] - '0') % 2 != 0;
      if (!may) fail("drive_right", name + " has taken over " + topic + ", and its role may not");
    }
    given_.clear();
  }
  void note_events() {
    for (const auto& one : people_) {
      const auto told = one->answered();
      const std::pair<bool, event> all[] = {
          {told.taken, event::drive_taken},       {told.taken_over, event::drive_taken_over},
          {told.released, event::drive_released}, {told.driven, event::drive_driven},
          {told.pause, event::drive_pause},       {told.role, event::drive_no_right},
          {told.tick, event::drive_old_tick},     {told.action, event::drive_no_action}};
      for (const auto& [happened, what] : all)
        if (happened) seen_.add(what);
      flushed_ = flushed_ || one->flushed() != 0;
    }
    const std::pair<counter, event> counted[] = {{counter::commands_stale, event::drive_stale},
                                                 {counter::commands_unproven, event::drive_unproven},
                                                 {counter::commands_refused, event::drive_refused},
                                                 {counter::commands_stopped, event::drive_stopped}};
    const std::uint64_t expired = on_.count(counter::expired);
    if (expired != std::exchange(expired_, expired)) seen_.add(event::drive_expired);
    for (std::size_t i = 0; i < std::size(counted); ++i) {
      const std::uint64_t now = on_.count(counted[i].first);
      if (now == std::exchange(dropped_[i], now)) continue;
      seen_.add(counted[i].second);
      if (std::exchange(flushed_, false)) seen_.add(event::drive_flushed);
    }
  }
  void note_reset() {
    for (auto& one : people_) {
      if (one->connected() && on_.net.unread(one->link()->peer.id()) != 0)
        seen_.add(event::drive_reset_between);
    }
  }

  void note_obeyed(author who) {
    if (who == driving_oracle::this_process) return seen_.add(event::drive_own);
    for (const auto& one : people_) {
      if (one->who() == who)
        seen_.add(one->is().is == kind::old_client ? event::drive_without_ticks : event::drive_obeyed);
    }
  }
  // ---- what must happen at last

  // Nobody says anything any more. What is under way still comes.
  void stand_still() {
    quiet_ = true;
    const time_point newest = oracle_.newest();
    duration lease{}, hold{};
    for (const std::string& topic : robot_.topics()) {
      lease = std::max(lease, oracle_.lease(topic));
      hold = std::max(hold, oracle_.hold(topic));
    }
    service_late_until_ = on_.now;
    robot_.be_in_time();
    const time_point begin = std::max(newest + lease, on_.now) + driven_robot::looks_every_max + 1ms;
    const time_point end = std::max(newest + hold + 2 * period_, begin) + 1ms;
    while (on_.now < end && !broken()) {
      moment();
      if (on_.now < begin) continue;
      for (const std::string& topic : robot_.topics()) {
        if (robot_.any_acts(topic))
          fail("drive_still", "a loop of " + topic + " moves, and nobody has said anything since the lease");
      }
    }
    for (const std::string& topic : robot_.topics()) {
      if (oracle_.driven(topic))
        fail("drive_still",
             topic + " is driven, and nobody has said anything for so long as control is kept");
    }
    seen_.add(event::drive_still);
    quiet_ = false;
  }

  // An honest driver, while others are silent, or gone: then nobody drives from now on.
  void drive_alone() {
    const bool others_stay = random_.one_in(2);
    quiet_ = true;
    if (!others_stay)
      for (auto& one : people_) leave(*one, true);
    for (auto& one : left_) one->over = std::min(one->over, on_.now);
    service_late_until_ = on_.now;
    resets_at_ = on_.now;
    const std::string topic = robot_.some_topic();
    // What the others have said before comes first, and they keep control for a while. So does this process.
    const time_point calm = std::max(oracle_.newest(), on_.now) + under_way_max;
    while ((on_.now < calm || oracle_.stopped()) && !broken()) {
      moment();
      if (on_.now > calm + 1s) fail("drive_alone", "the robot is not let go");
    }
    driving_peer::person who{.is = kind::honest, .topic = topic, .address = "10.0.0.50", .name = "alone"};
    if (roles_) who.token = token_of(who.identity = "operator");
    alone_ = std::make_unique<driving_peer>(place(), std::move(who));
    alone_->connect(some_of(5ms));
    const time_point begin = on_.now;
    while (!robot_.all_act(topic) && !broken()) {
      moment();
      if (on_.now - begin > 1s)
        fail("drive_alone", "an honest driver of " + topic + " is not obeyed within a second");
    }
    if (!broken()) seen_.add(event::drive_alone);
    left_.push_back(alone_->cut(true));
    left_.back()->over = on_.now;
    alone_ = nullptr;
    quiet_ = false;
  }
  static constexpr duration under_way_max = 2200ms;

  const bool roles_;
  driving_oracle oracle_;
  driven_robot robot_;
  swarm::far_end watcher_; // the operator's
  std::vector<std::unique_ptr<driving_peer>> people_;
  std::unique_ptr<driving_peer> alone_;
  std::vector<std::unique_ptr<driving_link>> left_; // their peers are gone
  duration period_ = 1ms;                           // of the core
  time_point next_cycle_{}, service_late_until_{}, own_next_{}, resets_at_{};
  std::int64_t stop_number_ = -1, stop_tick_ = 0;
  std::vector<std::pair<std::string, std::string>> given_; // control of a topic, to whom
  std::array<std::uint64_t, 4> dropped_{};
  std::uint64_t expired_ = 0;
  bool flushed_ = false; // what was said without a connection
  bool drives_itself_ = false;
  bool quiet_ = false;
};

} // namespace flow
