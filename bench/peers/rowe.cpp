// SPDX-License-Identifier: Apache-2.0
// rowe as a server of bench/peers (peers.hpp), in two layers:
//   --layer frames    the transport and the frames: what other libraries are
//   --layer endpoint  a hub, to which messages are rosbridge's: each is parsed, checked and given to its
//                     topic's subscribers (modes echo and fan_out)
// --idle is how the thread waits. --unclamped writes as much as the kernel takes; as shipped, what is in
// flight is bounded (../flood.hpp).
#include <algorithm>
#include <array>
#include <chrono>
#include <climits>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <unistd.h>

#include <rowe/rowe.hpp>

#include "arguments.hpp"
#include "flood.hpp"
#include "net/transport/socket_transport.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::bench {
namespace {

using rt::monotonic_clock;
using service::connection_id;

constexpr std::size_t message_bytes_max = 4096;
constexpr std::uint32_t connections_max = 1100;

class frames_server final : public service::transport_sink {
 public:
  frames_server(service::transport& sockets, const peer_arguments& how) : transport_{sockets}, how_{how} {}

  service::admit_answer admit(const service::credentials&) const noexcept override { return {}; }
  void on_open(connection_id id, const service::peer_info&) noexcept override {
    if (connections_.size() <= id.index) connections_.resize(id.index + 1);
    auto& made = connections_[id.index] = std::make_unique<connection>();
    made->id = id;
    made->parser.reset(wire::role::server, {.message_bytes_max = message_bytes_max, .fragments_max = 1024},
                       made->assembly);
  }
  void on_bytes(connection_id id, std::span<std::byte> bytes) noexcept override {
    while (!bytes.empty() && connections_[id.index]) {
      connection& from = *connections_[id.index];
      const wire::frame_step step = from.parser.next(bytes);
      bytes = bytes.subspan(step.consumed);
      if (step.event == wire::frame_event::text) take(from, step.payload);
      if (step.event == wire::frame_event::pong && flood_)
        flood_->take_pong(step.payload, monotonic_clock::now());
      if (step.event == wire::frame_event::close || step.event == wire::frame_event::violation)
        return transport_.close(id, service::close_how::aborted);
    }
  }
  void on_writable(connection_id id) noexcept override {
    if (flood_ && id == flood_->peer()) flood_->on_writable();
  }
  void on_close(connection_id id, service::close_cause) noexcept override {
    connections_[id.index].reset();
    if (flood_ && id == flood_->peer()) flood_.reset();
  }
  void on_rejected(const service::rejection& why) noexcept override {
    std::fprintf(stderr, "refused: %.*s\n", static_cast<int>(why.what.size()), why.what.data());
  }
  service::http_answer on_http(const service::http_request&) noexcept override { return {}; }

  // Whether there is more to write at once.
  bool turn() noexcept {
    if (!flood_) return false;
    for (unsigned i = 0; i < service::batches_per_cycle; ++i)
      if (!flood_->write(monotonic_clock::now())) return false;
    return true;
  }

 private:
  struct connection {
    connection_id id;
    std::size_t count = 0; // messages
    wire::frame_parser parser;
    std::array<std::byte, message_bytes_max + 64> assembly;
  };

  void take(connection& from, std::span<std::byte> text) noexcept {
    ++from.count;
    switch (how_.mode) {
    case serving::echo: send(from.id, frame_of(text, joined_.data())); break;
    case serving::fan_out: {
      const auto frame = frame_of(text, joined_.data());
      for (const auto& to : connections_)
        if (to) send(to->id, frame);
      break;
    }
    case serving::sink:
      if (text.size() == 1) {
        const std::string count = std::to_string(from.count);
        send(from.id, frame_of(std::as_bytes(std::span{count}), joined_.data()));
      }
      break;
    case serving::flood:
      flood_.emplace(transport_, from.id, text,
                     how_.clamped ? flood::in_flight::as_shipped : flood::in_flight::unbounded);
    }
  }
  static std::span<const std::byte> frame_of(std::span<const std::byte> text, std::byte* buffer) noexcept {
    const std::size_t header = wire::write_frame_header(buffer, wire::opcode::text, text.size());
    std::memcpy(buffer + header, text.data(), text.size());
    return {buffer, header + text.size()};
  }
  void send(connection_id to, std::span<const std::byte> frame) noexcept {
    (void)transport_.write(to, frame); // fits: whoever it goes to waits for it
  }
  service::transport& transport_;
  const peer_arguments how_;
  std::vector<std::unique_ptr<connection>> connections_;                         // by index
  std::array<std::byte, message_bytes_max + wire::frame_headroom_bytes> joined_; // a frame
  std::optional<flood> flood_;
};

int serve_frames(const peer_arguments& how) {
  net::listen_options options;
  options.port = how.port;
  options.limits.connections_max = connections_max;
  if (!how.clamped) options.limits.unsent_bytes_max = INT_MAX;
  auto sockets = net::socket_transport::listen(options);
  if (!sockets) return 1;
  frames_server server{**sockets, how};
  for (;;) {
    const time_point now = monotonic_clock::now();
    (*sockets)->poll(now, server);
    const bool more = server.turn();
    if (how.idle == "spin" || more) continue;
    const duration timeout = how.idle == "poll" ? endpoint_options{}.poll_period : rt::for_ever;
    (*sockets)->wait(now, rt::deadline_after(now, timeout));
  }
}

int serve_endpoint(const peer_arguments& how) {
  limits within;
  within.connections_max = connections_max;
  within.subscriptions_max = 2 * connections_max;
  within.messages_per_second_max = 0;
  const idle policy = how.idle == "spin" ? idle::spin : how.idle == "poll" ? idle::poll : idle::wake;
  // A peer that is silent while others connect is not asked whether it is alive: sends are counted.
  const auto hub = endpoint::listen(how.port, {.idle_policy = policy,
                                               .relay = true,
                                               .ping_period = std::chrono::seconds{30},
                                               .silence_max = std::chrono::seconds{60},
                                               .limits = within});
  if (!hub) {
    std::fprintf(stderr, "endpoint: %s\n", hub.error().name().data());
    return 1;
  }
  for (;;) ::pause();
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  const peer_arguments how = arguments_of(count, arguments);
  return how.layer == "endpoint" ? serve_endpoint(how) : serve_frames(how);
}
