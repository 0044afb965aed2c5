// SPDX-License-Identifier: Apache-2.0
// What else is known of a value that is published: who did, and since when it counts. No calls.
#pragma once
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/rt/clock.hpp>

#include "wire/codec/codec.hpp"

namespace rowe::service {

// The peer that published a relayed value, and the id of its request; none: this process published it.
struct published_by {
  detail::peer_ref peer{};
  std::string_view id_raw{};
  wire::typed_value value{}; // what else encodes it; none: it is JSON
  rt::time_point sent{};     // of a peer's command: not before
};

} // namespace rowe::service
