// SPDX-License-Identifier: Apache-2.0
// Endpoints: where we are reachable, or whom we try to reach. Endpoints are for set-up, handles are for
// loops.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <rowe/caller.hpp>
#include <rowe/connection.hpp>
#include <rowe/detail/pair_request.hpp>
#include <rowe/emergency_stop.hpp>
#include <rowe/event.hpp>
#include <rowe/lane.hpp>
#include <rowe/message.hpp>
#include <rowe/options.hpp>
#include <rowe/parameter.hpp>
#include <rowe/publisher.hpp>
#include <rowe/received.hpp>
#include <rowe/responder.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/grants.hpp>
#include <rowe/schema.hpp>
#include <rowe/stop_latch.hpp>
#include <rowe/subscriber.hpp>

namespace rowe {

class recorder;        // rowe/recording.hpp
struct record_options; // likewise

// One counter of an endpoint, by the name under which /rowe/stats has it too.
struct count {
  std::string_view name;
  std::string_view group;   // "loss", "chosen", "flow", "refusal", "own"
  std::string_view meaning; // a phrase
  std::uint64_t value = 0;
};

// Owns a service thread, its sockets and its memory. Set-up calls may come from any thread, one at a time;
// they may wait, allocate and enter the kernel. send(), receive(), invoke(), reply() and similar calls may
// come from any threads at the same time, but not from real-time threads, which use handles. Handles outlive
// their endpoint safely. One that was moved from answers every call with misuse, or with nothing.
//
// An endpoint and its handles belong to the process that opened it. In a child of fork() their calls say
// forked at once, or nothing, a stop_latch is engaged, and their destructors do nothing. The child can open
// endpoints of its own.
class endpoint {
 public:
  // Listens on `port` (0: any free one) and serves the page, rosbridge and WebSockets there. Errors:
  // address_in_use, bad_address, bad_access, bad_certificate, bad_web, not_loopback, no_memory, no_thread,
  // bad_argument (an option out of its range).
  static result<endpoint> listen(std::uint16_t port, const endpoint_options& options = {});
  // The same on `options.port`.
  static result<endpoint> listen(const endpoint_options& options);

  // Connects to `url`, "ws://HOST[:PORT][/PATH]" or "wss://HOST[:PORT][/PATH]", and again whenever the
  // connection is lost, until closed. Returns at once; wait_peer() waits for the connection. Errors: bad_url,
  // bad_access (`token` or `token_file`), bad_certificate, no_memory, no_thread, bad_argument.
  static result<endpoint> connect(std::string_view url, const endpoint_options& options = {});

  endpoint(endpoint&&) noexcept;
  endpoint& operator=(endpoint&&) noexcept;
  ~endpoint(); // close(0)

  // A publisher of T on `topic`, which peers see as `options.type`, else the schema's type. Errors:
  // bad_argument (a name that is empty or too long, or begins with /rowe/; a depth or ttl out of range),
  // too_big (no text of a T is as short as a message may be; value: the longest one, limit: that of
  // messages), too_many_handles, handle_memory, too_many_topics, type_conflict, closed. The text of a T may
  // be longer than message_bytes_max: then the service thread encodes it in pieces, and it goes as a long
  // message.
  template <class T>
  result<publisher<T>> advertise(std::string_view topic, const topic_options& options = {});

  // A subscriber to `topic`: it gets what peers publish, and what this process publishes on the same
  // endpoint, decoded into T, or as text for json_text. If the endpoint listens, topics below /rowe/ are its
  // own. If it connects, they are its server's, and counts() and connections() have its own figures. Errors:
  // as advertise().
  template <class T>
  result<subscriber<T>> subscribe(std::string_view topic, const topic_options& options = {});

  // A responder that provides the service `name`; "x" and "/x" are the same service. Peers call it over
  // rosbridge or in the plain format, handles of this process with callers and lanes. Both of Q and A may
  // be json_text. Errors: bad_argument (a name that is empty or too long; a depth out of range),
  // reserved_topic, service_taken, too_many_services, too_many_handles, handle_memory, closed.
  template <class Q, class A>
  result<responder<Q, A>> serve(std::string_view name, const service_options& options = {});

  // A caller of the service `name`. Nobody needs to provide it yet: each call looks for the provider. Errors:
  // as serve(), but for service_taken and too_many_services.
  template <class Q, class A>
  result<caller<Q, A>> client(std::string_view name, const service_options& options = {});

  // A parameter: a value that a loop reads, and that the program and peers may change while it runs, within
  // `allowed`. It begins as `first`. "x" and "/x" are the same parameter. T: a bool, a number, an enum with
  // listed names, or a fixed_string of up to 124 bytes. Peers see it from the service thread's next cycle on,
  // until the handle is destroyed. Errors: bad_argument (a name that is empty or too long), reserved_topic (a
  // name below /rowe/), out_of_range (`first` is not allowed), parameter_taken, too_many_parameters, closed.
  template <parameter_type T>
  result<rowe::parameter<T>> parameter(std::string_view name, const T& first, const range<T>& allowed = {});

  // A lane for plain messages, calls and replies. Errors: bad_argument, too_many_handles, handle_memory,
  // closed.
  result<lane> open_lane(const lane_options& options = {});

  // ---- the stop: see docs/stop.md

  // A latch for one loop. From the first one on the endpoint has a stop, and is stopped. Errors: bad_argument
  // (name, loop_timeout), too_many_latches (8), too_many_handles, too_many_topics, closed.
  result<rowe::stop_latch> stop_latch(const latch_options& options = {});

  // Stops all loops of this endpoint, as a peer does that calls /rowe/stop; for another thread of this
  // process that knows of a danger. Needs no free slot, queue or call, and works while the endpoint closes.
  // Any threads, at the same time; not for real-time loops: it wakes the service thread, and waits until the
  // loops have acknowledged, at most `timeout` (negative: no longer than the option observe_timeout, which
  // bounds it in any case; 0: does not wait). Allocates nothing. Errors: no_service (there is no latch, so
  // nothing is stopped), closed (the loops stand since the endpoint was closed); timed_out: the loops are
  // stopped, and it is not known whether they have acknowledged.
  result<emergency_stop_result> emergency_stop(const emergency_stop_request& what, duration timeout);

  // Ends an emergency stop: lets the loops go again, as a person at the robot would. For a program that has a
  // button of its own, or whose option `unguarded` says that it moves from the start. Returns at once if the
  // loops may move already, else waits until they have acknowledged the stop, at most `timeout` (negative:
  // for ever). Any threads, at the same time; not for real-time loops. Allocates nothing. Errors: refused (a
  // guard is missing; the stop is not the one that was named, or that was there at the beginning; or somebody
  // asked for a stop meanwhile), timed_out (a loop does not look, or has not acknowledged), no_service (there
  // is no latch), closed. After an error the loops stand.
  result<emergency_stop_reset_result> reset_emergency_stop(const emergency_stop_reset_request& what,
                                                           duration timeout);

  // ---- plain messages, from ordinary threads. Messages as in rowe/lane.hpp; of up to `door_slot_bytes`.
  // Errors of all: closed; too_big; full: all `door_slots` are taken; or what waits for `to`, which does not
  // read, has its share of them (docs/limits.md).

  // Sends a message to `to`, or to every peer that takes plain messages, and waits until it was handed to the
  // kernel, for one peer at least. `ttl`: how long it may wait for a peer and behind others; 0 is now or
  // never, negative for ever. The peer learns what is left of it from a member `ttl_ms` of up to 27 bytes,
  // which the message must not have yet. Errors: expired, peer_lost, malformed, not_an_object,
  // reserved_member.
  status send(body object, duration ttl, connection to = everyone);
  // Queues it and returns at once; what becomes of it is counted. Errors: peer_lost where it is known
  // already.
  status try_send(body object, duration ttl, connection to = everyone);

  // Waits until a message to `to`, or to everyone, would not be refused with `full`, at most `timeout`
  // (negative: for ever; 0: does not wait, only looks); other threads may be faster. Errors: timed_out,
  // peer_lost, closed.
  status wait_room(duration timeout, connection to = everyone);

  // Waits for the next message, or call that no handle serves, at most `timeout` (negative: for ever; 0:
  // does not wait). From the first call on, calls that no handle serves wait here instead of being refused
  // (see the option `answers_any`). Errors: timed_out.
  result<received> receive(duration timeout);

  // Sends an invocation and waits for its reply at most `timeout` (negative: for ever). Errors: as
  // lane::invoke(). Where it was refused, or nobody provides it, and `why` is given, the diagnostic that says
  // so is assigned to it.
  result<received> invoke(body object, duration timeout, connection to = everyone,
                          std::string* why = nullptr);

  // Answers a call that receive() returned, and waits until the reply was handed to the kernel, at most `ttl`
  // (negative: for ever). Errors: misuse (no call of this endpoint), peer_lost (the caller is gone), expired
  // (the caller does not wait any more, or `ttl` is over), malformed, not_an_object, reserved_member. After
  // too_big and full (also if too many answers wait for the caller) it can be answered again.
  status reply(const received& call, body object, duration ttl = rt::for_ever);
  // Queues the reply and returns at once. Errors: misuse, peer_lost, expired.
  status try_reply(const received& call, body object);
  // Refuses a call, with a diagnostic (cut at 192 bytes), and returns at once. Errors: as try_reply().
  status refuse(const received& call, std::string_view diagnostic);

  // ---- recording: see rowe/recording.hpp

  // Records topics into files, from now on until the recorder is closed or destroyed. Takes a handle. Errors:
  // bad_recording, and `why`, if given, is assigned what is wrong; too_many_recordings (6), too_many_handles,
  // no_memory, no_thread, bad_argument (buffer_bytes), closed.
  result<recorder> record(const record_options& options, std::string* why = nullptr);

  // ---- peers and events

  // Waits until at least one peer is connected, at most `timeout` (negative: for ever). Errors: timed_out,
  // closed.
  status wait_peer(duration timeout);
  std::uint32_t peers() const noexcept;
  // The established connections at the moment, with the peers' addresses and the names of their identities.
  std::vector<peer> connections() const;
  // The name of a peer's identity; empty if it has none, or is gone. Never waits, never allocates, no system
  // call; any thread.
  identity_name identity_of(connection of) const noexcept;

  // ---- rights: see rowe/access.hpp

  // Changes who may do what, while everything runs. When it returns, the new rights hold. Whoever has them
  // still, or more, stays connected. A peer whose token is gone, or whose role has lost a right, is closed
  // (code 1008, "token revoked" or "role changed"); if it guarded the robot, that stops. Waits for one cycle
  // of the service thread. Errors: bad_access, and `why`, if given, is assigned what is wrong: as
  // check_access() says, or that no identity is left though there were some, so everyone might do everything;
  // misuse (the endpoint connects, so the rights are its server's), no_memory, closed. After an error nothing
  // has changed.
  status set_access(const access_options& access, std::string* why = nullptr);

  // The port listened on; 0 for an endpoint that connects.
  std::uint16_t port() const noexcept;
  // Under idle::wake, the eventfd that a handle may write to while the service thread sleeps; -1 under the
  // other policies, under which handles make no system call at all. For programs that trap system calls.
  int wake_descriptor() const noexcept;

  // Takes the oldest event that was not taken yet.
  std::optional<event> try_event() noexcept;

  // All counters since the endpoint was opened.
  std::vector<count> counts() const;

  // What the service thread was granted (core, priority, timer slack), and whether the endpoint's memory is
  // locked. An event also reports a core or a priority that was refused, with the reason. The memory of a
  // handle is locked when it is opened, as far as `ulimit -l` permits, so what a program opens first is
  // locked. memory_unlocked_bytes() is what is not, as of the last handle that was opened. Any thread.
  const rt::grants& service_grants() const noexcept;
  bool memory_locked() const noexcept;
  std::size_t memory_unlocked_bytes() const noexcept;

  // Waits up to `drain` until everything published so far is written, sends the peers a close frame, and
  // stops the service thread. Each recording that is under way has up to 10 s more to write what it has.
  // Handles say errc::closed from then on. Errors: timed_out (something was not
  // written in time; it is closed all the same).
  status close(duration drain = duration::zero());

 private:
  friend struct detail::pair_opener;
  // Errors: misuse (moved from), forked.
  status usable() const noexcept;
  explicit endpoint(std::shared_ptr<detail::endpoint_state> state) noexcept;
  result<detail::pair_handle> open(const detail::pair_request& asked);
  result<detail::parameter_handle> open(const detail::parameter_request& asked);

  std::shared_ptr<detail::endpoint_state> state_;
};

// ---- set-up of handles

template <class T>
result<publisher<T>> endpoint::advertise(std::string_view topic, const topic_options& options) {
  auto handle = open(detail::advertise_request<T>(topic, options));
  if (!handle) return handle.error();
  return publisher<T>{std::move(*handle)};
}

template <class T>
result<subscriber<T>> endpoint::subscribe(std::string_view topic, const topic_options& options) {
  auto handle = open(detail::subscribe_request<T>(topic, options));
  if (!handle) return handle.error();
  return subscriber<T>{std::move(*handle)};
}

template <class Q, class A>
result<responder<Q, A>> endpoint::serve(std::string_view name, const service_options& options) {
  auto handle = open(detail::serve_request<Q, A>(name, options));
  if (!handle) return handle.error();
  return responder<Q, A>{std::move(*handle)};
}

template <class Q, class A>
result<caller<Q, A>> endpoint::client(std::string_view name, const service_options& options) {
  auto handle = open(detail::client_request<Q, A>(name, options));
  if (!handle) return handle.error();
  return caller<Q, A>{std::move(*handle)};
}

template <parameter_type T>
result<rowe::parameter<T>> endpoint::parameter(std::string_view name, const T& first,
                                               const range<T>& allowed) {
  auto handle = open(detail::parameter_request_of(name, first, allowed));
  if (!handle) return handle.error();
  return rowe::parameter<T>{std::move(*handle), first, allowed};
}

} // namespace rowe
