// SPDX-License-Identifier: Apache-2.0
// A transport without sockets: bytes go through pipes of a fixed size in memory. For tests, the simulation
// and benches, which hold the other ends and decide how badly the network behaves: how much a pipe takes at a
// time, how the bytes are cut when they arrive, how long they take, when a connection stalls or breaks. One
// thread; deterministic.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "service/base/transport.hpp"

namespace rowe::net {

class memory_transport : public service::transport {
 public:
  // What the network does to one connection.
  struct link_conditions {
    std::size_t arrive_bytes_max = SIZE_MAX; // to our side in one poll()
    std::size_t chunk_bytes_max = 64 * 1024; // in one on_bytes()
    std::size_t capacity_bytes = 256 * 1024; // what the way to the peer holds before write() is refused
    std::size_t rest_bytes_max = 0;          // of a frame it has the beginning of, beyond that
    // When that arrives which is sent at a time, either way; none: at once. What is sent later never arrives
    // earlier, whatever they say: bytes stay in order. rt::never: not at all, nor anything behind it. Times
    // are those of poll(): what a peer says between two of them is sent at the time of the first.
    std::function<rt::time_point(rt::time_point)> to_us, to_peer;
  };

  explicit memory_transport(std::uint32_t connections_max);

  // ---- the other end, held by whoever tests

  // A peer connects (ours: server), or the remote accepts us (ours: client). The next poll() reports it. No
  // connection when all places are taken.
  service::connection_id open(service::side ours, std::string_view address = "127.0.0.1:1",
                              std::string_view path = "/", std::string_view subprotocol = {},
                              std::string_view token = {});
  // How many polls later a peer is connected than it was asked who it is: 0, unless said here.
  void handshakes_last(std::uint32_t polls) noexcept { handshake_polls_ = polls; }
  // Bytes from the peer.
  void arrive(service::connection_id id, std::span<const std::byte> bytes);
  // What of that which we have written has arrived at the peer, and it has not read; and the peer reading so
  // much of it.
  std::span<const std::byte> sent(service::connection_id id) const noexcept;
  void peer_reads(service::connection_id id, std::size_t bytes);
  // The peer ends the stream, or it breaks.
  void peer_closes(service::connection_id id, service::close_cause cause = service::close_cause::peer);
  // The core has closed its side (the peer may still read what was sent).
  bool closed_by_us(service::connection_id id) const noexcept;
  std::size_t send_buffer(service::connection_id id) const noexcept; // as the core said
  // What has arrived from the peer, or is on its way, and we have not read.
  std::size_t unread(service::connection_id id) const noexcept;
  link_conditions& link_of(service::connection_id id) noexcept { return links_[id.index].conditions; }

  // Called after each write(): what it was given, and how much of that it took.
  std::function<void(service::connection_id, std::span<const std::byte>, std::size_t)> written;

  // A hash of all that the core has asked of this transport so far: every byte, in its order.
  std::uint64_t trace() const noexcept { return trace_; }
  // For who does not ask for it.
  void leave_trace_out() noexcept { traces_ = false; }

  // How attempts to connect end: nothing (they are open until open() or reject() is called).
  std::uint64_t attempts() const noexcept { return attempts_; }
  void reject(std::string_view what);

  // What was asked of on_http by the last request.
  service::http_answer get(const service::http_request& request, service::transport_sink& sink) noexcept {
    return sink.on_http(request);
  }

  // ---- service::transport
  void poll(rt::time_point now, service::transport_sink& sink) noexcept override;
  void wait(rt::time_point, rt::time_point) noexcept override {} // whoever tests moves the time
  void wake() noexcept override {}
  int wake_descriptor() const noexcept override { return -1; }
  std::size_t write(service::connection_id id, std::span<const std::byte> bytes) noexcept override;
  std::size_t write_rest(service::connection_id id, std::span<const std::byte> rest) noexcept override;
  void close(service::connection_id id, service::close_how how) noexcept override;
  void limit_send_buffer(service::connection_id id, std::size_t bytes) noexcept override;
  void read_enabled(service::connection_id id, bool enabled) noexcept override;
  void connect() noexcept override {
    note("connect", {}, {});
    ++attempts_;
  }

 private:
  // Bytes on their way: sent, arrived, taken.
  class pipe {
   public:
    void send(std::span<const std::byte> bytes, rt::time_point arrival);
    std::size_t waiting() const noexcept { return bytes_.size() - taken_; } // whether or not it has arrived
    std::span<const std::byte> arrived(rt::time_point now) const noexcept;
    void take(std::size_t bytes) noexcept;
    void clear() noexcept;
    // When that arrives which is sent at `now`, if it takes as long as `how` says.
    rt::time_point arrival(const std::function<rt::time_point(rt::time_point)>& how,
                           rt::time_point now) const;

   private:
    struct batch {
      std::uint64_t end = 0; // in the stream
      rt::time_point arrival{};
    };
    std::vector<std::byte> bytes_;
    std::size_t taken_ = 0;
    std::uint64_t forgotten_ = 0; // bytes of the stream before bytes_
    std::deque<batch> batches_;
    rt::time_point last_{}; // the latest arrival so far
  };

  enum class phase : std::uint8_t { free, opening, open, ended };
  struct link {
    phase state = phase::free;
    std::uint32_t generation = 0;
    service::side ours = service::side::server;
    std::string address, path, subprotocol, token;
    link_conditions conditions;
    pipe inbound, outbound;
    std::optional<service::admit_answer> admitted; // opening: who it is
    std::uint32_t polls_left = 0;                  // likewise: until it is open
    bool refused = false;                          // write() took less than it was given
    bool reading = true;
    std::size_t send_buffer = 0;
    bool asked = false; // we have closed
    service::close_cause cause = service::close_cause::peer;
    bool ending = false;
    rt::time_point ends{};      // when we hear of it
    bool gone = false;          // on_gone() was told
    bool wrote_to_none = false; // we have written behind the end, which its side answers with a reset
  };

  link* find(service::connection_id id) noexcept;
  const link* find(service::connection_id id) const noexcept;
  void deliver(link& on, service::connection_id id, service::transport_sink& sink);
  void note(std::string_view call, service::connection_id id, std::span<const std::byte> bytes) noexcept;

  std::vector<link> links_;
  std::deque<std::string> rejections_;
  std::vector<std::byte> buffer_;
  rt::time_point now_{}; // of the last poll()
  std::uint32_t handshake_polls_ = 0;
  std::uint64_t attempts_ = 0;
  std::uint64_t trace_ = 0;
  bool traces_ = true;
};

} // namespace rowe::net
