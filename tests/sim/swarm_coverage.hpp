// SPDX-License-Identifier: Apache-2.0
// What the generators really did: how often each class of each member of each operation of peers and of
// ordinary threads was said in each state of what it names, and how often the handles of this process reached
// each moment of their lives; and what the worlds of flow.hpp reached. A cell that can happen, and did not in
// as many seeds as the tests run, is a hole in the generators, and fails.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "swarm_grammar.hpp"

namespace swarm {

// The states of each dimension, one after the other: the columns.
enum class state : std::uint8_t {
  topic_absent,  // nobody holds it
  topic_peers,   // peers do
  topic_own,     // a handle of this process does
  topic_latched, // likewise, and it is latched
  subscription_none,
  subscription_idle,
  subscription_queued,    // throttled, with a queue in which something may wait
  subscription_throttled, // throttled, without one
  subscription_backpressured,
  service_nobodys,
  service_peers,
  service_own,
  service_endpoints,
  call_none,    // the peer asks nothing
  call_open,    // it waits for answers
  call_same_id, // under this very id
  answer_asked,
  answer_over, // it has answered, or the call is over
  answer_foreign,
  stop_unused, // no latch yet
  stop_stopped,
  stop_running,
  connection_fresh, // nothing was said on it
  connection_rosbridge,
  connection_plain,
  connection_numbers,
  connection_foxglove,
  connection_backpressured,
  connection_closing, // a close frame, or what breaks the protocol, was sent before
  times_once,
  times_burst,
  times_in_turn, // with what undoes it
  queue_takes,
  queue_full,
  queue_refuses, // the text is too long
  inbox_empty,
  inbox_message,
  inbox_call,
  outcome_good,
  outcome_bad,
  outcome_given_up,
  heard_nothing,
  heard_acknowledged, // a stop, by the loops
  heard_reset,
  heard_refused,
  heard_too_late,
};
inline constexpr std::size_t states = 46;

struct state_name {
  dimension of;
  std::string_view name;
};
const std::vector<state_name>& state_names(); // `states` of them

// The handles of this process.
enum class handle_kind : std::uint8_t {
  publish_text,
  publish_value,
  subscribe_text,
  subscribe_value,
  respond,
  call,      // without waiting
  call_wait, // as caller::call() does, which gives up
  talk,
  latch,
  record,
};
inline constexpr std::size_t handle_kinds = 10;
std::string_view name_of(handle_kind kind);

enum class moment : std::uint8_t {
  opened,
  opened_latched,
  opened_again, // in the place of one that is gone
  refused,
  used,
  closed_unused,
  closed,
  closed_holding, // views, requests or calls, which end before it, or with it
  outlived,       // by views or requests
};
inline constexpr std::size_t moments = 9;

// What the worlds of flow.hpp reach: how frames are gathered, how much is in flight, and how much is read.
enum class flow_event : std::uint8_t {
  group_of_two,       // or more
  group_full,         // of group_max
  member_partly,      // the socket takes a part of its frame
  member_refused,     // or nothing
  member_gone,        // its connection breaks while its frame is gathered
  buffer_grown,       // the kernel's send buffer
  buffer_shrunk,      // likewise
  buffer_given_back,  // the round trip has become long
  lone_ping,          // measured the round trip
  second_lone_ping,   // did, after the first one was late
  late_lone_pings,    // all were: the peer counts as far
  lone_pings_not_low, // several, though its round trip was not low before
  read_beyond,        // a lone peer: more than the quantum at once
  read_in_parts,      // likewise, and too much for one turn
  read_in_turn,       // several peers: each a quantum
  fragments_in_parts, // a turn ends within a message
  call_beside_flood,  // is answered
  calls_beside_flood, // several at once
  calls_left_behind,  // of a client that has gone
  stop_behind_read,   // waits for what was read before it
  assembly_behind,    // a long message is assembled while a large read waits behind it
  role_by_token,      // a peer is let in
  role_without_token, // likewise: by its address, or to stop only
  role_not_admitted,
  role_allowed,          // a request
  role_denied_subscribe, // likewise, one for each verb, in the order of flow::verb
  role_denied_publish,
  role_denied_advertise,
  role_denied_call,
  role_denied_provide,
  role_denied_plain,
  role_stopped,
  role_reset, // let the loop go
  role_not_reset,
  role_guards, // may guard, or end the guard of another
  role_guards_not,
  role_kept,          // though the policy has changed
  role_revoked,       // a peer is closed by that
  role_late,          // the old policy let it in, and the new one holds
  role_looks,         // at a list of topics
  hop_value,          // with a time to live is taken behind a hub
  hop_message,        // likewise a plain one, by the next endpoint
  hop_told,           // what is left of it
  hop_expired,        // at the hub
  hop_over_at_handle, // which would have taken it
  hop_reconnected,
  long_endless, // a hostile peer, one for each flow::mischief, in their order
  long_trickle,
  long_wrong_end,
  long_two,
  long_binary,
  long_envelope,
  long_too_long,
  long_stop,
  long_call,
  long_no_object,
  long_no_text,
  long_leaves,
  fragments_gap,
  fragments_no_last,
  fragments_nested,
  fragments_interleaved,
  fragments_heard,    // by who asked for them
  fragments_let_pass, // other messages, that is
  long_stalled,       // a reader, whose place others want: it is closed
  long_displaced,     // endless messages, by another
  long_evicted,       // from who reads slowly
  long_ping_between,  // fragments that are written
  long_pong_between,  // likewise
  long_close_between, // likewise: the message never ends
  not_kept_told,      // a sender, that its value is not retained for late subscribers
  long_latched_read,  // by who subscribes later
  long_to_handle,
  long_request,
  long_answer,
  long_call_late,   // it is given up
  long_call_lost,   // it found no room, or lost it
  drive_taken,      // control of a topic
  drive_taken_over, // from another
  drive_released,
  drive_lost,   // for want of commands
  drive_driven, // who asks for control is refused: another drives
  drive_pause,
  drive_no_right,
  drive_old_tick,
  drive_no_action,
  drive_stale, // a command is dropped
  drive_unproven,
  drive_refused,
  drive_stopped,
  drive_expired,       // by a time to live of its own
  drive_flushed,       // dropped commands, given without a connection
  drive_reset_between, // commands are under way
  drive_flood,         // of who drives
  drive_forged,        // a tick that was not issued yet
  drive_cut,
  drive_stalled,
  drive_obeyed,
  drive_without_ticks,
  drive_own,   // obeyed
  drive_still, // after all have fallen silent
  drive_alone, // an honest driver, within a second
  // What anybody says of driving in the swarm world (swarm_driving.hpp).
  anybody_takes, // control
  anybody_releases,
  anybody_no_topic, // is refused, likewise the next four
  anybody_no_action,
  anybody_old_tick,
  anybody_driven,
  anybody_pause,
  anybody_watches, // the state of control
  anybody_obeyed,  // a command in force
  anybody_own,     // likewise, of this process
  anybody_stale,   // a command is dropped, likewise the next four
  anybody_unproven,
  anybody_refused,
  anybody_stopped,
  anybody_unreadable,
  anybody_reopened, // the driven topic, while somebody's command is in force
  // Who is told what it may do: anybody in the swarm world (swarm_rights.hpp), by both codecs in which it has
  // a name.
  anybody_rights,
  anybody_rights_plain,
  anybody_rights_here, // by its address
  anybody_rights_elsewhere,
  // Likewise where there are roles: one for each, in the order of flow::role.
  rights_of_observer,
  rights_of_driver,
  rights_of_supervisor,
  rights_of_peer,
  rights_of_arm,
  rights_of_guard,
  rights_by_address, // its role is by its address
  rights_refused,    // the question is none
};
inline constexpr std::size_t flow_events = 1 + static_cast<std::size_t>(flow_event::rights_refused);
std::string_view name_of(flow_event what);

class coverage {
 public:
  coverage() : counts_(cells()) {}

  void add(std::size_t row, state in) { ++counts_[row * states + static_cast<std::size_t>(in)]; }
  void add(handle_kind of, moment when) { ++counts_[place_of(of, when)]; }
  void add(flow_event what) { ++counts_[place_of(what)]; }
  // For memory that processes share.
  std::vector<std::uint32_t>& counts() { return counts_; }
  static std::size_t cells() { return rows().size() * states + handle_kinds * moments + flow_events; }

  // Cells that can happen and were not seen.
  std::vector<std::string> holes() const;
  std::string table() const;

 private:
  static std::size_t place_of(handle_kind of, moment when) {
    return rows().size() * states + static_cast<std::size_t>(of) * moments + static_cast<std::size_t>(when);
  }
  static std::size_t place_of(flow_event what) {
    return rows().size() * states + handle_kinds * moments + static_cast<std::size_t>(what);
  }

  std::vector<std::uint32_t> counts_;
};

// Whether the row's operation looks at what the column says.
bool has(std::size_t row, std::size_t column);
// Why a cell cannot happen; empty: it can.
std::string_view impossible(std::size_t row, std::size_t column);
std::string_view impossible(handle_kind of, moment when);

} // namespace swarm
