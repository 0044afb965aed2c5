// SPDX-License-Identifier: Apache-2.0
// Why a request is refused, and the diagnostic for it. The diagnostic is the same for all codecs; each codec
// puts it into its own message. Pure functions; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace rowe::wire {

// What a decoder does not accept. Views point into the text, into the scratch buffer, or to constants.
struct refusal {
  enum class kind : std::uint8_t {
    not_an_object,
    missing,        // member; expected: a hint, or empty
    twice,          // member
    wrong_type,     // member, expected; value, or empty
    negative,       // member, value
    too_small,      // member, value, limit
    too_large,      // likewise
    too_long,       // member, bytes, limit
    empty,          // member
    bad_characters, // member, value: control characters, or escapes that are no character
    not_offered,    // member, value, expected
    unsupported_op, // value; expected: what is offered
    unknown_op,     // likewise
  };
  kind what = kind::not_an_object;
  std::string_view verb_text{}; // empty: not known
  std::string_view member{};    // "topic", "qos.depth"
  std::string_view value{};     // JSON as it stood there, or an operation's name
  std::string_view expected{};  // "an integer"
  std::size_t bytes = 0;
  std::int64_t limit = 0;

  // For programs, if the codec has a place for it.
  std::string_view code() const noexcept {
    return what == kind::not_an_object ? "not_an_object" : "bad_request";
  }

  // The diagnostic, e.g. `subscribe: the member "throttle_rate" must be an integer; it is "50"`. Long values
  // are shortened. It is cut at the end of `buffer`, which never happens with text_bytes_max.
  static constexpr std::size_t text_bytes_max = 416;
  std::string_view text(std::span<char> buffer) const noexcept;
};

// The diagnostic for a caller whose service nobody provides: "Service /add does not exist". rosbridge has no
// code for that; its clients and servers recognise it by this text.
inline constexpr std::size_t no_service_bytes_max = 320; // with the longest name
std::string_view no_service_diagnostic(std::string_view service, std::span<char> buffer) noexcept;
bool says_no_service(std::string_view diagnostic, std::string_view service) noexcept;

} // namespace rowe::wire
