// SPDX-License-Identifier: Apache-2.0
// What happened on an endpoint. The library never prints; a program that wants to know calls
// endpoint::try_event().
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include <rowe/rt/attributes.hpp>

namespace rowe {

struct event {
  enum class kind : std::uint8_t {
    peer_joined,       // a connection is established
    peer_left,         // and has ended; `what` says why
    refused_handshake, // a peer was refused before it became one; `remedy` says what would let it in
    cannot_connect,    // an attempt of endpoint::connect failed; it is repeated
    refused_request,   // a peer asked for something that was answered with a status error
    status_from_peer,  // a peer, most often the server we are connected to, sent a status
    limit,             // something did not fit; `remedy` names the limit
    warning,           // the endpoint works, but not as promised
    stop,              // loops were stopped, or let go by a reset; `peer` is who did it, as far as known.
                       // What somebody gave as a name or a reason stands in '' in `what`
    denied,            // a peer asked for something that its role does not allow; `what` says who and what
  };

  // A text that owns its bytes; a longer one is cut.
  template <std::size_t Bytes>
  class text {
   public:
    text& operator=(std::string_view from) noexcept {
      bytes_ = static_cast<std::uint16_t>(from.copy(buffer_.data(), Bytes));
      return *this;
    }
    operator std::string_view() const noexcept {
      return {buffer_.data(), bytes_};
    } // NOLINT(google-explicit-constructor)

   private:
    std::array<char, Bytes> buffer_{};
    std::uint16_t bytes_ = 0;
  };

  kind what_kind = kind::warning;
  text<64> peer;        // its numeric address and port; empty where there is none
  text<64> identity;    // as whom it came in; empty where it has no identity, or nobody knows
  text<224> what;       // a diagnostic
  text<192> remedy;     // what to change; empty where nothing can be
  bool lasting = false; // cannot_connect: it fails the same way until somebody changes something, a token say
};

} // namespace rowe
