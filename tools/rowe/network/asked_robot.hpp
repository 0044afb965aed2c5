// SPDX-License-Identifier: Apache-2.0
// A robot that a verb connects to, in order to ask its services. One thread, which waits.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <rowe/endpoint.hpp>

#include "../console.hpp"
#include "../exit_code.hpp"
#include "remote.hpp"
#include "service_asker.hpp"

namespace rowe::tools {

class asked_robot {
 public:
  // `timeout`: for each answer. `verb`: whose arguments are to blame.
  asked_robot(std::string_view verb, rt::duration timeout, const console& to)
      : verb_{verb}, timeout_{timeout}, to_{to} {}

  // Nothing: it is connected. Otherwise the verb ends with this, and the reason was printed.
  // `within`: how long it may take; nothing: until Ctrl-C. `bounds`: of the endpoint; nothing: as usual.
  std::optional<exit_code> connect(const remote_place& at, std::optional<rt::duration> within,
                                   std::optional<limits> bounds = std::nullopt);
  std::optional<exit_code> connect(const remote_place& at) { return connect(at, timeout_); }

  // ---- once it is connected

  service_asker& services() noexcept { return *open_->services; }
  std::optional<std::string> ask(std::string_view service, std::string_view request = "{}") {
    return services().ask(service, request);
  }
  // Prints why there is no answer; how the verb ends. `what` it does not say.
  exit_code give_up(std::string_view what);
  // The same of /rowe/stats, which roles may lack the right for.
  exit_code give_up_statistics();

  endpoint& hub() noexcept { return open_->hub; }
  remote& connection() noexcept { return open_->connection; }
  const std::string& url() const noexcept { return url_; }

 private:
  struct opened { // stays where it is: its members refer to each other
    endpoint hub;
    remote connection;
    std::optional<watcher> waits{};
    std::optional<service_asker> services{};
    opened(endpoint on, const std::string& url, const console& to)
        : hub{std::move(on)}, connection{hub, url, to} {}
  };

  const std::string_view verb_;
  const rt::duration timeout_;
  const console& to_;
  std::string url_;
  std::unique_ptr<opened> open_;
};

} // namespace rowe::tools
