// SPDX-License-Identifier: Apache-2.0
#include "wire/text/word_table.hpp"

#include <gtest/gtest.h>

#include <string>

#include "wire/codec/members.hpp"

namespace word_table_test {
namespace {

using rowe::wire::find_escaped;
using rowe::wire::word_table;

constexpr word_table words{"op", "id", "topic", "level", "latch", "subscribe", "advertise"};

} // namespace
} // namespace word_table_test
