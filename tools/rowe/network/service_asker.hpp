// SPDX-License-Identifier: Apache-2.0
// Asks the services of whoever an endpoint is connected to, one after the other. One thread, which waits.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include <rowe/endpoint.hpp>

#include "../exit_code.hpp"
#include "remote.hpp"

namespace rowe::tools {

class service_asker {
 public:
  // `timeout`: for each answer. `waits` sees to the connection meanwhile.
  service_asker(endpoint& hub, watcher& waits, rt::duration timeout) noexcept
      : hub_{hub}, waits_{waits}, timeout_{timeout} {}

  void answer_within(rt::duration timeout) noexcept { timeout_ = timeout; }

  // The answer, in JSON. Nothing: why() and end() say why not.
  std::optional<std::string> ask(std::string_view service, std::string_view request = "{}");

  // Of the last answer that did not come: what is wrong, for people; empty: a signal came.
  const std::string& why() const noexcept { return why_; }
  // And how a verb ends that needs it.
  exit_code end() const noexcept { return end_; }
  // Whether there is no such service for us: our role may not call it, or nobody provides it.
  bool has_no_such() const noexcept { return code_ == errc::no_service || code_ == errc::refused; }

 private:
  endpoint& hub_;
  watcher& waits_;
  rt::duration timeout_;
  std::string why_;
  errc code_{};
  exit_code end_ = exit_code::failed;
};

} // namespace rowe::tools
