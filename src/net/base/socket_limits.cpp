// SPDX-License-Identifier: Apache-2.0
#include "net/base/socket_limits.hpp"

#include <climits>

#include "wire/http/http_request.hpp"

namespace rowe::net {

status check(const socket_limits& limits) noexcept {
  const auto outside = [](std::uint64_t value, std::uint64_t least, std::uint64_t most) {
    return value < least || value > most;
  };
  const auto bad = [](std::uint64_t value, std::uint64_t limit) {
    return error{errc::bad_argument, static_cast<std::int64_t>(value), static_cast<std::int64_t>(limit)};
  };
  constexpr std::uint64_t most_bytes = 65536;
  struct range {
    std::uint64_t value, least, most;
  };
  const range ranges[] = {
      {limits.connections_max, 1, 65536},
      {limits.connections_per_address_max, 1, UINT32_MAX},
      {limits.handshakes_max, 1, 1024},
      {limits.handshake_bytes, handshake_bytes_least, std::uint64_t{1} << 26},
      {limits.header_bytes_max, 256, wire::http_header_bytes_max},
      {limits.read_quantum_bytes, 512, most_bytes},
      {limits.read_alone_bytes_min, limits.read_quantum_bytes, most_bytes},
      {limits.read_alone_bytes_max, limits.read_alone_bytes_min, std::uint64_t{1} << 20},
      {limits.send_buffer_bytes, 0, INT_MAX / 2},
      {limits.unsent_bytes_max, 1, INT_MAX},
  };
  for (const range& one : ranges)
    if (outside(one.value, one.least, one.most))
      return bad(one.value, one.value < one.least ? one.least : one.most);
  for (const rt::duration one : {limits.header_timeout, limits.page_timeout, limits.connect_timeout,
                                 limits.write_timeout, limits.close_timeout})
    if (one <= rt::duration::zero()) return error{errc::bad_argument, one.count(), 1};
  return {};
}

std::size_t descriptors_reserved(const socket_limits& limits, bool tls) noexcept {
  return 2 + std::size_t{tls ? 3U : 1U} * reserved_for_stop(limits.handshakes_max) +
         reserved_for_stop(limits.connections_max);
}

} // namespace rowe::net
