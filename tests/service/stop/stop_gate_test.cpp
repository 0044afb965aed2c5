// SPDX-License-Identifier: Apache-2.0
#include "service/stop/stop_gate.hpp"

#include <gtest/gtest.h>

#include <string_view>

namespace stop_gate_test {
namespace {

using rowe::service::stop_gate;
using rowe::service::stop_verb;
using rowe::wire::decoded;
using rowe::wire::verb;

} // namespace
} // namespace stop_gate_test
