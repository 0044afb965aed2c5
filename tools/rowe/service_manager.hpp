// SPDX-License-Identifier: Apache-2.0
// Tells systemd how a service is doing, by the datagrams of sd_notify(3), which are a few lines of text to a
// socket that the environment names. Where it names none, everything here does nothing. One thread.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include <rowe/rt/clock.hpp>

namespace rowe::tools {

class service_manager {
 public:
  struct environment {
    const char* notify_socket = nullptr; // a path, or a name with @ in front; null: nobody wants to know
    const char* watchdog_usec = nullptr;
    const char* watchdog_pid = nullptr; // null: whoever has the environment
    static environment of_process();
  };

  explicit service_manager(const environment& told);
  ~service_manager();
  service_manager(const service_manager&) = delete;
  service_manager& operator=(const service_manager&) = delete;

  // Why it cannot be told, with the value; empty where it can, or need not.
  std::string_view fault() const noexcept { return fault_; }
  // Whether it wants to be fed.
  bool watches() const noexcept { return watchdog_period_ > rt::duration{}; }

  // `status` is shown by `systemctl status`.
  void ready(std::string_view status);
  void stopping(std::string_view status);
  // The service thread has begun so many cycles. Feeds the watchdog at half of its time, but only if there
  // was a new one since it was fed last: a service thread that hangs is to be restarted.
  void cycles_are(std::uint64_t cycles, rt::time_point now);

 private:
  void send(std::string_view text);

  int socket_ = -1;
  std::string fault_;
  rt::duration watchdog_period_{};
  std::uint64_t cycles_fed_ = 0;
  rt::time_point fed_{};
};

} // namespace rowe::tools
