// SPDX-License-Identifier: Apache-2.0
// What the verbs that connect have in common: reading the URL, waiting for the connection, and telling what
// happens to it.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include <rowe/endpoint.hpp>

#include "console.hpp"
#include "exit_code.hpp"

namespace rowe::tools {

// A URL as people write it.
struct spelled_url {
  std::string url;   // "ws://HOST[:PORT][/PATH]"; empty when it is none
  std::string wrong; // and then: why
};

// Takes ws://..., HOST:PORT[/PATH], and http://... as a browser shows it for the page.
spelled_url read_url(std::string_view text);

// An endpoint that connects, and the person waiting for it. One thread.
class remote {
 public:
  remote(endpoint& via, std::string url, const console& to) : via_{via}, url_{std::move(url)}, to_{to} {}

  // Waits until we are connected, at most `patience` (nothing: until Ctrl-C), and says so when it takes a
  // while. Nothing: connected. Otherwise the verb ends with this, and the reason was printed.
  std::optional<exit_code> wait(std::optional<rt::duration> patience);

  // Prints what has happened since the last call. The same failure again and again is printed once.
  void report();

  const std::string& url() const noexcept { return url_; }

 private:
  endpoint& via_;
  std::string url_;
  const console& to_;
  std::string failure_; // of the newest attempt to connect; empty once connected
};

// How a verb ends that could not be set up: `usage` where its arguments are to blame.
exit_code exit_code_of(const error& reason) noexcept;

// Messages that were lost on this side, after close(). A value that was refused for want of room is not: the
// verbs offer it again.
std::uint64_t lost_here(const endpoint& closed);

} // namespace rowe::tools
