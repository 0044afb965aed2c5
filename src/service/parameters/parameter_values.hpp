// SPDX-License-Identifier: Apache-2.0
// Values of parameters and what they may be, as JSON, and the checks of what is to become a value. Pure
// functions; nothing waits or allocates.
#pragma once
#include <string_view>

#include <rowe/detail/parameter_cell.hpp>

#include "wire/text/text_out.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

// Whether the parameter may have this value, which is of its type.
bool is_allowed(const detail::parameter_description& what, const detail::parameter_value& value) noexcept;

// Reads a valid JSON text. False, and `why` is what is wanted and what was found, if the parameter may not
// have this value.
bool read_value(const detail::parameter_description& what, std::string_view json,
                detail::parameter_value& into, wire::text_out& why) noexcept;

void write_value(const detail::parameter_description& what, const detail::parameter_value& value,
                 json::writer& into) noexcept;

// Writes what it may be, as one object in the form of a member's value in json/structs/description.hpp. Of a
// number it also says "least" and "most", unless its type alone bounds it there.
void write_description(const detail::parameter_description& what, json::writer& into) noexcept;

} // namespace rowe::service
