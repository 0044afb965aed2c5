// SPDX-License-Identifier: Apache-2.0
#include "service_manager.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include "arguments/values.hpp"
#include "console.hpp"

namespace rowe::tools {
namespace {

std::string_view text_of(const char* variable) { return variable == nullptr ? "" : variable; }

} // namespace

service_manager::environment service_manager::environment::of_process() {
  return {std::getenv("NOTIFY_SOCKET"), std::getenv("WATCHDOG_USEC"), std::getenv("WATCHDOG_PID")};
}

service_manager::service_manager(const environment& told) {
  const std::string_view name = text_of(told.notify_socket);
  if (name.empty()) return;
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  if ((name[0] != '/' && name[0] != '@') || name.size() >= sizeof to.sun_path) {
    fault_ = joined("NOTIFY_SOCKET is ", quoted(name), ", and should be a path or a name with @, of at most ",
                    sizeof to.sun_path - 1, " bytes");
    return;
  }
  name.copy(to.sun_path, name.size());
  if (name[0] == '@') to.sun_path[0] = '\0'; // a name in no file system
  const auto bytes = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket_ < 0 || ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), bytes) != 0)
    fault_ = joined("NOTIFY_SOCKET ", quoted(name), " cannot be reached: ", std::strerror(errno));

  const std::string_view pid = text_of(told.watchdog_pid);
  if (!pid.empty() && pid != std::to_string(::getpid())) return; // it is another's
  const std::string_view wanted = text_of(told.watchdog_usec);
  if (wanted.empty()) return;
  const auto period = duration_of(joined(wanted, "us"));
  if (period && *period > rt::duration{}) {
    watchdog_period_ = *period;
  } else if (fault_.empty()) {
    fault_ = joined("WATCHDOG_USEC is ", quoted(wanted), ", and should be a whole number above 0");
  }
}

service_manager::~service_manager() {
  if (socket_ >= 0) ::close(socket_);
}

// What does not arrive is no failure: it is missed, and it is for the manager to draw its conclusions.
void service_manager::send(std::string_view text) {
  if (socket_ >= 0) (void)::send(socket_, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

void service_manager::ready(std::string_view status) { send(joined("READY=1\nSTATUS=", status, "\n")); }

void service_manager::stopping(std::string_view status) {
  send(joined("STOPPING=1\nSTATUS=", status, "\n"));
}

void service_manager::cycles_are(std::uint64_t cycles, rt::time_point now) {
  if (!watches() || cycles == cycles_fed_ || now - fed_ < watchdog_period_ / 2) return;
  send("WATCHDOG=1\n");
  cycles_fed_ = cycles;
  fed_ = now;
}

} // namespace rowe::tools
