// SPDX-License-Identifier: Apache-2.0
// What came of a long message when its last piece was taken.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include <rowe/limits.hpp>
#include <rowe/result.hpp>

#include "service/ids.hpp"
#include "wire/codec.hpp"

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
    far_behind,  // its long member stands behind more others than are noted
    other_long,  // all but one of its members are too long together: `bytes`
    unsupported, // binary, and of no kind that may be long
  };
  verdict is = verdict::no_room;
  error wrong = errc::malformed;
  std::size_t bytes = 0; // no_room: of the message
  std::span<std::byte>
      envelope{};              // fine: a small message; tailroom behind it may be read. Else: its beginning
  std::size_t stand_in_at = 0; // where in it the stand-in is
  text_id body{};              // what it stands for; the caller releases it

  // How a sender is told what is not fine. The text lies in the buffer.
  wire::diagnostic refusal(const limits& bounds, std::span<char> buffer) const noexcept;
};

} // namespace rowe::service
