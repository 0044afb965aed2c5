// SPDX-License-Identifier: Apache-2.0
// What refused.cpp includes: refused_test.py precompiles it, once for all cases.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <rowe/json_value.hpp>
#include <rowe/schema.hpp>
