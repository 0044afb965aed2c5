// SPDX-License-Identifier: Apache-2.0
// A server of bench/peers (peers.hpp) that is nothing but sockets, one epoll and the frames that the others
// carry as well: the limit of this kernel. It believes what it is sent: no check of UTF-8, of lengths or of
// order, and a message is one frame.
#include <array>
#include <cstddef>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "arguments.hpp"
#include "upgrade.hpp"

namespace rowe::bench {
namespace {

constexpr std::size_t capacity = 64 * 1024;

struct connection {
  std::array<unsigned char, capacity> in;
  std::size_t have = 0;
  bool upgraded = false;
  std::size_t count = 0; // messages
};

void unmask(unsigned char* at, std::size_t bytes, const unsigned char* key) {
  std::uint64_t twice = 0;
  std::memcpy(&twice, key, 4);
  twice |= twice << 32;
  std::size_t i = 0;
  for (; i + 8 <= bytes; i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, at + i, 8);
    word ^= twice;
    std::memcpy(at + i, &word, 8);
  }
  for (; i < bytes; ++i) at[i] ^= key[i % 4];
}

class server {
 public:
  explicit server(const peer_arguments& how) : how_{how} {}

  int run() {
    const int listening = ::socket(AF_INET, SOCK_STREAM, 0);
    const int yes = 1;
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(how_.port);
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    (void)::setsockopt(listening, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes); // bind() tells
    if (::bind(listening, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 ||
        ::listen(listening, 64) != 0)
      return 1;
    watch(listening);
    for (;;) {
      std::array<epoll_event, 64> ready;
      const int count =
          ::epoll_wait(polled_, ready.data(), static_cast<int>(ready.size()), how_.busy ? 0 : -1);
      for (int i = 0; i < count; ++i) {
        const int fd = ready[static_cast<std::size_t>(i)].data.fd;
        if (fd == listening)
          accept(listening);
        else if (!read(fd, *open_.at(fd)))
          end(fd);
      }
    }
  }

 private:
  void watch(int fd) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = fd;
    (void)::epoll_ctl(polled_, EPOLL_CTL_ADD, fd, &event); // a connection that cannot be watched is silent
  }
  void accept(int listening) {
    const int fd = ::accept4(listening, nullptr, nullptr, 0);
    if (fd < 0) return;
    const int yes = 1;
    (void)::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // loopback has it
    open_.emplace(fd, new connection); // its room is not touched before it is used
    watch(fd);
  }
  void end(int fd) {
    ::close(fd);
    open_.erase(fd);
  }

  bool read(int fd, connection& from) {
    const ssize_t bytes = ::recv(fd, from.in.data() + from.have, capacity - from.have, MSG_DONTWAIT);
    if (bytes <= 0) return bytes < 0 && errno == EAGAIN;
    from.have += static_cast<std::size_t>(bytes);
    if (!from.upgraded) return upgrade(fd, from);
    std::size_t used = 0;
    while (const std::size_t frame = take(fd, from, from.in.data() + used, from.have - used)) used += frame;
    std::memmove(from.in.data(), from.in.data() + used, from.have - used);
    from.have -= used;
    return true;
  }
  bool upgrade(int fd, connection& from) {
    const std::string_view text{reinterpret_cast<const char*>(from.in.data()), from.have};
    if (!text.ends_with("\r\n\r\n")) return true;
    const auto answer = upgrade_answer(text);
    from.have = 0;
    from.upgraded = answer && send(fd, answer->data(), answer->size());
    return from.upgraded;
  }

  // The frame at the front; its length, 0 if it is not here whole.
  std::size_t take(int fd, connection& from, unsigned char* at, std::size_t have) {
    if (have < 8) return have >= 7 && (at[1] & 0x7f) == 1 ? one(fd, from, at, 6, 1) : 0;
    const std::size_t length = at[1] & 0x7f;
    const std::size_t header = length == 126 ? 8 : 6;
    const std::size_t bytes = length == 126 ? std::size_t{at[2]} << 8 | at[3] : length;
    return have < header + bytes ? 0 : one(fd, from, at, header, bytes);
  }
  std::size_t one(int fd, connection& from, unsigned char* at, std::size_t header, std::size_t bytes) {
    if ((at[0] & 0x0f) == 0x0a) return header + bytes; // a pong
    unsigned char* const payload = at + header;
    unmask(payload, bytes, payload - 4);
    ++from.count;
    if (how_.mode == serving::sink && bytes == 1) answer(fd, std::to_string(from.count));
    if (how_.mode == serving::sink) return header + bytes;
    unsigned char* frame = payload; // its header is shorter than the one that was received
    if (bytes > 125) {
      *--frame = static_cast<unsigned char>(bytes & 0xff);
      *--frame = static_cast<unsigned char>(bytes >> 8);
    }
    *--frame = static_cast<unsigned char>(bytes > 125 ? 126 : bytes);
    *--frame = 0x81;
    const std::size_t all = static_cast<std::size_t>(payload + bytes - frame);
    if (how_.mode == serving::echo) send(fd, frame, all);
    if (how_.mode == serving::flood) flood(fd, {reinterpret_cast<const char*>(frame), all});
    if (how_.mode == serving::fan_out)
      for (const auto& [to, unused] : open_) send(to, frame, all);
    return header + bytes;
  }
  void answer(int fd, const std::string& text) {
    const std::string frame = "\x81" + std::string(1, static_cast<char>(text.size())) + text;
    send(fd, frame.data(), frame.size());
  }

  // Until the client goes away.
  void flood(int fd, std::string_view frame) {
    std::string many;
    while (many.size() + frame.size() <= capacity) many += frame;
    for (std::size_t at = 0;;) {
      const ssize_t sent = ::send(fd, many.data() + at, many.size() - at, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent < 0 && errno != EAGAIN) return;
      if (sent > 0) at = (at + static_cast<std::size_t>(sent)) % many.size();
      pollfd writable{.fd = fd, .events = POLLOUT, .revents = 0};
      if (sent < 0 && !how_.busy) (void)::poll(&writable, 1, -1); // send() tells
    }
  }
  // What is sent here always fits into a socket of somebody who waits for it.
  static bool send(int fd, const void* data, std::size_t bytes) {
    return ::send(fd, data, bytes, MSG_NOSIGNAL) == static_cast<ssize_t>(bytes);
  }

  const peer_arguments how_;
  const int polled_ = ::epoll_create1(0);
  std::map<int, std::unique_ptr<connection>> open_;
};

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  return rowe::bench::server{rowe::bench::arguments_of(count, arguments)}.run();
}
