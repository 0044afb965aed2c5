// SPDX-License-Identifier: Apache-2.0
// Passes the values of topics to who records them (state/recordings.hpp). Service thread only; nothing waits
// or allocates.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "service/outgoing/long_outbox.hpp"
#include "service/outgoing/message_store.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

// Each does nothing for a topic that nobody records.
class recorded_values {
 public:
  recorded_values(core_state& state, message_store& store, long_outbox& long_values) noexcept
      : state_{state}, message_store_{store}, long_outbox_{long_values} {}

  // True: somebody records it.
  bool keep(topic_id index, std::span<const char> body, rt::time_point published) noexcept;
  // A long value. `by`: for these sinks alone (their bits in topic::aside).
  bool keep_long(topic_id index, text_id value, rt::time_point published,
                 std::uint8_t by = recordings::everyone) noexcept;
  // What is retained of a topic, for those who begin to record.
  void keep_latched(topic_id index, std::uint8_t by) noexcept;
  // Copies this cycle's share of the long values that are under way. Its timer is due.
  void copy_long_values() noexcept;

 private:
  core_state& state_;
  message_store& message_store_;
  long_outbox& long_outbox_;
};

} // namespace rowe::service
