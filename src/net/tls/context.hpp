// SPDX-License-Identifier: Apache-2.0
// What all TLS connections of an endpoint have in common: its certificate and key, whom it trusts, and what
// it speaks. That is TLS 1.2 and 1.3 with forward secrecy and authenticated encryption, and of the key
// exchanges X25519 and P-256 only: the client chooses, and others cost a server ten times as much. Nothing
// that makes a connection depend on an earlier one (tickets, sessions, early data), no compression, no
// renegotiation.
#pragma once
#include <array>
#include <cstdint>
#include <ctime>
#include <memory>
#include <optional>
#include <string>

#include <rowe/tls.hpp>

struct ssl_ctx_st;
struct ssl_st;

namespace rowe::net::tls {

enum class end : std::uint8_t { server, client };

// What is wrong with which file, in words.
struct file_fault {
  std::string file;
  std::string what;
};

class context {
 public:
  // Reads the files. Null if they are wrong; then `why`, if it is not null, says how. Not real-time: reads
  // files, allocates.
  static std::shared_ptr<const context> open(end ours, const tls_options& options, file_fault* why);
  ~context();
  context(const context&) = delete;
  context& operator=(const context&) = delete;

  ssl_ctx_st* get() const noexcept { return context_; }
  // When our certificate ends, in seconds since 1970; 0: we have none.
  std::time_t ends_at() const noexcept { return ends_at_; }
  // Server: whether clients are asked for a certificate.
  bool asks_clients() const noexcept { return asks_clients_; }
  // Client: whether the server has the key that is wanted of it.
  bool accepts(const ssl_st* connection) const noexcept;

 private:
  context() = default;
  ssl_ctx_st* context_ = nullptr;
  std::optional<std::array<unsigned char, 32>> pin_;
  std::time_t ends_at_ = 0;
  bool asks_clients_ = false;
};

} // namespace rowe::net::tls
