// SPDX-License-Identifier: Apache-2.0
// What the two ends of a measurement say to each other.
#pragma once
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/json_value.hpp>
#include <rowe/schema.hpp>

namespace rowe::tools::bench {

inline constexpr std::string_view echo_service = "/bench/echo";   // answers with what it was asked
inline constexpr std::string_view info_service = "/bench/peer";   // {"boot_id":...,"line":...}
inline constexpr std::string_view reset_service = "/bench/reset"; // lets the robot run again
inline constexpr std::string_view out_topic = "/bench/out";       // probes
inline constexpr std::string_view back_topic = "/bench/back";     // when each of them arrived

// A message with a number, made once and then changed in place: the text stays as long as it is.
class probe_text {
 public:
  explicit probe_text(std::size_t bytes) : text_{R"({"n":1000000000000000,"pad":"")"} {
    const std::size_t pad = bytes > text_.size() + 1 ? bytes - text_.size() - 1 : 0;
    text_.insert(text_.size() - 1, pad, '.');
    text_ += '}';
  }
  // Never allocates. Numbers below 10^15.
  std::string_view numbered(std::uint64_t number) noexcept {
    std::to_chars(text_.data() + at, text_.data() + at + 16, base + number);
    return text_;
  }
  // The number of such a text.
  static std::optional<std::uint64_t> number_of(json_value json) noexcept {
    const auto found = json.get<std::uint64_t>("n");
    if (!found || *found < base) return std::nullopt;
    return *found - base;
  }

 private:
  static constexpr std::size_t at = 5;
  static constexpr std::uint64_t base = 1'000'000'000'000'000; // 16 digits, below 2^53
  std::string text_;
};

// A probe was there at this time of the peer's clock.
struct arrived {
  std::uint64_t n = 0;
  std::int64_t at_ns = 0;
};

} // namespace rowe::tools::bench

template <>
inline constexpr auto rowe::schema<rowe::tools::bench::arrived> =
    rowe::fields<&rowe::tools::bench::arrived::n,
                 rowe::field<&rowe::tools::bench::arrived::at_ns>.as_string()>{};
