// SPDX-License-Identifier: Apache-2.0
// Everything that peers can say and ordinary threads of this process can ask for, as data: each operation of
// the codecs and of the stop, each member it may have, and for each member the classes of values that make a
// difference: absent, good ones up to the limit and beyond, bad ones of each kind. A text is chosen in two
// steps: first a recipe, which is one class for each member, then as many texts of that recipe as one likes.
// The simulated peers, the threads and the fuzzer of the core choose from here, and what was chosen is
// counted by class (swarm_coverage.hpp).
//
// An operation or a member that is added to a codec gets its line in operations(); nothing else is needed.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <rowe/limits.hpp>

#include "swarm_choices.hpp"
#include "swarm_foxglove.hpp"
#include "swarm_numbers.hpp"

namespace swarm {

// What values a member may have.
enum class domain : std::uint8_t {
  topic,
  service,
  called_service, // may end in "#id"
  stop_service,   // the spellings of one name
  id,
  answered_id, // of a call that this peer was asked
  type,
  period, // milliseconds
  count,
  fragment_size,
  depth, // of a queue
  boolean,
  compression,
  level,
  history,
  reliability,
  durability,
  time, // lifespan, deadline
  body,
  args,
  values,
  timeout, // seconds
  ttl,     // milliseconds
  text,
  source,
  guard,
  number, // of a stop
  tick,
  error,
  unsupported,
  unknown,
  payload, // of a control frame
  raw,     // bytes that are no frame, or not all of one
  // Of the codec with numbers.
  list,          // of requests in one text
  own_number,    // that the peer gives: a tag, or a channel of its own
  channel,       // the number of a topic, as peers were told it
  called_number, // likewise of a service
  call_number,   // four bytes
  number_frame,  // a binary message that is none
  // Of a connection.
  codec,
  path,
  address,
  // Of ordinary threads.
  submitted, // a plain message
  thread_service,
  wait,
  addressee,
  outcome, // whether the thread waits for it
  held_call,
  stop_words, // who stops, and why
  // Of Foxglove's protocol.
  request_id,
  parameter_list,  // of names
  parameter_value, // of one that is set
  // Of driving.
  driven_topic,
  command_body,
  command_tick,
  control_service, // the spellings of one name
  control_state,   // likewise of a topic
  control_topic,
  control_action,
  driver_name,
  control_tick,
  // Of what a peer may do.
  rights_service, // the spellings of one name
  rights_args,
  rights_asked, // the list in them
  right,        // of its elements
  right_of,     // likewise: of which name
};

struct value_class {
  std::string_view name;
  bool good = true;
};
const std::vector<value_class>& classes_of(domain what);

struct member_rule {
  std::string_view name;
  domain is = domain::text;
};

// The dimensions of the coverage table: the things whose state matters to a text.
enum class dimension : std::uint8_t {
  topic,
  subscription,
  service,
  call,
  answer,
  stop,
  connection,
  times, // how often in a row
  queue, // of what threads submit
  inbox, // from which they receive
  outcome,
  heard, // what became of a thread's stop or reset
};
inline constexpr std::size_t dimensions = 12;
std::string_view name_of(dimension what);

// Who says it.
// foxglove_peer: one with numbers that says it by Foxglove's protocol.
enum class speaker : std::uint8_t { any_peer, peer, numbers_peer, foxglove_peer, thread };

// In what form it is sent.
enum class form : std::uint8_t {
  rosbridge,    // an object with op
  plain,        // an object
  stop_call,    // a call of the stop, by rosbridge
  stop_plain,   // the same in the plain format
  stop_publish, // on the stop's topic
  malformed,    // a text that is no JSON
  binary,       //
  control,      // ping, pong
  close,        //
  fragments,    // a text in several frames
  partial,      // a frame that is not finished, for now
  no_frame,     // bytes that break the protocol
  number_text,  // by the codec with numbers
  number_binary,
  number_stop,   // a call of the stop by its number
  foxglove_text, // what only Foxglove's protocol has
  opening,       // of a connection
  submission,    // of an ordinary thread
  thread_stop,   // the stop by an ordinary thread, and its reset
};
speaker speaker_of(form goes);
inline bool is_binary(form goes) {
  return goes == form::binary || goes == form::number_binary || goes == form::number_stop;
}
// Said in a frame of its own, which can be repeated.
bool is_message(form goes);

struct operation {
  std::string_view name;
  form goes = form::rosbridge;
  std::vector<member_rule> members{};
  std::vector<dimension> of{};
  std::string_view op{}; // of rosbridge, where it is not the name
};
const std::vector<operation>& operations();
std::size_t operation_named(std::string_view name);
// Operations that undo another: what is taken is given back.
struct opposites {
  std::string_view takes, gives;
};
inline constexpr opposites pairs_of_operations[] = {{"subscribe", "unsubscribe"},
                                                    {"advertise", "unadvertise"},
                                                    {"advertise_service", "unadvertise_service"},
                                                    {"advertise_action", "unadvertise_action"},
                                                    {"send_action_goal", "cancel_action_goal"},
                                                    {"want", "drop"},
                                                    {"offer", "keep"},
                                                    {"watch_parameters", "unwatch_parameters"},
                                                    {"watch_graph", "unwatch_graph"}};
// Of what only Foxglove's protocol has: its choices are drawn apart, so that worlds without it stay.
inline constexpr std::size_t opposites_of_foxglove = 2;
inline constexpr std::string_view first_of_foxglove = "get_parameters"; // and all up to
inline constexpr std::string_view first_of_driving = "command";         // likewise
inline constexpr std::string_view first_of_rights = "rights";           // and all behind it, likewise

// A class of a member of an operation has a number: its row in the coverage table. Each operation begins with
// a row for itself.
struct row_name {
  std::size_t operation = 0;
  std::size_t member = 0; // in operation::members; none: the operation's own row
  std::size_t value = 0;  // in classes_of()
  bool own = false;
};
const std::vector<row_name>& rows();
std::size_t row_of(std::size_t operation);
std::size_t row_of(std::size_t operation, std::size_t member, std::size_t value);
std::string text_of(const row_name& row);
inline domain domain_of(const row_name& row) { return operations()[row.operation].members[row.member].is; }

// What a generator knows of the world.
struct knowledge {
  rowe::limits bounds{};
  std::string made_up;                        // a prefix of names that nobody else makes up
  std::vector<std::string> asked{};           // ids of calls that this peer was asked and has not answered
  std::vector<std::string> answered{};        // and has answered
  std::vector<std::string> asked_of_others{}; // that somebody else was asked
  std::vector<std::string> own_calls{};       // ids of this peer's open calls
  std::int64_t stop_number = 1;
  std::int64_t tick = 0;
  std::int64_t control_tick = 0;                                  // the newest
  std::vector<std::pair<std::int64_t, std::int64_t>> old_stops{}; // numbers and ticks that were shown before
  std::size_t names = 6;                                          // of each kind that are used
  bool honest_topics = true;                                      // untrusted peers may publish on them
  std::uint32_t* message_number = nullptr;                        // raised for each message: its "n"
  // Of a peer with numbers.
  tongue speaks = tongue::numbers;
  number_lists listed{};
  std::map<std::uint32_t, std::string> tags{};     // that it gave its subscriptions
  std::map<std::uint32_t, std::string> channels{}; // that it gave what it offers
};

struct recipe {
  std::size_t operation = 0;
  std::vector<std::size_t> classes{}; // of each member
  bool shuffled = false;              // members in another order than usual
  bool doubled = false;               // one of them stands twice
  bool escaped_names = false;         // of members
  std::size_t odd = 0;                // what else is chosen once for a recipe
};

// One element of a list of the codec with numbers.
struct numbered {
  std::uint32_t number = rowe::wire::no_number; // that the peer gives
  std::string topic;                            // plain; empty: none that is known
};

// What a peer asks whether it may, as it is meant. A text that cannot be read is empty.
struct asked_right {
  std::string right;
  std::string name;
};

// What was said, for those who record it.
struct saying {
  std::size_t operation = 0;
  std::string text{};               // or a payload, or raw bytes
  std::vector<std::string> parts{}; // of fragments
  bool good = true;                 // nothing in it is to be refused for its form
  std::string topic{};              // plain
  std::string service{};            // plain, without "#id"
  std::string id_raw{};             // as it is to be echoed
  std::string answers{};            // the id of the call that it answers
  std::int64_t throttle_ms = 0;
  std::int64_t queue_length = 0;
  bool queue_stated = false;
  bool latch = false;
  bool answered_well = true; // service_response: result
  bool stops = false;        // names the stop itself
  bool resets = false;
  std::int64_t number = -1;
  std::int64_t tick = -1;
  std::uint32_t message = 0; // its "n"
  std::vector<numbered> elements{};
  bool asks_rights = false;
  std::vector<asked_right> rights{};
};

// The class that a recipe has of a member; empty where there is none.
std::string_view value_of(const recipe& what, std::string_view member);
// Gives it that class, where it has such a member with such a class.
void give_value(recipe& to, std::string_view member, std::string_view value);
// One class for each member. Of the classes that `use` has left out none is chosen; a bad one is in about one
// recipe of `bad_in`, one at a time (0: never).
recipe choose_recipe(choices& from, const weights& use, std::size_t operation, std::uint64_t bad_in);
saying render(choices& from, const recipe& what, const knowledge& known);

// Names that the world shares.
inline constexpr std::string_view shared_topics[] = {"/t0", "/t1", "/t2", "/t3", "/t4", "/t5"};
inline constexpr std::string_view own_topics[] = {"/own0", "/own1", "/own2", "/own3", "/own4", "/own5"};
inline constexpr std::string_view honest_topics[] = {"/honest/steady", "/honest/changing"};
inline constexpr std::string_view shared_services[] = {"/s0", "/s1", "/s2"};
inline constexpr std::string_view honest_service = "/honest/echo";
inline constexpr std::string_view driven_topic = "/t0"; // where a world has one

} // namespace swarm
