// SPDX-License-Identifier: Apache-2.0
// The two servers that benches of urgent messages compare, each with one peer at a time, each kept full of
// telemetry of 300 B, each handing over an urgent message every 7 ms:
//   robot            an endpoint with a topic of telemetry and an urgent topic; its service thread under
//                    SCHED_FIFO where that is permitted
//   default_sockets  a socket with the kernel's own buffers; an urgent frame is always the next one written,
//                    with a ping in front of each 25th: what a server does that has priorities and no bound
// An urgent message is {"t":NANOSECONDS,"kernels":BYTES}: when it was handed over (CLOCK_MONOTONIC), and how
// much the kernels of both ends then held that the peer's program had not taken.
#pragma once
#include <array>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <rowe/rowe.hpp>

#include "kernel_window.hpp"
#include "net/base/descriptor.hpp"
#include "upgrade.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::bench {

using rt::monotonic_clock;

inline constexpr std::size_t frame_bytes = 300;
inline constexpr duration between_urgent = std::chrono::milliseconds{7}; // no multiple of anything else here
inline constexpr unsigned urgent_a_ping = 25; // ws closes the connection at 60 pings that it takes at once
inline constexpr std::string_view stamp_mark = R"("t":)";

inline sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return at;
}

// When an urgent message is due, and what it says.
class metronome {
 public:
  bool due(time_point now) {
    if (now < next_) return false;
    next_ = now + between_urgent;
    return true;
  }
  std::string text(int our_end) const {
    const std::size_t kernels = our_end < 0 ? 0 : window_.bytes_between(our_end);
    const auto now = rt::nanoseconds_of(monotonic_clock::now());
    return "{" + std::string{stamp_mark} + std::to_string(now) + R"(,"kernels":)" + std::to_string(kernels) +
           "}";
  }

 private:
  kernel_window window_;
  time_point next_{};
};

class robot {
 public:
  // Pages of `origin` are let in.
  bool open(std::string_view origin, idle policy = idle::poll) {
    using namespace std::chrono_literals;
    endpoint_ = endpoint::listen(0, {.idle_policy = policy,
                                     .poll_period = 50us,
                                     .service_priority = 20,
                                     .allow_origins = {std::string{origin}}});
    if (!endpoint_) return false;
    telemetry_ = endpoint_->advertise<json_text>("/telemetry", {.depth = 256, .text_bytes_max = 400});
    urgent_ =
        endpoint_->advertise<json_text>("/urgent", {.priority = priority::urgent, .text_bytes_max = 100});
    if (!telemetry_ || !urgent_) return false;
    constexpr std::string_view envelope = R"({"op":"publish","topic":"/telemetry","msg":{"x":""}})";
    text_ = R"({"x":")" + std::string(frame_bytes - 4 - envelope.size(), 'x') + R"("})";
    return true;
  }
  std::uint16_t port() const { return endpoint_->port(); }

  // Publishes for a slow reader.
  void turn(time_point now) {
    publish(now, 64);
    ::usleep(300);
  }
  // The same for one that reads as fast as it gets: as much as there are slots for.
  void full_turn(time_point now) {
    publish(now, 256);
    ::usleep(10);
  }

 private:
  void publish(time_point now, int most) {
    for (int i = 0; i < most && telemetry_->publish(text_, now); ++i) continue;
    if (urgently_.due(now)) // what is refused is not measured
      (void)urgent_->publish(urgently_.text(kernel_window::end_at(port())), now);
  }

  result<endpoint> endpoint_ = errc::closed; // until open()
  result<publisher<json_text>> telemetry_ = errc::closed, urgent_ = errc::closed;
  metronome urgently_;
  std::string text_;
};

// Says on stdout when the ping in front of an urgent message is answered, if it is told to.
class default_sockets {
 public:
  bool open(bool say_pongs) {
    say_pongs_ = say_pongs;
    sockaddr_in at = loopback(0);
    socklen_t bytes = sizeof at;
    if (::bind(listening_.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 ||
        ::listen(listening_.get(), 1) != 0 ||
        ::getsockname(listening_.get(), reinterpret_cast<sockaddr*>(&at), &bytes) != 0)
      return false;
    port_ = ntohs(at.sin_port);
    const std::string telemetry = frame_of(wire::opcode::text, std::string(frame_bytes - 4, 'x'));
    for (int i = 0; i < 16; ++i) many_ += telemetry;
    return true;
  }
  std::uint16_t port() const { return port_; }

  void turn(time_point now) {
    const bool writing = out_ && upgraded_;
    pollfd ready{.fd = out_ ? out_.get() : listening_.get(), .events = POLLIN, .revents = 0};
    if (writing) ready.events |= POLLOUT;
    (void)::poll(&ready, 1, 1); // or the next urgent one
    if (!out_) {
      if (ready.revents != 0) begin();
      return;
    }
    if ((ready.revents & ~POLLOUT) != 0) read();
    if (!writing || !out_) return;
    if (urgently_.due(now)) {
      const std::string text = urgently_.text(out_.get());
      const std::size_t stamp = stamp_mark.size() + 1;
      if (urgent_++ % urgent_a_ping == 0)
        waiting_ += frame_of(wire::opcode::ping, {text.data() + stamp, text.find(',') - stamp});
      waiting_ += frame_of(wire::opcode::text, text);
    }
    if (rest_.empty()) rest_ = waiting_.empty() ? many_ : std::exchange(waiting_, {});
    const ssize_t sent = ::send(out_.get(), rest_.data(), rest_.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent > 0) rest_.erase(0, static_cast<std::size_t>(sent));
  }

 private:
  static std::string frame_of(wire::opcode what, std::string_view text) {
    std::string frame(wire::frame_header_bytes(text.size(), wire::role::server), '\0');
    (void)wire::write_frame_header(reinterpret_cast<std::byte*>(frame.data()), what, text.size());
    return frame.append(text);
  }

  void begin() {
    out_.reset(::accept4(listening_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    const int yes = 1;
    (void)::setsockopt(out_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // as everybody does
    upgraded_ = false;
    request_.clear();
    rest_.clear();
    waiting_.clear();
    parser_.reset(wire::role::server, {.message_bytes_max = 4096, .fragments_max = 1}, assembly_);
  }

  void read() {
    std::array<std::byte, 4096 + 64> buffer;
    const ssize_t bytes = ::recv(out_.get(), buffer.data(), 4096, MSG_DONTWAIT);
    if (bytes <= 0) return out_.reset();
    std::span<std::byte> rest{buffer.data(), static_cast<std::size_t>(bytes)};
    if (!upgraded_) return upgrade({reinterpret_cast<const char*>(rest.data()), rest.size()});
    while (out_ && !rest.empty()) {
      const wire::frame_step step = parser_.next(rest);
      rest = rest.subspan(step.consumed);
      if (step.event == wire::frame_event::close || step.event == wire::frame_event::violation) out_.reset();
      if (step.event != wire::frame_event::pong || !say_pongs_) continue;
      std::printf("pong %.*s %lld\n", static_cast<int>(step.payload.size()),
                  reinterpret_cast<const char*>(step.payload.data()),
                  static_cast<long long>(rt::nanoseconds_of(monotonic_clock::now())));
      std::fflush(stdout);
    }
  }

  // Whoever asks gets in: this is no server, it is what one does to its sockets.
  void upgrade(std::string_view more) {
    request_ += more;
    if (!request_.ends_with("\r\n\r\n")) return;
    const auto answer = upgrade_answer(request_);
    if (!answer) return out_.reset();
    upgraded_ = ::send(out_.get(), answer->data(), answer->size(), MSG_NOSIGNAL) ==
                static_cast<ssize_t>(answer->size());
  }

  net::descriptor listening_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  net::descriptor out_; // the peer, if there is one
  std::uint16_t port_ = 0;
  bool say_pongs_ = false;
  bool upgraded_ = false;
  unsigned urgent_ = 0; // handed over
  std::string request_;
  std::string many_;    // telemetry
  std::string rest_;    // of what is being written
  std::string waiting_; // urgent, next to be written
  metronome urgently_;
  wire::frame_parser parser_;
  std::array<std::byte, 4096 + 64> assembly_{};
};

} // namespace rowe::bench
