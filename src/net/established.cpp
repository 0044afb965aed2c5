// SPDX-License-Identifier: Apache-2.0
#include "net/established.hpp"

#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "net/socket_options.hpp"

namespace rowe::net {

using service::close_cause;
using service::close_how;
using service::connection_id;
using service::stop_place_kept_for;
using service::transport_sink;

namespace {

// The kernel doubles it, and it is an int.
constexpr std::size_t send_buffer_max = INT_MAX / 2;

// How much is written into a limited send buffer at once. The kernel takes a write as one segment, however
// small the buffer is, and takes no other until that one is acknowledged. But a receiver that also sends now
// and then acknowledges a lone segment only after 40 ms, or when it is repeated. It acknowledges two segments
// at once. The buffer is twice as large as was asked for, and its socket is writable while a third of it is
// free. So two segments are always under way if each is shorter than 4/3 of what was asked for, with what the
// kernel adds.
constexpr std::size_t segment_bytes_max(std::uint32_t buffer_bytes) noexcept {
  return buffer_bytes == 0 ? SIZE_MAX : std::size_t{buffer_bytes} + buffer_bytes / 5;
}

bool would_block(int code) noexcept { return code == EAGAIN || code == EWOULDBLOCK || code == EINTR; }

// Also true if the kernel has no memory for buffers: then, too, the socket becomes writable later.
bool has_no_room(int code) noexcept { return would_block(code) || code == ENOBUFS || code == ENOMEM; }

ssize_t send_now(int fd, std::span<const std::byte> bytes) noexcept {
  return ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

close_cause cause_of(int code) noexcept {
  return code == ETIMEDOUT ? close_cause::timed_out : close_cause::reset;
}

} // namespace

established::established(const socket_limits& limits, poll_set& polled)
    : limits_{limits},
      polled_{polled},
      connections_(limits.connections_max),
      stop_visits_(limits.connections_max),
      refused_{limits.write_timeout},
      closing_{limits.close_timeout} {
  free_.reserve(limits.connections_max);
  ended_.reserve(limits.connections_max);
  for (std::uint32_t index = limits.connections_max; index-- > 0;) free_.push_back(index);
}

established::~established() {
  for (connection& one : connections_)
    if (one.socket) drop_socket(one);
}

std::uint32_t established::count_from(const socket_address& source) const noexcept {
  return static_cast<std::uint32_t>(
      std::count_if(connections_.begin(), connections_.end(),
                    [&](const auto& one) { return one.socket && same_source(one.peer, source); }));
}

connection_id established::open(descriptor socket, const socket_address& peer, purpose why) noexcept {
  const std::uint32_t index = free_.back();
  free_.pop_back();
  connection& one = connections_[index];
  if (++one.generation == 0) one.generation = 1; // 0 is never a connection that was reported
  one.opened_at = now_;
  one.why = why;
  if (why == purpose::any) {
    ++ordinary_;
  } else {
    one.stop_visit = begin_visit(peer);
  }
  one.socket = std::move(socket);
  one.peer = peer;
  one.now = phase::open;
  one.reading = true;
  one.refused = one.broken = false;
  prepare_for_frames(one.socket.get(), limits_);
  one.buffer_bytes = limits_.send_buffer_bytes;
  one.unsent_bytes = limits_.unsent_bytes_max;
  one.segment_bytes = segment_bytes_max(one.buffer_bytes);
  watch(one);
  return id_of(one);
}

// ---- reserved places for the stop

// On loopback, each connection is a visit of its own, unless it comes back after a pause.
bool established::goes_on(const visit& one) const noexcept {
  if (one.connections != 0) return !is_loopback(one.source);
  return now_ - one.left_at < stop_place_kept_for;
}

std::uint32_t established::begin_visit(const socket_address& source) noexcept {
  auto found = std::find_if(stop_visits_.begin(), stop_visits_.end(), [&](const visit& one) {
    return same_source(one.source, source) && goes_on(one);
  });
  if (found == stop_visits_.end()) {
    // Takes the visit that ended longest ago. There are as many visits as connections, so one has ended.
    found = std::min_element(stop_visits_.begin(), stop_visits_.end(), [](const visit& a, const visit& b) {
      return std::pair{a.connections != 0, a.left_at} < std::pair{b.connections != 0, b.left_at};
    });
    *found = {.source = source, .since = now_};
  }
  ++found->connections;
  return static_cast<std::uint32_t>(found - stop_visits_.begin());
}

// A peer that comes to stop gets a place while any is free, a reserved one too. Then another peer on the path
// is displaced: the oldest one, unless the sink says that it has just stopped the robot.
//
// A crowd of peers must keep nobody out. So one source, except loopback, has only one of the reserved places.
// When it comes again, or beyond connections_per_address_max, its own connection is displaced. A connection
// of another source is displaced only when that source has had its place for stop_place_kept_for. The time is
// counted for the source, so closing and coming back does not begin it anew.
bool established::make_room_for_stop(const socket_address& peer, transport_sink& sink) noexcept {
  const auto of_its_own = [&](const connection& one) { return same_source(one.peer, peer); };
  const auto held_long = [&](const connection& one) {
    return now_ - stop_visits_[one.stop_visit].since >= stop_place_kept_for;
  };
  report_ended(sink);
  const bool instead = !is_loopback(peer) &&
                       (free_.size() <= kept_for_stop(limits_.connections_max) ||
                        count_from(peer) >= limits_.connections_per_address_max) &&
                       std::any_of(connections_.begin(), connections_.end(), [&](const connection& one) {
                         return one.socket && one.why == purpose::stop && of_its_own(one);
                       });
  if (!instead && !free_.empty()) return true;
  return displace_oldest(sink, of_its_own) || (!instead && displace_oldest(sink, held_long));
}

template <class Wanted>
bool established::displace_oldest(transport_sink& sink, Wanted&& wanted) noexcept {
  connection* oldest = nullptr;
  for (connection& one : connections_) {
    if (!one.socket || one.why != purpose::stop || !wanted(one)) continue;
    if (oldest != nullptr && one.opened_at >= oldest->opened_at) continue;
    if (sink.may_displace(id_of(one))) oldest = &one;
  }
  if (oldest == nullptr) return false;
  sink.displace(id_of(*oldest));
  if (oldest->socket) { // unread bytes would make this a reset, which may overtake the close frame
    (void)discard_input(oldest->socket.get());
    end(*oldest, close_cause::asked);
  }
  report_ended(sink);
  return true;
}

established::connection* established::find(connection_id id) noexcept {
  if (id.index >= connections_.size()) return nullptr;
  connection& one = connections_[id.index];
  const bool alive = one.now == phase::open || one.now == phase::closing;
  return alive && one.generation == id.generation ? &one : nullptr;
}

connection_id established::id_of(const connection& one) const noexcept {
  return {static_cast<std::uint32_t>(&one - connections_.data()), one.generation};
}

void established::watch(connection& one) noexcept {
  std::uint32_t events = 0;
  if (one.reading || one.now == phase::closing) events |= EPOLLIN;
  if (one.refused) events |= EPOLLOUT;
  const connection_id id = id_of(one);
  polled_.modify(one.socket.get(), events, {source::connection, id.index, id.generation});
}

std::size_t established::on_event(const socket_event& event, std::span<std::byte> buffer,
                                  transport_sink& sink) noexcept {
  const connection_id id{event.token.index, event.token.generation};
  connection* one = find(id);
  if (!one) return 0; // ended earlier in this batch
  if (one->now == phase::closing) {
    discard(*one, sink);
    return 0;
  }
  const bool broken = (event.events & (EPOLLERR | EPOLLHUP)) != 0;
  if (broken && !one->reading) {
    // The bytes that it left are lost: the core does not want them now, and there is no later.
    finish(*one, cause_of(socket_error(one->socket.get())), sink);
    return 0;
  }
  std::size_t bytes = 0;
  if (broken || (one->reading && (event.events & EPOLLIN))) {
    const std::size_t wanted = std::min(buffer.size(), sink.wanted_bytes(id));
    if (wanted != 0) bytes = read(*one, buffer.first(wanted), sink); // inbound before outbound
  }
  one = find(id); // the sink may have closed it
  if (one && one->refused && (event.events & EPOLLOUT)) {
    one->refused = false;
    one->disarm();
    watch(*one);
    sink.on_writable(id);
  }
  return bytes;
}

std::size_t established::read(connection& one, std::span<std::byte> buffer, transport_sink& sink) noexcept {
  const ssize_t bytes = ::recv(one.socket.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (bytes > 0) {
    sink.on_bytes(id_of(one), buffer.first(static_cast<std::size_t>(bytes)));
    return static_cast<std::size_t>(bytes);
  }
  if (bytes == 0) {
    finish(one, one.broken ? one.cause : close_cause::peer, sink);
  } else if (!would_block(errno)) {
    finish(one, cause_of(errno), sink);
  }
  return 0;
}

void established::discard(connection& one, transport_sink& sink) noexcept {
  const ssize_t bytes = discard_input(one.socket.get());
  if (bytes == 0 || (bytes < 0 && !would_block(errno))) finish(one, close_cause::asked, sink);
}

std::size_t established::write(connection_id id, std::span<const std::byte> bytes) noexcept {
  connection* one = find(id);
  if (!one || one->now != phase::open || one->refused) return 0;
  std::size_t taken = 0;
  while (taken < bytes.size()) {
    const auto segment = bytes.subspan(taken, std::min(bytes.size() - taken, one->segment_bytes));
    const ssize_t sent = send_now(one->socket.get(), segment);
    if (sent < 0) {
      // A broken connection may still have bytes of its peer; its event reads them to the end.
      if (!has_no_room(errno)) {
        one->broken = true;
        one->cause = cause_of(errno);
      }
      return refuse(*one, taken);
    }
    taken += static_cast<std::size_t>(sent);
    if (static_cast<std::size_t>(sent) < segment.size()) return refuse(*one, taken);
  }
  return taken;
}

// Makes the send buffer large enough during this call. What is in the buffer stays there afterwards.
std::size_t established::write_rest(connection_id id, std::span<const std::byte> rest) noexcept {
  connection* one = find(id);
  if (!one || one->now != phase::open || one->broken) return 0;
  const int fd = one->socket.get();
  widen_send_buffer(fd, rest.size());
  const ssize_t sent = send_now(fd, rest);
  limit_unsent(fd, one->unsent_bytes);
  net::limit_send_buffer(fd, one->buffer_bytes);
  one->unacknowledged = unacknowledged_bytes(fd);       // more than before: that is no standstill
  return sent < 0 ? 0 : static_cast<std::size_t>(sent); // what broke is seen by its event
}

std::size_t established::refuse(connection& one, std::size_t taken) noexcept {
  one.refused = true;
  one.unacknowledged = unacknowledged_bytes(one.socket.get());
  watch(one);
  refused_.arm(one, now_);
  return taken;
}

void established::close(connection_id id, close_how how) noexcept {
  connection* one = find(id);
  if (!one) return;
  if (how == close_how::aborted) {
    reset_on_close(one->socket.get());
    return end(*one, close_cause::asked);
  }
  if (one->now == phase::closing) return;
  if (::shutdown(one->socket.get(), SHUT_WR) != 0)
    return end(*one, close_cause::asked); // the peer was faster
  one->now = phase::closing;
  one->refused = false;
  watch(*one);
  closing_.arm(*one, now_);
}

void established::limit_send_buffer(connection_id id, std::size_t bytes) noexcept {
  connection* one = find(id);
  if (!one) return;
  const auto limited = static_cast<std::uint32_t>(std::min(bytes, send_buffer_max));
  one->buffer_bytes = limited != 0 ? limited : limits_.send_buffer_bytes;
  one->unsent_bytes = std::max(limited, limits_.unsent_bytes_max);
  net::limit_send_buffer(one->socket.get(), one->buffer_bytes);
  limit_unsent(one->socket.get(), one->unsent_bytes);
  one->segment_bytes = segment_bytes_max(one->buffer_bytes);
}

void established::read_enabled(connection_id id, bool enabled) noexcept {
  connection* one = find(id);
  if (!one || one->reading == enabled) return;
  one->reading = enabled;
  watch(*one);
}

void established::expire(transport_sink& sink) noexcept {
  while (deadline_node* node = refused_.take_due(now_)) {
    auto& one = static_cast<connection&>(*node);
    const int unacknowledged = unacknowledged_bytes(one.socket.get());
    if (unacknowledged < one.unacknowledged) { // slow is not dead
      one.unacknowledged = unacknowledged;
      refused_.arm(one, now_);
      continue;
    }
    reset_on_close(one.socket.get());
    finish(one, close_cause::timed_out, sink);
  }
  while (deadline_node* node = closing_.take_due(now_)) {
    auto& one = static_cast<connection&>(*node);
    reset_on_close(one.socket.get());
    finish(one, close_cause::asked, sink);
  }
}

rt::time_point established::next_deadline() const noexcept {
  return std::min(refused_.next(), closing_.next());
}

void established::drop_socket(connection& one) noexcept {
  one.disarm();
  polled_.remove(one.socket.get());
  one.socket.reset();
}

// Ends a connection outside poll(), where nothing may be reported.
void established::end(connection& one, close_cause cause) noexcept {
  drop_socket(one);
  one.now = phase::ended;
  one.cause = cause;
  ended_.push_back(id_of(one).index);
}

// Ends a connection inside poll().
void established::finish(connection& one, close_cause cause, transport_sink& sink) noexcept {
  drop_socket(one);
  const connection_id id = id_of(one);
  free_place(one);
  sink.on_close(id, cause);
}

void established::free_place(connection& one) noexcept {
  one.now = phase::free;
  if (one.why == purpose::any) {
    --ordinary_;
  } else {
    visit& ended = stop_visits_[one.stop_visit];
    --ended.connections;
    ended.left_at = now_;
  }
  free_.push_back(id_of(one).index);
}

void established::report_ended(transport_sink& sink) noexcept {
  const std::size_t count = ended_.size(); // on_close may end others; they wait for the next turn
  for (std::size_t i = 0; i < count; ++i) {
    connection& one = connections_[ended_[i]];
    free_place(one);
    sink.on_close(id_of(one), one.cause);
  }
  ended_.erase(ended_.begin(), ended_.begin() + static_cast<std::ptrdiff_t>(count));
}

} // namespace rowe::net
