// SPDX-License-Identifier: Apache-2.0
// What a message asks for, whatever its format. Decoders fill a request, the service carries it
// out.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace rowe::json {
class encoder;
class writer;
} // namespace rowe::json

namespace rowe::wire {

// The number of a codec in its protocol_set. A request is answered in the codec in which it came.
enum class codec_id : std::uint8_t {};

// The answer to a request has the codec of the request; the messages of a subscription may have another.
inline constexpr codec_id same_codec{0xff};

enum class verb : std::uint8_t {
  message, // to whoever receives
  publish,
  subscribe,
  unsubscribe,
  advertise,
  unadvertise,
  call,
  reply,
  advertise_service,
  unadvertise_service,
  advertise_action,
  unadvertise_action,
  send_goal, // a call with answers in between
  cancel_goal,
  goal_feedback, // one of those answers
  goal_result,   // the last one
  status,
  set_level,
  fragment,       // of a message, which is carried out when all of it is there
  get_parameters, // without a call; so the five below
  set_parameters,
  subscribe_parameters, // to their changes
  unsubscribe_parameters,
  subscribe_graph, // who publishes, subscribes and provides what
  unsubscribe_graph,
  unsupported, // the format has it, rowe does not
  unknown,
};

// Whether only clients ask for this.
constexpr bool is_for_servers(verb what) noexcept {
  return what != verb::publish && what != verb::status && what != verb::call && what != verb::reply &&
         what != verb::fragment;
}

// Whether this is asked for the sake of what is answered, or sent later. The others have a meaning for others
// than who asked.
constexpr bool is_for_who_asks(verb what) noexcept {
  switch (what) {
  case verb::subscribe:
  case verb::unsubscribe:
  case verb::advertise_service:
  case verb::advertise_action:
  case verb::call:
  case verb::send_goal:
  case verb::set_level:
  case verb::get_parameters:
  case verb::subscribe_parameters:
  case verb::unsubscribe_parameters:
  case verb::subscribe_graph:
  case verb::unsubscribe_graph: return true;
  default: return false;
  }
}

// For a status, and for set_level: what is at least as severe is reported.
enum class severity : std::uint8_t { none, error, warning, info };

inline constexpr std::uint32_t no_number = UINT32_MAX;

// The least that a peer may ask for as the size of fragments: what is around one is a third of it then.
inline constexpr std::int64_t fragment_size_min = 256;

inline constexpr std::int64_t unlimited = -1; // of a time: it has no end, or none was given

inline constexpr std::int64_t no_tick = -1;

struct name_limits {
  std::size_t name_bytes_max = 128;          // of topics, services and types, unescaped
  std::size_t id_bytes_max = 256;            // as it stands in the text
  std::uint32_t parameters_max = UINT32_MAX; // of a list, that are looked at
};

// The arguments of a call.
struct call_args {
  enum class form : std::uint8_t {
    args,   // JSON; empty: none
    object, // the whole call as one object (object_form.hpp), with or without its id
    value,  // of a struct, and what encodes it
  };
  form is = form::args;
  std::string_view text{};
  const json::encoder* encoder = nullptr;
  const std::byte* value = nullptr;
};

// A message may list several requests: where one of them begins. The first: at 0.
struct list_place {
  std::uint32_t at = 0;    // in the text of the message
  std::uint32_t index = 0; // in the list
  std::uint8_t means = 0;  // what the list is of, as its decoder has it
  explicit operator bool() const noexcept { return at != 0; }
};

// Views point into the message, or into the decoder's scratch. Members that the verb does not have, or that
// were absent, have the values below.
struct request {
  verb what = verb::unknown;
  codec_id codec{};
  codec_id messages_in = same_codec;            // subscribe: the codec of the topic's messages
  std::uint8_t encoding = 0;                    // subscribe: which of its format's encodings of messages
  call_args::form form = call_args::form::args; // object: body_raw is the whole message
  bool failed = false;                          // reply: a refusal
  bool latch = false;                           // advertise, publish, subscribe
  bool has_queue_length = false;                // subscribe
  bool keep_all = false;                        // subscribe, advertise: so much history
  bool by_number = false;                       // numbers stand in place of names, see below
  bool feedback = false;                        // send_goal: the answers in between are wanted
  std::int8_t goal_status = 0;                  // goal_result: a GoalStatus of ROS, 0 to 127
  severity level = severity::info;              // status, set_level
  std::string_view verb_text;                   // as the format calls it
  std::string_view id_raw;  // as it stood there, to be echoed; reply: the call's. Empty: none
  std::string_view topic;   // unescaped, never empty where the verb needs it
  std::string_view service; // or action, likewise
  std::string_view type;    // unescaped; empty: none given
  // JSON: message, arguments, value, or what a status says. Empty: none. Of parameters, a list of names, or
  // of objects with a `name` and perhaps a `value`; an empty list of names is all of them. Of a fragment, a
  // string.
  std::string_view body_raw;
  std::string_view code;                // reply that failed: a word for programs; empty: none
  std::int64_t ttl_ns = unlimited;      // message, publish, call: its time to live
  std::int64_t tick = no_tick;          // publish: the newest tick of the robot that its sender had
  std::int64_t throttle_ms = 0;         // subscribe: 0 to milliseconds_max
  std::int64_t queue_length = 0;        // subscribe: 0 or more; 0: not stated
  std::int64_t queue_size = 100;        // advertise: 0 or more
  std::int64_t lifespan_ns = unlimited; // subscribe, advertise: a time to live
  std::int64_t deadline_ns = unlimited; // subscribe, advertise: most time between two messages
  // fragment: its number, from 0 on, and how many there are; if the sender does not know exactly, it is a
  // number with a fraction, rounded down.
  std::uint32_t fragment_number = 0;
  std::uint32_t fragment_count = 0;
  bool fragment_count_exact = true;
  // subscribe, call, send_goal: messages to the peer that are longer are sent in fragments; 0: not stated
  std::uint32_t fragment_size = 0;
  // For codecs with numbers: the number that the peer gave its subscription, or the topic that it advertises.
  std::uint32_t tag = no_number;
  // by_number: the number of the topic or the service. It is ours, or one that the peer gave its topic. If
  // there is none, the tag names one of the peer's subscriptions.
  std::uint32_t channel = no_number;
  bool channel_is_peers = false;
  std::uint32_t service_number = no_number;
  // Where the next request of a list begins; at 0: there is none. A stop must not be in a list, nor requests
  // for handles of this process, because these may have to wait. Each counts as a message for its peer's
  // rate, and some are carried out in one turn.
  list_place next{};
};

inline constexpr std::int64_t milliseconds_max = INT64_MAX / 1'000'000; // as nanoseconds it still fits

} // namespace rowe::wire
