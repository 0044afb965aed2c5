// SPDX-License-Identifier: Apache-2.0
// A robot whose services are asked one after the other, by a person who waits. One thread.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/endpoint.hpp>

#include "../console.hpp"
#include "../exit_code.hpp"
#include "remote.hpp"

namespace rowe::tools {

class asked_robot {
 public:
  // `timeout`: for each answer. `verb`: whose arguments are to blame.
  asked_robot(std::string_view verb, rt::duration timeout, const console& to)
      : verb_{verb}, timeout_{timeout}, to_{to} {}

  // Nothing: it is connected. Otherwise the verb ends with this, and the reason was printed.
  // `within`: how long it may take; nothing: until Ctrl-C.
  std::optional<exit_code> connect(const remote_place& at, std::optional<rt::duration> within);
  std::optional<exit_code> connect(const remote_place& at) { return connect(at, timeout_); }

  // The answer of a service, in JSON. Nothing: why() and end() say why not.
  std::optional<std::string> ask(std::string_view service, std::string_view request = "{}");

  // Of the last answer that did not come: what is wrong, for people; empty: a signal came.
  const std::string& why() const noexcept { return why_; }
  exit_code end() const noexcept { return end_; }
  // Whether there is no such service for us: our role may not call it, or nobody provides it.
  bool has_no_such() const noexcept { return code_ == errc::no_service || code_ == errc::refused; }
  // Prints that; how the verb ends.
  exit_code give_up(std::string_view what) const;

  endpoint& hub() noexcept { return open_->hub; }
  remote& connection() noexcept { return open_->connection; }
  watcher& waits() noexcept { return *open_->waits; }
  const std::string& url() const noexcept { return url_; }
  rt::duration timeout() const noexcept { return timeout_; }

 private:
  struct opened { // stays where it is: its members refer to each other
    endpoint hub;
    remote connection;
    std::optional<watcher> waits{};
    opened(endpoint on, const std::string& url, const console& to)
        : hub{std::move(on)}, connection{hub, url, to} {}
  };

  const std::string_view verb_;
  const rt::duration timeout_;
  const console& to_;
  std::string url_;
  std::unique_ptr<opened> open_;
  std::string why_;
  errc code_{};
  exit_code end_ = exit_code::failed;
};

} // namespace rowe::tools
