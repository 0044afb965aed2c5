// SPDX-License-Identifier: Apache-2.0
// Three endpoints in a row: a robot, a hub, and a service that listens behind it. The robot's values and
// messages have times to live of all lengths. Sockets are full now and then, the ways between them stall and
// break, and come again. Beside them stand a browser, which speaks rosbridge alone, and a viewer, which
// offers rowe.v1. One clock for all; so it is known of each message when its time is over, and how long it
// was under way between two endpoints, which none of them can know.
#pragma once
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "flow.hpp"
#include "stream.hpp"

namespace flow {

class hops final : public world {
 public:
  hops(std::uint64_t seed, swarm::coverage& seen, const std::set<std::string>& without, bool trace)
      : world{seed, options(), seen, without, trace},
        robot_{harness::small_options(), rowe::service::side::client, seed + 1},
        service_{harness::small_options(), rowe::service::side::client, seed + 2},
        ways_{{way{robot_}, way{service_}}},
        browser_{on_},
        viewer_{on_, rowe::service::side::server, "127.0.0.1:2", "/", "rowe.v1"} {
    constexpr duration ttls[] = {2ms, 20ms, 100ms, rowe::rt::for_ever};
    for (const duration ttl : ttls) {
      const bool latched = sources_.size() == 1 || sources_.size() == 3;
      sources_.push_back({&robot_.offer(rowe::detail::pair_kind::publish_text, topic(), 200,
                                        {.ttl = ttl, .latched = latched}),
                          ttl});
    }
    taker_.emplace(harness::core_harness::handle_of(
        service_.offer(rowe::detail::pair_kind::subscribe_text, topic(), 256, {.depth = 16})));
    for (far_end* one : {&browser_, &viewer_})
      one->say(R"({"op":"subscribe","topic":")" + std::string{topic()} + "\"}");
    watch(on_, at_hub_);
    watch(robot_, at_robot_);
    for (way& one : ways_) connect(one);
    turn(1ms);
  }

  void finish(std::uint64_t number) override {
    world::finish(number);
    for (int i = 0; i < 20 && !broken(); ++i) {
      calm();
      turn(20ms);
    }
    on_.net.written = nullptr;
    robot_.net.written = nullptr;
  }

 private:
  using far_end = swarm::far_end;
  struct source {
    rowe::detail::queue_pair* pair;
    duration ttl;
    std::int64_t heard = -1; // by the service
  };
  // Of one message.
  struct record {
    time_point over = rowe::rt::never;
    duration under_way{}; // between endpoints: from its frame's first byte until its last one was read
  };
  // What one connection was sent: frames, and how much of them has left it.
  struct written_stream {
    sim::stream frames;
    std::uint64_t moved = 0;
  };
  using streams = std::map<std::uint32_t, written_stream>; // by the connection's index
  struct way {
    explicit way(harness::core_harness& other) : far{other} {}
    harness::core_harness& far;
    connection_id at_far{}, at_hub{};
    bool open = false;
    bool stalls = false;
  };

  static constexpr std::string_view topic() { return "/hops"; }
  static rowe::endpoint_options options() {
    auto chosen = harness::small_options();
    chosen.relay = true;
    return chosen;
  }

  void act() override {
    way& some = ways_[random_.below(2)];
    switch (random_.below(12)) {
    case 0: some.open ? disconnect(some) : connect(some); break;
    case 1:
      if (!some.open) connect(some);
      break;
    case 2: change_conditions(some); break;
    case 3: some.stalls = random_.one_in(3); break;
    case 4:
      on_.net.link_of(viewer_.id()).capacity_bytes = random_.one_in(2) ? random_.below(200) : 1 << 20;
      break;
    case 5:
    case 6: send(random_.one_in(2) ? robot_ : on_); break;
    case 7: calm(); break;
    default: publish_some();
    }
    constexpr duration waits[] = {0us, 3us, 400us, 1ms, 1ms, 5ms, 15ms};
    turn(random_.one_of(waits));
    if (random_.one_in(2)) take();
  }

  // ---- ways

  void connect(way& one) {
    one.at_far = one.far.net.open(rowe::service::side::client, "127.0.0.1:9090", "/", "rowe.v1");
    one.at_hub = on_.net.open(rowe::service::side::server, "127.0.0.1:3", "/", "rowe.v1");
    at_hub_[one.at_hub.index] = {};
    if (&one.far == &robot_) at_robot_[one.at_far.index] = {};
    one.open = true;
    one.stalls = false;
    if (std::exchange(was_connected_, true)) seen_.add(flow_event::hop_reconnected);
  }
  void disconnect(way& one) {
    one.far.net.peer_closes(one.at_far, rowe::service::close_cause::reset);
    on_.net.peer_closes(one.at_hub, rowe::service::close_cause::reset);
    one.open = false;
  }
  void change_conditions(way& one) {
    if (!one.open) return;
    constexpr std::size_t rooms[] = {0, 10, 60, 300, 1 << 20};
    one.far.net.link_of(one.at_far).capacity_bytes = random_.one_of(rooms);
    on_.net.link_of(one.at_hub).capacity_bytes = random_.one_of(rooms);
  }
  void calm() {
    for (way& one : ways_) {
      one.stalls = false;
      if (!one.open) connect(one);
      one.far.net.link_of(one.at_far).capacity_bytes = 1 << 20;
      on_.net.link_of(one.at_hub).capacity_bytes = 1 << 20;
    }
    on_.net.link_of(viewer_.id()).capacity_bytes = 1 << 20;
  }
  // Moves what was written to the other end.
  void move(harness::core_harness& from, connection_id at, harness::core_harness& to, connection_id there,
            written_stream* watched) {
    const auto sent = from.net.sent(at);
    const std::vector<std::byte> bytes(sent.begin(), sent.end());
    from.net.peer_reads(at, bytes.size());
    to.net.arrive(there, bytes);
    if (watched != nullptr) watched->moved += bytes.size();
  }
  // Of what was moved, all that the other end has read is under way no more. It reads nothing from a peer of
  // which it has a message parked.
  void note_read(written_stream& of, const harness::core_harness& by, connection_id at) {
    const std::uint64_t read = of.moved - by.net.unread(at);
    auto& frames = of.frames.complete;
    for (; !frames.empty() && frames.front().end <= read; frames.pop_front()) {
      if (const auto n = number_of(frames.front().payload); known(n))
        record_of(n).under_way += on_.now - frames.front().begun;
    }
  }
  void note_read_by_hub() {
    const way& robots = ways_[0];
    if (robots.open) note_read(at_robot_[robots.at_far.index], on_, robots.at_hub);
  }
  void move_all() {
    for (way& one : ways_) {
      if (!one.open) continue;
      if (one.far.net.closed_by_us(one.at_far) || on_.net.closed_by_us(one.at_hub)) {
        disconnect(one);
        continue;
      }
      if (one.stalls) continue;
      const bool robots = &one.far == &robot_;
      move(one.far, one.at_far, on_, one.at_hub, robots ? &at_robot_[one.at_far.index] : nullptr);
      move(on_, one.at_hub, one.far, one.at_far, &at_hub_[one.at_hub.index]);
    }
  }
  void turn(duration later) {
    on_.now += later;
    for (const way& one : ways_) one.far.now = on_.now;
    for (int i = 0; i < 2; ++i) {
      robot_.core.cycle(on_.now);
      move_all();
      on_.core.cycle(on_.now);
      move_all();
      service_.core.cycle(on_.now);
    }
    note_read_by_hub();
    for (const way& one : ways_) {
      if (one.open) note_read(at_hub_[one.at_hub.index], one.far, one.at_far);
    }
    check_structures();
    if (!robot_.core.check() || !service_.core.check()) fail("structures", "of a client do not agree");
    for (const std::string& text : browser_.hear()) {
      if (text.find("ttl_ms") != std::string::npos)
        fail("hop_told", "who speaks rosbridge alone is told a time to live: " + text);
    }
    (void)viewer_.hear();
    at_hub_[viewer_.id().index].frames.complete.clear();
    at_hub_[browser_.id().index].frames.complete.clear();
    if (on_.count(counter::expired) != 0) seen_.add(flow_event::hop_expired);
  }

  // ---- what is said

  std::int64_t new_record(duration ttl) {
    records_.push_back({.over = rowe::rt::deadline_after(on_.now, ttl)});
    return static_cast<std::int64_t>(records_.size()) - 1;
  }
  bool known(std::int64_t n) const { return n >= 0 && n < static_cast<std::int64_t>(records_.size()); }
  record& record_of(std::int64_t n) { return records_[static_cast<std::size_t>(n)]; }
  static std::int64_t number_of(std::string_view text) { return swarm::integer_after(text, R"("n":)"); }

  void publish_some() {
    const std::size_t which = random_.below(sources_.size());
    const std::int64_t n = new_record(sources_[which].ttl);
    const std::string text = R"({"s":)" + std::to_string(which) + R"(,"n":)" + std::to_string(n) +
                             R"(,"x":")" + std::string(random_.below(100), 'x') + "\"}";
    const auto done =
        rowe::detail::publish_into(*sources_[which].pair, text.size(), on_.now, [&](std::byte* slot) {
          text.copy(reinterpret_cast<char*>(slot), text.size());
        });
    (void)done; // `no_peer` and `full` are seen by nobody
  }
  void send(harness::core_harness& from) {
    constexpr duration ttls[] = {1ms, 10ms, 50ms};
    const duration ttl = random_.one_of(ttls);
    const std::int64_t n = new_record(ttl);
    (void)from.submissions.submit(
        {.what = rowe::detail::entry::message, .stamped = on_.now, .expires = on_.now + ttl},
        R"({"n":)" + std::to_string(n) + "}"); // none: too many wait
  }

  // ---- what is taken

  void take() {
    while (const auto got = taker_->try_take(on_.now)) {
      const std::string_view text = **got;
      const std::int64_t n = number_of(text);
      check_taken(text, n);
      source& of = sources_[static_cast<std::size_t>(swarm::integer_after(text, R"("s":)"))];
      if (n < of.heard) fail("hop_stale", "comes behind a newer one: " + std::string{text});
      of.heard = n;
      if (of.ttl != rowe::rt::for_ever) seen_.add(flow_event::hop_value);
    }
    if (taker_->expired() != 0) seen_.add(flow_event::hop_over_at_handle);
    for (harness::core_harness* const one : {&robot_, &on_, &service_}) {
      while (const auto slot = one->inbox.try_receive(on_.now)) {
        check_taken(one->inbox.text(*slot), number_of(one->inbox.text(*slot)));
        one->inbox.release(*slot);
        seen_.add(flow_event::hop_message);
      }
    }
  }
  void check_taken(std::string_view text, std::int64_t n) {
    if (!known(n)) return fail("whole", "nobody said: " + std::string{text});
    const record& of = record_of(n);
    if (of.over == rowe::rt::never) return;
    if (const duration late = on_.now - of.over; late >= of.under_way)
      fail("hop_over", "taken " + std::to_string(late.count()) +
                           " ns after its time, of which it was under way " +
                           std::to_string(of.under_way.count()) + ": " + std::string{text});
  }

  // ---- what is written

  void watch(harness::core_harness& at, streams& into) {
    at.net.written = [this, &into](connection_id to, std::span<const std::byte> bytes, std::size_t taken) {
      written_stream& of = into[to.index];
      const std::size_t before = of.frames.complete.size();
      of.frames.take(bytes.first(taken), on_.now);
      for (std::size_t i = before; i < of.frames.complete.size(); ++i)
        check_written(of.frames.complete[i], &into == &at_hub_ && to.index == browser_.id().index);
    };
  }
  void check_written(const sim::written_frame& frame, bool to_browser) {
    const std::int64_t n = number_of(frame.payload);
    if (!frame.whole_text() || !known(n) || to_browser) return;
    note_read_by_hub(); // which may have read it in this cycle
    const record& of = record_of(n);
    const auto at = frame.payload.find(R"("ttl_ms":)");
    const bool told = at != std::string::npos;
    if (told != (of.over != rowe::rt::never))
      return fail("hop_told", (told ? "it has no time to live: " : "it says none: ") + frame.payload);
    if (!told) return;
    const double ns = std::strtod(frame.payload.c_str() + at + 9, nullptr) * 1e6;
    const auto left = of.over + of.under_way - frame.begun;
    if (ns <= 0 || std::llround(ns) > left.count())
      fail("hop_told", "of which " + std::to_string(left.count()) + " ns are left: " + frame.payload);
    seen_.add(flow_event::hop_told);
  }

  harness::core_harness robot_, service_;
  std::array<way, 2> ways_;
  far_end browser_, viewer_;
  std::vector<source> sources_;
  std::optional<rowe::subscriber<rowe::json_text>> taker_;
  streams at_hub_, at_robot_;
  std::deque<record> records_;
  bool was_connected_ = false;
};

} // namespace flow
