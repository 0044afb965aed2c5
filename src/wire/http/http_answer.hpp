// SPDX-License-Identifier: Apache-2.0
// The answer to a request that is refused: a status, a text that names what was wrong with which value, and a
// text that says what to change. People read it, in a browser or in the output of a client, and the event of
// the rejection has the same texts. http_request.hpp decides what is refused; the transport writes the
// answer.
//
// Every function here: pure, any thread, never waits, never allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace rowe::wire {

// Bytes that always suffice for write_rejection().
inline constexpr std::size_t http_rejection_bytes_max = 1280;

// Why a request was rejected. The texts are printable ASCII whatever the peer sent, and quote it shortened.
class http_rejection {
 public:
  std::uint16_t status = 0; // HTTP
  bool to_head = false;     // the request was HEAD: the answer has no body
  bool to_form = false;     // somebody logs in: the answer is a page, which leads back to the form
  bool lasting = false;     // of a server, as its client sees it: it will be so again

  std::string_view what() const noexcept { return {what_.data(), what_bytes_}; }       // names the value
  std::string_view remedy() const noexcept { return {remedy_.data(), remedy_bytes_}; } // what to change

  // Sets the texts. `%` in them stands for `value`, which is shortened and cleaned. In the remedy it stands
  // for `remedy_value`, if there is one.
  void set(std::uint16_t http_status, std::string_view what, std::string_view remedy,
           std::string_view value = {}, std::string_view remedy_value = {}) noexcept;

 private:
  std::array<char, 224> what_{};
  std::array<char, 224> remedy_{};
  std::uint8_t what_bytes_ = 0;
  std::uint8_t remedy_bytes_ = 0;
};

// Writes the complete HTTP/1.1 answer (Connection: close, a body with what and remedy) and returns it.
// Returns an empty text if `out` is too small.
std::string_view write_rejection(std::span<char> out, const http_rejection& rejection) noexcept;

} // namespace rowe::wire
