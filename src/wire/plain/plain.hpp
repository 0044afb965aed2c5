// SPDX-License-Identifier: Apache-2.0
// The plain format, that of the report of 2015: every JSON text is a message. Three members are reserved.
// `message_id` makes an object an invocation. `in_reply_to`, with the same id as it was written, makes it the
// reply. `ttl_ms` is its time to live. An invocation may name the service in `service`; a reply that is a
// refusal has `error`. All other members belong to the users and are not looked at.
//
//   {"service":"add-two-numbers","a":38,"b":4,"message_id":"7"}     an invocation
//   {"result":42,"in_reply_to":"7"}                                 its reply
//   {"error":{"code":"no_service","text":"..."},"in_reply_to":"7"}  or its refusal
//
// All texts that are read were validated by json::reader. Every function: one thread at a time, never waits,
// never allocates; time is linear in the text.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "wire/codec/codec.hpp"
#include "wire/codec/refusal.hpp"
#include "wire/codec/request.hpp"
#include "json/reading/reader.hpp"
#include "json/writing/writer.hpp"

namespace rowe::wire::plain {

// The first member `op` of a text. If it is a string, the text is rosbridge's.
enum class op_member : std::uint8_t { none, text, other };

inline constexpr std::size_t code_bytes_max = 64; // of an error's code

// Bytes of scratch that decode() needs at most.
constexpr std::size_t scratch_bytes(const name_limits& limits) noexcept {
  return limits.name_bytes_max + code_bytes_max;
}

// Reads one validated text into a new request, except its codec. `scratch` is scratch_bytes(limits) long, and
// must live as long as the request is used. If `op` is a string, no other member is read. On a refusal, `out`
// has `what`, and for a call the id, if that is valid: write_error() can answer it.
//
// A call's `service` is its member of that name, if that is a string. A reply has failed if `error` is an
// object with a string `code` of 1 to code_bytes_max bytes; its body is the `text` of that object, as JSON,
// if there is one. Any other `error` belongs to the users.
//
// Decided: a text that is no object is a message. An object with both ids is a reply; its message_id is still
// read and checked. null is a wrong type for an id. Ids are strings or integers, of at most
// limits.id_bytes_max bytes as written. A `service` of an invocation must not be empty or too long, or have
// control characters; if it is not a string, it belongs to the users. A ttl_ms is a number of milliseconds, 0
// or more, fractions allowed; if 64 bits of nanoseconds cannot hold it, there is none. None of message_id,
// in_reply_to and ttl_ms may occur twice, nor `service` in an invocation, nor `error` in a reply.
std::optional<refusal> decode(const json::document& validated_text, std::span<char> scratch,
                              const name_limits& limits, request& out, op_member& op) noexcept;

// Whether a text, which need not be JSON, was probably meant as an invocation or a reply of this format: it
// has `"message_id":` or `"in_reply_to":` somewhere.
bool names_id(std::string_view text) noexcept;

// ---- Writing ----
//
// Each function writes one value into a json::writer, whose overflowed() says that it did not fit. An
// `object_text` is validated JSON of a user or a peer; it may contain white space. Bodies and texts are
// written in place, without another copy.

// The object and a last member, "message_id":"id". A text that is no object goes under "args".
void write_invocation(json::writer& out, std::string_view object_text, std::string_view id) noexcept;

// {"service":"service", members of the arguments, "message_id":"id"}. Arguments that are no object go under
// "args", and so do those that have a member service, op, message_id or in_reply_to themselves.
void write_call(json::writer& out, std::string_view service, std::string_view id,
                const call_args& args) noexcept;

// {members of the body, "in_reply_to":ID}; ID is the invocation's message_id as it was written. A body that
// is no object goes under "result", and so does one that has a member op, message_id or in_reply_to itself.
void write_reply(json::writer& out, std::string_view in_reply_to_raw, const body& value) noexcept;

// {"error":{"code":"code","text":"text"},"in_reply_to":ID}; without in_reply_to where that is empty.
void write_error(json::writer& out, std::string_view in_reply_to_raw, std::string_view code,
                 std::string_view text) noexcept;

} // namespace rowe::wire::plain
