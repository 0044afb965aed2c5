// SPDX-License-Identifier: Apache-2.0
// What came of a long message when its last piece was taken.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/result.hpp>

#include "service/base/stand_in.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/request.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {

// Besides the longest member, a long message has so many bytes at most.
inline constexpr std::size_t long_envelope_bytes_max = 4096;

// A long message that is complete, or why there is none.
struct long_arrival {
  enum class verdict : std::uint8_t {
    fine,
    no_room,     // there was no place for it, or it lost its place to another peer
    malformed,   // `wrong` says why
    no_object,   // it has no member that could be long
    far_behind,  // its long member stands behind more others than are indexed
    other_long,  // all but one of its members are too long together: `bytes`
    unsupported, // binary, and of no kind that may be long
  };
  verdict is = verdict::no_room;
  error wrong = errc::malformed;
  bool binary = false;
  std::size_t bytes = 0;  // of the whole message
  std::size_t others = 0; // other_long: of all but the longest member
  // fine: a small message; tailroom behind it may be read. Else what is known of the message, enough to say
  // what it asks for: an object of some of its members, or how it begins if it is binary.
  std::span<const std::byte> envelope{};
  std::size_t stand_in_at = 0;      // where in it the stand-in is
  long_value body{};                // and what it stands for; the caller releases its text
  std::array<char, 8> wrong_text{}; // malformed: what stands where it is wrong

  // The report to the sender: what it asked for, as far as that is known, and why it is refused. The text
  // lies in the buffer.
  wire::diagnostic refusal(const limits& bounds, const wire::request& asked,
                           std::span<char> buffer) const noexcept;

 private:
  std::string_view code() const noexcept;
  void explain(const limits& bounds, wire::text_out& into) const noexcept;
};

} // namespace rowe::service
