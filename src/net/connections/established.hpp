// SPDX-License-Identifier: Apache-2.0
// The established connections: upgraded sockets, which libwebsockets has released. Reads, writes, closes, and
// enforces the write deadline. Service thread; allocates only in its constructor.
//
// The epoll is level triggered here. Unread bytes are reported again, in rotation, so read quanta are fair
// and nothing is forgotten. EPOLLOUT is asked for only while a write is refused, so an ordinary message costs
// no epoll_ctl.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "net/base/address.hpp"
#include "net/base/arrival.hpp"
#include "net/base/deadline_list.hpp"
#include "net/base/descriptor.hpp"
#include "net/base/poll_set.hpp"
#include "net/base/socket_limits.hpp"
#include "net/connections/stop_visits.hpp"
#include "net/connections/stream.hpp"
#include "service/base/transport.hpp"

namespace rowe::net {

namespace tls {
class terminator;
}

class established {
 public:
  established(const socket_limits& limits, poll_set& polled);
  // Set-up: who gives TLS sessions and takes them back.
  void use(tls::terminator& sessions) noexcept { sessions_ = &sessions; }
  ~established();
  established(const established&) = delete;
  established& operator=(const established&) = delete;

  // Whether there is no place for an ordinary peer, which did not come for the stop alone.
  bool full() const noexcept { return ordinary_ >= ordinary_max() || free_.empty(); }
  std::uint32_t ordinary_max() const noexcept {
    return limits_.connections_max - reserved_for_stop(limits_.connections_max);
  }
  std::uint32_t count_from(const socket_address& source) const noexcept; // linear; for handshakes

  // Whether there is a place for a peer on service::stop_path; another peer on the path may be displaced for
  // it (established.cpp). Only inside poll(). Linear.
  bool make_room_for_stop(const socket_address& peer, bool lent, service::transport_sink& sink) noexcept;

  enum class purpose : std::uint8_t { any, stop };
  // Takes over a socket that is already in the poll_set, under any token. There must be a place: full(),
  // make_room_for_stop().
  service::connection_id open(descriptor socket, const socket_address& peer, purpose why = purpose::any,
                              bool lent = false) noexcept;
  // The same for a connection under TLS, whose session the terminator has at that place. Until it comes,
  // nothing can be read or written, and the peer has no answer to its upgrade.
  service::connection_id open(tls::place_id place, const socket_address& peer, purpose why,
                              bool lent = false) noexcept;
  // Under TLS: who is at that place is answered later, and nobody else waits for the place.
  void answer_late(tls::place_id place) noexcept;
  // The session, or null if it has ended.
  void attach(service::connection_id id, std::unique_ptr<tls::session> secure,
              service::transport_sink& sink) noexcept;

  // Begins a turn. Deadlines that are set until the next turn count from this time.
  void begin_turn(rt::time_point now) noexcept { now_ = now; }
  // Reports the connections that ended outside poll(): by close(), or because a write failed.
  void report_ended(service::transport_sink& sink) noexcept;
  bool has_ended() const noexcept { return !ended_.empty(); }

  // Connections that have something to read of which the kernel knows nothing, as events for read_held().
  // Each turn takes them before it handles the poll_set's events, and reads them afterwards. So each
  // connection is read once in a turn. Valid until the next call.
  std::span<const socket_event> take_held() noexcept;
  std::size_t read_held(const socket_event& taken, std::span<std::byte> buffer,
                        service::transport_sink& sink) noexcept;
  bool holds_input() const noexcept { return !held_.empty(); }

  // Handles one event of the poll_set. Reads at most `buffer`, behind which tailroom_bytes
  // are readable. Returns how many bytes were read.
  std::size_t on_event(const socket_event& event, std::span<std::byte> buffer,
                       service::transport_sink& sink) noexcept;

  void expire(service::transport_sink& sink) noexcept;
  rt::time_point next_deadline() const noexcept;

  // As in service::transport.
  std::size_t write(service::connection_id id, std::span<const std::byte> bytes) noexcept;
  std::size_t write_rest(service::connection_id id, std::span<const std::byte> rest) noexcept;
  void close(service::connection_id id, service::close_how how) noexcept;
  void limit_send_buffer(service::connection_id id, std::size_t bytes) noexcept;
  void read_enabled(service::connection_id id, bool enabled) noexcept;

 private:
  enum class phase : std::uint8_t {
    free,
    open,
    closing, // our end is shut, the peer's is awaited; what arrives is thrown away
    ended,   // the socket is gone, on_close is not reported yet
  };
  struct connection : deadline_node {
    stream bytes; // none: its session is on the way
    socket_address peer;
    std::uint32_t generation = 0;
    phase now = phase::free;
    purpose why = purpose::any;
    bool lent = false; // its descriptor is reserved for the stop
    bool reading = true;
    bool refused = false;
    bool held = false;              // it is in `held_`
    bool gone = false;              // on_gone() was called
    bool broken = false;            // a write failed for `cause`; there may still be something to read
    int unacknowledged = 0;         // bytes, when it was
    std::size_t segment_bytes = 0;  // of one call, at most
    std::uint32_t buffer_bytes = 0; // SO_SNDBUF as it was asked for
    std::uint32_t unsent_bytes = 0; // TCP_NOTSENT_LOWAT
    service::close_cause cause = service::close_cause::asked;
    rt::time_point opened_at{};   // purpose::stop, as is this:
    std::uint32_t stop_visit = 0; // number
  };

  connection& take_place(const socket_address& peer, purpose why, bool lent) noexcept;
  bool is_in_use(const connection& one) const noexcept {
    return one.now == phase::open || one.now == phase::closing;
  }
  std::uint32_t events_of(const connection& one) const noexcept;
  void hold(connection& one) noexcept;
  void let_write(connection& one, service::transport_sink& sink) noexcept;
  void go_on_closing(connection& one, std::uint32_t events, service::transport_sink& sink) noexcept;
  connection* find(service::connection_id id) noexcept;
  service::connection_id id_of(const connection& one) const noexcept;
  void watch(connection& one) noexcept;
  std::size_t read(connection& one, std::span<std::byte> buffer, service::transport_sink& sink) noexcept;
  std::size_t refuse(connection& one, std::size_t taken) noexcept;
  void drop_socket(connection& one) noexcept;
  void end(connection& one, service::close_cause cause) noexcept;
  void finish(connection& one, service::close_cause cause, service::transport_sink& sink) noexcept;
  void free_place(connection& one) noexcept;
  template <class Wanted>
  bool displace_oldest(service::transport_sink& sink, Wanted&& wanted) noexcept;

  const socket_limits limits_;
  poll_set& polled_;
  tls::terminator* sessions_ = nullptr;
  std::vector<connection> connections_;
  std::uint32_t ordinary_ = 0; // of those in use: not for the stop alone
  stop_visits stop_visits_;
  std::vector<std::uint32_t> free_;  // indices
  std::vector<std::uint32_t> ended_; // indices, in the order of ending
  std::vector<std::uint32_t> held_;  // indices
  std::vector<socket_event> taken_;  // what take_held() has returned
  deadline_list refused_;
  deadline_list closing_;
  rt::time_point now_{};
};

} // namespace rowe::net
