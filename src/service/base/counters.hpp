// SPDX-License-Identifier: Apache-2.0
// The counters: their names, and what each counts. The service thread writes them; any thread reads them.
// User threads cause two of them: these are counted in the queue pairs, and added when they are read.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/rt/counter.hpp>

namespace rowe::service {

// name, group, meaning. Groups: loss = a message did not arrive; chosen = thinned out as asked; flow = it
// went through; refusal = a request was refused; own = the service thread itself.
#define ROWE_COUNTERS(X)                                                                                     \
  X(full, loss, "refused: the handle's queue to the service thread was full")                                \
  X(expired, loss, "its time to live passed before it was written")                                          \
  X(outbox_full, loss, "dropped, the oldest or beyond its share: the peer does not read fast enough")        \
  X(evicted, loss, "dropped as the oldest of the peer that held most: all places of a pool were taken")      \
  X(no_slot, loss, "dropped: all slots for encoded messages were taken")                                     \
  X(no_chunks, loss, "long messages dropped: all chunks for their texts, or the sender's share, were taken") \
  X(left_behind, loss, "requests that were not carried out: their peer had gone, and read no answer")        \
  X(fragments_lost, loss, "messages in fragments that were not put together: one was wrong, or too late")    \
  X(too_big, loss, "dropped: larger than the slot it should go into")                                        \
  X(malformed, loss, "not valid JSON, or not the object a message must be")                                  \
  X(inbox_full, loss, "dropped: the subscriber in this process does not take fast enough")                   \
  X(undecodable, loss, "arrived, but was not what the handle of this process reads")                         \
  X(inbound_expired, loss, "arrived, but was not taken within its time to live")                             \
  X(lost_with_peer, loss, "queued for a peer that went away")                                                \
  X(lost_at_close, loss, "published, but the endpoint closed before it was taken")                           \
  X(no_peer, flow, "nobody listened")                                                                        \
  X(replaced, chosen, "a newer value took its place")                                                        \
  X(throttled, chosen, "within the throttle_rate a peer asked for")                                          \
  X(deadlines_missed, flow, "periods in which a subscription with a deadline got no message")                \
  X(messages_in, flow, "messages received")                                                                  \
  X(messages_out, flow, "messages written, counted per peer")                                                \
  X(bytes_in, flow, "bytes received")                                                                        \
  X(bytes_out, flow, "bytes written")                                                                        \
  X(calls_in, flow, "calls received from peers")                                                             \
  X(calls_out, flow, "calls asked of peers")                                                                 \
  X(calls_timed_out, loss, "calls that were not answered in time")                                           \
  X(calls_lost, loss, "calls whose provider went away")                                                      \
  X(replies_late, loss, "replies to a call that had ended")                                                  \
  X(replies_foreign, loss, "replies to no call of the connection they came on")                              \
  X(replies_unsent, loss, "answers of this process to a peer that had gone")                                 \
  X(stops, flow, "stops asked for")                                                                          \
  X(stop_refusals, refusal, "resets and heartbeats of the stop that were refused")                           \
  X(stop_answers_lost, loss, "answers to a stop for which a peer that does not read had no room")            \
  X(commands_refused, refusal, "commands of who did not drive, dropped")                                     \
  X(commands_unproven, refusal, "commands dropped: not known when they were sent")                           \
  X(commands_stale, refusal, "commands dropped: the lease was over, or the robot was stopped since")         \
  X(commands_stopped, refusal, "commands dropped: the robot was stopped")                                    \
  X(control_refusals, refusal, "requests to /rowe/control that were refused")                                \
  X(calls_refused, refusal, "calls answered with an error")                                                  \
  X(nonfinite, flow, "NaN or infinity written as null")                                                      \
  X(peers_joined, flow, "connections established")                                                           \
  X(slow_peers, flow, "peers that left two pings unanswered: only urgent messages, until they do")           \
  X(refused_handshakes, refusal, "connections refused before they were established")                         \
  X(handshakes_starved, refusal, "handshakes and pages for which handshake_bytes had no room")               \
  X(handshakes_evicted, refusal, "handshakes and pages under way whose place a newer one needed")            \
  X(pages_cut, refusal, "long values over HTTP that were cut: too slow a reader, or others needed the room") \
  X(slowed_handshakes, refusal, "wrong tokens answered late: many had come from the same address")           \
  X(stop_peers_displaced, refusal, "connections on /rowe/stop whose place the next one needed")              \
  X(names_left_out, refusal, "names for which answers of /rosapi/topics and /rosapi/services had no room")   \
  X(over_rate, refusal, "messages of peers beyond messages_per_second_max, dropped but for stops")           \
  X(refusals_unsaid, refusal, "refusals beyond refusals_per_second_max, not answered")                       \
  X(flooding_peers, refusal, "connections closed because they went on beyond a rate")                        \
  X(not_latched, loss, "last values of latched topics for which latched_bytes had no room")                  \
  X(refused_requests, refusal, "requests answered with a status error")                                      \
  X(denied, refusal, "requests that the role of their peer does not allow")                                  \
  X(revoked_peers, refusal, "connections closed because their token or a right was taken away")              \
  X(violations, refusal, "connections closed because they broke the WebSocket protocol")                     \
  X(silent_peers, refusal, "connections closed because nothing was heard from them")                         \
  X(unfinished_messages, refusal, "connections closed because a message was not finished in time")           \
  X(stalled_peers, refusal, "connections closed because they did not read")                                  \
  X(events_lost, own, "events that the program did not take in time, or peers caused beyond their rate")     \
  X(cycles, own, "cycles of the service thread")                                                             \
  X(pauses, own, "times of 3 s or more when this process did not run; they do not count against peers")      \
  X(cycle_ns_max, own, "its longest cycle, in nanoseconds")                                                  \
  X(queued_max, own, "messages waiting at one time, at most")                                                \
  X(phase_hits, own, "idle::phase: values that came while it was awake for them")                            \
  X(phase_misses, own, "idle::phase: values with a period that came at another time")                        \
  X(phase_watched_ns, own, "idle::phase: how long it was awake for values to come")                          \
  X(handshake_bytes_used, own, "of handshake_bytes, now")                                                    \
  X(handshake_bytes_peak, own, "of handshake_bytes, at most")                                                \
  X(handshake_allocations, own, "taken from handshake_bytes; none while peers are only connected")           \
  X(tls_handshakes, flow, "TLS handshakes that were done")                                                   \
  X(tls_failed_plain, refusal, "TLS handshakes that failed: the client did not speak TLS")                   \
  X(tls_failed_silent, refusal, "TLS handshakes that failed: the client said nothing in time")               \
  X(tls_failed_timeout, refusal, "TLS handshakes that failed: they were not done in time")                   \
  X(tls_failed_lost, refusal, "TLS handshakes that failed: the peer left")                                   \
  X(tls_failed_certificate, refusal, "TLS handshakes that failed: one of the two refused a certificate")     \
  X(tls_failed_protocol, refusal, "TLS handshakes that failed: nothing in common, or not what TLS allows")   \
  X(tls_failed_evicted, refusal, "TLS handshakes that failed: a newer one needed the place")                 \
  X(tls_failed_resources, refusal, "TLS handshakes that failed: no memory was left for them")                \
  X(tls_cuts, refusal, "TLS connections that ended without close_notify, by the peer or on the way")         \
  X(tls_key_floods, refusal, "TLS connections closed because their peer asked for new keys too often")       \
  X(tls_alerts, refusal, "TLS connections that ended by an alert: a record was wrong, say")                  \
  X(tls_reloads, own, "new certificates that were taken")                                                    \
  X(tls_reload_faults, own, "new certificates that were not taken: a file is wrong")                         \
  X(tls_certificate_end, own, "when the certificate ends, in seconds since 1970; 0: there is none")

enum class counter_group : std::uint8_t { loss, chosen, flow, refusal, own };

enum class counter : std::uint8_t {
#define ROWE_COUNTER_NAME(name, group, meaning) name,
  ROWE_COUNTERS(ROWE_COUNTER_NAME)
#undef ROWE_COUNTER_NAME
};

struct counter_description {
  std::string_view name;
  counter_group group;
  std::string_view meaning;
};

inline constexpr std::array counter_descriptions{
#define ROWE_COUNTER_ROW(name, group, meaning) counter_description{#name, counter_group::group, meaning},
    ROWE_COUNTERS(ROWE_COUNTER_ROW)
#undef ROWE_COUNTER_ROW
};

class counters {
 public:
  // Service thread.
  void add(counter which, std::uint64_t by = 1) noexcept { at(which).add(by); }
  void set(counter which, std::uint64_t value) noexcept { at(which).set(value); }
  void raise_to(counter which, std::uint64_t value) noexcept {
    if (value > at(which).get()) at(which).set(value);
  }
  // Any thread.
  std::uint64_t read(counter which) const noexcept { return counts_[static_cast<std::size_t>(which)].get(); }

 private:
  rt::counter& at(counter which) noexcept { return counts_[static_cast<std::size_t>(which)]; }

  std::array<rt::counter, counter_descriptions.size()> counts_{};
};

} // namespace rowe::service
