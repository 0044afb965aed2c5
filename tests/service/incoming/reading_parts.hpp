// SPDX-License-Identifier: Apache-2.0
// What is read from peers, with a handler that only writes down what it is handed, or says that there is no
// room. For tests of reading and of what depends on it.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "service/incoming/ingress.hpp"
#include "service/incoming/peer_parts.hpp"

namespace reading_parts {

using namespace ::peer_parts;
using rowe::wire::opcode;

// A masked frame, as clients send them.
inline std::string frame(std::string_view payload, opcode what = opcode::text, bool final = true) {
  const rowe::wire::mask_key key{std::byte{7}, std::byte{8}, std::byte{9}, std::byte{10}};
  std::vector<std::byte> bytes(rowe::wire::frame_header_bytes_max + payload.size());
  const std::size_t header = rowe::wire::write_frame_header(bytes.data(), what, payload.size(), key);
  if (!final) bytes[0] &= std::byte{0x7F};
  payload.copy(reinterpret_cast<char*>(bytes.data() + header), payload.size());
  rowe::wire::mask(std::span{bytes}.subspan(header, payload.size()), key);
  return {reinterpret_cast<const char*>(bytes.data()), header + payload.size()};
}

// Writes down who said what: "0:hello".
class recorder final : public rowe::service::frame_handler {
 public:
  std::function<bool(peer_index, std::string_view)> takes; // false: it has no room; empty: it always has
  bool has_stop = false; // what begins with {"op":"call_service" and names the stop is one
  std::vector<std::string> heard;
  std::vector<std::string> heard_again; // what was parked before
  bool binary_again = false;
  rowe::service::ingress* from = nullptr;

  void handle(peer_index peer, const rowe::wire::frame_step& step) noexcept override {
    take(peer, text_of(step.payload), heard);
  }
  void handle_again(peer_index peer, std::span<std::byte> message, bool binary) noexcept override {
    binary_again = binary;
    take(peer, text_of(message), heard_again);
  }
  bool stop_in_use() const noexcept override { return has_stop; }
  bool is_stop(peer_index, std::span<const std::byte> message, bool) noexcept override {
    return text_of(message).find("\"/rowe/stop\"") != std::string_view::npos;
  }

 private:
  static std::string_view text_of(std::span<const std::byte> bytes) noexcept {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  void take(peer_index peer, std::string_view text, std::vector<std::string>& to) noexcept {
    if (takes && !takes(peer, text)) return from->park(peer);
    to.push_back(std::to_string(peer.value) + ':' + std::string{text});
  }
};

struct reading_parts : peer_parts::peer_parts {
  explicit reading_parts(const rowe::endpoint_options& chosen) : peer_parts{chosen} { handler.from = &in; }

  recorder handler;
  rowe::service::ingress in{
      memory,
      {.state_ = state, .outbox_ = out, .sender_ = sending, .receiver_ = inbox, .frame_handler_ = handler}};

  connection& arrive() {
    connection& c = connect();
    in.open({c.id.index});
    return c;
  }
  // As the transport reports them: with bytes behind that may be read.
  void read(const connection& c, std::string_view bytes) {
    constexpr std::size_t behind = rowe::service::tailroom_bytes;
    of_transport.resize(bytes.size() + behind);
    bytes.copy(reinterpret_cast<char*>(of_transport.data()), bytes.size());
    in.receive({c.id.index}, std::span{of_transport}.first(bytes.size()));
    std::fill(of_transport.begin(), of_transport.end(), std::byte{'?'}); // it reads into it again
  }
  std::vector<std::byte> of_transport;
  // Its connection has ended; the place is free.
  void leave(connection& c) {
    const peer_index peer{c.id.index};
    in.forget(peer);
    inbox.forget(peer);
    sending.forget(peer);
    out.forget(peer);
    c.state = connection::phase::free;
    peers.remove();
  }
  void TearDown() override {
    EXPECT_TRUE(in.check());
    peer_parts::TearDown();
  }
};

} // namespace reading_parts
