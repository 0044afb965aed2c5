// SPDX-License-Identifier: Apache-2.0
#include "service/state/call_table.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

namespace call_table_test {
namespace {

using rowe::service::call_endpoint;
using rowe::service::call_index;
using rowe::service::call_table;
using rowe::service::connection_id;

struct call_table_test : testing::Test {
  call_table_test() { calls.begin(0xF00D); }

  const rowe::limits bounds{.connections_max = 4, .calls_max = 32, .calls_per_connection_max = 20};
  rowe::rt::arena memory{call_table::footprint_bytes(bounds), rowe::rt::page_lock::none};
  call_table calls{memory, bounds, bounds.connections_max};

  static call_endpoint peer(std::uint32_t index) { return call_endpoint::of(connection_id{index, 1}, {}); }
  // Of this process.
  call_index open_own() { return calls.open({}, {}, "/add"); }
  std::string id_of(call_index index) {
    std::array<char, call_table::our_id_bytes_max> buffer{};
    return '"' + std::string{calls.write_id(buffer, index, 3)} + '"';
  }
  void TearDown() override { EXPECT_TRUE(calls.check()); }
};

TEST_F(call_table_test, finds_no_call_beyond_its_end) {
  EXPECT_EQ(calls.find({bounds.calls_max, 1}), nullptr);
  EXPECT_EQ(calls.find({UINT32_MAX, 1}), nullptr);
}

// 0 in a reference says that there is no call.
TEST_F(call_table_test, leaves_out_the_generation_that_means_no_call) {
  const call_index index = open_own();
  calls.at(index).generation = UINT32_MAX;
  calls.close(index);
  const call_index again = open_own();
  ASSERT_EQ(again, index);
  EXPECT_EQ(calls.ref(again).generation, 1U);
}

// So many calls share some of the buckets.
TEST_F(call_table_test, finds_the_others_whichever_call_ends) {
  std::vector<std::pair<std::string, call_index>> open;
  for (int i = 0; i < 18; ++i) {
    const std::string id = std::to_string(i);
    open.emplace_back(id, calls.open(peer(static_cast<std::uint32_t>(i % 2)), id, "/add"));
  }
  ASSERT_TRUE(calls.check());
  const auto by = [](const std::string& id) {
    return connection_id{static_cast<std::uint32_t>(std::stoi(id) % 2), 1};
  };
  while (!open.empty()) {
    const auto ends = open.begin() + static_cast<std::ptrdiff_t>(open.size() * 2 / 3);
    const std::string id = ends->first;
    calls.close(ends->second);
    open.erase(ends);
    EXPECT_FALSE(calls.find_asked(by(id), id)) << id;
    for (const auto& [other, index] : open) EXPECT_EQ(calls.find_asked(by(other), other), index) << other;
    ASSERT_TRUE(calls.check());
  }
}

TEST_F(call_table_test, keeps_texts_as_long_as_they_may_be_and_none_that_are_longer) {
  const std::string id(rowe::service::call_id_bytes_max, 'i'), name(bounds.topic_bytes_max, 's');
  const call_index longest = calls.open(peer(0), id, name);
  const call_index longer = calls.open(peer(0), id + 'i', name + 's');
  EXPECT_EQ(calls.id_raw(longest), id);
  EXPECT_EQ(calls.service(longest), name);
  EXPECT_EQ(calls.id_raw(longer), "");
  EXPECT_EQ(calls.service(longer), "");
}

TEST_F(call_table_test, reads_no_id_that_is_changed_in_any_way) {
  const std::string id = id_of(open_own());
  ASSERT_TRUE(calls.read_id(id));
  const std::string inner = id.substr(1, id.size() - 2), nonce = inner.substr(0, 16);
  for (const std::string& wrong :
       {std::string{}, std::string{"\""}, std::string{"\"\""}, inner, '"' + inner + ".1\"",
        '"' + inner + " \"", '"' + inner + "-\"", '"' + nonce + '"', '"' + nonce + ".3\"",
        '"' + nonce + ".3.0\"", '"' + nonce + ".3.0.\"", '"' + nonce + ".3.-1.1\"",
        '"' + nonce + ".4294967296.0.1\"", '"' + nonce + ".3.0.4294967296\"", '"' + nonce + "..0.1\"",
        '"' + inner.substr(1) + '"', "\"x" + inner.substr(1) + '"'}) {
    EXPECT_FALSE(calls.read_id(wrong)) << wrong;
  }
}

} // namespace
} // namespace call_table_test
