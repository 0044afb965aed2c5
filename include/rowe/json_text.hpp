// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace rowe {

// Stands for messages that are JSON text already, in publisher<json_text> and subscriber<json_text>: for
// tools, and for programs that make or read JSON themselves.
struct json_text {};

} // namespace rowe
