// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/detail/lane.hpp>
#include <rowe/options.hpp>
#include <rowe/schema.hpp>

namespace rowe::detail {

// What a handle asks set-up for: a lane of this kind, with paths of this size. Depths and bytes of paths that
// the kind does not have stay 0.
struct lane_request {
  lane_kind kind = lane_kind::publish_value;
  std::string_view name = {}; // of the topic or service
  std::string_view type = {};
  rowe::keep keep = rowe::keep::all; // of the one path that a topic's handle has
  rowe::priority priority = rowe::priority::normal;
  bool latched = false;
  duration ttl = rt::for_ever;
  bool receives = false; // talk

  std::uint32_t out_depth = 0; // slots of each path, 1 to 4096
  std::uint32_t in_depth = 0;
  std::uint32_t ends_depth = 0;
  std::size_t out_bytes = 0; // of the largest value
  std::size_t in_bytes = 0;
  std::size_t ends_bytes = 0;

  const schema_description* encoded = nullptr; // of the values that go out
  const schema_description* decoded = nullptr; // of those that come in
};

} // namespace rowe::detail
