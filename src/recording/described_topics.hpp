// SPDX-License-Identifier: Apache-2.0
// The topics of a recording by the numbers that a feed has for them, and what of them stands in files. One
// thread.
#pragma once
#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mcap/format.hpp"

namespace rowe::recording {

// What has no schema of its own has this one: programs that show recordings want one.
inline constexpr std::string_view any_schema = R"({"type":"object"})";

struct described_topic {
  std::string name{};
  std::string type{};
  std::string schema{}; // in JSON; empty: it is not known
  std::uint32_t sequence = 0;
  mcap::channel_number channel = 0; // in the present file; 0: none yet
  std::uint64_t unsaid = 0;         // messages that were lost, and no file says so yet

  bool has_schema() const noexcept { return !type.empty() || !schema.empty(); }
  std::string_view schema_name() const noexcept { return type.empty() ? name : type; }
  std::string_view schema_text() const noexcept { return schema.empty() ? any_schema : schema; }

  // Its next message. Times before 1970 are that.
  mcap::message next(std::string_view json, std::int64_t logged_ns, std::int64_t published_ns) noexcept {
    const auto as_time = [](std::int64_t ns) {
      return static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0));
    };
    return {.channel = channel,
            .sequence = sequence++,
            .logged_ns = as_time(logged_ns),
            .published_ns = as_time(published_ns != 0 ? published_ns : logged_ns),
            .data = json};
  }
};

class described_topics {
 public:
  // From now on the number stands for this topic; for the same one, nothing changes.
  void set(std::uint32_t number, std::string name, std::string type, std::string schema) {
    if (all_.size() <= number) all_.resize(std::size_t{number} + 1);
    described_topic& its = all_[number];
    if (its.name == name && its.type == type && its.schema == schema) return;
    its = {};
    its.name = std::move(name);
    its.type = std::move(type);
    its.schema = std::move(schema);
  }
  // Null: it was never set; there was no memory for that.
  described_topic* find(std::uint32_t number) noexcept {
    return number < all_.size() ? &all_[number] : nullptr;
  }
  auto begin() noexcept { return all_.begin(); }
  auto end() noexcept { return all_.end(); }

 private:
  std::vector<described_topic> all_;
};

} // namespace rowe::recording
