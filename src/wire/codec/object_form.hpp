// SPDX-License-Identifier: Apache-2.0
// The object form: plain messages and calls as users of this process write and read them, whatever codec
// their peers use. It is one JSON object. A call has a member `service` beside its arguments; the members op,
// message_id and in_reply_to belong to the endpoint. It is not another format: the plain codec writes it
// unchanged.
//
// The core calls this on the service thread; users' threads call find_reserved(). Texts are validated.
// Nothing waits or allocates; time is linear in the text.
#pragma once
#include <cstddef>
#include <optional>
#include <string_view>

#include "wire/codec/request.hpp"

namespace rowe::wire {

// What stands for a long object whose members are not known (service/base/stand_in.hpp). They go into no
// other object.
inline constexpr std::string_view long_object = R"({"<a long value>":0})";

// Finds a member of the endpoint at the top level of a user's text (escapes are understood). `ttl_ms` is one
// where the endpoint writes it. Returns the index of its name's opening quote; nothing if there is none, or
// the text is no object.
std::optional<std::size_t> find_reserved(std::string_view validated_text, bool with_ttl = false) noexcept;

// Whether the object has a member that would stand twice in a call in this form, or would change what it is.
bool has_names_of_calls(std::string_view validated_object) noexcept;

// Writes the arguments alone, as one JSON value. Of an object, these are the members that neither belong to
// the endpoint nor name the service.
void write_args(json::writer& out, const call_args& what) noexcept;

// Writes a call for a generic receiver: {"service":"service", members of args, "message_id":"id"}. The
// arguments are an object, an array or none (empty). An array goes under "args", and so does an object that
// has a member service, op, message_id or in_reply_to itself.
void write_delivered_call(json::writer& out, std::string_view service, std::string_view args_raw,
                          std::string_view id) noexcept;

// Writes {"result":VALUE}, for a value that is no object, or that must not share an object with the
// endpoint's members.
void write_result(json::writer& out, std::string_view value_raw) noexcept;

// The pieces of an object that is being written.
void write_service_member(json::writer& out, std::string_view service) noexcept;
void write_id_member(json::writer& out, std::string_view id) noexcept;
// Writes the members of an object; another value becomes one member of that name.
void write_members(json::writer& out, std::string_view text, std::string_view name_otherwise) noexcept;

} // namespace rowe::wire
