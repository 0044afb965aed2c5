// SPDX-License-Identifier: Apache-2.0
// A core in a harness: the memory transport in place of sockets, time that moves when told to, random bytes
// from a seed, queue pairs without threads, and peers that speak frames by hand. For tests of the core, the
// simulation and benches.
#pragma once
#include <cstddef>
#include <cstring>
#include <deque>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <rowe/publisher.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/schema.hpp>
#include <rowe/subscriber.hpp>

#include "api/pair_memory.hpp"
#include "memory_transport/memory_transport.hpp"
#include "service/core/core.hpp"
#include "service/core/memory_plan.hpp"
#include "service/threads/shared_inbox.hpp"
#include "service/threads/shared_state.hpp"
#include "service/threads/submission_queue.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "wire/websocket/websocket.hpp"
#include "json/reading/reader.hpp"

namespace harness {

using namespace std::chrono_literals;
using rowe::service::connection_id;

class seeded_entropy final : public rowe::service::entropy {
 public:
  explicit seeded_entropy(std::uint64_t seed) : random_{seed} {}
  void fill(std::span<std::byte> bytes) noexcept override {
    for (std::byte& b : bytes) b = static_cast<std::byte>(random_());
  }

 private:
  std::mt19937_64 random_;
};

// Options whose limits make small, quick cores.
inline rowe::endpoint_options small_options() {
  rowe::endpoint_options options;
  options.limits.connections_max = 8;
  options.limits.message_bytes_max = 8 * 1024;
  options.limits.long_message_bytes_max = 0;
  options.limits.topics_max = 32;
  options.limits.subscriptions_max = 64;
  options.limits.subscriptions_per_connection_max = 8;
  options.limits.advertisements_per_connection_max = 4;
  options.limits.small_slots = 64;
  options.limits.small_slot_bytes = 1024;
  options.limits.large_slots = 4;
  options.limits.queue_depth_max = 16;
  options.limits.queued_max = 256;
  options.limits.handles_max = 6;
  options.limits.services_max = 16;
  options.limits.calls_max = 16;
  options.limits.calls_per_connection_max = 4;
  options.limits.door_slots = 4;
  options.limits.door_slot_bytes = 1024;
  return options;
}

// Such options of a hub.
inline rowe::endpoint_options hub_options() {
  rowe::endpoint_options options = small_options();
  options.relay = true;
  return options;
}

// That of a hub whose loops may move without a guard.
inline rowe::endpoint_options unguarded_hub_options() {
  rowe::endpoint_options options = hub_options();
  options.stop.unguarded = true;
  return options;
}

using rowe::limits;

// The options with other limits: with_limits(small_options(), &limits::topics_max, 8).
template <class Limit, class Value, class... Others>
rowe::endpoint_options with_limits(rowe::endpoint_options options, Limit limits::*limit, Value value,
                                   const Others&... others) {
  options.limits.*limit = static_cast<Limit>(value);
  if constexpr (sizeof...(others) == 0) {
    return options;
  } else {
    return with_limits(std::move(options), others...);
  }
}

// Over any transport that is made for so many connections.
template <class Transport>
class core_harness_over {
 public:
  explicit core_harness_over(const rowe::endpoint_options& chosen = small_options(),
                             rowe::service::side ours = rowe::service::side::server, std::uint64_t seed = 1,
                             rowe::rt::time_point begins = rowe::rt::time_point{std::chrono::seconds{1000}},
                             const rowe::wire::protocol_set* protocols = nullptr)
      : options{chosen},
        access{chosen.access},
        rights{access},
        memory{rowe::service::plan_memory(chosen.limits).arena() +
                   rowe::service::plan_memory(chosen.limits).pair_memory,
               rowe::rt::page_lock::in_parts}, // a short test uses few of its pages
        chunk_pool{new std::byte[rowe::service::plan_memory(chosen.limits).chunks]},
        random{seed},
        validator{
            rowe::json::reader::create(chosen.limits.message_bytes_max, chosen.limits.depth_max).value()},
        net{chosen.limits.connections_max},
        pairs{memory.carve<rowe::detail::queue_pair>(chosen.limits.handles_max)},
        now{begins},
        shared{*memory.make<rowe::service::shared_state>(memory, chosen.limits)},
        submissions{*memory.make<rowe::service::submission_queue>(memory, chosen.limits)},
        inbox{*memory.make<rowe::service::shared_inbox>(memory, chosen.limits)},
        waker{*memory.make<rowe::rt::waker<>>(rowe::rt::eventfd_signal{})},
        core{*memory.make<rowe::service::core>(
            memory, rowe::service::core_options::from(options, ours, "robot"),
            rowe::service::shared_parts{pairs, shared, submissions, inbox},
            rowe::service::core_seams{net,
                                      random,
                                      validator,
                                      nullptr,
                                      protocols != nullptr ? *protocols
                                                           : rowe::wire::protocols_of(options.profile),
                                      rights,
                                      nullptr,
                                      {chunk_pool.get(), rowe::service::plan_memory(chosen.limits).chunks}},
            now)} {}

  // Moves the time and does one cycle. In a long time the core runs when it wants to, as its thread does.
  rowe::rt::time_point cycle(rowe::rt::duration later = 1ms) {
    const auto end = now + later;
    while (later > rowe::service::pause_min && next_wake < end) {
      now = std::max(now + 1us, next_wake);
      next_wake = core.cycle(now);
    }
    now = end;
    return next_wake = core.cycle(now);
  }
  // The process does not run for so long: it is stopped, or its machine is suspended.
  void pause(rowe::rt::duration time) {
    now += time;
    next_wake = core.cycle(now);
  }
  void cycles(int count, rowe::rt::duration each = 1ms) {
    while (count-- > 0) cycle(each);
  }

  // As endpoint::set_access(), with a cycle that takes the new rights.
  void offer_access(const rowe::access_options& to) {
    rights.offer(policies.emplace_back(to, policies.empty() ? access : policies.back()));
  }
  void set_access(const rowe::access_options& to) {
    offer_access(to);
    cycle();
    if (!rights.is_taken()) throw std::runtime_error{"the new rights were not taken"};
  }

  std::uint64_t count(rowe::service::counter which) const {
    return rowe::service::read_count(shared, pairs, which);
  }

  // Of ordinary threads.
  bool all_slots_free() { return submissions.all_free() && inbox.all_free(); }
  const char* check_slots() {
    const char* const wrong = submissions.check();
    return wrong != nullptr ? wrong : inbox.check();
  }

  // Offers a queue pair as set-up does. It is active after the next cycle.
  rowe::detail::queue_pair& offer(const rowe::detail::pair_request& asked) {
    using namespace rowe::detail;
    for (queue_pair& one : pairs) {
      if (!one.lifecycle.is_free()) continue;
      if (one.memory.size() < pair_bytes(asked)) one.memory = memory.carve_bytes(pair_bytes(asked));
      if (one.memory.empty()) throw std::runtime_error{"no memory for a lane"};
      build_pair(one, asked, shared.generations());
      one.peers_taking = shared.takers();
      codecs.push_back(
          std::make_unique<pair_codecs>(std::move(pair_codecs::compile(asked, options.limits)).value()));
      one.encoder = codecs.back()->encoder ? &*codecs.back()->encoder : nullptr;
      one.other_encoders = codecs.back()->others();
      one.granted = &shared.permit;
      one.decoder = codecs.back()->decoder ? &*codecs.back()->decoder : nullptr;
      one.waker = options.idle_policy == rowe::idle::wake ? &waker : nullptr;
      shared.use_pair(static_cast<std::uint32_t>(&one - pairs.data()));
      one.lifecycle.offer();
      return one;
    }
    throw std::runtime_error{"no free lane"};
  }
  // Of a topic.
  rowe::detail::queue_pair& offer(rowe::detail::pair_kind kind, std::string_view topic,
                                  std::size_t value_bytes, const rowe::topic_options& how = {},
                                  const rowe::schema_description* schema = nullptr,
                                  std::string_view type = {}) {
    rowe::detail::pair_request asked{.kind = kind,
                                     .name = topic,
                                     .type = type,
                                     .keep = how.keep,
                                     .priority = how.priority,
                                     .latched = how.latched,
                                     .shared = how.shared,
                                     .ttl = how.ttl,
                                     .period = how.period,
                                     .lease = how.lease};
    const bool publishes = rowe::detail::publishes(kind);
    (publishes ? asked.out_depth : asked.in_depth) = rowe::detail::of_topics.or_asked(how.depth, value_bytes);
    (publishes ? asked.out_bytes : asked.in_bytes) = value_bytes;
    (publishes ? asked.encoded : asked.decoded) = schema;
    asked.fill_missing = how.fill_missing.value_or(rowe::is_ros_type(asked.type));
    if (kind == rowe::detail::pair_kind::subscribe_text) asked.keep = rowe::keep::all;
    if (how.lease != rowe::duration{}) asked.keep = rowe::keep::newest;
    return offer(asked);
  }

  // Offers one that is active from the next cycle on, which this is.
  rowe::detail::queue_pair& offer_now(const rowe::detail::pair_request& asked) {
    rowe::detail::queue_pair& made = offer(asked);
    cycle();
    return made;
  }
  rowe::detail::queue_pair& offer_now(rowe::detail::pair_kind kind, std::string_view topic,
                                      std::size_t value_bytes, const rowe::topic_options& how = {},
                                      const rowe::schema_description* schema = nullptr,
                                      std::string_view type = {}) {
    rowe::detail::queue_pair& made = offer(kind, topic, value_bytes, how, schema, type);
    cycle();
    return made;
  }

  // What a handle on it is made of. Such a handle does not give the queue pair back: close its lifecycle for
  // that.
  static rowe::detail::pair_handle handle_of(rowe::detail::queue_pair& on) { return {nullptr, on}; }
  // Such a handle, on a queue pair that is active from now on.
  template <class Handle>
  Handle open(const rowe::detail::pair_request& asked) {
    return Handle{handle_of(offer_now(asked))};
  }

  rowe::endpoint_options options;
  rowe::access::policy access;               // the first
  std::deque<rowe::access::policy> policies; // those after it
  rowe::service::policy_handover<> rights;
  rowe::rt::arena memory;
  std::unique_ptr<std::byte[]> chunk_pool; // not touched here
  seeded_entropy random;
  rowe::json::reader validator;
  Transport net;
  std::span<rowe::detail::queue_pair> pairs;
  rowe::rt::time_point now;
  rowe::rt::time_point next_wake{};
  rowe::service::shared_state& shared;
  rowe::service::submission_queue& submissions;
  rowe::service::shared_inbox& inbox;
  rowe::rt::waker<>& waker; // of idle::wake; nobody sleeps here
  rowe::service::core& core;
  std::vector<std::unique_ptr<rowe::detail::pair_codecs>> codecs;
};
using core_harness = core_harness_over<rowe::net::memory_transport>;

// The other end of a connection: writes frames as a client (or server) would and reads those that come.
class peer {
 public:
  explicit peer(core_harness& in, rowe::service::side ours = rowe::service::side::server,
                std::string_view address = "127.0.0.1:50000", std::string_view path = "/",
                std::string_view subprotocol = {}, std::string_view token = {})
      : on_{in},
        net_{in.net},
        id_{in.net.open(ours, address, path, subprotocol, token)},
        masks_{ours == rowe::service::side::server},
        has_clock_{subprotocol.starts_with("foxglove")} {
    assembly_.resize(128 * 1024); // more than the options of a core in a harness allow, and filled in no time
    parser_.reset(masks_ ? rowe::wire::role::client : rowe::wire::role::server,
                  {.message_bytes_max = assembly_.size() - 64, .fragments_max = 1000}, assembly_);
  }

  connection_id id() const { return id_; }

  void say(std::string_view text) { send(rowe::wire::opcode::text, text); }
  // Says it, and the core does its next cycles.
  void tell(std::string_view text, int cycles = 1) {
    say(text);
    on_.cycles(cycles);
  }
  void send(rowe::wire::opcode what, std::string_view payload) {
    const rowe::wire::mask_key key{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}};
    std::vector<std::byte> frame(rowe::wire::frame_header_bytes_max + payload.size());
    const auto masked = masks_ ? std::optional{key} : std::nullopt;
    const std::size_t header = rowe::wire::write_frame_header(frame.data(), what, payload.size(), masked);
    payload.copy(reinterpret_cast<char*>(frame.data() + header), payload.size());
    frame.resize(header + payload.size());
    if (masks_) rowe::wire::mask(std::span{frame}.subspan(header), key);
    net_.arrive(id_, frame);
  }
  void send_raw(std::span<const std::byte> bytes) { net_.arrive(id_, bytes); }

  // What has come since the last call: texts, and binary messages; pings are answered, the close code kept,
  // and times of Foxglove's clock too.
  std::vector<std::string> hear(std::size_t bytes_max = SIZE_MAX) {
    std::vector<std::string> texts;
    const auto sent = net_.sent(id_);
    std::vector<std::byte> bytes(
        sent.begin(), sent.begin() + static_cast<std::ptrdiff_t>(std::min(bytes_max, sent.size())));
    net_.peer_reads(id_, bytes.size());
    std::span<std::byte> rest{bytes};
    while (!rest.empty()) {
      const auto step = parser_.next(rest);
      rest = rest.subspan(step.consumed);
      const std::string_view text{reinterpret_cast<const char*>(step.payload.data()), step.payload.size()};
      const bool binary = step.event == rowe::wire::frame_event::binary;
      if (binary && takes_time(text)) continue;
      if (step.event == rowe::wire::frame_event::text || binary) texts.emplace_back(text);
      if (binary) ++binaries;
      if (step.event == rowe::wire::frame_event::ping) {
        ++pings;
        if (answers_pings) send(rowe::wire::opcode::pong, text);
      }
      if (step.event == rowe::wire::frame_event::pong) ++pongs;
      if (step.event == rowe::wire::frame_event::close) {
        close_code = step.close_code;
        close_reason = step.reason;
      }
      if (step.event == rowe::wire::frame_event::violation) violated = std::string{step.reason};
    }
    return texts;
  }
  std::string hear_as_one() {
    std::string all;
    for (const std::string& text : hear()) all += text;
    return all;
  }
  // What has come when the core has done so many cycles more.
  std::vector<std::string> hear_after(int cycles) {
    on_.cycles(cycles);
    return hear();
  }
  // What comes in so many cycles, after each of which it reads.
  std::vector<std::string> hear_during(int cycles, rowe::rt::duration each = 1ms) {
    std::vector<std::string> texts;
    while (cycles-- > 0) {
      on_.cycle(each);
      for (std::string& text : hear()) texts.push_back(std::move(text));
    }
    return texts;
  }
  // What it is told when it says this.
  std::vector<std::string> ask(std::string_view text, int cycles = 1) {
    tell(text, cycles);
    return hear();
  }
  // Reads all that has come and keeps nothing of it; pings are answered. Allocates nothing once it has read
  // as much before.
  void skim() {
    const auto sent = net_.sent(id_);
    skimmed_.assign(sent.begin(), sent.end());
    net_.peer_reads(id_, skimmed_.size());
    for (std::span<std::byte> rest{skimmed_}; !rest.empty();) {
      const auto step = parser_.next(rest);
      rest = rest.subspan(step.consumed);
      if (step.event != rowe::wire::frame_event::ping) continue;
      send(rowe::wire::opcode::pong,
           {reinterpret_cast<const char*>(step.payload.data()), step.payload.size()});
    }
  }
  bool cut() const { return net_.closed_by_us(id_); }
  void leave(rowe::service::close_cause how = rowe::service::close_cause::peer) {
    net_.peer_closes(id_, how);
  }

  std::uint16_t close_code = 0;
  std::string close_reason;
  int binaries = 0;                // of what was heard
  std::vector<std::int64_t> times; // nanoseconds since 1970
  int pings = 0;
  int pongs = 0;
  bool answers_pings = true;
  std::string violated; // what was wrong with what we were sent

 private:
  bool takes_time(std::string_view message) {
    if (!has_clock_ || message.size() != 9 || message[0] != 2) return false;
    std::int64_t ns = 0;
    std::memcpy(&ns, message.data() + 1, sizeof ns);
    if (!times.empty() && ns < times.back()) violated = "the time goes back";
    times.push_back(ns);
    return true;
  }

  core_harness& on_;
  rowe::net::memory_transport& net_;
  connection_id id_;
  bool masks_;
  bool has_clock_;
  std::vector<std::byte> assembly_;
  std::vector<std::byte> skimmed_;
  rowe::wire::frame_parser parser_;
};

} // namespace harness
