// SPDX-License-Identifier: Apache-2.0
// The verbs of the program, as verb_list.cpp lists them. Each lives in the file of its name beside this one,
// but for doctor and bench, which have folders of theirs in tools/.
#pragma once
#include "../arguments/command_line.hpp"
#include "../exit_code.hpp"

namespace rowe::tools {

exit_code serve(argument_list arguments);
exit_code config(argument_list arguments);
exit_code pub(argument_list arguments);
exit_code echo(argument_list arguments);
exit_code list(argument_list arguments);
exit_code topics(argument_list arguments);
exit_code services(argument_list arguments);
exit_code actions(argument_list arguments);
exit_code hz(argument_list arguments);
exit_code bw(argument_list arguments);
exit_code delay(argument_list arguments);
exit_code top(argument_list arguments);
exit_code completion(argument_list arguments);
exit_code complete(argument_list arguments); // not listed: what the shells' scripts ask
exit_code man(argument_list arguments);
exit_code call(argument_list arguments);
exit_code stop(argument_list arguments);
exit_code reset(argument_list arguments);
exit_code param(argument_list arguments);
exit_code types(argument_list arguments);
exit_code peers(argument_list arguments);
exit_code record(argument_list arguments);
exit_code info(argument_list arguments);
exit_code replay(argument_list arguments);
exit_code plot(argument_list arguments);
exit_code setup(argument_list arguments);
exit_code token(argument_list arguments);
exit_code discover(argument_list arguments);
exit_code doctor(argument_list arguments);
exit_code version(argument_list arguments);
namespace bench {
exit_code run(argument_list arguments);
}

} // namespace rowe::tools
