// SPDX-License-Identifier: Apache-2.0
// What the decoder and the codec of Foxglove's protocol share: its words, and its binary messages. Pure
// functions; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace rowe::wire::foxglove_words {

// Binary messages, by their first bytes. Integers have their lowest byte first.
inline constexpr char message_data = 1;     // to the client: subscription, time, body
inline constexpr char server_time = 2;      // nanoseconds since 1970
inline constexpr char service_response = 3; // service, call, bytes of the encoding's name, the name, body
inline constexpr char client_message = 1;   // from it: channel, body
inline constexpr char service_request = 2;  // as service_response

inline constexpr std::size_t channel_head_bytes = 1 + 4;
inline constexpr std::size_t call_id_bytes = 4 + 4; // the service's and the call's numbers
inline constexpr std::size_t call_head_bytes = 1 + call_id_bytes + 4;
inline constexpr std::string_view json_encoding = "json";

// Of four bytes; those that are missing are 0.
inline std::uint32_t number_at(std::string_view bytes) noexcept {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4 && i < bytes.size(); ++i)
    number |= std::uint32_t{static_cast<unsigned char>(bytes[i])} << (8 * i);
  return number;
}

} // namespace rowe::wire::foxglove_words
