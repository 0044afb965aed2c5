// SPDX-License-Identifier: Apache-2.0
// The core: everything the service thread does, as a function of state, time and what the transport reports.
// It has no thread, clock, socket or randomness of its own, so a simulation can run hours of bad network in
// seconds from one seed, a fuzzer can feed it bytes, and sockets are one transport among others.
//
// One cycle, in this order:
//   transport events in: of each peer, what it said is put aside; a stop is carried out as it is read
//   the stop's own turn: loops, guards, answers
//   what was put aside, one message of each peer in turn: inbound before outbound
//   take from lanes, a stated budget each, then from the front door
//   expire: messages, throttled subscriptions that are due, peers to ping or cut, the statistics
//   offer frames to connections that have something to write, in turn, up to a stated amount of work; urgent
//   first on each
//
// core.cpp holds the cycle and the life of a connection, reading.cpp in which order peers are heard,
// inbound.cpp what they say, publishing.cpp topics, lanes.cpp what this process publishes and takes,
// talking.cpp what it says to peers, delivering.cpp what it is told, calling.cpp who is asked, answering.cpp
// how calls end, providing.cpp services, stopping.cpp the stop, stop_peers.cpp whoever came for that alone.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <rowe/detail/lane.hpp>
#include <rowe/options.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/thread.hpp>

#include "service/board.hpp"
#include "service/calls.hpp"
#include "service/checked_text.hpp"
#include "service/core_options.hpp"
#include "service/direct_messages.hpp"
#include "service/front_door.hpp"
#include "service/ingress.hpp"
#include "service/local_delivery.hpp"
#include "service/outbox.hpp"
#include "service/peer_table.hpp"
#include "service/phase_plan.hpp"
#include "service/queues.hpp"
#include "service/receiver.hpp"
#include "service/router.hpp"
#include "service/sender.hpp"
#include "service/services.hpp"
#include "service/shares.hpp"
#include "service/stop_rules.hpp"
#include "service/timers.hpp"
#include "service/transport.hpp"
#include "service/wire_slots.hpp"
#include "wire/codec.hpp"
#include "wire/own_names.hpp"
#include "wire/protocols.hpp"
#include "wire/text_out.hpp"
#include "wire/websocket.hpp"
#include "json/decoder.hpp"
#include "json/reader.hpp"
#include "json/writer.hpp"

namespace rowe::service {

// As slots' headers have it; the other way of rt::nanoseconds_of().
inline rt::time_point time_of(std::int64_t ns) noexcept { return rt::time_point{rt::duration{ns}}; }

using close_reason = event::text<wire::close_reason_bytes_max>;
inline constexpr rt::duration flood_time_max = std::chrono::seconds{5}; // then whoever floods is cut

class core final : public transport_sink, private frame_handler {
 public:
  static constexpr std::string_view stop_state_topic = wire::stop_state_name;

  static std::size_t footprint_bytes(const limits& bounds) noexcept;

  // `lanes`, `shown` and `door` are shared with other threads; everything else of the core is the service
  // thread's. `memory` must have footprint_bytes() left; time begins at `start`.
  core(rt::arena& memory, const core_options& options, std::span<detail::lane> lanes, board& shown,
       front_door& door, core_seams seams, rt::time_point start) noexcept;

  // Does everything there is to do at `now` and returns when the next cycle is needed at the latest, provided
  // that the transport has nothing to report and no handle publishes before. Bounded by the limits; never
  // waits.
  rt::time_point cycle(rt::time_point now) noexcept;

  // For a thread that does not sleep. A handle of this process that was given a call in the last cycle, and
  // answers at once, has done so before the carrier could be asked again.
  bool awaits_answer() const noexcept { return asked_lane_ != no_index; }
  // Whether it has said something since.
  bool has_answer() noexcept;
  // If it has: takes that and writes what comes of it, as a cycle would; returns as cycle().
  rt::time_point write_answer(rt::time_point now) noexcept;

  // What the service thread was granted, as /rowe/stats says it. Before the first cycle.
  void describe_thread(const rt::grants& granted, bool memory_locked) noexcept;

  // How long the last cycle took, by the clock of whoever runs the core.
  void record_cycle(rt::duration took) noexcept;

  // How long the next cycle may be put off when nothing else calls for it: a handle of this process may have
  // something that a peer waits for, or something that must not be left lying when its time is over. Handles
  // that tell leave only what waits in a lane for room further on; so do those that phases() looks after.
  rt::duration idle_time_max(rt::duration poll_period) const noexcept {
    const bool lanes_talk = talking_lanes_ != 0 && peers_.count() != 0;
    if (lanes_wait_ && (wanted_lanes_ != 0 || lanes_talk)) return poll_period;
    if (!options_.lanes_tell && (wanted_lanes_ > phases_.listened() || lanes_talk)) return poll_period;
    if (ingress_.any_parked() && receiver_.pair() != no_index)
      return poll_period; // a lane does not tell what it takes
    // Something waits for room at a peer, or for a slot.
    if (door_held_count_ != 0 || (peers_.count() != 0 && messages_.pending() != 0)) return talking_rest;
    return talking_lanes_ != 0 ? talking_rest : idle_rest;
  }
  // Under idle::phase: what else to wait for.
  phase_plan& phases() noexcept { return phases_; }
  // Where handles tell: nothing was handed over since cycle() looked. For rt::wake_bell::sleep().
  bool lanes_quiet() const noexcept;
  std::uint32_t peers() const noexcept { return peers_.count(); }
  // True when nothing that was published waits to be written.
  bool drained() const noexcept;
  // Stops the loops: the endpoint is about to close.
  void stop_loops(rt::time_point now) noexcept;
  // Says goodbye to every peer (close code 1001) and refuses further work.
  void close_all(rt::time_point now) noexcept;

  // transport_sink
  void on_open(connection_id id, const peer_info& peer) noexcept override;
  void on_bytes(connection_id id, std::span<std::byte> bytes) noexcept override;
  std::size_t wanted_bytes(connection_id id) const noexcept override;
  void on_writable(connection_id id) noexcept override;
  void on_close(connection_id id, close_cause cause) noexcept override;
  void on_refused(const refusal& reason) noexcept override;
  http_answer on_http(const http_request& request) noexcept override;
  bool may_displace(connection_id id) const noexcept override;
  void displace(connection_id id) noexcept override;

  // True when every structure is consistent and no slot is lost. For tests, after every step.
  bool check() const noexcept { return inconsistency().empty(); }
  std::string_view inconsistency() const noexcept; // which of them is not; empty: all are
  std::uint32_t slots_in_use() const noexcept { return store_.slots().in_use(); }

 private:
  static constexpr std::uint32_t own_topics = 2;    // statistics, and the stop's state
  static constexpr std::uint32_t reports_burst = 8; // events about refusals to one peer; then one a second
  static constexpr rt::duration talking_rest = std::chrono::milliseconds{10};
  static constexpr rt::duration rates_period = std::chrono::seconds{1}; // of the service /rowe/stats
  // How long the next cycle may wait while a loop is to acknowledge a stop: not long at first.
  static constexpr rt::duration acknowledgment_rest_min = std::chrono::microseconds{50};
  static constexpr rt::duration acknowledgment_rest_max = std::chrono::milliseconds{1};
  static constexpr rt::duration idle_rest = std::chrono::milliseconds{250}; // set-up and sockets wake earlier

  void arm_what_stays() noexcept;

  // check.cpp
  bool check_calls() const noexcept;
  bool check_holders() const noexcept;
  bool check_shares() const noexcept;

  // core.cpp
  connection* find(connection_id id) const noexcept { return peers_.find(id); }
  rt::time_point next_cycle() const noexcept;
  void expire() noexcept;
  void show_carrier_memory() noexcept;
  void look_after_later(const connection& c) noexcept;
  void look_after(connection& c) noexcept;
  void close(connection& c, std::uint16_t code, std::string_view reason) noexcept;
  void cut(connection& c, std::string_view reason) noexcept;
  void forget(connection& c) noexcept;
  void reconnect_later() noexcept;
  void report(event::kind kind, std::string_view peer, std::string_view what,
              std::string_view remedy = {}) noexcept;
  void add(counter which, std::uint64_t by = 1) noexcept { shown_.counts.add(which, by); }

  // frame_handler
  void handle(peer_index from, const wire::frame_step& step) noexcept override;
  void handle_again(peer_index from, std::span<const std::byte> text) noexcept override;
  bool stop_in_use() const noexcept override { return stop_.in_use(); }
  bool is_stop(peer_index from, std::string_view text) noexcept override;
  std::uint64_t room_changes() const noexcept { return ingress_.room_changes(); }

  // inbound.cpp
  void take_text(connection& c, std::span<const std::byte> payload) noexcept;
  void hear(connection& c, std::span<const std::byte> payload) noexcept;
  using sentence_room = std::array<char, wire::refusal::text_bytes_max>;
  wire::decode_room decode_room(sentence_room& sentence) const noexcept {
    return {.scratch = scratch_, .sentence = sentence, .limits = {.name_bytes_max = bounds_.topic_bytes_max}};
  }
  void carry_out(connection& c, const wire::request& asked, const json::document& text,
                 const wire::diagnostic& unknown) noexcept;
  void refuse_malformed(connection& c, std::string_view text, const error& why) noexcept;
  void take_message(connection& c, const wire::request& asked, const json::document& text) noexcept;
  void subscribe(connection& c, const wire::request& asked) noexcept;
  void unsubscribe(connection& c, const wire::request& asked) noexcept;
  void advertise(connection& c, const wire::request& asked) noexcept;
  void unadvertise(connection& c, const wire::request& asked) noexcept;
  void relay(connection& c, const wire::request& asked) noexcept;
  void tell_other_type(connection& c, std::string_view id_raw, std::uint32_t topic,
                       std::string_view asked) noexcept;
  void tell_other_types(std::uint32_t topic) noexcept;
  void answer_refusal(connection& c, wire::codec_id in, std::string_view id_raw,
                      const wire::diagnostic& why) noexcept;
  void say_error(connection& c, wire::codec_id in, std::string_view id_raw,
                 const wire::diagnostic& why) noexcept;
  void send_status(connection& c, std::string_view id_raw, std::string_view why) noexcept;
  void answer_failure(connection& c, wire::codec_id in, const wire::call_origin& call,
                      const wire::diagnostic& why) noexcept;
  std::uint32_t peers_topics_held(const connection& c) const noexcept;
  bool holds_topic(const connection& c, std::uint32_t topic) const noexcept;
  std::uint32_t topic_for(connection& c, const wire::request& asked) noexcept;
  void refuse(connection& c, wire::codec_id in, std::string_view id_raw,
              const wire::diagnostic& why) noexcept;
  void refuse(connection& c, std::string_view id_raw, std::string_view why) noexcept;
  void refuse_limit(connection& c, std::string_view id_raw, std::string_view what, std::uint64_t limit,
                    std::string_view option) noexcept;
  struct taken_share {
    std::string_view what;
    std::uint32_t held; // by the peer
    std::uint32_t left; // of those
    std::uint32_t for_peers;
    std::uint32_t kept; // of those that are left
    std::string_view option;
  };
  // How many connections there may be, each with its claims.
  std::uint32_t claimants() const noexcept { return ours_ == side::client ? 1 : bounds_.connections_max; }
  claims claims_to(std::uint32_t pool, std::uint32_t one_in = 2) const noexcept {
    return {pool, claimants(), one_in};
  }
  claims claims_to_topics(std::uint32_t share) noexcept;
  void refuse_share(connection& c, const wire::request& asked, const taken_share& of) noexcept;
  void refuse_for(connection& c, std::string_view id_raw, wire::text_out& why,
                  std::string_view option) noexcept;
  bool admits_refusal(connection& c, event::kind kind, std::string_view why,
                      std::string_view remedy) noexcept;
  bool within_refusals(connection& c) noexcept;
  void report_refusal(connection& c, event::kind kind, std::string_view why,
                      std::string_view remedy) noexcept;
  void report_refusals(connection& c) noexcept;
  bool drops_excess() noexcept;
  void cut_if_flooding(connection& c, const rate_limit& rate, std::string_view why) noexcept;

  // publishing.cpp
  template <class WriteText>
  std::uint32_t compose(rt::time_point expires, WriteText&& write_text,
                        slot_use what = slot_use::ordinary) noexcept {
    return outbox_.compose(expires, write_text, what);
  }
  template <class WriteText>
  std::uint32_t answer(connection& c, WriteText&& write_text, rt::time_point expires = rt::never) noexcept {
    return outbox_.reply({c.id.index}, write_text, expires);
  }
  void release(std::uint32_t slot) noexcept { store_.release(slot); }
  void list(const connection& c) noexcept { outbox_.schedule({c.id.index}); }
  void send_direct(connection& c, const json::writer& written) noexcept;
  // Which peer published what is relayed, and its request's id; none: this process.
  struct published_by {
    detail::peer_ref peer{};
    std::string_view id_raw{};
  };
  template <class WriteBody>
  void publish(std::uint32_t topic, rt::time_point published, rt::time_point expires, latch_owner latches,
               WriteBody&& write_body, const published_by& who = {}) noexcept;
  void remove_subscription(connection& c, std::uint32_t index) noexcept;
  void keep_latched(topic& on, std::uint32_t slot, latch_owner owner) noexcept;
  void forget_latched(topic& on, latch_owner owner) noexcept;
  void let_go_topic(std::uint32_t topic) noexcept;
  void let_go_own_topic(std::uint32_t topic) noexcept;
  const peer_queues& queues_of(const connection& c) const noexcept { return outbox_.of({c.id.index}); }

  // lanes.cpp
  void take_from_lanes() noexcept;
  void attach(std::uint32_t lane) noexcept;
  void detach(std::uint32_t lane) noexcept;
  void count_refusals(const detail::lane& lane) noexcept;
  void take_from(std::uint32_t lane) noexcept;
  std::size_t ample_budget(const topic& on) const noexcept;
  void take_value(std::uint32_t lane, std::uint32_t slot) noexcept;
  void take_topic_from_peers(std::uint32_t topic, std::string_view type) noexcept;
  bool withdraw_advertisement(connection& c, std::uint32_t topic) noexcept;
  bool take_back_topic() noexcept;
  queue* queue_to_server(std::uint32_t lane) noexcept;
  void report_conflict(std::uint32_t topic, const detail::lane& asked) noexcept;
  bool has_other_handle(std::uint32_t topic, bool that_reads) const noexcept;
  bool has_unsent(std::uint32_t lane) noexcept;
  void note(topic& on, rt::time_point published) noexcept;
  bool wanted_now(const topic& on) noexcept;
  void deliver_inbox(std::uint32_t lane, std::span<const char> body, const published_by& who) noexcept;
  void tell_misfit(std::uint32_t lane, const published_by& who, std::string_view why) noexcept;
  void update_wanted(std::uint32_t topic) noexcept;
  void announce(connection& c, std::uint32_t lane, bool begins) noexcept;
  void announce_all(connection& c) noexcept;

  // talking.cpp
  void take_entries(std::uint32_t lane) noexcept;
  std::size_t take_new_entries(std::uint32_t lane) noexcept;
  void retry_entries(std::uint32_t lane) noexcept;
  bool take_entry(std::uint32_t lane, std::uint32_t slot, bool parked) noexcept;
  void take_from_door() noexcept;
  void retry_door() noexcept;
  bool take_door_slot(std::uint32_t slot, bool parked) noexcept;
  void tell_of_room() noexcept;
  status check_text(std::string_view text) noexcept { return check_object_text(validator_, text); }
  // What those are told who wanted a peer that is there no more.
  errc gone_as() const noexcept { return closing_ ? errc::closed : errc::peer_lost; }
  void tell(const party& whom, detail::call_ref own, const status& outcome,
            std::string_view text = {}) noexcept {
    delivery_.complete(whom, own, outcome, text);
  }
  bool goes_to_receiver(std::string_view service) noexcept;
  rt::time_point inbound_expiry(std::int64_t ttl_ns) const noexcept;
  // When something of this process ends that was stamped so: at its own time means in the cycle that takes
  // it, however long it has lain in its lane.
  rt::time_point expiry_of(rt::time_point stamped, rt::time_point expires) const noexcept {
    return expires == stamped ? now_ : expires;
  }

  enum class stop_service : std::uint8_t; // stopping.cpp

  // calling.cpp, answering.cpp, providing.cpp
  void take_call(connection& c, const wire::request& asked) noexcept;
  void take_reply(connection& c, const wire::request& said) noexcept;
  // `to`: of generation 0 whoever provides it.
  void start_call(const party& asker, detail::call_ref own, std::string_view service,
                  const wire::call_args& what, detail::peer_ref to, rt::time_point began,
                  rt::time_point deadline) noexcept;
  struct reply {
    std::string_view text{};                // JSON; where no value is given
    const json::encoder* encoder = nullptr; // of the value
    const std::byte* value = nullptr;
    rt::time_point expires = rt::never;
    party waits{}; // who is told once it is written; nobody
    detail::call_ref own{};
  };
  status answer_call(const party& provider, detail::call_ref which, const reply& with) noexcept;
  status refuse_call(const party& provider, detail::call_ref which, std::string_view why) noexcept;
  result<std::uint32_t> find_answered(const party& provider, detail::call_ref which) noexcept;
  void route(std::uint32_t call, std::string_view service, const wire::call_args& what,
             detail::peer_ref to) noexcept;
  void ask_anyone(std::uint32_t call, std::string_view service, const wire::call_args& what) noexcept;
  void hand_to_lane(std::uint32_t call, std::uint32_t lane, const wire::call_args& what) noexcept;
  void hand_to_receiver(std::uint32_t call, std::string_view service, const wire::call_args& what) noexcept;
  void ask_peer(std::uint32_t call, connection* c, const wire::codec& in, std::string_view service,
                const wire::call_args& what) noexcept;
  static std::string_view own_service(std::string_view asked) noexcept; // its whole name; empty: none of ours
  void answer_own(std::uint32_t call, std::string_view service, const wire::call_args& what) noexcept;
  void write_publishers(json::writer& into, std::uint32_t topic) noexcept;
  void answer_stop_call(std::uint32_t call, stop_service which, const wire::call_args& what) noexcept;
  result<std::uint32_t> finish(std::uint32_t call, const wire::body& value, rt::time_point expires) noexcept;
  result<std::uint32_t> finish_with(std::uint32_t call, std::string_view text,
                                    rt::time_point expires = rt::never) noexcept;
  void end_without_room(std::uint32_t call, const result<std::uint32_t>& finished) noexcept;
  void finish_badly(std::uint32_t call, const error& why, std::string_view sentence = {}) noexcept;
  void close_call(std::uint32_t call) noexcept;
  void end_calls_of(connection& c) noexcept;
  void end_calls_of_lane(std::uint32_t lane) noexcept;
  void advertise_service(connection& c, const wire::request& asked) noexcept;
  void unadvertise_service(connection& c, const wire::request& asked) noexcept;
  void take_service_from_peer(std::uint32_t index) noexcept;
  void attach_talker(std::uint32_t lane) noexcept;
  void detach_talker(std::uint32_t lane) noexcept;
  void take_over_inbox(std::uint32_t lane) noexcept;
  void announce_service(connection& c, std::uint32_t lane, bool begins) noexcept;
  connection* server_connection() noexcept;
  void limit_call(std::uint32_t call, rt::time_point until) noexcept;
  rt::time_point time_limit(std::int64_t time_ns) const noexcept;

  // stopping.cpp
  enum class stop_service : std::uint8_t { none, stop, reset, lease, state };
  static stop_service stop_service_named(std::string_view name) noexcept;
  static std::string_view name_of(stop_service which) noexcept;
  struct stop_asker {
    party who{};
    std::string_view id_raw{}; // peer
    detail::call_ref call{};   // of this process
    bool silent = false;       // wants no answer
  };
  // Who waits for the answer to a stop.
  struct stop_waiter {
    party who{};
    detail::call_ref call{};
    rt::time_point accepted{};
    rt::time_point until{};
    std::uint16_t id_bytes = 0;
    std::array<char, call_table::id_bytes_max> id{};
  };
  status attach_latch(std::uint32_t lane) noexcept;
  void detach_latch(std::uint32_t lane) noexcept;
  void take_stop_call(connection& c, const wire::request& asked, stop_service which) noexcept;
  bool asks_to_stop(const json::document& text) const noexcept;
  void take_silent_stop(connection& c, std::string_view args) noexcept;
  void carry_out_stop(stop_service which, const stop_asker& asker, std::string_view args) noexcept;
  void report_stop(std::string_view reason) noexcept;
  void leave_stop(const connection& c) noexcept;
  void await_observed(const stop_asker& asker) noexcept;
  void answer_observed() noexcept;
  void answer_stop(stop_service which, const stop_asker& asker, rt::time_point accepted,
                   stop_rules::refusal refused) noexcept;
  void write_stop_answer(json::writer& into, stop_service which, rt::time_point accepted,
                         stop_rules::refusal refused) noexcept;
  void turn_stop() noexcept;
  void show_stop_state() noexcept;
  void show_stop_as_message(bool changed) noexcept;
  rt::time_point next_stop_turn() const noexcept;

  // Whether a topic is shown: that of the stop's state only where there is a stop, or somebody subscribes.
  bool is_listed(std::uint32_t topic) noexcept {
    const std::uint32_t holders = router_.at(topic).holders;
    return topic == stop_topic_ && !stop_.in_use() ? holders > 1 : holders != 0;
  }

  // stop_peers.cpp
  static bool is_for_stop(stop_service which) noexcept;
  static bool is_for_stop(const wire::request& asked) noexcept;

  // statistics.cpp
  void begin_statistics() noexcept;
  void end_statistics_period() noexcept;
  void mark_rates() noexcept;
  void publish_statistics() noexcept;
  void write_statistics(json::writer& into) noexcept;
  void write_topics(json::writer& into, bool of_service) noexcept;
  void write_losses(json::writer& into) noexcept;
  void write_report(json::writer& into) noexcept;
  void write_state(json::writer& into, bool of_service) noexcept;
  void write_connections(json::writer& into) noexcept;

  const core_options options_;
  const limits bounds_;
  const side ours_;
  std::array<char, 64> name_{};
  std::size_t name_bytes_ = 0;
  transport& carrier_;
  entropy& random_;
  json::reader& validator_;
  const wire::protocol_set& protocols_;
  http_answer (*page_)(const http_request&) noexcept;
  board& shown_;
  front_door& door_;

  cycle_state cycle_;
  rt::time_point& now_ = cycle_.now;
  bool& closing_ = cycle_.closing;
  std::size_t& work_bytes_ = cycle_.work_bytes;
  timers timers_;
  peer_table peers_;
  router router_;
  latch_store latches_;
  message_store store_;
  outbox outbox_;
  wire_slots& slots_ = store_.slots();
  sender sender_;
  std::span<detail::lane> lanes_;
  std::span<lane_view> views_;
  call_table calls_;
  local_delivery delivery_;
  receiver receiver_;
  ingress ingress_;
  direct_messages messages_;
  bool heard_before_ = false; // the text that is carried out found no room then
  phase_plan phases_;
  services services_;
  std::uint32_t topics_charged_ = 0; // counts of claims_to_topics()
  claims subscription_claims_;
  claims service_claims_;
  claims call_claims_;
  std::span<std::uint32_t> door_held_;     // slots taken there that wait for room further on, in their order
  std::span<std::uint32_t> unarmed_calls_; // likewise: calls with a deadline
  std::uint32_t unarmed_count_ = 0;
  std::span<char> scratch_; // the names and the id of the request that is carried out: only decoders write it

  stop_rules stop_;
  std::span<stop_waiter> stop_waiters_; // a ring: who came first is answered first
  std::uint32_t stop_first_waiter_ = 0;
  std::uint32_t stops_awaited_ = 0;
  rt::time_point stop_awaited_since_{}; // of the newest that waits
  std::uint32_t stop_topic_ = no_index; // of the state; from the first latch on
  std::uint64_t stop_version_shown_ = 0;
  bool stop_reported_running_ = false; // as of the last event
  rt::time_point stop_state_due_ = rt::never;
  rt::time_point stop_delivered_at_{};

  rt::time_point opened_at_ = rt::never;
  rt::time_point statistics_at_{};
  // When the newest period of the service's rates began, and the one before.
  std::array<rt::time_point, 2> rates_marked_{};
  std::uint32_t statistics_topic_ = no_index; // of a server
  std::uint32_t wanted_lanes_ = 0;
  std::uint32_t talking_lanes_ = 0;
  std::uint64_t lanes_attached_ = 0;
  // Of events that somebody came, went, or was not let in.
  rate_limit comings_{std::chrono::milliseconds{20}, 128};
  // Why peers that flood are cut.
  close_reason too_many_messages_;
  close_reason too_many_refusals_;
  std::uint64_t door_expired_ = 0; // there, and counted
  std::uint32_t door_held_count_ = 0;
  std::uint32_t peer_calls_ = 0;        // in flight, asked by peers
  bool room_came_ = false;              // at the front door
  bool lanes_ask_room_ = false;         // a handle sleeps until there is room
  std::uint64_t retried_at_ = 0;        // likewise, for what is put aside
  std::uint32_t asked_lane_ = no_index; // that was given a call in this cycle, the last one
  std::uint32_t attempts_failed_ = 0;
  bool lanes_left_ = false; // a lane had more than its share of this cycle
  bool lanes_wait_ = false; // something stays in a lane until there is room further on
  bool excess_ = false;     // the message that is carried out is beyond its peer's rate
  rt::grants granted_;
  bool memory_locked_ = false;
};

} // namespace rowe::service
