// SPDX-License-Identifier: Apache-2.0
// What must work whatever untrusted peers do: a peer that reads, answers and keeps to the rules, and the
// handles of this process that it uses. It has a floor of service, in cycles of the core and in messages. Its
// calls are answered, small and large. Of a topic that comes twenty times a second it gets nearly everything.
// Of a topic whose options it changes all the time, it gets what the options of the moment say.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "swarm_context.hpp"
#include "swarm_peer.hpp"
#include "swarm_process.hpp"

namespace swarm {

class honest {
 public:
  static constexpr std::uint64_t cycles_max = 40; // until an answer has come,
  static constexpr duration time_max = 100ms;     // and so long: what waits for a pong needs both
  // Where the transport does not take the rest of large frames, a large answer may have to wait until peers
  // that do not finish theirs are disconnected: 500 ms each time, and as often as there are untrusted peers
  // for each two of the slots of partial frames.
  static constexpr duration large_time_max = 3s;
  static constexpr duration plain_period = 2ms;   // within each messages_per_second_max
  static constexpr std::uint64_t window = 100;    // messages of the steady topic
  static constexpr std::uint64_t heard_min = 90;  // of these
  static constexpr duration period = 50ms;        // of the two topics
  static constexpr std::uint64_t overdue_max = 4; // messages after one was due

  honest(context& in, process& here, codec_check& check, std::uint64_t comes, std::uint64_t sets_up)
      : in_{in}, here_{here}, check_{check}, comes_{comes}, sets_up_{sets_up} {}

  // Before each cycle.
  void act() {
    if (in_.step >= sets_up_) set_up();
    publish();
    publish_map();
    respond();
    if (echoes) send_back();
    if (in_.step < comes_) return;
    if (!link_) {
      link_ = std::make_unique<far_end>(in_.on, in_.ours, "127.0.0.1:40000");
      came_at_ = in_.on.now;
      link_->say(R"({"op":"subscribe","topic":"/honest/steady","id":"h"})");
      link_->say(R"({"op":"subscribe","topic":"/rowe/stop/state","id":"h"})");
      link_->say(R"({"op":"advertise","topic":"/of/honest","type":"sim/Own"})");
      link_->say(R"({"op":"advertise_service","service":"/of/honest","type":"sim/Own"})");
    }
    if (in_.result.broken()) return;
    send_plainly();
    ask();
    change();
    look_at_map();
    operate();
  }
  // After each cycle that was one.
  void look() {
    if (!link_) return;
    if (plain_) hear_plainly();
    for (const std::string& text : link_->hear()) hear(text);
    if (!link_->violated.empty()) in_.fail("frames", "the honest peer was sent " + link_->violated);
    if (link_->cut())
      return in_.fail("honest_cut", "the honest peer was disconnected: " + link_->close_reason);
    if (map_asked_in_ != 0 && in_.cycles > map_asked_in_ + cycles_max &&
        in_.worked_until() > map_asked_at_ + time_max)
      return in_.fail("floor_latched", "the honest peer has no value of a latched topic after " +
                                           std::to_string(in_.cycles - map_asked_in_) + " cycles");
    if (asked_ && in_.cycles > asked_->cycle + cycles_max &&
        in_.worked_until() >
            asked_->worked_until +
                (asked_->floor == "floor_call" || in_.takes_rest ? time_max : large_time_max))
      in_.fail(asked_->floor, "the honest peer's call of " + asked_->service + " has no answer after " +
                                  std::to_string(in_.cycles - asked_->cycle) + " cycles and " +
                                  std::to_string((in_.worked_until() - asked_->worked_until) / 1ms) + " ms");
  }
  void leave() {
    if (link_) link_->leave();
    if (plain_) plain_->leave();
    link_.reset();
    plain_.reset();
    held_.reset();
    asked_.reset();
  }

  // Its handles are there.
  bool is_ready() const { return ready(); }

  bool operates = false;      // guards and resets
  bool echoes = false;        // a thread sends every plain message back to whom it came from
  unsigned takes_at_once = 8; // so many of them in a cycle
  std::uint64_t served = 0;   // calls
  std::uint64_t received = 0; // messages of the steady topic

  struct stop_seen {
    bool known = false;
    bool running = false;
    std::int64_t number = 0;
    std::int64_t tick = 0;
    bool fresh = false; // in this cycle
    std::vector<std::string> gone_guards{};
  };
  stop_seen stop;

 private:
  struct call {
    std::string id{};
    std::string service{};
    std::string_view floor{}; // the invariant
    std::uint64_t cycle = 0;
    time_point at{};
    time_point worked_until{}; // context::worked_until()
  };

  void set_up() {
    if (set_up_) return;
    if (!steady_) {
      steady_ = here_.open(
          handle_kind::publish_text,
          rowe::detail::advertise_request<json_text>(
              "/honest/steady", {.ttl = 500ms, .depth = 8, .type = "sim/Steady", .text_bytes_max = 100}));
      if (steady_ == nullptr) return;
      steady_->honest = true;
    }
    if (!changing_) {
      changing_ =
          here_.open(handle_kind::publish_text,
                     rowe::detail::advertise_request<json_text>(
                         "/honest/changing", {.depth = 8, .type = "sim/Changing", .text_bytes_max = 100}));
      if (changing_ == nullptr) return;
      changing_->honest = true;
    }
    if (!short_lived_) { // on the same topic
      short_lived_ = here_.open(
          handle_kind::publish_text,
          rowe::detail::advertise_request<json_text>(
              "/honest/changing", {.ttl = 100ms, .depth = 8, .type = "sim/Changing", .text_bytes_max = 100}));
      if (short_lived_ == nullptr) return;
      short_lived_->honest = true;
    }
    if (!map_) {
      map_ = here_.open(handle_kind::publish_text,
                        rowe::detail::advertise_request<json_text>("/honest/map", {.ttl = rowe::rt::for_ever,
                                                                                   .keep = rowe::keep::newest,
                                                                                   .depth = 1,
                                                                                   .latched = true,
                                                                                   .type = "sim/Map",
                                                                                   .text_bytes_max = 1000}));
      if (map_ == nullptr) return;
      map_->honest = true;
    }
    if (!echo_) {
      echo_ = here_.open(handle_kind::respond,
                         rowe::detail::serve_request<json_text, json_text>(
                             honest_service, {.depth = 32, .type = "sim/Echo", .text_bytes_max = 4000}));
      if (echo_ == nullptr) return;
      echo_->honest = true;
      responder_ = rowe::responder<json_text, json_text>{core_harness::handle_of(echo_->pair())};
    }
    set_up_ = true;
    if (operates) here_.open_latch();
    set_up_at_ = in_.cycles;
  }
  bool ready() const {
    return set_up_ && in_.cycles > set_up_at_ + 2 && steady_->phase() == pair_phase::active &&
           changing_->phase() == pair_phase::active && short_lived_->phase() == pair_phase::active &&
           map_->phase() == pair_phase::active && echo_->phase() == pair_phase::active;
  }

  void publish() {
    if (!ready() || in_.on.now < publishes_next_) return;
    publishes_next_ = in_.on.now + period;
    publications_.push_back(in_.on.now);
    const bool counts = link_ && in_.cycles > subscribed_at_ + 10 && subscribed_at_ != 0;
    rowe::publisher<json_text> steady{core_harness::handle_of(steady_->pair())};
    const std::string text = "{\"h\":" + std::to_string(++steady_number_) + "}";
    (void)steady.publish(text, in_.on.now); // the other end sees what became of it
    if (counts && ++sent_ == window) {
      if (got_ < heard_min)
        in_.fail("floor_topic", "of " + std::to_string(window) +
                                    " messages of a topic that comes 20 times a "
                                    "second the honest peer got " +
                                    std::to_string(got_));
      sent_ = got_ = 0;
    }
    handle* const one = in_.random.one_in(2) ? changing_ : short_lived_;
    rowe::publisher<json_text> changing{core_harness::handle_of(one->pair())};
    (void)changing.publish(text, in_.on.now); // likewise
    if (due() && ++overdue_ > overdue_max) {
      in_.fail("throttle", "the honest peer's subscription asks for a message each " +
                               std::to_string(throttle_ms()) + " ms, and got none for " +
                               std::to_string((in_.on.now - std::max(changed_, arrived_)) / 1ms) +
                               " ms although " + std::to_string(overdue_) + " were published meanwhile");
    }
  }

  // Published now and then, for late subscribers.
  void publish_map() {
    if (!ready() || in_.on.now < map_next_) return;
    map_next_ = in_.on.now + 700ms;
    rowe::publisher<json_text> map{core_harness::handle_of(map_->pair())};
    if (map.publish("{\"m\":\"" + std::string(800, 'm') + "\"}", in_.on.now)) map_published_in_ = in_.cycles;
  }
  // Subscribes late again and again.
  void look_at_map() {
    if (map_published_in_ == 0 || in_.cycles < map_published_in_ + 3 || map_asked_in_ != 0) return;
    if (in_.on.now < map_looks_next_) return;
    map_asked_in_ = in_.cycles;
    map_asked_at_ = in_.worked_until();
    link_->say(R"({"op":"subscribe","topic":"/honest/map","id":"m"})");
  }
  void take_map() {
    if (map_asked_in_ == 0) return;
    map_asked_in_ = 0;
    map_looks_next_ = in_.on.now + 90ms;
    link_->say(R"({"op":"unsubscribe","topic":"/honest/map","id":"m"})");
  }

  void respond() {
    if (!ready()) return;
    for (int left = 32; left > 0; --left) {
      auto asked = responder_.try_next(in_.on.now);
      if (!asked) return;
      const std::string text{asked->value()};
      (void)responder_.reply(*asked, rowe::json::is_object(text) ? text : "{}",
                             in_.on.now); // a caller that is gone needs none
    }
  }

  // ---- the peer

  void ask() {
    if (asked_ || !ready() || in_.on.now < asks_next_) return;
    asks_next_ = in_.on.now + 60ms;
    call one{.id = "\"h" + std::to_string(++calls_) + "\"",
             .service = std::string{honest_service},
             .floor = "floor_call",
             .cycle = in_.cycles,
             .at = in_.on.now,
             .worked_until = in_.worked_until()};
    std::string args = R"({"a":)" + std::to_string(calls_) + "}";
    switch (calls_ % 8) {
    case 3:
      one.floor = "floor_large_call";
      args = R"({"a":)" + std::to_string(calls_) + R"(,"x":")" +
             std::string(in_.known.bounds.small_slot_bytes + 500, 'h') + "\"}";
      break;
    case 5:
      one.floor = "floor_large_call";
      one.service = "/rowe/stats";
      args = "{}";
      break;
    default: break;
    }
    link_->say(R"({"op":"call_service","id":)" + one.id + R"(,"service":")" + one.service +
               R"(","timeout":5,"args":)" + args + "}");
    asked_ = one;
  }

  // Plain messages, to the thread that sends them back.
  void send_plainly() {
    if (!echoes || !ready() || sent_plainly_ != 0 || in_.worked_until() < sent_plainly_at_ + plain_period)
      return;
    if (!plain_) plain_ = std::make_unique<far_end>(in_.on, in_.ours, "127.0.0.1:40001");
    sent_plainly_ = ++plain_number_;
    sent_plainly_at_ = in_.worked_until();
    sent_plainly_in_ = in_.cycles;
    plain_->say("{\"e\":" + std::to_string(plain_number_) + "}");
  }
  void hear_plainly() {
    for (const std::string& text : plain_->hear()) {
      if (integer_after(text, "{\"e\":") == static_cast<std::int64_t>(sent_plainly_)) sent_plainly_ = 0;
    }
    if (plain_->cut())
      return in_.fail("honest_cut",
                      "the honest peer that sends plain messages was disconnected: " + plain_->close_reason);
    // What was handed over earlier is taken earlier.
    const std::uint64_t before = in_.known.bounds.door_slots / takes_at_once;
    if (sent_plainly_ != 0 && in_.cycles > sent_plainly_in_ + cycles_max + before &&
        in_.worked_until() > sent_plainly_at_ + time_max)
      in_.fail("floor_echo", "the honest peer's plain message did not come back within " +
                                 std::to_string(in_.cycles - sent_plainly_in_) + " cycles, with " +
                                 std::to_string(in_.on.core.slots_in_use()) + " slots in use" +
                                 (took_plainly_ == sent_plainly_
                                      ? held_ ? ": it was received, and another one finds no room"
                                              : ": it was received and sent"
                                  : held_ ? ": nothing is received while one finds no room"
                                          : ": it was not received"));
  }
  // The ordinary thread: what it cannot send it holds, and takes nothing meanwhile.
  void send_back() {
    using rowe::detail::entry;
    auto& inbox = in_.on.inbox;
    for (unsigned left = takes_at_once; left > 0; --left) {
      if (!held_) {
        const auto slot = inbox.try_receive(in_.on.now);
        if (!slot) return;
        const auto& came = inbox.header(*slot);
        held_.emplace(came, std::string{inbox.text(*slot)});
        (void)inbox.release(*slot); // the next cycle comes anyway
        const std::int64_t number = integer_after(held_->second, "{\"e\":");
        if (number >= 0) took_plainly_ = static_cast<std::uint64_t>(number);
      }
      const bool is_call = held_->first.what == entry::invocation;
      if (!is_call && is_full(held_->first.peer)) return;
      const auto sent =
          in_.on.submissions.submit({.what = is_call ? entry::reply : entry::message,
                                     .peer = held_->first.peer,
                                     .call = held_->first.call,
                                     .stamped = in_.on.now,
                                     .expires = rowe::rt::never},
                                    is_call ? std::string_view{"{}"} : std::string_view{held_->second});
      if (!sent && sent.code() == rowe::errc::full) return;
      held_.reset();
    }
  }

  // As endpoint_state::gone() and takes() say before somebody sends.
  bool is_full(rowe::detail::peer_ref of) const {
    const auto& shown = in_.on.shared;
    // relaxed: as there
    const bool there = shown.generations()[of.index].load(std::memory_order_relaxed) == of.generation;
    return there && shown.takers()[of.index].load(std::memory_order_relaxed) != of.generation;
  }

  // Of the topic that changes: subscribes, changes what it has asked for, and leaves, by several ids.
  void change() {
    if (!ready() || in_.on.now < changes_next_) return;
    constexpr duration pauses[] = {100ms, 400ms, 1s};
    changes_next_ = in_.on.now + in_.random.one_of(pauses);
    const std::string id = "c" + std::to_string(in_.random.below(3));
    if (requests_.contains(id) && in_.random.one_in(4)) {
      link_->say(R"({"op":"unsubscribe","topic":"/honest/changing","id":")" + id + "\"}");
      in_.say("honest unsubscribes " + id);
      requests_.erase(id);
    } else {
      constexpr std::int64_t throttles[] = {0, 0, 1, 60, 200, 1000, 3'600'000};
      constexpr std::int64_t lengths[] = {-1, -1, 0, 1, 3, 16, 1000};
      const std::int64_t throttle = in_.random.one_of(throttles);
      const std::int64_t length = in_.random.one_of(lengths);
      std::string text = R"({"op":"subscribe","topic":"/honest/changing","id":")" + id + "\"";
      if (throttle != 0) text += R"(,"throttle_rate":)" + std::to_string(throttle);
      if (length >= 0)
        text += (in_.random.one_in(2) ? R"(,"queue_length":)" + std::to_string(length)
                                      : R"(,"qos":{"depth":)" + std::to_string(length) + "}");
      link_->say(text + "}");
      in_.say("honest " + text + "}");
      requests_[id] = throttle;
    }
    changed_ = in_.on.now;
    changed_in_ = in_.cycles;
    overdue_ = 0;
  }
  std::int64_t throttle_ms() const {
    std::int64_t least = INT64_MAX;
    for (const auto& [id, throttle] : requests_) least = std::min(least, throttle);
    return least;
  }
  // Whether a message of the changing topic must come with the next ones that are published.
  bool due() const {
    if (requests_.empty() || !link_ || in_.cycles < changed_in_ + 10) return false;
    return in_.on.now >= std::max(changed_, arrived_) + throttle_ms() * 1ms + period;
  }

  // Guards the robot and resets it, so that there is something to stop.
  void operate() {
    if (!operates || !stop.known || in_.on.now < operates_next_) return;
    operates_next_ = in_.on.now + 40ms;
    link_->say(R"({"op":"call_service","service":"/rowe/stop/guard","args":{"guard":"honest","tick":)" +
               std::to_string(stop.tick) + "}}");
    for (const std::string& gone : stop.gone_guards) {
      if (gone != "honest")
        link_->say(R"({"op":"call_service","service":"/rowe/stop/guard","args":{"guard":")" + gone +
                   R"(","resign":true,"tick":)" + std::to_string(stop.tick) + "}}");
    }
    if (stop.running) return;
    link_->say(R"({"op":"call_service","service":"/rowe/stop/reset","args":{"number":)" +
               std::to_string(stop.number) + R"(,"tick":)" + std::to_string(stop.tick) + "}}");
    in_.resets.insert({stop.number, stop.tick});
  }

  void hear(const std::string& text) {
    using kind = codec_check::kind;
    const auto h = check_.look(text);
    if (h.is == kind::wrong)
      return in_.fail("json", "the honest peer was sent " + shortened(text, 700) + ": " + h.why);
    if (h.is == kind::status) return in_.fail("honest_refused", "the honest peer was refused: " + text);
    if (h.is == kind::publish && h.topic == "/honest/steady" &&
        text.find(R"("msg":{"h":)") != std::string::npos) {
      if (subscribed_at_ == 0) subscribed_at_ = in_.cycles;
      ++got_;
      ++received;
    }
    if (h.is == kind::publish && h.topic == "/honest/changing") {
      arrived_ = in_.on.now;
      overdue_ = 0;
    }
    if (h.is == kind::publish && h.topic == "/honest/map") take_map();
    if (h.is == kind::publish && h.topic == "/rowe/stop/state") take_state(text);
    if (h.is != kind::answer || !asked_ || h.id_raw != asked_->id) return;
    // Where time jumps, or nobody does anything for long, its time may truly be over.
    if (h.failed && in_.on.now > asked_->at + 150ms && text.find("in time") != std::string::npos)
      return asked_.reset();
    if (h.failed)
      return in_.fail(asked_->floor,
                      "the honest peer's call of " + asked_->service + " was answered " + shortened(text));
    if (asked_->service == honest_service &&
        integer_after(text, "\"values\":{\"a\":") != static_cast<std::int64_t>(calls_))
      in_.fail("answers", "the honest peer was answered with another's answer: " + shortened(text));
    if (asked_->service == "/rowe/stats") check_statistics(text);
    ++served;
    asked_.reset();
  }

  void take_state(const std::string& text) {
    stop.known = stop.fresh = true;
    stop.running = text.find(R"("state":"running")") != std::string::npos;
    stop.number = integer_after(text, "\"number\":");
    stop.tick = integer_after(text, "\"tick\":");
    stop.gone_guards.clear();
    for (std::size_t at = text.find("\"guards\":["); at != std::string::npos;) {
      at = text.find("{\"name\":\"", at);
      if (at == std::string::npos || at > text.find("\"loops\":[")) break;
      const std::size_t end = text.find('"', at + 9);
      if (text.compare(text.find("\"fresh\":", end), 13, "\"fresh\":false") == 0)
        stop.gone_guards.push_back(text.substr(at + 9, end - at - 9));
      at = end;
    }
  }

  // The rate of a topic that has come steadily for three seconds is about that: a short window may have a few
  // more, or less.
  void check_statistics(const std::string& text) {
    const auto within = [&](duration span) {
      const auto first = std::lower_bound(publications_.begin(), publications_.end(), in_.on.now - span);
      return static_cast<double>(publications_.end() - first) / std::chrono::duration<double>(span).count();
    };
    // Values without an audience are not counted.
    if (publications_.empty() || in_.on.now - std::max(publications_.front(), came_at_) < 3s) return;
    for (const duration span : {duration{500ms}, duration{1s}, duration{2s}, duration{3s}}) {
      if (const double rate = within(span); rate < 14 || rate > 22) return;
    }
    const std::size_t at = text.find(R"({"topic":"/honest/steady")");
    const std::size_t rate_at = text.find("\"rate_hz\":", at);
    if (at == std::string::npos || rate_at == std::string::npos)
      return in_.fail("statistics", "/rowe/stats does not know /honest/steady");
    const double rate = std::stod(text.substr(rate_at + 10, 20));
    if (rate < 4 || rate > 90)
      in_.fail("statistics",
               "/rowe/stats says that a topic of 14 to 22 Hz has " + std::to_string(rate) + " Hz");
  }

  context& in_;
  process& here_;
  codec_check& check_;
  std::uint64_t comes_, sets_up_;
  time_point came_at_{};
  std::unique_ptr<far_end> link_;
  handle* steady_ = nullptr;
  handle* changing_ = nullptr;
  handle* short_lived_ = nullptr;
  handle* map_ = nullptr;
  handle* echo_ = nullptr;
  rowe::responder<json_text, json_text> responder_;
  bool set_up_ = false;
  std::uint64_t set_up_at_ = 0;
  time_point publishes_next_{};
  std::vector<time_point> publications_;
  std::uint64_t steady_number_ = 0;
  std::uint64_t subscribed_at_ = 0; // the cycle in which the first message came
  std::uint64_t sent_ = 0, got_ = 0;
  time_point map_next_{}, map_looks_next_{}, map_asked_at_{};
  std::uint64_t map_published_in_ = 0, map_asked_in_ = 0; // cycles; 0: not yet, and not now
  std::optional<call> asked_;
  std::uint64_t calls_ = 0;
  time_point asks_next_{};
  std::map<std::string, std::int64_t> requests_; // of the changing topic: throttle_rate by id
  time_point changes_next_{}, changed_{}, arrived_{};
  std::uint64_t changed_in_ = 0;
  std::uint64_t overdue_ = 0;
  time_point operates_next_{};
  std::unique_ptr<far_end> plain_;
  std::uint64_t plain_number_ = 0, sent_plainly_ = 0; // 0: none is under way
  std::uint64_t took_plainly_ = 0;                    // the newest that was received
  std::uint64_t sent_plainly_in_ = 0;
  time_point sent_plainly_at_{};
  std::optional<std::pair<rowe::service::inbound_header, std::string>> held_;
};

} // namespace swarm
