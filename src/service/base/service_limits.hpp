// SPDX-License-Identifier: Apache-2.0
// Folder base: rows, lists, pools, limits, names, counters, the seam to sockets. No peers, no topics.
// The bounds of the service that are not options, each with its unit and its reason, and the assertions that
// tie them to each other. What a user may choose is in rowe/limits.hpp.
#pragma once
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <rowe/detail/calls.hpp>
#include <rowe/detail/parameter_cell.hpp>
#include <rowe/detail/waiting.hpp>
#include <rowe/event.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/slab.hpp>
#include <rowe/rt/timer_wheel.hpp>

#include "service/base/ids.hpp"
#include "service/base/transport.hpp"
#include "service/base/work.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/refusal.hpp"
#include "wire/codec/request.hpp"
#include "wire/websocket/websocket.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {

// ---- pools

// One piece in so many of a pool is reserved for what would otherwise find none.
inline constexpr std::uint32_t reserve_one_in = 4;
static_assert(reserve_one_in > 2); // direct messages leave two such reserves (shares.hpp)
// One slot in so many of the receiver is reserved for claims.
inline constexpr std::uint32_t receiver_claims_one_in = 4;
// Topics of the endpoint itself: the statistics, and the stop's state.
inline constexpr std::uint32_t endpoint_topics = 2;
// Topics with a lease.
inline constexpr std::uint32_t driven_topics_max = 8;
// The texts of a request for control, unescaped.
inline constexpr std::size_t control_member_bytes_max = 256;
// A peer without ticks is not told of its first commands, which are always dropped.
inline constexpr rt::duration unproven_unsaid_for = std::chrono::seconds{1};
// How often the state of control is published while somebody drives, and else.
inline constexpr rt::duration control_period_driven = std::chrono::milliseconds{50};
inline constexpr rt::duration control_period = std::chrono::milliseconds{500};
// The first number of a service in the directory. Lower ones are for the endpoint's own services.
inline constexpr std::uint32_t first_service_number = 64;
// Bytes of a latched value in one block. With the number of the next block they fill 1 KiB.
inline constexpr std::size_t latch_block_bytes_max = 1020;
static_assert(latch_block_bytes_max + sizeof(block_id) == 1024);

// Latched values that are queued for one late subscriber before a message that comes meanwhile.
inline constexpr std::uint32_t latched_before_max = 4;

// ---- pages

// Topics whose last values are retained for HTTP, and for how long after somebody asked for one.
inline constexpr std::uint32_t asked_topics_max = 32;
inline constexpr rt::duration asked_topic_retained_for = std::chrono::seconds{60};
static_assert(page_wait_max < asked_topic_retained_for);
// The memory for them, in the longest messages that there may be.
inline constexpr std::uint32_t last_values_messages = 2;
// Long values that are sent as pages at once.
inline constexpr std::uint32_t long_pages_max = 2;
// Pages that were given up keep a row until whoever sends them has seen that.
inline constexpr std::uint32_t long_page_rows = 4 * long_pages_max;

// ---- reading

// The bytes of one read of a peer while others are readable too, and the tailroom behind them.
inline constexpr std::size_t staging_bytes = transport_sink::read_bytes_in_turn + tailroom_bytes;
// How much of a message is looked at for a stop, and how long the frame of a stop is.
inline constexpr std::size_t stop_look_bytes = 160;
inline constexpr std::size_t stop_frame_bytes_max = transport_sink::read_bytes_in_turn;
static_assert(stop_look_bytes < stop_frame_bytes_max && stop_frame_bytes_max < staging_bytes);

// A piece of a long message is scanned byte by byte, which takes so many times as long as reading a message
// does: two pieces are a cycle's work, some 50 us.
inline constexpr std::size_t long_work_times = 12;
// A message that is not complete is safe from newcomers until its peer has used as much as it takes in this
// time.
inline constexpr std::uint64_t long_grace_ms = 500;
// What a peer has used for long messages is half forgotten in this time.
inline constexpr std::uint64_t long_use_half_ms = 8000;
// A long message has message_time_max for each so many of its bytes.
inline constexpr std::size_t timed_bytes = 64 * 1024;
// Bytes of a long text of this process that are checked in one cycle.
inline constexpr std::size_t long_scan_bytes = 8 * 1024;
// Bytes of the text of a long struct that are encoded in one cycle: some 100 us of numbers.
inline constexpr std::size_t long_encode_bytes = 8 * 1024;
// Bytes that are copied into the inboxes of handles in one cycle, of long messages.
inline constexpr std::size_t long_copy_bytes = 64 * 1024;

// What a JSON parser may read behind a text, and what is reserved for that behind each text.
static_assert(tailroom_bytes >= json::reader::tailroom_bytes &&
              rt::tailroom_bytes >= json::reader::tailroom_bytes);

// Longest id of a peer's request, as written in its text. A longer one is refused; a stop with a longer one
// is answered without it.
inline constexpr std::size_t call_id_bytes_max = 256;
// Longest id of ours.
inline constexpr std::size_t our_call_id_bytes_max = 64;
static_assert(call_id_bytes_max == wire::name_limits{}.id_bytes_max);
static_assert(our_call_id_bytes_max <= call_id_bytes_max);

// Requests, with different ids, that one subscription merges.
inline constexpr std::size_t subscribe_requests_max = 4;
static_assert(subscribe_requests_max <= UINT8_MAX);

// ---- TLS

// Bytes of the heap in all, with what malloc adds. tests/counts/tls_memory_test.cpp measures them. A
// connection: its session, and OpenSSL's part with a buffer for a record in each direction.
inline constexpr std::size_t tls_connection_bytes = std::size_t{88} << 10;
// A handshake that is under way, at most: OpenSSL takes a hello of 128 KiB, into a buffer a third larger.
inline constexpr std::size_t tls_handshake_bytes = std::size_t{264} << 10;
// A place for one, from the start: a header, and the messages of the two threads about it.
inline constexpr std::size_t tls_place_bytes = std::size_t{8} << 10;
// What an endpoint has once: the certificates, and how often each source has come.
inline constexpr std::size_t tls_bytes = std::size_t{112} << 10;

// ---- writing

// Bytes of one byte of a text in JSON, at most: \u001f.
inline constexpr std::size_t escaped_bytes_max = 6;

// A batch ends with the frame that reaches this, or before one for which there is no room. A little less than
// a segment of TCP can be (65 483 bytes on loopback): a longer batch leaves a tiny segment behind it.
inline constexpr std::size_t batch_bytes_max = 60 * 1024;
inline constexpr std::size_t batch_pieces_max = 256;
// How much of a long message one of its frames has. Control frames go between them, and other peers have
// their turns after so many.
inline constexpr std::size_t long_fragment_bytes = 32 * 1024;
inline constexpr unsigned long_fragments_per_turn = 2;
// How much of a message one fragment of a text has at most, whatever its peer asked for. Each byte may
// need six (\u0001), and around them are so many.
inline constexpr std::size_t text_fragment_bytes_max = 8 * 1024;
// Messages in fragments that may be set aside, because a part of another frame is written between them. If
// there are so many, nothing goes between the fragments of others for the moment.
inline constexpr std::size_t messages_aside_max = 8;
inline constexpr std::size_t text_fragment_envelope_bytes = 160;
inline constexpr std::size_t text_fragment_frame_bytes =
    escaped_bytes_max * text_fragment_bytes_max + text_fragment_envelope_bytes;
static_assert(text_fragment_frame_bytes + wire::frame_headroom_bytes <= batch_bytes_max);
static_assert(wire::fragment_size_min <= text_fragment_bytes_max);
static_assert(long_fragment_bytes <= UINT16_MAX);
static_assert(long_fragment_bytes + wire::frame_header_bytes_max <= batch_bytes_max);
// One peer takes a cycle's writing at most.
static_assert(batches_per_cycle * (1 + batch_bytes_max / write_work_bytes) <= write_work_per_cycle);
static_assert(batch_bytes_max < 65'483);
// Random bytes for masks that are fetched at once; a key has four.
inline constexpr std::size_t mask_buffer_bytes = 4096;
static_assert(mask_buffer_bytes % 4 == 0);

// Calls whose time is over while a long answer comes are looked at again after this.
inline constexpr rt::duration long_answer_look_period = std::chrono::milliseconds{100};

// Bytes of the JSON around the text of a relayed message, besides its name and its id.
inline constexpr std::size_t envelope_bytes_fixed = 64;

// Replies that may wait to be written to one peer. A backpressured peer may have fewer: otherwise a few peers
// that ask and never read would take the slots of all.
inline constexpr std::uint32_t replies_max = 64;
inline constexpr std::uint32_t replies_max_backpressured = 16;
static_assert(replies_max_backpressured < replies_max);
// Feedback of actions is queued while fewer replies wait than this.
inline constexpr std::uint32_t feedback_queued_max = 8;
static_assert(feedback_queued_max < replies_max_backpressured);

// Events about refusals to one peer at once; then one a second.
inline constexpr std::uint32_t refusal_events_burst = 8;
// A peer is closed when it has exceeded a rate for so long.
inline constexpr rt::duration flood_time_max = std::chrono::seconds{5};
// Who takes a long value more slowly than this, after so long, makes way if others need its place, but for
// the one that has had its own for the longest time.
inline constexpr std::int64_t slow_reader_bytes_per_second = 256 * 1024;
inline constexpr rt::duration slow_reader_time_min = std::chrono::seconds{2};
// How long a frame may stay partly written while others wait, and the rate at which longer frames get more
// time: that of a poor radio link.
inline constexpr rt::duration partial_time_min = std::chrono::milliseconds{500};
inline constexpr std::int64_t partial_bytes_per_second = 64 * 1024;
// Changes are announced to peers that get lists of topics and services once in this period at most, after a
// first burst of so many.
inline constexpr rt::duration listings_period = std::chrono::milliseconds{250};
inline constexpr std::uint32_t listings_burst = 4;
// To how many peers changes are announced in one cycle, by one message each. There may be a thousand peers.
inline constexpr unsigned listings_per_cycle = 8;
// Nothing is announced to a peer with so many replies until it has read some.
inline constexpr std::uint32_t listings_queued_max = 4;
static_assert(listings_queued_max < replies_max_backpressured);
// This is looked at again after a pause, which is longer where the peer does not read.
inline constexpr rt::duration listings_retry = std::chrono::milliseconds{1};
inline constexpr rt::duration listings_retry_backpressured = std::chrono::milliseconds{20};
static_assert(listings_retry < listings_retry_backpressured &&
              listings_retry_backpressured < listings_period);

// What one report of the statistics may spend on topics that only peers hold, and on connections: one byte in
// so many of message_bytes_max. The rest of the report always finds room.
inline constexpr std::uint32_t report_topics_one_in = 8;
inline constexpr std::uint32_t report_connections_one_in = 2;
static_assert(report_topics_one_in > 2 && report_connections_one_in >= 2); // together less than all

// ---- deadlines

// The ids of requests for deadlines have blocks of so many bytes, one for so many subscriptions. With the
// number of the next block they fill 32 bytes.
inline constexpr std::size_t id_block_bytes_max = 28;
static_assert(id_block_bytes_max + sizeof(id_block_id) == 32);
inline constexpr std::uint32_t id_blocks_one_in = 2;

// A subscription's deadline that is shorter is watched as if it were this long, so that each costs little.
inline constexpr rt::duration deadline_min = std::chrono::milliseconds{100};

// ---- parameters

// The topic /rowe/parameters is published this often at most.
inline constexpr rt::duration parameters_period = std::chrono::milliseconds{20};
// The text of a value, with its quotes and escapes, is not longer than this.
inline constexpr std::size_t parameter_json_bytes_max =
    escaped_bytes_max * detail::parameter_text_bytes_max + 2;
// How many peers get the changes of parameters in one cycle, each by a message of its own.
inline constexpr unsigned parameter_announcements_per_cycle = 4;
inline constexpr std::size_t record_cause_bytes_max = 256; // of the service /rowe/record
// What a message says of a parameter besides its name and its value, at most; and around all of them, besides
// the id.
inline constexpr std::size_t parameter_update_bytes = 48;
inline constexpr std::size_t parameters_envelope_bytes = 64;
// The work of finding a parameter by its name.
inline constexpr std::size_t parameter_work_bytes = 256;

// ---- the connection graph

// How often peers with a clock get the time, so that what they show moves smoothly, or has a time.
inline constexpr rt::duration clock_period = std::chrono::milliseconds{12}; // with the wheel's ticks, 60 Hz
inline constexpr rt::duration idle_clock_period = std::chrono::milliseconds{250};
// How often changes are looked for, while somebody wants them, and how often they are announced to one peer.
inline constexpr rt::duration graph_period = std::chrono::milliseconds{250};
// Messages about it in one cycle, each to another peer; and the work: looks at a row, a holder, or a peer.
inline constexpr unsigned graph_messages_per_cycle = 4;
inline constexpr std::uint32_t graph_work_per_cycle = 4096;
// Nothing is announced to a peer while anything waits to be written to it. This is looked at again after a
// pause, which is longer where the peer does not read.
inline constexpr rt::duration graph_retry = std::chrono::milliseconds{1};
inline constexpr rt::duration graph_retry_backpressured = std::chrono::milliseconds{20};
static_assert(graph_retry < graph_retry_backpressured && graph_retry_backpressured < graph_period);
// If names that are gone find no place for so long, because some peers do not know of earlier ones yet, the
// subscriptions of these peers end.
inline constexpr rt::duration graph_behind_max = std::chrono::seconds{5};
static_assert(graph_period < graph_behind_max);
// What a message says of a topic or a service besides its name and who holds it, and of a holder besides its
// name; and the words around all of them.
inline constexpr std::size_t graph_entry_bytes = 40;
inline constexpr std::size_t graph_holder_bytes = 3;
inline constexpr std::size_t graph_envelope_bytes = 160;

// ---- diagnostics and events, in bytes

// Handles store no longer diagnostic of a failed call than a peer is sent.
static_assert(wire::refusal::text_bytes_max >= detail::diagnostic_bytes_max);

inline constexpr std::size_t event_text_bytes_max = 224;
static_assert(std::is_same_v<decltype(event::what), event::text<event_text_bytes_max>>);
// Events about peers that come and go: one in this period, after a first burst.
inline constexpr rt::duration coming_events_period = std::chrono::milliseconds{20};
inline constexpr std::uint32_t coming_events_burst = 128;

// How much a diagnostic repeats of a name, of a verb, of a topic or a type beside other text, and of what the
// decoder says about a message. Longer ones are shortened.
inline constexpr std::size_t name_bytes_shown = 128;
inline constexpr std::size_t verb_bytes_shown = 24;
inline constexpr std::size_t topic_bytes_shown = 96;
inline constexpr std::size_t type_bytes_shown = 96;
inline constexpr std::size_t diagnosis_bytes_shown = 320;
inline constexpr std::size_t parameter_value_bytes_shown = 48;
inline constexpr std::size_t parameter_name_bytes_shown = 24; // of an enum's value
static_assert(name_bytes_shown + 64 <= detail::diagnostic_bytes_max);
static_assert(topic_bytes_shown + 2 * type_bytes_shown + 64 <= wire::refusal::text_bytes_max);
// An event has less space.
inline constexpr std::size_t event_topic_bytes_shown = 64;
inline constexpr std::size_t event_type_bytes_shown = 56;
static_assert(event_topic_bytes_shown + 2 * event_type_bytes_shown + 48 <= event_text_bytes_max);
static_assert(event_topic_bytes_shown + diagnosis_bytes_shown + 16 <= wire::refusal::text_bytes_max);

// Buffers of single diagnostics: a share is used up; which option helps; how many more requests were refused;
// too many calls; a type is replaced.
inline constexpr std::size_t share_text_bytes_max = 384;
static_assert(verb_bytes_shown + topic_bytes_shown + 192 <= share_text_bytes_max);
inline constexpr std::size_t remedy_bytes_max = 128;
static_assert(std::is_same_v<decltype(event::remedy), event::text<192>> && remedy_bytes_max <= 192);
inline constexpr std::size_t missed_text_bytes_max = 64;
inline constexpr std::size_t unknown_text_bytes_max = 96;
// Who has no right to what. Names of roles and identities have 64 bytes at most.
inline constexpr std::size_t denied_name_bytes_shown = 56;
static_assert(2 * 64 + denied_name_bytes_shown + 38 <= event_text_bytes_max);
// Each pattern of a role that a request is compared with counts as so many bytes that were read.
inline constexpr std::size_t pattern_work_bytes = 128;
inline constexpr std::size_t busy_text_bytes_max = 160;
static_assert(busy_text_bytes_max <= detail::diagnostic_bytes_max);
inline constexpr std::size_t replaced_type_text_bytes_max = 896;
inline constexpr std::size_t replaced_name_bytes_shown = 264; // any name, unless it has many escapes
static_assert(3 * (replaced_name_bytes_shown + 3) + 80 <= replaced_type_text_bytes_max);

// ---- stop

// The source and the reason of a stop by a thread of this process.
inline constexpr std::size_t stop_source_bytes_max = 63;
inline constexpr std::size_t stop_reason_bytes_max = 192;
static_assert(stop_reason_bytes_max < event_text_bytes_max); // an event repeats it

// A member of a request for the stop, as text.
inline constexpr std::size_t stop_member_bytes_max = 1024;
// A peer's name, with what it calls itself.
inline constexpr std::size_t peer_name_bytes_max = identity_name::capacity() + 3 + stop_member_bytes_max;
// Bytes of the body of a stop's answer, or of its state, which lists guards and loops.
inline constexpr std::size_t stop_body_bytes_max = 2560;
// The same with the id and the envelope around it.
inline constexpr std::size_t stop_answer_bytes_max = stop_body_bytes_max + call_id_bytes_max + 128;
// The buffer that each peer has for answers and the state.
inline constexpr std::size_t stop_buffer_bytes = 4096;
static_assert(stop_answer_bytes_max + wire::frame_header_bytes_max <= stop_buffer_bytes);
// How many stops of one peer may wait for the loops. One more is answered at once.
inline constexpr int stops_awaited_per_peer = 2;
// Places for the stops of this process, besides one for each connection.
inline constexpr std::size_t stops_awaited_of_process = 8;
// How often peers that are no guards get the state, in ticks.
inline constexpr int stop_ticks_for_others = 10;

// ---- receiver

// After this time without a take, a receiver is absent: messages that find no room are dropped.
inline constexpr rt::duration receiver_absent_after = std::chrono::seconds{8};
// How often a peer gets a report, at most, that messages for it were dropped.
inline constexpr rt::duration losses_period = std::chrono::seconds{10};
// How often an event reports messages of a topic that handles cannot decode.
inline constexpr rt::duration undecodable_period = std::chrono::seconds{1};

// ---- time

// How long the endpoint waits at most until its connections are closed, and a handle until its queue pair is
// released; the transport closes connections sooner.
inline constexpr rt::duration closing_time_max = std::chrono::milliseconds{1500};
static_assert(close_time_max < closing_time_max);
// The longest sleep meanwhile.
inline constexpr rt::duration closing_look_period = std::chrono::milliseconds{10};
static_assert(closing_look_period < closing_time_max - close_time_max);
// A full period of the rates that the service of the statistics reports.
inline constexpr rt::duration rates_period = std::chrono::seconds{1};
// Each peer is checked this often. So silence, or an unfinished message, is noticed at most this much too
// late.
inline constexpr rt::duration liveness_period = std::chrono::milliseconds{500};
// Checks are due at multiples of this (17 ms), so peers share wake-ups: a thousand quiet peers must not wake
// the thread two thousand times a second. A slot of the wheel's second level begins there, so the thread does
// not wake for that slot before its entries are due.
inline constexpr rt::duration liveness_step = 256 * rt::timer_wheel::tick;
static_assert(liveness_step % rt::timer_wheel::tick == rt::duration{0} && liveness_step < liveness_period);
// A ping may stay unanswered for so many times silence_max, whatever else the peer sends.
inline constexpr int silences_unanswered_max = 2;

// The longest sleep while a handle may submit what a peer waits for, or something waits for room.
inline constexpr rt::duration talking_rest = std::chrono::milliseconds{10};
// The longest sleep otherwise: sockets and set-up wake the thread.
inline constexpr rt::duration idle_rest = std::chrono::milliseconds{250};
static_assert(talking_rest < detail::word_late_max && talking_rest < idle_rest);
// The longest time between the beginnings of two cycles that is no fault. If there was a longer one, /healthz
// says so for a while: short enough that whoever asks every 10 s does not hear of it three times.
inline constexpr rt::duration cycle_gap_max = std::chrono::milliseconds{1250};
inline constexpr rt::duration unhealthy_after_gap = std::chrono::seconds{10};
static_assert(4 * idle_rest < cycle_gap_max && cycle_gap_max < unhealthy_after_gap);
static_assert(rates_period <= cycle_gap_max); // so a cycle behind a long gap ends a period of the rates
// The sleeps while a loop has yet to acknowledge a stop: short at first.
inline constexpr rt::duration acknowledgment_rest_min = std::chrono::microseconds{50};
inline constexpr rt::duration acknowledgment_rest_max = std::chrono::milliseconds{1};
static_assert(acknowledgment_rest_min < acknowledgment_rest_max && acknowledgment_rest_max < talking_rest);
// When an expired slot whose frame is partly written is looked at again.
inline constexpr rt::duration partial_look_period = std::chrono::milliseconds{10};

} // namespace rowe::service
