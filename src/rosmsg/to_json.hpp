// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string_view>

#include "rosmsg/definition.hpp"
#include "rosmsg/failure.hpp"
#include "rosmsg/output.hpp"

namespace rowe::rosmsg {

// Writes the message's JSON. False: `why` says why not; what was written means nothing. Never takes more
// steps than in proportion to the bytes, and to the members of the types that are there.
bool to_json(const definition& of, ros_encoding in, std::string_view bytes, output& to, failure& why);

} // namespace rowe::rosmsg
