// SPDX-License-Identifier: Apache-2.0
// Folder core: the cycle, the parts as members, the thread, the memory. Parts decide what a message does.
// The core: everything the service thread does, as a function of state, time and what the transport reports.
// It has no thread, clock, socket or randomness of its own. So a simulation can run hours of bad network in
// seconds from one seed, a fuzzer can feed it bytes, and sockets are one transport among others.
// The parts do the work (core_parts.hpp). This file has the cycle, and how connections come and go.
// One cycle, in this order:
//   read: what each peer sent is staged; a stop is carried out as it is read
//   update the stop: loops, guards, answers
//   carry out what was staged, one message of each peer in turn: inbound before outbound
//   take from handles, a stated budget each, then from threads
//   expire: messages, throttled subscriptions that are due, peers to ping or cut, the statistics
//   flush the scheduled peers in turn, up to a stated amount of work; urgent frames go first on each
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/thread.hpp>

#include "service/core/core_parts.hpp"

namespace rowe::service {

class core final : public transport_sink, private frame_handler, private core_parts {
 public:
  using core_parts::footprint_bytes;

  // As core_parts.
  core(rt::arena& memory, const core_options& options, const shared_parts& with_threads,
       const core_seams& seams, rt::time_point start) noexcept;

  // Does all the work that there is at `now`, and returns the latest time for the next cycle. An event of the
  // transport, or a publish of a handle, calls for a cycle before that. Bounded by the limits; never waits.
  rt::time_point cycle(rt::time_point now) noexcept;

  // A handle of this process was given a call in the last cycle. If it answers at once, its answer comes
  // before the transport can be polled again. For a service thread that does not sleep.
  bool awaits_answer() const noexcept { return static_cast<bool>(call_requests_.awaited()); }
  // Whether that handle has submitted something since.
  bool has_answer() const noexcept;
  // If it has: takes the submission and writes the answer, as a cycle would. Returns as cycle().
  rt::time_point write_answer(rt::time_point now) noexcept;

  // What the service thread was granted, as /rowe/stats says it. Before the first cycle.
  void describe_thread(const rt::grants& granted, bool memory_locked) noexcept {
    statistics_report_.describe_thread(granted, memory_locked);
    stop_options_ = settled(state_.options.stop, static_cast<bool>(granted.fifo));
  }

  // How long the last cycle took, by the clock of whoever runs the core.
  void record_cycle(rt::duration took) noexcept;

  // The longest sleep. Handles that do not wake the thread must be polled, because a peer may wait for what
  // they submit, and what they submit may expire. If they wake the thread, or predictor() knows when they
  // publish, only parked submissions and parked peers need polling.
  rt::duration idle_time_max(rt::duration poll_period) const noexcept {
    const bool handles_talk = handle_registry_.talking() != 0 && state_.peers.count() != 0;
    const std::uint32_t listened = audiences_.listened();
    const bool pending = handle_submissions_.waits() && (listened != 0 || handles_talk);
    const bool unseen = listened > publish_predictor_.listened() || handles_talk; // by who predicts
    const bool parked = ingress_.any_parked() && receiver_.pair(); // a handle that takes one wakes nobody
    if (pending || parked || (unseen && !state_.options.handles_wake)) return poll_period;
    const bool waits = thread_submissions_.waits() ||
                       (state_.peers.count() != 0 && direct_messages_.pending() != 0); // for room, or a slot
    return waits || handle_registry_.talking() != 0 ? talking_rest : idle_rest;
  }
  // Under idle::phase: says when to poll.
  publish_predictor& predictor() noexcept { return publish_predictor_; }
  // If handles wake this thread: nothing was submitted since cycle() looked. For rt::waker::sleep().
  bool nothing_submitted() const noexcept { return handle_registry_.quiet(); }
  std::uint32_t peers() const noexcept { return state_.peers.count(); }
  // True when nothing that was submitted is still to be written.
  bool drained() const noexcept;
  // Stops the loops: the endpoint is about to close.
  void stop_loops(rt::time_point now) noexcept;
  // Closes every peer with code 1001 and refuses further work.
  void close_all(rt::time_point now) noexcept;

  // transport_sink
  void on_open(connection_id id, const peer_info& peer) noexcept override;
  void on_bytes(connection_id id, std::span<std::byte> bytes) noexcept override;
  std::size_t wanted_bytes(connection_id id) const noexcept override;
  void on_gone(connection_id id) noexcept override;
  void on_writable(connection_id id) noexcept override;
  void on_close(connection_id id, close_cause cause) noexcept override;
  void on_rejected(const rejection& reason) noexcept override;
  http_answer on_http(const http_request& request) noexcept override { return own_pages_.answer(request); }
  bool may_displace(connection_id id) const noexcept override;
  void displace(connection_id id) noexcept override;

  // True when every structure is consistent and no slot is lost. For tests, after every step.
  bool check() const noexcept { return inconsistency().empty(); }
  using core_parts::inconsistency; // which structure is not consistent; empty: all are
  std::uint32_t slots_in_use() const noexcept { return message_store_.slots().in_use(); }
  std::uint32_t chunks_in_use() const noexcept { return state_.chunks.chunks() - state_.chunks.free(); }

 private:
  // transport_sink
  admit_answer admit(const credentials& shown) const noexcept override;
  admit_answer may_read(const credentials& shown) noexcept override { return own_pages_.may_read(shown); }
  std::uint64_t awaited_came() const noexcept override { return state_.last_values.came(); }
  void on_warning(std::string_view what, std::string_view remedy) noexcept override;

  // frame_handler
  void handle(peer_index from, const wire::frame_step& step) noexcept override;
  void handle_again(peer_index from, std::span<std::byte> message, bool binary) noexcept override;
  bool stop_in_use() const noexcept override { return stop_rules_.in_use(); }
  bool is_stop(peer_index from, std::span<const std::byte> message, bool binary) noexcept override {
    return dispatcher_.is_stop(from, message, binary);
  }

  // the cycle
  rt::time_point next_cycle() noexcept;
  void expire() noexcept;
  void arm_what_stays() noexcept;
  void notify_room() noexcept;
  bool waits_for_room() const noexcept { return thread_submissions_.waits() || handle_submissions_.waits(); }

  // connections
  connection* find(connection_id id) const noexcept { return state_.peers.find(id); }
  void take_ping(connection& c, std::span<const std::byte> payload) noexcept;
  void close_marked() noexcept;
  void close(connection& c, std::uint16_t code, std::string_view reason) noexcept;
  void cut(connection& c, std::string_view reason) noexcept;
  void forget(connection& c) noexcept;
  void reconnect_later() noexcept;

  std::uint64_t retried_at_ = 0;  // ingress::room_changes() when what is parked was tried last
  std::uint64_t came_before_ = 0; // awaited_came() when the transport was polled last
  std::uint32_t attempts_failed_ = 0;
};

} // namespace rowe::service
