// SPDX-License-Identifier: Apache-2.0
// The rosbridge v2 format: JSON text to request, and back. The core calls it on the service thread, with
// texts that json::reader has validated completely. This file only reads the envelope and never looks into
// `msg`. It follows the protocol text where that and the reference server agree. It is stricter where the
// server is silent: what the server would log and drop is refused here, with a diagnostic that names member,
// value and limit, for a `status` answer.
//
// Both directions are here, because rowe is also a client of rosbridge servers: `publish` and `status` come
// either way. Names are unescaped before they are compared, because the reference server writes "\/odom".
//
// Every function here: one thread, never waits, never allocates; time is linear in the text.
#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "wire/codec/refusal.hpp"
#include "wire/codec/request.hpp"

namespace rowe::json {
struct document;
class writer;
} // namespace rowe::json

namespace rowe::wire {
struct text_fragment;
} // namespace rowe::wire

namespace rowe::wire::rosbridge {

std::string_view name_of(severity which) noexcept;

// Bytes of scratch that decode() needs at most: for names that may have to be unescaped, and for the id at
// the end of a service's name.
constexpr std::size_t scratch_bytes(const name_limits& limits) noexcept {
  return 2 * limits.name_bytes_max + limits.id_bytes_max + 128;
}

// Reads one validated text into a new request. `scratch` is scratch_bytes(limits) long, and must live as long
// as the request is used. On a refusal, `out` still has what, verb_text and id_raw, as far as they could be
// read. verb::unsupported and verb::unknown are not refusals: refuse_op() makes one for an answer.
//
// Decided: null is a wrong type, but a null id means that there is none; both as in the reference server.
// `fragment_size` holds for all that the peer is sent from then on; fragment_size_min is its least.
// `compression` is an encoding of topics' messages, and has no effect on a call, as in the reference server.
// A throttle_rate below 0 is 0. `type` is optional everywhere. A publish without `msg` is refused (the
// reference server publishes defaults, which only it knows).
//
// Services: "/add#7" is the name "/add" and, if the call has no `id`, the id "7" (old clients write this; an
// `id` takes precedence). A `timeout` of 0 means that there is none, as for the reference server, and so does
// one that 64 bits cannot hold. Arguments and a fragment_size that are null are none. An answer with an `id`
// need not name what it answers. A service_response without `result` succeeded. Its `values` are not looked
// into, even if it failed and they should be a string.
//
// Actions: a goal has no end of its own, as for the reference server, unless it has a `timeout`, which is
// read as that of a call. Cancelling needs the goal's id; an answer without one is read, as one of a service
// is. A result's `status` is a GoalStatus of ROS (0 to 127), and 0 where it is left out.
//
// A `fragment` needs its id, as in the protocol text. Its `total` may be a number with a fraction, as the
// reference server writes it: that is not the count, but one less at the least when it is rounded down.
std::optional<refusal> decode(const json::document& validated_text, std::span<char> scratch,
                              const name_limits& limits, request& out) noexcept;

// Whether a text, which need not be JSON, was probably meant for rosbridge: its first name is `"op"`, with a
// string, or it has `"op"` with the name of an operation somewhere.
bool names_operation(std::string_view text) noexcept;

// For verb::unsupported and verb::unknown.
refusal refuse_op(const request& asked) noexcept;

// ---- Writing: into a json::writer that stands where a value is due; what did not fit is known by its
// overflowed().

// A publish is head, message, tail. The head is the same for every message of a topic, so it is written once
// and then copied.
void write_publish_head(json::writer& out, std::string_view topic) noexcept;
inline constexpr std::string_view publish_tail = "}";
// The beginning of the head, up to the topic's name. If a slash follows, it is one byte; without that byte,
// this is the head for the name without a slash.
inline constexpr std::string_view publish_begins = R"({"op":"publish","topic":")";
// Bytes that always suffice for the head of a topic with a name of so many bytes: each may need two (\").
constexpr std::size_t publish_head_bytes_max(std::size_t topic_bytes) noexcept {
  return 34 + 2 * topic_bytes;
}

// {"op":"status","level":"error","id":…,"msg":"…"}; without the id where id_raw is empty.
void write_status(json::writer& out, severity how, std::string_view id_raw, std::string_view text) noexcept;

// What we send as a client, with ids such as "subscribe:/odom:1": what ends another request has the id of
// that. Nothing is written for topics of more than 980 bytes. A type that is empty is left out; rosbridge
// servers want one of whoever advertises.
void write_subscribe(json::writer& out, std::string_view topic, std::string_view type,
                     std::int64_t throttle_ms) noexcept;
void write_unsubscribe(json::writer& out, std::string_view topic) noexcept;
void write_advertise(json::writer& out, std::string_view topic, std::string_view type, bool latch) noexcept;
void write_unadvertise(json::writer& out, std::string_view topic) noexcept;

// Neither has an id, because roslib's have none.
void write_advertise_service(json::writer& out, std::string_view service, std::string_view type) noexcept;
void write_unadvertise_service(json::writer& out, std::string_view service) noexcept;

// Bytes that always suffice for the six above.
constexpr std::size_t request_bytes_max(const name_limits& limits) noexcept {
  return 192 + 18 * limits.name_bytes_max; // topic twice (in the id, too) and type, six bytes a byte at worst
}

// A call is head, arguments, and the end of the object: after the head the caller writes one value into the
// same writer, an object or an array ({} where there are no arguments).
//   {"op":"call_service","id":"ID","service":"/add","args":  ...  }
void write_call_service_head(json::writer& out, std::string_view service, std::string_view id) noexcept;

// Its answer, likewise: after the head one value, which is a string (why) when `result` is false.
// `id_raw` is the call's, as it stood there; without the id where it is empty.
//   {"op":"service_response","id":ID,"service":"/add","result":true,"values":  ...  }
void write_service_response_head(json::writer& out, std::string_view service, std::string_view id_raw,
                                 bool result) noexcept;

// An action's goal for its provider, as a call. `id` is ours.
//   {"op":"send_action_goal","id":"ID","action":"/dock","action_type":"a/Dock","feedback":true,"args":  ... }
void write_goal_head(json::writer& out, std::string_view action, std::string_view type, std::string_view id,
                     bool feedback) noexcept;
void write_cancel_goal(json::writer& out, std::string_view action, std::string_view id) noexcept;
// {"op":"fragment","id":"ID","data":"...","num":0,"total":3}
void write_fragment(json::writer& out, const text_fragment& what) noexcept;
// What the provider answers, for who sent the goal: head, and one value. `id_raw` as above. A result that
// failed has a string, unless its provider said something else.
void write_feedback_head(json::writer& out, std::string_view action, std::string_view id_raw) noexcept;
void write_action_result_head(json::writer& out, std::string_view action, std::string_view id_raw,
                              int goal_status, bool result) noexcept;

} // namespace rowe::wire::rosbridge
