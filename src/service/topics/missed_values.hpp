// SPDX-License-Identifier: Apache-2.0
// What a handle that subscribed did not get, or late subscribers will not, and why: counted, and reported to
// who published it. Service
// thread only; nothing waits or allocates.
#pragma once
#include <string_view>

#include "service/incoming/refusals.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/published_by.hpp"
#include "json/structs/decoder.hpp"

namespace rowe::service {

class missed_values {
 public:
  missed_values(core_state& state, refusals& refused) noexcept : state_{state}, refusals_{refused} {}

  // `done`: the error of the delivery; `why`: what the decoder has found, if that is it.
  void report(pair_index pair, const published_by& who, const status& done,
              const json::decoder::diagnosis& why) noexcept;
  void report_too_big(pair_index pair, const error& why, const published_by& who) noexcept;
  // There is no room to retain a value of so many bytes.
  void report_not_latched(topic_id index, std::size_t bytes, const published_by& who) noexcept;

 private:
  void report_undecodable(pair_index pair, const published_by& who, std::string_view why) noexcept;

  core_state& state_;
  refusals& refusals_;
};

} // namespace rowe::service
