// SPDX-License-Identifier: Apache-2.0
// The rosbridge v2 dialect: JSON text to request, and back. The core calls it on the service thread, with
// texts that json::reader has validated whole; this file only reads the envelope and never looks into `msg`.
// The rules are those of the protocol text where it and the reference server agree, and stricter where the
// server is silent: whatever it would log and drop is refused here with a sentence that names member, value
// and limit, for a `status` answer.
//
// Both ends are here, since rowe is also a client of rosbridge servers: `publish` and `status` come either
// way. Names are unescaped before anybody compares them, because the reference server writes "\/odom".
//
// Every function here: one thread, never waits, never allocates; time is linear in the text. Encoders return
// what they wrote, empty when `out` is too small; nothing is cut in the middle.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace rowe::json {
struct document;
class writer;
} // namespace rowe::json

namespace rowe::wire::rosbridge {

enum class op : std::uint8_t {
  subscribe,
  unsubscribe,
  advertise,
  unadvertise,
  publish,
  status,
  set_level,
  call_service,
  service_response,
  advertise_service,
  unadvertise_service,
  unsupported, // rosbridge has it, rowe does not: actions, fragments, png, auth
  unknown,
};

// Of a status, and of set_level: what is at least that grave is reported.
enum class level : std::uint8_t { none, error, warning, info };
std::string_view name_of(level which) noexcept;

inline constexpr std::int64_t lifespan_for_ever = -1; // or a deadline that never comes
inline constexpr std::int64_t no_timeout = -1;        // of a call: none was given

// What a text asked for. Views point into the text or into the scratch buffer. Members that the operation
// does not have, or that were absent, hold what stands here; members this file does not know are ignored.
struct request {
  op what = op::unknown;
  std::string_view op_text; // unescaped
  std::string_view id_raw; // JSON, a string with its quotes or an integer, to be echoed verbatim; empty: none
  std::string_view topic;  // unescaped, never empty where the operation needs it
  std::string_view service;                     // likewise; of call_service without its "#id"
  std::string_view type;                        // unescaped; empty: none given
  std::string_view msg_raw;                     // JSON: publish: an object; status: a string
  std::string_view args_raw;                    // JSON: call_service: an object or an array; empty: none
  std::string_view values_raw;                  // JSON: service_response: any value; empty: none
  bool result = true;                           // service_response: false when the call failed
  std::int64_t timeout_ns = no_timeout;         // call_service: more than 0
  rosbridge::level level = level::info;         // status, set_level
  std::int64_t throttle_ms = 0;                 // subscribe: 0 to milliseconds_max
  std::int64_t queue_length = 0;                // subscribe: 0 or more; qos.depth wins over queue_length
  bool has_queue_length = false;                // one of the two was given
  bool keep_all = false;                        // qos.history was keep_all
  std::int64_t lifespan_ns = lifespan_for_ever; // qos.lifespan: a time to live
  std::int64_t deadline_ns = lifespan_for_ever; // qos.deadline: most time between two messages
  bool latch = false;                           // advertise, publish; or qos.durability was transient_local
  std::int64_t queue_size = 100;                // advertise: 0 or more
};

inline constexpr std::int64_t milliseconds_max = INT64_MAX / 1'000'000; // as nanoseconds it still fits

struct name_limits {
  std::size_t topic_bytes_max = 128; // unescaped; names of services and types likewise
  std::size_t id_bytes_max = 256;    // as it stands in the text
};

// Bytes of scratch that decode() needs at most: the names that may have to be unescaped, and the id that a
// service's name ends in.
constexpr std::size_t scratch_bytes(const name_limits& limits) noexcept {
  return 2 * limits.topic_bytes_max + limits.id_bytes_max + 128;
}

// Why a text is refused.
struct refusal {
  enum class kind : std::uint8_t {
    not_an_object,
    missing,        // member
    twice,          // member
    wrong_type,     // member, value, expected
    negative,       // member, value
    too_large,      // member, value, limit
    too_long,       // member, bytes, limit
    empty,          // member
    bad_characters, // member: control characters, or escapes that are no character
    not_offered,    // member, value, expected
    unsupported_op, // value
    unknown_op,     // value
  };
  kind what = kind::not_an_object;
  std::string_view op_text{};  // empty: not known
  std::string_view member{};   // "topic", "qos.depth"
  std::string_view value{};    // JSON as it stood there, or an operation's name
  std::string_view expected{}; // "an integer"
  std::size_t bytes = 0;
  std::int64_t limit = 0;

  // The sentence, e.g. `subscribe: the member "throttle_rate" must be an integer; it is "50"`; long values
  // are shortened; cut where `buffer` ends, which never happens with refusal_text_bytes_max.
  std::string_view text(std::span<char> buffer) const noexcept;
};
inline constexpr std::size_t refusal_text_bytes_max = 416;

// Reads one validated text. `scratch` is scratch_bytes(limits) long and is lent as long as the request is
// used. On a refusal, `out` still has what, op_text and id_raw as far as they could be read. op::unsupported
// and op::unknown are not refusals: refuse_op() makes one for those who want to answer.
//
// Decided: null counts as a wrong type, but as an id it means that there is none; both as there.
// `fragment_size` is checked and then ignored: a peer that asks for fragments must take whole messages as
// well. `compression` other than "none" is refused. `type` is optional everywhere. A publish without `msg` is
// refused (the reference server publishes defaults, which only it knows).
//
// Services: "/add#7" is the name "/add" and, where the call has no `id`, the id "7" (as old clients write
// it; an id given wins). A `timeout` of 0 means, as for the reference server, that there is none; one that 64
// bits cannot hold, too. A service_response without `result` succeeded; its `values` are not looked into,
// also where it failed, when they should be a string.
//
// `fragment` is unsupported in both directions. The reference server cuts only for those who asked for a
// `fragment_size`, which rowe never does; and its fragments could not be trusted (every id is 0, `total` is
// not the count).
std::optional<refusal> decode(const json::document& validated_text, std::span<char> scratch,
                              const name_limits& limits, request& out) noexcept;

// Whether a text, which need not be JSON, was meant as one of rosbridge's: its first name is `"op"`, of a
// string, or it has that with the name of an operation somewhere.
bool names_operation(std::string_view text) noexcept;

// For op::unsupported and op::unknown.
refusal refuse_op(const request& asked) noexcept;

// A publish is head, message, tail; the head is the same for every message of a topic: written once, then
// copied.
std::string_view encode_publish_head(std::span<char> out, std::string_view topic) noexcept;
inline constexpr std::string_view publish_tail = "}";
// Where in the head the topic's name begins, behind its quote. A slash there is one byte, which can be left
// out to get the head of the same name without it.
inline constexpr std::size_t publish_name_at = 25;
// Bytes that always suffice for the head of a topic with a name of so many bytes: each may need six (\u0001).
constexpr std::size_t publish_head_bytes_max(std::size_t topic_bytes) noexcept {
  return 34 + 6 * topic_bytes;
}

// {"op":"status","level":"error","id":…,"msg":"…"}; without the id where id_raw is empty.
std::string_view encode_status(std::span<char> out, level how, std::string_view id_raw,
                               std::string_view text) noexcept;

// What we send as a client, with ids such as "subscribe:/odom:1": `number` tells several of one topic apart,
// and an unsubscribe names the subscribe it ends. Topics of more than 980 bytes cannot be asked for.
struct subscription {
  std::string_view topic;
  std::string_view type{}; // empty: left out
  std::uint64_t number = 1;
  std::int64_t throttle_ms = 0;
  std::int64_t queue_length = 0;
};
std::string_view encode_subscribe(std::span<char> out, const subscription& what) noexcept;
std::string_view encode_unsubscribe(std::span<char> out, std::string_view topic,
                                    std::uint64_t number) noexcept;

struct advertisement {
  std::string_view topic;
  std::string_view type{}; // rosbridge servers want one
  std::uint64_t number = 1;
  bool latch = false;
  std::int64_t queue_size = 100;
};
std::string_view encode_advertise(std::span<char> out, const advertisement& what) noexcept;
std::string_view encode_unadvertise(std::span<char> out, std::string_view topic,
                                    std::uint64_t number) noexcept;

// Texts of more than `out`, as above, are not written. rosbridge servers want a type. Neither has an id,
// because roslib's have none.
std::string_view encode_advertise_service(std::span<char> out, std::string_view service,
                                          std::string_view type) noexcept;
std::string_view encode_unadvertise_service(std::span<char> out, std::string_view service) noexcept;

// Bytes that always suffice for the six above.
constexpr std::size_t request_bytes_max(const name_limits& limits) noexcept {
  return 192 +
         18 * limits.topic_bytes_max; // topic twice (in the id, too) and type, six bytes a byte at worst
}

// A call is head, arguments, tail: between the two the caller writes one value into the same writer, an
// object or an array ({} where there are no arguments). `timeout_ns` is left out unless it is more than 0.
// What did not fit is known by the writer's overflowed(), as always with it.
//   {"op":"call_service","id":"ID","service":"/add","timeout":0.5,"args":  ...  }
void write_call_service_head(json::writer& out, std::string_view service, std::string_view id,
                             std::int64_t timeout_ns = no_timeout) noexcept;
void write_call_service_tail(json::writer& out) noexcept;

// Its answer, likewise: between head and tail one value, which is a string (why) when `result` is false.
// `id_raw` is the call's, as it stood there; without the id where it is empty.
//   {"op":"service_response","id":ID,"service":"/add","result":true,"values":  ...  }
void write_service_response_head(json::writer& out, std::string_view service, std::string_view id_raw,
                                 bool result) noexcept;
void write_service_response_tail(json::writer& out) noexcept;

} // namespace rowe::wire::rosbridge
