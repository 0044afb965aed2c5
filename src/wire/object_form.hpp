// SPDX-License-Identifier: Apache-2.0
// Plain messages and calls as users of this process write and read them, whatever their peers speak: one JSON
// object. A call has a member `service` beside its arguments; three members, op, message_id and in_reply_to,
// are the endpoint's. This is no format of its own: the bare codec writes it as it is.
//
// The core calls this on the service thread; users' threads call find_reserved(). Texts are validated.
// Nothing waits or allocates; time is linear in the text.
#pragma once
#include <cstddef>
#include <optional>
#include <string_view>

#include "wire/request.hpp"

namespace rowe::wire {

// Which of the endpoint's members a user's own text has at its top level (escapes are understood): the index
// of its name's opening quote. Nothing when it has none or is not an object.
std::optional<std::size_t> find_reserved(std::string_view validated_text) noexcept;

// The arguments alone, as one JSON value: of an object, the members that are neither the endpoint's nor the
// service's name.
void write_args(json::writer& out, const call_args& what) noexcept;

// What a generic receiver sees of a call with arguments of its own, which are an object, an array or none
// (empty): {"service":"service", members of args, "message_id":"id"}. Arguments that are an array go under
// "args", and so does an object that has a member service, op, message_id or in_reply_to itself.
void write_delivered_call(json::writer& out, std::string_view service, std::string_view args_raw,
                          std::string_view id) noexcept;

// {"result":VALUE}: a value that is no object, or must not stand beside the endpoint's members.
void write_result(json::writer& out, std::string_view value_raw) noexcept;

// The pieces of an object that is being written.
void write_service_member(json::writer& out, std::string_view service) noexcept;
void write_id_member(json::writer& out, std::string_view id) noexcept;
// The members of an object; another value as one member of that name.
void write_members(json::writer& out, std::string_view text, std::string_view name_otherwise) noexcept;

} // namespace rowe::wire
