// SPDX-License-Identifier: Apache-2.0
// The part of instructions.cpp that is about JSON.
#pragma once

namespace rowe::bench {

void json_steps();

} // namespace rowe::bench
