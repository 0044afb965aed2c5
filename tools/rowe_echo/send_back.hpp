// SPDX-License-Identifier: Apache-2.0
// What rowe_echo and rowe_echo_client do: the programs that suites of WebSocket tests talk to where they are
// to meet all of rowe (tests/conformance has one for the layer below JSON).
#pragma once

#include <rowe/endpoint.hpp>

#include "../rowe/console.hpp"

namespace rowe::tools {

// The options of an endpoint that sends back: messages as large as peers may send them, and every call.
endpoint_options echoing_options(const limits& bounds);

// Sends every plain message back to whom it came from, and answers every call with itself, until a signal
// comes; or, with `once`, until a peer has left. Prints what happens.
void send_back(endpoint& through, bool once, const console& to);

} // namespace rowe::tools
