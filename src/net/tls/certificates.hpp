// SPDX-License-Identifier: Apache-2.0
// The context that new connections get. Looks whether the files have changed, and says when the certificate
// is about to end. Terminator's thread.
#pragma once
#include <array>
#include <cstdint>
#include <ctime>
#include <memory>
#include <optional>

#include <rowe/tls.hpp>

#include "net/tls/context.hpp"

namespace rowe::net::tls {

class certificates {
 public:
  certificates(end ours, tls_options options, std::shared_ptr<const context> first);

  const std::shared_ptr<const context>& current() const noexcept { return current_; }

  // Reads the files anew if they have changed, again and again until they are right. Wrong ones change
  // nothing; then this returns what is wrong, once.
  std::optional<file_fault> look();

  // In how many days the certificate ends, once a day, from `warned_days` before on; -1: nothing to say, or
  // that was said.
  int days_left(std::time_t now);

  static constexpr int warned_days = 30;

 private:
  using file_versions = std::array<std::uint64_t, 3>;
  file_versions versions() const noexcept;

  const end ours_;
  const tls_options options_;
  std::shared_ptr<const context> current_;
  file_versions seen_;           // of what is in use
  file_versions reported_for_{}; // of those that were wrong last
  file_fault reported_;
  std::time_t said_for_ = 0; // the certificate that ends then
  int said_days_ = -1;
};

} // namespace rowe::net::tls
