// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string_view>

#include "rosmsg/definition.hpp"
#include "rosmsg/failure.hpp"
#include "rosmsg/output.hpp"

namespace rowe::rosmsg {

// Writes the message whose JSON this is; `validated` is JSON that was accepted. False: `why` says why not;
// what was written means nothing.
bool from_json(const definition& of, ros_encoding in, std::string_view validated, output& to, failure& why);

// Whether the default of the member, which is not an object, is a value of it; else `why` says why not.
bool check_default(ros_version version, const member& of, failure& why);

} // namespace rowe::rosmsg
