// SPDX-License-Identifier: Apache-2.0
// What the tests of net/ share: a sink that keeps everything it is told, a raw socket on the other side, and
// a driver that turns the transport in the test's own thread until something has come true. Nothing here
// waits without turning the transport, and every such wait has a watchdog.
#pragma once
#include <arpa/inet.h>
#include <dirent.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "net/base/address.hpp"
#include "net/base/descriptor.hpp"
#include "net/transport/socket_transport.hpp"
#include "rt/loopback.hpp"

namespace rowe::net {

using namespace std::chrono_literals;
using service::close_cause;
using service::close_how;
using service::connection_id;

struct recording_sink final : service::transport_sink {
  struct opened {
    connection_id id;
    service::side ours;
    std::string address, path, subprotocol;
    access::subject who;
  };
  struct closed {
    connection_id id;
    close_cause cause;
  };
  struct rejected {
    std::uint16_t status;
    std::string peer, what, remedy;
    bool lasting;
  };
  struct asked {
    std::string path, if_none_match;
    bool accepts_gzip;
  };

  void on_open(connection_id id, const service::peer_info& peer) noexcept override {
    opens.push_back({id, peer.ours, std::string{peer.address}, std::string{peer.path},
                     std::string{peer.subprotocol}, peer.who});
    if (when_open) when_open(id);
  }
  void on_bytes(connection_id id, std::span<std::byte> bytes) noexcept override {
    reads.push_back(bytes.size());
    received[id.index].append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    // The tail room is readable (under the address sanitizer this would be found out).
    for (std::size_t i = 0; i < service::tailroom_bytes; ++i)
      tail_ ^= std::to_integer<int>(bytes.data()[bytes.size() + i]);
    if (when_bytes) when_bytes(id, bytes);
  }
  void on_gone(connection_id id) noexcept override {
    gone.push_back(id);
    received_when_gone = received[id.index];
  }
  void on_writable(connection_id id) noexcept override {
    ++writables;
    if (when_writable) when_writable(id);
  }
  void on_close(connection_id id, close_cause cause) noexcept override { closes.push_back({id, cause}); }
  void on_rejected(const service::rejection& why) noexcept override {
    rejections.push_back({why.http_status, std::string{why.peer}, std::string{why.what},
                          std::string{why.remedy}, why.lasting});
  }
  void on_warning(std::string_view what, std::string_view) noexcept override { warnings.emplace_back(what); }
  service::http_answer on_http(const service::http_request& request) noexcept override {
    pages.push_back({std::string{request.path}, std::string{request.if_none_match}, request.accepts_gzip});
    return answer ? answer(request) : service::http_answer{};
  }

  std::uint64_t awaited_came() const noexcept override { return came; }

  service::admit_answer admit(const service::credentials& shown) const noexcept override {
    return when_asked ? when_asked(shown) : service::admit_answer{};
  }

  service::admit_answer may_read(const service::credentials& shown) noexcept override {
    return when_page_asked ? when_page_asked(shown) : service::admit_answer{};
  }

  bool may_displace(connection_id id) const noexcept override {
    return may_displace_which && may_displace_which(id);
  }
  void displace(connection_id id) noexcept override {
    if (when_displaced) when_displaced(id);
  }

  std::function<service::admit_answer(const service::credentials&)> when_asked, when_page_asked;
  std::vector<opened> opens;
  std::vector<closed> closes;
  std::vector<rejected> rejections;
  std::vector<std::string> warnings;
  std::vector<asked> pages;
  std::vector<std::size_t> reads;
  std::map<std::uint32_t, std::string> received; // by index
  std::vector<connection_id> gone;
  std::string received_when_gone; // of the last one
  int writables = 0;
  std::uint64_t came = 0;
  std::function<void(connection_id)> when_open, when_writable, when_displaced;
  std::function<bool(connection_id)> may_displace_which;
  std::function<void(connection_id, std::span<std::byte>)> when_bytes;
  std::function<service::http_answer(const service::http_request&)> answer;

 private:
  int tail_ = 0;
};

inline service::http_answer page_of(std::string_view body) {
  service::http_answer answer;
  answer.status = 200;
  answer.body = {reinterpret_cast<const std::byte*>(body.data()), body.size()};
  return answer;
}

inline std::unique_ptr<socket_transport> listening(listen_options options = {}) {
  auto made = socket_transport::listen(options);
  EXPECT_TRUE(made) << "errc " << static_cast<int>(made.code()) << ", value " << made.error().value;
  return made ? std::move(*made) : nullptr;
}

inline std::unique_ptr<socket_transport> connecting(const connect_options& options) {
  auto made = socket_transport::connect(options);
  EXPECT_TRUE(made) << "errc " << static_cast<int>(made.code()) << ", value " << made.error().value;
  return made ? std::move(*made) : nullptr;
}

// Turns transports, in real time plus what was skipped, until a condition holds. Where a test looks on both
// sides of a deadline it stops the clock first: what a busy machine takes of its own is no time then.
class driver {
 public:
  explicit driver(socket_transport& transport) { add(transport); }
  recording_sink& add(socket_transport& transport) {
    turned_.push_back({&transport, std::make_unique<recording_sink>()});
    return *turned_.back().sink;
  }
  recording_sink& sink(std::size_t which = 0) { return *turned_[which].sink; }

  rt::time_point now() const {
    return (stopped_at_ == rt::never ? rt::monotonic_clock::now() : stopped_at_) + skipped_;
  }
  void stop_clock() { stopped_at_ = rt::monotonic_clock::now(); }
  void skip(rt::duration by) { skipped_ += by; }

  void turn() {
    for (auto& one : turned_) one.transport->poll(now(), *one.sink);
  }
  // False when the watchdog bit: nothing a test waits for takes a minute.
  template <class Condition>
  bool until(Condition condition) {
    const auto watchdog = rt::monotonic_clock::now() + 60s;
    for (;;) {
      turn();
      if (condition()) return true;
      if (rt::monotonic_clock::now() > watchdog) return false;
      for (auto& one : turned_) one.transport->wait(now(), now() + 1ms);
    }
  }

 private:
  struct turned {
    socket_transport* transport;
    std::unique_ptr<recording_sink> sink;
  };
  std::vector<turned> turned_;
  rt::duration skipped_{};
  rt::time_point stopped_at_ = rt::never;
};

// Two sockets that are connected, and do not wait. They have no addresses, so a test says where one is from.
inline std::pair<descriptor, descriptor> local_pair() {
  int both[2] = {-1, -1};
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, both), 0);
  return {descriptor{both[0]}, descriptor{both[1]}};
}

// A TCP socket on the other side. Never waits.
class raw_socket {
 public:
  raw_socket() = default;
  explicit raw_socket(std::uint16_t port, const char* address = "127.0.0.1", int receive_buffer = 0,
                      const char* from = nullptr) {
    const bool v6 = std::strchr(address, ':') != nullptr;
    fd_.reset(::socket(v6 ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (receive_buffer) ::setsockopt(fd(), SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in four{};
    sockaddr_in6 six{};
    four.sin_family = AF_INET;
    four.sin_port = six.sin6_port = htons(port);
    six.sin6_family = AF_INET6;
    if (from != nullptr) { // IPv4
      ::inet_pton(AF_INET, from, &four.sin_addr);
      four.sin_port = 0;
      EXPECT_EQ(::bind(fd(), reinterpret_cast<const sockaddr*>(&four), sizeof four), 0);
      four.sin_port = htons(port);
    }
    ::inet_pton(v6 ? AF_INET6 : AF_INET, address, v6 ? static_cast<void*>(&six.sin6_addr) : &four.sin_addr);
    const auto* any = v6 ? reinterpret_cast<const sockaddr*>(&six) : reinterpret_cast<const sockaddr*>(&four);
    connected_ =
        ::connect(fd(), any, v6 ? sizeof six : sizeof four) == 0; // the backlog answers, not the transport
    ::fcntl(fd(), F_SETFL, O_NONBLOCK);
  }
  explicit raw_socket(descriptor socket) : fd_{std::move(socket)}, connected_{true} {
    ::fcntl(fd(), F_SETFL, O_NONBLOCK);
  }

  int fd() const { return fd_.get(); }
  bool connected() const { return connected_; }
  bool send(std::string_view bytes) const {
    return ::send(fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  void shut() const { ::shutdown(fd(), SHUT_WR); }
  void reset() {
    const linger at_once{1, 0};
    ::setsockopt(fd(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    fd_.reset();
  }
  void close() { fd_.reset(); }

  // Takes what has arrived; `text` keeps it all. False once the stream has ended (see `failed`).
  bool read() {
    char buffer[16384];
    for (;;) {
      const ssize_t bytes = ::recv(fd(), buffer, sizeof buffer, 0);
      if (bytes > 0) {
        text.append(buffer, static_cast<std::size_t>(bytes));
        continue;
      }
      if (bytes < 0 && errno == EAGAIN) return true;
      failed = bytes < 0;
      return false;
    }
  }
  bool ended() { return !read(); }
  // Has all that was sent arrived at the other side's kernel? It acknowledges late at times.
  bool all_arrived() const {
    int unacknowledged = 0;
    return ::ioctl(fd(), SIOCOUTQ, &unacknowledged) == 0 && unacknowledged == 0;
  }
  // Has `what` arrived?
  bool has(std::string_view what) {
    read();
    return text.find(what) != std::string::npos;
  }

  std::string text;
  bool failed = false; // ended by a reset, not in good order

 private:
  descriptor fd_;
  bool connected_ = false;
};

inline constexpr std::string_view key = "dGhlIHNhbXBsZSBub25jZQ==";
inline constexpr std::string_view accept_of_key = "s3pPLMBiTxaQ9kYGzzhZRbK+xOo="; // RFC 6455 1.3

inline std::string request(std::uint16_t port, std::string_view path, std::string_view more = {}) {
  return "GET " + std::string{path} + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n" +
         std::string{more} + "\r\n";
}

inline std::string upgrade_request(std::uint16_t port, std::string_view more = {},
                                   std::string_view path = "/") {
  return request(
      port, path,
      "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " +
          std::string{key} + "\r\n" + std::string{more});
}

inline std::string upgrade_answer(std::string_view more = {}, std::string_view accept = accept_of_key) {
  return "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: "
         "Upgrade\r\nSec-WebSocket-Accept: " +
         std::string{accept} + "\r\n" + std::string{more} + "\r\n";
}

// A raw client that has sent this and was answered: a header, or all until the end.
inline raw_socket answered(driver& drive, socket_transport& transport, std::string_view sent) {
  raw_socket client{transport.port()};
  EXPECT_TRUE(client.send(sent));
  EXPECT_TRUE(drive.until([&] { return client.has("\r\n\r\n"); }));
  return client;
}
inline raw_socket answered_whole(driver& drive, socket_transport& transport, std::string_view sent) {
  raw_socket client{transport.port()};
  EXPECT_TRUE(client.send(sent));
  EXPECT_TRUE(drive.until([&] { return client.ended(); }));
  return client;
}

// One whose request for a page was taken up, and who reads nothing of it yet.
inline raw_socket reader_of(driver& drive, socket_transport& transport, std::string_view path,
                            int receive_buffer = 4096) {
  raw_socket client{transport.port(), "127.0.0.1", receive_buffer};
  const std::size_t before = drive.sink().pages.size();
  EXPECT_TRUE(client.send(request(transport.port(), path)));
  EXPECT_TRUE(drive.until([&] { return drive.sink().pages.size() > before; }));
  return client;
}

// A raw client behind its upgrade; `text` is empty again.
inline raw_socket upgraded(driver& drive, socket_transport& transport, int receive_buffer = 0) {
  raw_socket client{transport.port(), "127.0.0.1", receive_buffer};
  const std::size_t before = drive.sink().opens.size();
  EXPECT_TRUE(client.send(upgrade_request(transport.port())));
  EXPECT_TRUE(drive.until([&] { return client.has("\r\n\r\n") && drive.sink().opens.size() > before; }));
  client.text.clear();
  return client;
}

inline std::size_t write(socket_transport& transport, connection_id id, std::string_view text) {
  return transport.write(id, std::as_bytes(std::span{text}));
}

// The answer to the key that stands in `asked`, made by a server of ours: the tests have no SHA-1.
inline std::string accept_for(std::string_view asked) {
  const auto at = asked.find("Sec-WebSocket-Key: ");
  EXPECT_NE(at, std::string_view::npos);
  const std::string theirs{asked.substr(at + 19, 24)};
  auto transport = listening();
  driver drive{*transport};
  std::string text = upgrade_request(transport->port());
  const raw_socket client = answered(drive, *transport, text.replace(text.find(key), key.size(), theirs));
  return client.text.substr(client.text.find("Accept: ") + 8, 28);
}

// Writes so many bytes, in pieces, as there is room for them: what has none is refused, and nothing is lost.
template <class Client>
void write_beyond_its_room(driver& drive, socket_transport& transport, connection_id to, Client& client,
                           std::size_t piece_bytes, std::size_t bytes) {
  std::string piece(piece_bytes, 'a');
  for (std::size_t i = 0; i < piece.size(); ++i) piece[i] = static_cast<char>('a' + i % 26);
  std::string sent;
  const auto push = [&] { // keeps its place in the endless repetition of `piece`
    for (;;) {
      const std::string_view rest = std::string_view{piece}.substr(sent.size() % piece.size());
      const std::size_t taken = write(transport, to, rest);
      sent += rest.substr(0, taken);
      if (taken < rest.size()) return;
    }
  };
  push();
  EXPECT_EQ(write(transport, to, "more"), 0U);
  while (sent.size() < bytes) {
    const int before = drive.sink().writables;
    ASSERT_TRUE(drive.until([&] { return client.read() && drive.sink().writables > before; }));
    push();
  }
  ASSERT_TRUE(drive.until([&] { return client.read() && client.text.size() == sent.size(); }));
  EXPECT_TRUE(client.text == sent);
}

// A server of a test, and what turns it.
struct served : testing::Test {
  std::unique_ptr<socket_transport> transport = listening();
  driver drive{*transport};

  // With these options instead.
  void listen(const listen_options& options) {
    transport = listening(options);
    drive = driver{*transport};
  }
};

// A wait that only an event can end: seen from an hour ago, every deadline of the transport is an hour away.
// The test's time-out is the watchdog.
inline void wait_for_event(socket_transport& transport, rt::time_point now) {
  transport.wait(now - 1h, rt::never);
}

// An address of this machine that is not loopback, or empty.
inline std::string address_beyond_loopback(int family) {
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return {};
  std::string found;
  for (const ifaddrs* one = list; one && found.empty(); one = one->ifa_next) {
    const auto address = address_of(one->ifa_addr);
    if (!address || address->storage.ss_family != family || is_loopback(*address)) continue;
    char text[address_text_bytes_max];
    const std::string host{write_host(text, *address)};
    if (host.find('%') == std::string::npos) found = host;
  }
  ::freeifaddrs(list);
  return found;
}

inline std::size_t open_descriptors() {
  DIR* folder = ::opendir("/proc/self/fd");
  std::size_t count = 0;
  while (::readdir(folder)) ++count;
  ::closedir(folder);
  return count;
}

} // namespace rowe::net
