// SPDX-License-Identifier: Apache-2.0
// What a server looks after while it runs: the file of its settings, from which it takes new roles and
// tokens, and the certificate that `rowe setup` made, which it renews. The main thread; reads files.
#pragma once
#include <cstdint>
#include <string>

#include <rowe/endpoint.hpp>

#include "arguments/configuration.hpp"
#include "console.hpp"

namespace rowe::tools {

class upkeep {
 public:
  static constexpr rt::duration look_period = std::chrono::milliseconds{500};
  static constexpr rt::duration renewal_period = std::chrono::hours{1};
  static constexpr rt::duration clock_step_min = std::chrono::minutes{1};

  // `given` is read again when its file has changed.
  upkeep(const configuration_options& given, const console& to);

  // To be called some times a second. A file that cannot be read, or whose roles or identities are wrong,
  // changes nothing, and is said once. Whatever else is wrong is a warning: a restart would be refused.
  void look(endpoint& hub, rt::time_point now);

 private:
  bool take_access(endpoint& hub);
  void renew_certificate();
  bool clock_was_set(rt::time_point now);

  const configuration_options& given_;
  const console& to_;
  const std::string file_;
  std::uint64_t seen_ = 0; // version of the file that holds
  std::string told_;       // what was wrong with the file, last
  std::chrono::nanoseconds clock_between_{}; // the clock of the day and the monotonic one
  rt::time_point look_at_{};
  rt::time_point renew_at_{};
};

} // namespace rowe::tools
