// SPDX-License-Identifier: Apache-2.0
// The modes of `rowe bench`; each lives in the file of its name, and is listed in bench.cpp.
#pragma once
#include "../rowe/arguments/command_line.hpp"
#include "../rowe/exit_code.hpp"
#include "settings.hpp"

namespace rowe::tools::bench {

// Reads a mode's arguments; nothing: all is well, and what was said is in `s` and `to`.
std::optional<exit_code> read_mode(const command& table, argument_list arguments, settings& s, console& to);

exit_code rpc(argument_list arguments);
exit_code send(argument_list arguments);
exit_code stop(argument_list arguments);
exit_code loop(argument_list arguments);
exit_code expiry(argument_list arguments);
exit_code idle(argument_list arguments);
exit_code peer(argument_list arguments);

} // namespace rowe::tools::bench
