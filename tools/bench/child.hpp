// SPDX-License-Identifier: Apache-2.0
// The peer that a measurement starts for itself: this program once more, in a process of its own.
#pragma once
#include <string>
#include <sys/types.h>
#include <vector>

namespace rowe::tools::bench {

// Ends with this object, and with this process however that ends: it lives as long as its standard input is
// open. Does not see Ctrl-C, which is for us.
class child {
 public:
  // Runs `rowe bench peer ARGUMENTS...` and waits until it says where it listens.
  explicit child(const std::vector<std::string>& arguments);
  child(const child&) = delete;
  child& operator=(const child&) = delete;
  ~child();

  const std::string& url() const noexcept { return url_; } // empty: it did not start
  pid_t id() const noexcept { return id_; }
  const std::string& wrong() const noexcept { return wrong_; } // and then: why

 private:
  pid_t id_ = -1;
  int keeps_alive_ = -1; // the other end of its standard input
  std::string url_;
  std::string wrong_;
};

} // namespace rowe::tools::bench
