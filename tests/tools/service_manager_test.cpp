// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/service_manager.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <string>
#include <vector>

namespace rowe::tools {
namespace service_manager_test {
namespace {

using namespace std::chrono_literals;

// The manager's end of the socket, at a name in no file system.
struct service_manager : testing::Test {
  using texts = std::vector<std::string>;
  int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  std::string name = "@rowe-test-" + std::to_string(::getpid());
  rt::time_point now{1000s};

  service_manager() {
    sockaddr_un here{};
    here.sun_family = AF_UNIX;
    name.copy(here.sun_path, name.size());
    here.sun_path[0] = '\0';
    const auto bytes = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    EXPECT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&here), bytes), 0);
  }
  ~service_manager() override { ::close(fd); }

  tools::service_manager told(const char* usec = nullptr, const char* pid = nullptr) const {
    return tools::service_manager{{name.c_str(), usec, pid}};
  }
  texts heard() const {
    texts all;
    char text[512];
    for (ssize_t bytes = 0; (bytes = ::recv(fd, text, sizeof text, 0)) >= 0;)
      all.emplace_back(text, static_cast<std::size_t>(bytes));
    return all;
  }
};

TEST_F(service_manager, is_fed_at_half_of_its_time_while_cycles_advance) {
  auto manager = told("2000000");
  EXPECT_TRUE(manager.watches());
  for (std::uint64_t cycle = 1; cycle <= 40; ++cycle) manager.cycles_are(cycle, now += 100ms); // 4 s
  EXPECT_EQ(heard(), texts(4, "WATCHDOG=1\n"));
}

TEST_F(service_manager, is_not_fed_while_no_cycle_begins) {
  auto manager = told("2000000");
  manager.cycles_are(1, now);
  EXPECT_EQ(heard().size(), 1U);
  for (int i = 0; i < 1000; ++i) manager.cycles_are(1, now += 100ms);
  EXPECT_EQ(heard(), texts{});
  manager.cycles_are(2, now);
  EXPECT_EQ(heard().size(), 1U);
}

TEST_F(service_manager, is_not_fed_for_another_process) {
  EXPECT_FALSE(told("2000000", "1").watches());
  EXPECT_TRUE(told("2000000", std::to_string(::getpid()).c_str()).watches());
}

TEST_F(service_manager, is_named_with_what_is_wrong_with_it) {
  EXPECT_NE(told("soon").fault().find("WATCHDOG_USEC is 'soon'"), std::string_view::npos);
  EXPECT_NE(told("0").fault().find("WATCHDOG_USEC is '0'"), std::string_view::npos);
  const std::string too_long = "/" + std::string(200, 'x');
  for (const char* const socket : {"relative", too_long.c_str()}) {
    tools::service_manager manager{{socket, nullptr, nullptr}};
    EXPECT_NE(manager.fault().find(socket), std::string_view::npos);
    EXPECT_NE(manager.fault().find("107 bytes"), std::string_view::npos);
    manager.ready("nobody hears it");
  }
  EXPECT_NE(tools::service_manager({"/nobody/is/here", nullptr, nullptr}).fault().find("cannot be reached"),
            std::string_view::npos);
  EXPECT_EQ(tools::service_manager({nullptr, "2000000", nullptr}).fault(), "");
}

} // namespace
} // namespace service_manager_test
} // namespace rowe::tools
