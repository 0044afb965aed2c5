// SPDX-License-Identifier: Apache-2.0
#include "net/connections/established.hpp"

#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <utility>

#include "net/base/socket_options.hpp"
#include "net/tls/terminator.hpp"

namespace rowe::net {

using service::close_cause;
using service::close_how;
using service::connection_id;
using service::stop_place_protected_for;
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

close_cause cause_of(int code) noexcept {
  return code == ETIMEDOUT ? close_cause::timed_out : close_cause::reset;
}

} // namespace

established::established(const socket_limits& limits, poll_set& polled)
    : limits_{limits},
      polled_{polled},
      connections_(limits.connections_max),
      stop_visits_{limits.connections_max},
      refused_{limits.write_timeout},
      closing_{limits.close_timeout} {
  free_.reserve(limits.connections_max);
  ended_.reserve(limits.connections_max);
  held_.reserve(limits.connections_max);
  taken_.reserve(limits.connections_max);
  for (std::uint32_t index = limits.connections_max; index-- > 0;) free_.push_back(index);
}

established::~established() {
  for (connection& one : connections_)
    if (is_in_use(one)) drop_socket(one);
}

std::uint32_t established::count_from(const socket_address& source) const noexcept {
  return static_cast<std::uint32_t>(
      std::count_if(connections_.begin(), connections_.end(),
                    [&](const auto& one) { return is_in_use(one) && same_source(one.peer, source); }));
}

established::connection& established::take_place(const socket_address& peer, purpose why,
                                                 bool lent) noexcept {
  const std::uint32_t index = free_.back();
  free_.pop_back();
  connection& one = connections_[index];
  if (++one.generation == 0) one.generation = 1; // 0 is never a connection that was reported
  one.opened_at = now_;
  one.why = why;
  one.lent = lent;
  if (why == purpose::any) {
    ++ordinary_;
  } else {
    one.stop_visit = stop_visits_.begin(peer, now_);
  }
  one.peer = peer;
  one.now = phase::open;
  one.reading = true;
  one.refused = one.broken = one.held = one.gone = false;
  one.buffer_bytes = limits_.send_buffer_bytes;
  one.unsent_bytes = limits_.unsent_bytes_max;
  one.segment_bytes = segment_bytes_max(one.buffer_bytes);
  return one;
}

connection_id established::open(descriptor socket, const socket_address& peer, purpose why,
                                bool lent) noexcept {
  connection& one = take_place(peer, why, lent);
  one.bytes = stream{std::move(socket)};
  prepare_for_frames(one.bytes.get(), limits_);
  watch(one);
  return id_of(one);
}

// ---- connections under TLS

connection_id established::open(tls::place_id place, const socket_address& peer, purpose why,
                                bool lent) noexcept {
  connection& one = take_place(peer, why, lent);
  if (!sessions_->ask_session(place, id_of(one))) end(one, close_cause::reset);
  return id_of(one);
}

void established::answer_late(tls::place_id place) noexcept {
  if (place) sessions_->answer_late(place);
}

void established::attach(connection_id id, std::unique_ptr<tls::session> secure,
                         transport_sink& sink) noexcept {
  connection* const one = find(id);
  if (one == nullptr || one->bytes) { // it was closed meanwhile
    if (secure) sessions_->destroy(std::move(secure));
    return;
  }
  if (!secure) return finish(*one, close_cause::reset, sink);
  one->bytes = stream{std::move(secure)};
  const int fd = one->bytes.get();
  prepare_for_frames(fd, limits_);
  if (one->buffer_bytes != limits_.send_buffer_bytes) { // the core has asked for it already
    net::limit_send_buffer(fd, one->buffer_bytes);
    limit_unsent(fd, one->unsent_bytes);
  }
  const bool waits = std::exchange(one->refused, !one->bytes.flush()); // the answer to its upgrade
  if (!polled_.add(fd, events_of(*one), {source::connection, id.index, id.generation}))
    return finish(*one, close_cause::reset, sink);
  if (one->refused) refused_.arm(*one, now_);
  if (one->bytes.holds_input()) hold(*one);
  if (waits && !one->refused) sink.on_writable(id);
}

void established::hold(connection& one) noexcept {
  if (!one.reading || std::exchange(one.held, true)) return;
  held_.push_back(id_of(one).index);
}

std::span<const socket_event> established::take_held() noexcept {
  taken_.clear();
  for (const std::uint32_t index : held_)
    taken_.push_back({{source::connection, index, connections_[index].generation}, EPOLLIN});
  held_.clear();
  return taken_;
}

std::size_t established::read_held(const socket_event& taken, std::span<std::byte> buffer,
                                   transport_sink& sink) noexcept {
  connection* const one = find({taken.token.index, taken.token.generation});
  if (one == nullptr) return 0;
  one->held = false;
  return on_event(taken, buffer, sink);
}

established::connection* established::find(connection_id id) noexcept {
  if (id.index >= connections_.size()) return nullptr;
  connection& one = connections_[id.index];
  return is_in_use(one) && one.generation == id.generation ? &one : nullptr;
}

connection_id established::id_of(const connection& one) const noexcept {
  return {static_cast<std::uint32_t>(&one - connections_.data()), one.generation};
}

std::uint32_t established::events_of(const connection& one) const noexcept {
  std::uint32_t events = 0;
  if (one.reading || one.now == phase::closing) events |= EPOLLIN;
  if (one.refused) events |= EPOLLOUT;
  return events;
}

void established::watch(connection& one) noexcept {
  const connection_id id = id_of(one);
  if (one.bytes)
    polled_.modify(one.bytes.get(), events_of(one), {source::connection, id.index, id.generation});
}

std::size_t established::on_event(const socket_event& event, std::span<std::byte> buffer,
                                  transport_sink& sink) noexcept {
  const connection_id id{event.token.index, event.token.generation};
  connection* one = find(id);
  if (!one) return 0; // ended earlier in this batch
  if (one->now == phase::closing) {
    go_on_closing(*one, event.events, sink);
    return 0;
  }
  const bool broken = (event.events & (EPOLLERR | EPOLLHUP)) != 0;
  if (broken && !one->reading) {
    // The bytes that it left are lost: the core does not want them now, and there is no later.
    finish(*one, cause_of(socket_error(one->bytes.get())), sink);
    return 0;
  }
  if (broken && !std::exchange(one->gone, true)) sink.on_gone(id);
  std::size_t bytes = 0;
  const bool readable = broken || (one->reading && (event.events & EPOLLIN));
  if (readable && !one->held) { // else it comes later in this turn
    const std::size_t wanted = std::min(buffer.size(), sink.wanted_bytes(id));
    if (wanted != 0) {
      bytes = read(*one, buffer.first(wanted), sink); // inbound before outbound
    } else if (one->bytes.holds_input()) {
      hold(*one);
    }
  }
  one = find(id); // the sink may have closed it
  if (one && one->refused && (event.events & EPOLLOUT)) let_write(*one, sink);
  return bytes;
}

void established::let_write(connection& one, transport_sink& sink) noexcept {
  if (!one.bytes.flush()) return; // what breaks it comes as an event, too
  one.refused = false;
  one.disarm();
  watch(one);
  sink.on_writable(id_of(one));
}

std::size_t established::read(connection& one, std::span<std::byte> buffer, transport_sink& sink) noexcept {
  const ssize_t bytes = one.bytes.receive(buffer, now_);
  if (bytes > 0) {
    if (one.bytes.holds_input()) hold(one);
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

void established::go_on_closing(connection& one, std::uint32_t events, transport_sink& sink) noexcept {
  if (one.refused && (events & EPOLLOUT) && one.bytes.flush()) {
    one.refused = false;
    watch(one);
    if (!one.bytes.finish()) return finish(one, close_cause::asked, sink);
  }
  const ssize_t bytes = discard_input(one.bytes.get());
  if (bytes == 0 || (bytes < 0 && !would_block(errno))) finish(one, close_cause::asked, sink);
}

std::size_t established::write(connection_id id, std::span<const std::byte> bytes) noexcept {
  connection* one = find(id);
  if (!one || one->now != phase::open || one->refused) return 0;
  const stream::sent sent = one->bytes ? one->bytes.send(bytes, one->segment_bytes) : stream::sent{};
  if (sent.broken != 0) { // its peer may have left bytes; its event reads them to the end
    one->broken = true;
    one->cause = cause_of(sent.broken);
  }
  if (sent.taken == bytes.size() && sent.broken == 0 && !one->bytes.holds_output()) return sent.taken;
  return refuse(*one, sent.taken);
}

// Makes the send buffer large enough during this call. What is in the buffer stays there afterwards.
std::size_t established::write_rest(connection_id id, std::span<const std::byte> rest) noexcept {
  connection* one = find(id);
  if (!one || one->now != phase::open || one->broken || !one->bytes) return 0;
  const int fd = one->bytes.get();
  widen_send_buffer(fd, rest.size());
  const stream::sent sent = one->bytes.send(rest, SIZE_MAX);
  limit_unsent(fd, one->unsent_bytes);
  net::limit_send_buffer(fd, one->buffer_bytes);
  one->unacknowledged = unacknowledged_bytes(fd); // more than before: that is no standstill
  return sent.taken;                              // what broke is seen by its event
}

std::size_t established::refuse(connection& one, std::size_t taken) noexcept {
  one.refused = true;
  if (!one.bytes) return taken;
  one.unacknowledged = unacknowledged_bytes(one.bytes.get());
  watch(one);
  refused_.arm(one, now_);
  return taken;
}

void established::close(connection_id id, close_how how) noexcept {
  connection* one = find(id);
  if (!one) return;
  if (!one->bytes) return end(*one, close_cause::asked);
  if (how == close_how::aborted) {
    reset_on_close(one->bytes.get());
    return end(*one, close_cause::asked);
  }
  if (one->now == phase::closing) return;
  if (!one->bytes.finish()) return end(*one, close_cause::asked); // the peer was faster
  one->now = phase::closing;
  one->refused = one->bytes.holds_output();
  watch(*one);
  closing_.arm(*one, now_);
}

void established::limit_send_buffer(connection_id id, std::size_t bytes) noexcept {
  connection* one = find(id);
  if (!one) return;
  const auto limited = static_cast<std::uint32_t>(std::min(bytes, send_buffer_max));
  one->buffer_bytes = limited != 0 ? limited : limits_.send_buffer_bytes;
  one->unsent_bytes = std::max(limited, limits_.unsent_bytes_max);
  one->segment_bytes = segment_bytes_max(one->buffer_bytes);
  if (!one->bytes) return;
  net::limit_send_buffer(one->bytes.get(), one->buffer_bytes);
  limit_unsent(one->bytes.get(), one->unsent_bytes);
}

void established::read_enabled(connection_id id, bool enabled) noexcept {
  connection* one = find(id);
  if (!one || one->reading == enabled) return;
  one->reading = enabled;
  watch(*one);
  if (one->bytes.holds_input()) hold(*one);
}

void established::expire(transport_sink& sink) noexcept {
  while (deadline_node* node = refused_.take_due(now_)) {
    auto& one = static_cast<connection&>(*node);
    const int unacknowledged = unacknowledged_bytes(one.bytes.get());
    if (unacknowledged < one.unacknowledged) { // slow is not dead
      one.unacknowledged = unacknowledged;
      refused_.arm(one, now_);
      continue;
    }
    reset_on_close(one.bytes.get());
    finish(one, close_cause::timed_out, sink);
  }
  while (deadline_node* node = closing_.take_due(now_)) {
    auto& one = static_cast<connection&>(*node);
    reset_on_close(one.bytes.get());
    finish(one, close_cause::asked, sink);
  }
}

rt::time_point established::next_deadline() const noexcept {
  return std::min(refused_.next(), closing_.next());
}

void established::drop_socket(connection& one) noexcept {
  one.disarm();
  if (std::exchange(one.held, false)) std::erase(held_, id_of(one).index);
  if (!one.bytes) return;
  polled_.remove(one.bytes.get());
  if (auto secure = one.bytes.close()) sessions_->destroy(std::move(secure));
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
    stop_visits_.end(one.stop_visit, now_);
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
