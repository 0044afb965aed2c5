// SPDX-License-Identifier: Apache-2.0
// The messages between the terminator's thread and the service thread.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "access/policy.hpp"
#include "net/base/address.hpp"
#include "service/base/transport.hpp"
#include "wire/http/http_answer.hpp"

namespace rowe::net::tls {

class session;

// A place of the terminator, and which of its users is meant.
struct place_id {
  std::uint32_t index = 0;
  std::uint32_t generation = 0; // 0: none
  explicit operator bool() const noexcept { return generation != 0; }
  friend bool operator==(const place_id&, const place_id&) = default;
};

// The name in a client's certificate, which is verified.
struct client_certificate {
  std::array<char, access::common_name_bytes_max> text{};
  std::uint8_t bytes = 0; // 0: it presented none, or one that names nobody
  std::string_view name() const noexcept { return {text.data(), bytes}; }
};

// From the terminator.
struct arrival {
  enum class kind : std::uint8_t {
    newcomer, // a server's: the request's header is whole. A client's: the handshake is done
    session,  // that was asked for, or null: it has ended
    rejected, // what was wrong, and with whom
    warning,  // what is wrong with a file, or will be
    paused,   // nobody can be accepted: no descriptor or memory is left
  };
  kind what = kind::paused;
  place_id place{};                    // newcomer, and rejected of a client
  int socket = -1;                     // newcomer: what to read and write in plain; the receiver's to close
  socket_address peer{};               // newcomer, rejected
  client_certificate shown{};          // newcomer of a server
  bool lent = false;                   // likewise: on descriptors that are reserved for the stop
  service::connection_id connection{}; // session
  session* taken = nullptr;            // session
  wire::http_rejection rejection{};    // rejected; status 0: it was answered in no words. warning: its words
};

// To the terminator.
struct request {
  enum class kind : std::uint8_t {
    hand_over, // the session of a place: the upgrade is answered
    late,      // a place whose answer will come later
    destroy,   // a session
    connect,   // client: take this connected socket through the handshake
    drop,      // client: a place whose attempt was given up
  };
  kind what = kind::destroy;
  place_id place{};                    // hand_over, late, drop
  service::connection_id connection{}; // hand_over
  session* given = nullptr;            // destroy
  int socket = -1;                     // connect
  std::uint32_t attempt = 0;           // connect: comes back as the generation of the place
};

} // namespace rowe::net::tls
