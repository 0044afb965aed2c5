// SPDX-License-Identifier: Apache-2.0
// The pages of topics, for scripts: the last value of each. A latched value is retained anyway. Another
// topic's last value is retained from the first request for it until there was none for a while. In that time
// its publishers are heard, as by a subscriber. The first who asks waits for the next value. A long value is
// read out of its chunks while it is sent. Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/service_limits.hpp"
#include "service/base/transport.hpp"
#include "service/state/core_state.hpp"
#include "service/threads/stop_rules.hpp"
#include "service/topics/audiences.hpp"
#include "service/topics/topic_rates.hpp"

namespace rowe::service {

struct topic_pages_needs {
  core_state& state_;
  audiences& audiences_;
  topic_rates& topic_rates_;
  const stop_rules& stop_rules_;
};

class topic_pages final : topic_pages_needs, public body_source {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<char>(name_bytes(bounds));
  }
  topic_pages(rt::arena& memory, const topic_pages_needs& parts) noexcept;

  // The topic that a path below wire::topics_prefix names, valid until the next call. Empty: none, because it
  // is not percent-encoded as it should be, or longer than any.
  std::string_view topic_in(std::string_view path) const noexcept;

  // The answer to a request of such a path, written into `out`. Whoever asks has the right to the topic.
  http_answer answer(const http_request& request, std::span<char> out) noexcept;
  http_answer answer(const awaited_page& page, bool last, std::span<char> out) noexcept;

  // Of a long value. If rights change, or the endpoint closes, there is nothing more of it.
  std::span<const std::byte> read_body(std::uint32_t which, std::size_t at) noexcept override;
  void end_body(std::uint32_t which) noexcept override { state_.long_pages.end(which); }

  // Once in a while: publishers of topics that nobody asks for any more are not heard for that any longer.
  void end_unasked() noexcept;

 private:
  // One byte more than a name with its slash, so that a longer one is noticed.
  static std::size_t name_bytes(const limits& bounds) noexcept {
    return std::size_t{bounds.topic_bytes_max} + 2;
  }
  void begin(topic_id topic) noexcept;
  void end(topic_id topic) noexcept;
  http_answer value_of(const latched_value& value, const access::subject& who, std::span<char> out,
                       bool latched) noexcept;
  http_answer in_pieces(const latched_value& value, const access::subject& who, std::span<char> out) noexcept;
  http_answer too_long(topic_id topic, std::size_t bytes, std::span<char> out) const noexcept;
  http_answer page_of(const latched_value& value, std::span<char> out, bool latched) noexcept;

  std::span<char> name_;
  std::array<access::subject, long_page_rows> readers_{}; // of long values
};

} // namespace rowe::service
