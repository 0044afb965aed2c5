// SPDX-License-Identifier: Apache-2.0
// Who drives in a world of drivers (flow_driving.hpp), and the links between. Honest drivers take control,
// send commands with ticks, and let go. Those of old clients know nothing of ticks: their commands wait while
// there is no connection, and are sent all at once when there is one again. Others take control and say
// nothing, say ten commands a millisecond, take over in turn, or make up what they say.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "flow_driving_oracle.hpp"

namespace flow {

// One connection, with what it does to bytes. Held: nothing arrives, either way; later all does, in order.
struct driving_link {
  driving_link(swarm::core_harness& on, std::string_view address, std::string_view token)
      : peer{on, rowe::service::side::server, address, "/", "", token} {
    auto& conditions = on.net.link_of(peer.id());
    const auto arrival = [this](time_point sent) { return std::max(sent + latency, held_until); };
    conditions.to_us = arrival;
    conditions.to_peer = arrival;
  }
  swarm::far_end peer;
  duration latency{};
  time_point held_until{};
  driving_oracle::author author = driving_oracle::nobody;
  // When its peer is gone:
  bool told = false;                 // the core
  time_point over = rowe::rt::never; // when it will be
};

class driving_peer {
 public:
  enum class kind : std::uint8_t { honest, old_client, silent, flooder, usurper, forger };
  static constexpr std::size_t kinds = 6;
  using author = driving_oracle::author;

  struct place { // what they share
    swarm::core_harness& on;
    driving_oracle& oracle;
    swarm::seeded_choices& random;
    swarm::coverage& seen;
  };
  struct person {
    kind is = kind::honest;
    std::string topic;
    std::string address;             // without its port
    std::string identity{}, token{}; // where there are roles
    std::string name{};              // its own; empty: none
  };

  driving_peer(const place& in, person who) : in_{in}, who_{std::move(who)} {}

  // ---- the network

  bool connected() const { return link_ != nullptr; }
  driving_link* link() { return link_.get(); }
  author who() const { return link_ ? link_->author : driving_oracle::nobody; }
  const person& is() const { return who_; }

  void connect(duration latency) {
    const std::string address = who_.address + ':' + std::to_string(++connections_);
    link_ = std::make_unique<driving_link>(in_.on, address, who_.token);
    const std::string shown = who_.identity.empty() ? address : who_.identity;
    link_->author = in_.oracle.add_author(who_.name.empty() ? shown : "");
    link_->latency = latency;
    link_->peer.answers_pings = answers_pings_;
    newest_tick_ = -1;
    mine_ = false;
    babbles_ = who_.is == kind::forger && in_.random.one_in(2);
    // So long that other pings are answered before.
    const duration later = some_of(in_.random.one_in(2) ? 200ms : 3000ms);
    flushes_at_ = in_.on.now + (in_.random.one_in(2) ? duration{} : later);
    if (who_.is != kind::old_client || in_.random.one_in(2))
      say(R"({"op":"subscribe","topic":"/rowe/control/state"})");
    if (in_.random.one_in(2))
      say(R"({"op":"advertise","topic":")" + who_.topic + R"(","type":"sim/Driven"})");
  }
  // The connection is over for this side. The core hears of it, or is left to find out.
  std::unique_ptr<driving_link> cut(bool told) {
    if (told) {
      if (in_.oracle.driver(who_.topic) == who()) in_.seen.add(swarm::flow_event::drive_cut);
      link_->peer.leave(rowe::service::close_cause::reset);
      link_->told = true;
    }
    return std::exchange(link_, nullptr);
  }

  // ---- what it wants

  void answer_pings(bool whether) {
    answers_pings_ = whether;
    if (link_) link_->peer.answers_pings = whether;
  }
  // Begins to drive, or ends it.
  void drive(bool whether) {
    if (wants_ && !whether && link_ && who_.is == kind::honest) release();
    wants_ = whether;
  }
  bool drives() const { return wants_; }
  std::int64_t newest_tick() const { return newest_tick_; }

  // ---- each moment

  // Reads what has come. False: the core has closed the connection.
  bool read() {
    if (!link_) return true;
    for (const std::string& text : link_->peer.hear()) take(text);
    return !link_->peer.cut();
  }
  void act() {
    if (!link_) {
      if (wants_ && who_.is == kind::old_client && due(next_command_, 50ms))
        waiting_.push_back(in_.oracle.say(driving_oracle::nobody, who_.topic, in_.on.now, -1));
      return;
    }
    if (!waiting_.empty() && in_.on.now >= flushes_at_) flush();
    if (!wants_) return;
    switch (who_.is) {
    case kind::honest: return act_honestly();
    case kind::old_client:
      if (waiting_.empty() && due(next_command_, 50ms)) say(command_text({}));
      return;
    case kind::silent:
      if (due(next_request_, 200ms + some_of(2500ms))) request("take");
      return;
    case kind::flooder:
      for (int i = 0; i < 5; ++i) say(command_text(with_ticks_ ? std::optional{newest_tick_} : std::nullopt));
      if (in_.oracle.driver(who_.topic) == who()) in_.seen.add(swarm::flow_event::drive_flood);
      if (in_.random.one_in(400)) with_ticks_ = !with_ticks_;
      return;
    case kind::usurper:
      if (due(next_request_, 50ms + some_of(1500ms))) request("take_over");
      if (mine_ && due(next_command_, 20ms)) say(command_text(newest_tick_));
      return;
    case kind::forger:
      if (due(next_command_, 1ms + some_of(40ms))) forge();
      return;
    }
  }
  void request(std::string_view action) { request(action, newest_tick_, who_.name); }
  void release() {
    in_.oracle.release(who(), who_.topic, in_.on.now);
    request("release");
  }
  void command() { say(command_text(newest_tick_)); }
  std::size_t flushed() { return std::exchange(flushed_, 0); }

  // Of the answers since it was asked last.
  struct answers {
    bool taken = false, taken_over = false, released = false;
    bool driven = false, pause = false, role = false, tick = false, topic = false, action = false;
  };
  answers answered() { return std::exchange(answers_, {}); }

 private:
  duration some_of(duration most) {
    return 1us * static_cast<std::int64_t>(in_.random.below(static_cast<std::uint64_t>(most / 1us)));
  }
  // Whether it is time; then it is time again after `period`.
  bool due(time_point& next, duration period) {
    if (in_.on.now < next) return false;
    next = in_.on.now + period;
    return true;
  }
  void say(const std::string& text) { link_->peer.say(text); }

  // A command that is given now.
  std::string command_text(std::optional<std::int64_t> tick) {
    return command_text(in_.oracle.say(who(), who_.topic, in_.on.now, tick.value_or(-1)), tick);
  }
  std::string command_text(std::int64_t n, std::optional<std::int64_t> tick) const {
    std::string text =
        R"({"op":"publish","topic":")" + who_.topic + R"(","msg":{"n":)" + std::to_string(n) + '}';
    if (tick && *tick >= 0) text += R"(,"tick":)" + std::to_string(*tick);
    if (const duration ttl = driving_oracle::ttl(n); ttl != rowe::rt::for_ever)
      text += R"(,"ttl_ms":)" + std::to_string(ttl / 1ms);
    return text + '}';
  }
  void flush() {
    flushed_ = waiting_.size();
    for (const std::int64_t n : waiting_) {
      in_.oracle.give(n, who(), who_.topic);
      say(command_text(n, {}));
    }
    waiting_.clear();
  }

  void request(std::string_view action, std::int64_t tick, std::string_view name) {
    if (action != "release") in_.oracle.ask(who(), who_.topic, in_.on.now, tick);
    const std::string id = std::string{action == "take_over" ? "o" : action == "release" ? "r" : "t"};
    std::string args = R"("topic":")" + who_.topic + R"(","action":")" + std::string{action} + '"';
    if (tick >= 0) args += R"(,"tick":)" + std::to_string(tick);
    if (!name.empty()) args += R"(,"name":")" + std::string{name} + '"';
    say(R"({"op":"call_service","id":")" + id + R"(","service":"/rowe/control","args":{)" + args + "}}");
  }

  // Takes control, keeps it, and drives with the newest tick it has.
  void act_honestly() {
    if (newest_tick_ < 0) return;
    if (due(next_request_, mine_ ? 500ms : 300ms)) {
      if (!mine_ || in_.random.one_in(2)) request("take");
    }
    if (mine_ && (std::exchange(fresh_, false) || in_.on.now >= next_command_)) {
      next_command_ = in_.on.now + 50ms;
      command();
    }
  }

  // No loop can read it, so nobody drives by it.
  void babble() {
    constexpr const char* msgs[] = {R"({"n":"x"})", "{}", R"({"n":1e999})", R"({"n":null})", "[1]"};
    say(R"({"op":"publish","topic":")" + who_.topic + R"(","msg":)" + in_.random.one_of(msgs) +
        R"(,"tick":)" + std::to_string(newest_tick_) + '}');
  }
  void forge() {
    babbles_ = babbles_ && !in_.random.one_in(100);
    if (babbles_) return babble();
    const std::int64_t old = old_ticks_.empty() ? 5 : old_ticks_[in_.random.below(old_ticks_.size())];
    const auto ahead = static_cast<std::int64_t>(1 + in_.random.below(in_.random.one_in(2) ? 40 : 2000));
    switch (in_.random.below(12)) {
    case 0:
    case 1: return say(command_text(old));
    case 2:
    case 3:
      if (newest_tick_ >= 0) in_.seen.add(swarm::flow_event::drive_forged);
      return say(command_text(newest_tick_ < 0 ? 0 : newest_tick_ + ahead));
    case 4: return release();
    case 5: return request("take", in_.random.one_in(2) ? old : newest_tick_ + ahead, "phone");
    case 6: return request("take_over", in_.random.one_in(2) ? old : newest_tick_, R"(a\"},{\"driver\":\"b)");
    case 7: return request("fly", newest_tick_, "");
    case 8: return babble();
    case 9: {
      constexpr const char* ticks[] = {R"("soon")", "-5", "1e300", "null", "0", "9007199254740993"};
      const std::int64_t n = in_.oracle.say(who(), who_.topic, in_.on.now, -1);
      return say(R"({"op":"publish","topic":")" + who_.topic + R"(","msg":{"n":)" + std::to_string(n) +
                 R"(},"tick":)" + in_.random.one_of(ticks) + '}');
    }
    case 10: return say(command_text({}));
    default: return say(command_text(newest_tick_));
    }
  }

  // ---- what it is told

  void take(const std::string& text) {
    const bool state = text.find(R"("topic":"/rowe/control/state")") != std::string::npos;
    const bool answer = text.find(R"("service":"/rowe/control")") != std::string::npos;
    if (!state && !answer) return;
    if (const std::int64_t tick = swarm::integer_after(text, R"("tick":)"); tick >= 0) {
      fresh_ = fresh_ || tick > newest_tick_;
      newest_tick_ = std::max(newest_tick_, tick);
      if (old_ticks_.size() < 64) {
        old_ticks_.push_back(tick);
      } else {
        old_ticks_[in_.random.below(old_ticks_.size())] = tick;
      }
    }
    if (answer) take_answer(text);
  }
  void take_answer(const std::string& text) {
    const auto has = [&](std::string_view part) { return text.find(part) != std::string::npos; };
    const bool yours = has(R"("yours":true)");
    if (has(R"("refused":null)")) {
      answers_.taken |= yours && has(R"("id":"t")");
      answers_.taken_over |= yours && has(R"("id":"o")");
      answers_.released |= has(R"("id":"r")");
    }
    answers_.driven |= has(R"("refused":"driven")");
    answers_.pause |= has(R"("refused":"pause")");
    answers_.role |= has(R"("refused":"role")");
    answers_.tick |= has(R"("refused":"tick")");
    answers_.action |= has(R"("refused":"action")");
    mine_ = yours;
    in_.oracle.note_answer(who(), who_.topic, swarm::integer_after(text, R"("number":)"), yours);
  }

  place in_;
  person who_;
  std::unique_ptr<driving_link> link_;
  std::int64_t newest_tick_ = -1;
  std::vector<std::int64_t> old_ticks_; // some of all, of any connection
  std::vector<std::int64_t> waiting_;   // commands, while there is no connection
  std::uint32_t connections_ = 0;
  time_point flushes_at_{}, next_command_{}, next_request_{};
  std::size_t flushed_ = 0;
  answers answers_;
  bool answers_pings_ = true;
  bool wants_ = true;
  bool with_ticks_ = true;
  bool fresh_ = false;   // a newer tick has come
  bool mine_ = false;    // as it was told last
  bool babbles_ = false; // says nothing else, for a while
};

} // namespace flow
