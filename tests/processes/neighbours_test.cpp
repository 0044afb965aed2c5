// SPDX-License-Identifier: Apache-2.0
// A server that sends back what it receives, between a neighbour that sends and never reads, and a client
// that does as one should. Only what is counted is asked for: how long it takes is for a bench to say.
#include "rt/loopback.hpp"
#include "sides.hpp"

#include <poll.h>

#include <cerrno>
#include <cstdio>

namespace neighbours_test {
namespace {

using namespace sides;

// rowe_echo on a free port. Killed with its test, at the latest.
class echo_process {
 public:
  echo_process() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error{"no pipe"};
    process_ = ::fork();
    if (process_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::dup2(ends[1], STDOUT_FILENO);
      ::execl(ROWE_ECHO, ROWE_ECHO, "--quiet", nullptr);
      ::_exit(127);
    }
    ::close(ends[1]);
    FILE* const output = ::fdopen(ends[0], "r");
    unsigned port = 0;
    if (std::fscanf(output, "rowe_echo listens on ws://127.0.0.1:%u/", &port) != 1)
      ADD_FAILURE() << "it does not say where it listens";
    std::fclose(output);
    port_ = static_cast<std::uint16_t>(port);
  }
  ~echo_process() {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  echo_process(const echo_process&) = delete;
  echo_process& operator=(const echo_process&) = delete;

  std::uint16_t port() const { return port_; }

 private:
  pid_t process_ = -1;
  std::uint16_t port_ = 0;
};

// Sends messages of 4 KB as fast as they are taken, and reads nothing behind the handshake.
class deaf_neighbour {
 public:
  explicit deaf_neighbour(std::uint16_t port) : socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)} {
    EXPECT_TRUE(rowe::tests::connect_to(port, socket_));
    const std::string asks = "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                             "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                             "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    EXPECT_EQ(::send(socket_, asks.data(), asks.size(), 0), static_cast<ssize_t>(asks.size()));
    std::string answer;
    for (char one; !answer.ends_with("\r\n\r\n") && ::recv(socket_, &one, 1, 0) == 1;) answer += one;
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 101")) << answer;
    ::fcntl(socket_, F_SETFL, O_NONBLOCK);
    constexpr std::size_t bytes = 4096;
    frame_ = {'\x81', '\xfe', static_cast<char>(bytes >> 8), static_cast<char>(bytes & 255), 0, 0, 0, 0};
    frame_ += R"({"x":")" + std::string(bytes - 8, 'x') + "\"}";
  }
  ~deaf_neighbour() { ::close(socket_); }
  deaf_neighbour(const deaf_neighbour&) = delete;
  deaf_neighbour& operator=(const deaf_neighbour&) = delete;

  // How many bytes were taken of all that it has to say at the moment.
  std::size_t send() {
    std::size_t taken = 0;
    while (!cut_) {
      const ssize_t bytes = ::send(socket_, frame_.data() + at_, frame_.size() - at_, MSG_NOSIGNAL);
      if (bytes < 0) {
        cut_ = errno != EAGAIN;
        break;
      }
      taken += static_cast<std::size_t>(bytes);
      at_ = (at_ + static_cast<std::size_t>(bytes)) % frame_.size();
    }
    return taken;
  }
  // Until it can send again, or for so long.
  void wait_for_room(std::chrono::milliseconds longest) const {
    pollfd one{.fd = socket_, .events = POLLOUT, .revents = 0};
    (void)::poll(&one, 1, static_cast<int>(longest.count())); // send() sees what came of it
  }
  bool cut() const { return cut_; }

 private:
  int socket_;
  std::string frame_;
  std::size_t at_ = 0;
  bool cut_ = false;
};

TEST(neighbours, have_their_answers_beside_one_that_reads_nothing) {
  const echo_process echo;
  auto client = endpoint::connect("ws://127.0.0.1:" + std::to_string(echo.port()), {}).value();
  ASSERT_TRUE(client.wait_peer(timeout));
  auto mail = client.open_lane().value();
  deaf_neighbour neighbour{echo.port()};
  const auto round = [&](int n) {
    const std::string text = R"({"n":)" + std::to_string(n) + "}";
    ASSERT_TRUE(mail.send(text, rowe::rt::for_ever)) << n;
    const auto back = mail.receive(timeout);
    ASSERT_TRUE(back) << n << ": " << back.error().name();
    ASSERT_EQ(back->value(), text);
  };
  // Until the server takes no more, not even in a while: what the kernels hold is some megabytes.
  std::size_t taken = 0;
  int rounds = 0;
  for (int idle = 0; idle < 200 && !neighbour.cut(); ++rounds) {
    const std::size_t now = neighbour.send();
    taken += now;
    idle = now == 0 ? idle + 1 : 0;
    if (now == 0) neighbour.wait_for_room(1ms);
    ASSERT_NO_FATAL_FAILURE(round(rounds));
    ASSERT_LT(taken, 256U * 1024 * 1024) << "its messages are taken without end";
  }
}

} // namespace
} // namespace neighbours_test
