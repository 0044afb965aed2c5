// SPDX-License-Identifier: Apache-2.0
// A world with a bad network around one core, all of it from one seed. Peers come, go, stall, send their
// messages in pieces, break the protocol and read slowly. Handles publish, fall silent and are replaced. Time
// moves in small steps, and sometimes jumps. `habits` says what a world may do. After every step it checks:
//
//   - the core's structures are consistent (core::check)
//   - what a peer receives of one publisher comes in order, each value at most once, and was published
//   - no frame was begun after its message's time to live
//   - a peer is never sent anything that breaks the protocol
//
// The trace of a run is hashed, so that two runs of one seed can be compared.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sim_base.hpp"
#include "stream.hpp"

namespace sim {

struct habits {
  bool peers_leave = true;
  bool peers_misbehave = true;
  bool throttles = true;
  bool handles_change = true;
  duration ttl = 50ms;
};

// One value in the world: which publisher, which number, when.
struct tick {
  std::int64_t source, number, published_ns;
};

struct viewer {
  std::unique_ptr<harness::peer> link;
  std::map<std::int64_t, std::int64_t> newest; // of each source
  std::uint64_t heard = 0;
  std::uint64_t read = 0; // bytes of the stream
  stream written;
};

} // namespace sim

template <>
inline constexpr auto rowe::schema<sim::tick> =
    rowe::fields<&sim::tick::source, &sim::tick::number, &sim::tick::published_ns>{}.type("sim/Tick");

namespace sim {

class world : public sim_base {
 public:
  world(std::uint64_t seed, const habits& does)
      : sim_base{seed, options(), rowe::service::side::server}, does_{does} {
    add_source();
  }

  void step() {
    ++steps_;
    switch (below(10)) {
    case 0: connect(); break;
    case 1: disconnect(); break;
    case 2: change_conditions(); break;
    case 3: say_something(); break;
    case 4:
    case 5:
    case 6: publish(); break;
    case 7: read(); break;
    case 8: change_pairs(); break;
    default: wait(); break;
    }
    on_.core.cycle(on_.now);
    note_writes();
    mix(on_.core.slots_in_use());
  }

  // Lets everything that is in flight arrive: good link conditions, everyone reads.
  void drain() {
    for (int i = 0; i < 300; ++i) {
      for (viewer& v : viewers_) on_.net.link_of(v.link->id()) = {};
      on_.now += 1ms;
      on_.core.cycle(on_.now);
      note_writes();
      for (viewer& v : viewers_) hear(v, SIZE_MAX);
    }
  }
  void everyone_leaves() {
    for (viewer& v : viewers_) v.link->leave();
    drain();
    viewers_.clear();
  }

  std::uint64_t published() const { return published_; }
  std::uint64_t heard() const {
    std::uint64_t sum = 0;
    for (const viewer& v : viewers_) sum += v.heard;
    return sum;
  }
  std::size_t viewers() const { return viewers_.size(); }

  // For worlds in which nobody comes or goes by chance.
  void add_viewers(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      open_viewer();
      viewers_.back().link->say(R"({"op":"subscribe","topic":"/tick"})");
    }
    on_.core.cycle(on_.now);
    note_writes();
  }

 private:
  struct source {
    rowe::detail::queue_pair* pair;
    std::int64_t id;
    std::int64_t next = 0;
  };

  static rowe::endpoint_options options() {
    auto chosen = harness::small_options();
    chosen.relay = true;
    return chosen;
  }

  void open_viewer() {
    viewer fresh;
    fresh.link = std::make_unique<harness::peer>(on_);
    viewers_.push_back(std::move(fresh));
  }

  void connect() {
    if (!does_.peers_leave || viewers_.size() >= 6) return wait();
    open_viewer();
    if (!one_in(4)) subscribe(viewers_.back());
  }

  void disconnect() {
    if (!does_.peers_leave || viewers_.empty()) return wait();
    const std::size_t who = below(viewers_.size());
    on_.net.link_of(viewers_[who].link->id()) = {}; // else its last bytes might never arrive
    viewers_[who].link->leave(one_in(2) ? rowe::service::close_cause::reset
                                        : rowe::service::close_cause::peer);
    viewers_.erase(viewers_.begin() + static_cast<std::ptrdiff_t>(who));
  }

  void change_conditions() {
    if (viewers_.empty()) return wait();
    sim_base::change_conditions(viewers_[below(viewers_.size())].link->id());
  }

  void subscribe(viewer& v) {
    std::string request = R"({"op":"subscribe","topic":"/tick")";
    if (does_.throttles && one_in(3)) request += R"(,"throttle_rate":)" + std::to_string(below(100));
    if (does_.throttles && one_in(3)) request += R"(,"queue_length":)" + std::to_string(below(20));
    if (one_in(2)) request += R"(,"id":"s)" + std::to_string(below(5)) + "\"";
    v.link->say(request + "}");
  }

  void say_something() {
    if (viewers_.empty()) return wait();
    const std::size_t who = below(viewers_.size());
    harness::peer& p = *viewers_[who].link;
    if (!does_.peers_misbehave) return p.send(rowe::wire::opcode::ping, "x");
    switch (below(12)) {
    case 0: return subscribe(viewers_[who]);
    case 1: return p.say(R"({"op":"unsubscribe","topic":"/tick"})");
    case 2: return p.say(R"({"op":"unsubscribe","topic":"/tick","id":"s1"})");
    case 3:
      return p.say(R"({"op":"advertise","topic":"/t)" + std::to_string(below(30)) +
                   R"(","type":"a/B","latch":true})");
    case 4: return p.say(R"({"op":"unadvertise","topic":"/t)" + std::to_string(below(30)) + "\"}");
    case 5: return p.say(R"({"op":"subscribe","topic":"/t)" + std::to_string(below(30)) + "\"}");
    case 6:
      return p.say(R"({"op":"publish","topic":"/t)" + std::to_string(below(30)) + R"(","msg":{"data":")" +
                   std::string(below(3000), 'x') + "\"}}");
    case 7: return p.say("{\"op\":");
    case 8: return p.say(R"({"op":"subscribe","topic":"/rowe/stats"})");
    case 9: return p.send(rowe::wire::opcode::ping, "are you there");
    case 10:
      if (one_in(4)) p.send(rowe::wire::opcode::binary, "?");
      return;
    default:
      if (one_in(4)) p.send(rowe::wire::opcode::close, "");
      return;
    }
  }

  void read() {
    if (viewers_.empty()) return wait();
    hear(viewers_[below(viewers_.size())], one_in(2) ? SIZE_MAX : below(2000));
  }

  void hear(viewer& v, std::size_t bytes_max) {
    const std::size_t before = on_.net.sent(v.link->id()).size();
    const auto texts = v.link->hear(bytes_max);
    const std::size_t taken = before - on_.net.sent(v.link->id()).size();
    if (!v.link->violated.empty()) fail("a peer was sent something wrong: " + v.link->violated);
    v.read += taken;
    for (const std::string& text : texts) {
      mix(rowe::service::hash_of(text));
      if (text.starts_with(R"({"op":"publish","topic":"/tick","msg":)")) check_tick(v, text);
    }
  }

  static std::int64_t number_after(const std::string& text, std::string_view key) {
    const auto at = text.find(key);
    return at == std::string::npos ? -1 : std::stoll(text.substr(at + key.size()));
  }

  void check_tick(viewer& v, const std::string& text) {
    const std::int64_t id = number_after(text, "\"source\":");
    const std::int64_t number = number_after(text, "\"number\":");
    ++v.heard;
    const auto known = v.newest.find(id);
    if (known != v.newest.end() && number < known->second) fail("out of order: " + text);
    // A latched value may come again, to a peer that subscribes again.
    if (known != v.newest.end() && number == known->second && !does_.handles_change) fail("twice: " + text);
    v.newest[id] = number;
    bool exists = false;
    for (const source& s : all_sources_) exists = exists || (s.id == id && number < s.next);
    for (const source& s : sources_) exists = exists || (s.id == id && number < s.next);
    if (!exists) fail("never published: " + text);
    if (const auto begun = begun_at(v, text);
        begun > number_after(text, "\"published_ns\":") + does_.ttl.count())
      fail("begun after its time: " + text);
  }

  // When the first byte of this message, the next one that the peer reads, was handed to the network.
  std::int64_t begun_at(viewer& v, const std::string& text) {
    auto& frames = v.written.complete;
    while (!frames.empty() && frames.front().payload != text) frames.pop_front();
    if (!frames.empty()) return rowe::rt::nanoseconds_of(frames.front().begun);
    fail("a message nobody saw written: " + text);
    return 0;
  }

  // Looks at what each connection was given in this cycle and notes the messages that begin in it.
  void note_writes() {
    for (viewer& v : viewers_) {
      const auto bytes = on_.net.sent(v.link->id());
      v.written.take(bytes.subspan(std::min<std::size_t>(v.written.end() - v.read, bytes.size())), on_.now);
    }
  }

  void add_source() {
    for (const auto& one : on_.pairs) {
      if (one.lifecycle.is_free()) {
        auto& pair = on_.offer(rowe::detail::pair_kind::publish_value, "/tick", sizeof(tick),
                               {.ttl = does_.ttl,
                                .depth = 16,
                                .priority = static_cast<rowe::priority>(does_.handles_change ? below(3) : 1),
                                .latched = does_.handles_change && one_in(3)},
                               &rowe::describe<tick>(), "sim/Tick");
        sources_.push_back({&pair, next_source_++});
        on_.core.cycle(on_.now);
        return;
      }
    }
  }

  void change_pairs() {
    if (!does_.handles_change) return wait();
    if (sources_.size() > 1 && one_in(2)) {
      const std::size_t which = below(sources_.size());
      sources_[which].pair->lifecycle.close();
      all_sources_.push_back(sources_[which]);
      sources_.erase(sources_.begin() + static_cast<std::ptrdiff_t>(which));
    } else if (sources_.size() < 3) {
      add_source();
    }
  }

  void publish() {
    source& s = sources_[below(sources_.size())];
    for (std::uint64_t burst = below(4) + 1; burst-- > 0;) {
      const tick value{s.id, s.next, rowe::rt::nanoseconds_of(on_.now)};
      const auto done = rowe::detail::publish_into(
          *s.pair, sizeof value, on_.now, [&](std::byte* slot) { std::memcpy(slot, &value, sizeof value); });
      if (!done) continue;
      ++s.next;
      ++published_;
    }
  }

  void wait() { sim_base::wait(does_.peers_leave); }

  habits does_;
  std::vector<viewer> viewers_;
  std::vector<source> sources_;
  std::vector<source> all_sources_;
  std::int64_t next_source_ = 0;
  std::uint64_t published_ = 0;
};

} // namespace sim
