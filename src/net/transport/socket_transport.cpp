// SPDX-License-Identifier: Apache-2.0
#include "net/transport/socket_transport.hpp"

#include <sys/eventfd.h>

#include <algorithm>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "net/base/address.hpp"
#include "net/base/descriptor.hpp"
#include "net/base/listener.hpp"
#include "net/base/poll_set.hpp"
#include "net/base/socket_limits.hpp"
#include "net/client/client_attempt.hpp"
#include "net/connections/established.hpp"
#include "net/connections/read_pace.hpp"
#include "net/handshakes/handshakes.hpp"
#include "net/handshakes/policy_owner.hpp"
#include "net/lws/lws_host.hpp"
#include "net/tls/terminator.hpp"

namespace rowe::net {

using service::transport_sink;

namespace {

// Few, because a stop waits behind what one turn does for strangers.
constexpr int accepts_per_turn = 4;
constexpr int news_per_turn = 4; // the same, of the terminator
// libwebsockets' timers and deferred work. Nothing here depends on them: sockets are driven by our epoll.
constexpr rt::duration lws_turn_period = std::chrono::milliseconds{250};

class epoll_transport final : public socket_transport {
 public:
  static result<std::unique_ptr<socket_transport>> open(const listen_options& options);
  static result<std::unique_ptr<socket_transport>> open(const connect_options& options);

  void poll(rt::time_point now, transport_sink& sink) noexcept override;
  void wait(rt::time_point now, rt::time_point until) noexcept override;
  // Fails only if the count is at its maximum, and then the descriptor is readable already.
  void wake() noexcept override { (void)::eventfd_write(waker_.get(), 1); }
  int wake_descriptor() const noexcept override { return waker_.get(); }
  std::size_t write(service::connection_id connection, std::span<const std::byte> bytes) noexcept override {
    return connections_.write(connection, bytes);
  }
  std::size_t write_rest(service::connection_id connection,
                         std::span<const std::byte> rest) noexcept override {
    return connections_.write_rest(connection, rest);
  }
  void close(service::connection_id connection, service::close_how how) noexcept override {
    connections_.close(connection, how);
  }
  void limit_send_buffer(service::connection_id connection, std::size_t bytes) noexcept override {
    connections_.limit_send_buffer(connection, bytes);
  }
  void read_enabled(service::connection_id connection, bool enabled) noexcept override {
    connections_.read_enabled(connection, enabled);
  }
  void connect() noexcept override {
    if (attempt_) attempt_->ask();
  }
  std::uint16_t port() const noexcept override { return port_; }
  service::transport_memory memory() const noexcept override {
    const fixed_heap& heap = lws_->heap();
    return {.bytes_used = heap.bytes_used(),
            .bytes_peak = heap.bytes_peak(),
            .allocations = heap.allocations(),
            .refusals = heap.refusals() + counters_.handshakes_starved,
            .evictions = counters_.handshakes_evicted + (terminator_ ? terminator_->evictions() : 0),
            .pages_cut = counters_.pages_cut,
            .tls = terminator_ ? &terminator_->counters() : nullptr};
  }
  const socket_counters& counters() const noexcept override { return counters_; }

 private:
  epoll_transport(const socket_limits& limits, poll_set polled);
  static result<std::unique_ptr<epoll_transport>> prepare(const socket_limits& limits, lws_role role,
                                                          std::span<const std::string_view> subprotocols);

  status secure(const tls_options& files, std::string remote, std::optional<listener> from);
  template <class Read>
  void serve(Read&& read) noexcept;
  void take_news(transport_sink& sink) noexcept;
  void report_pause(transport_sink& sink) noexcept;
  void serve_connections(std::span<const socket_event> events, transport_sink& sink) noexcept;
  void serve_others(std::span<const socket_event> events, transport_sink& sink) noexcept;
  void accept_some(transport_sink& sink) noexcept;
  rt::time_point next_lws_turn() const noexcept;
  rt::time_point next_deadline() const noexcept;

  const socket_limits limits_;
  socket_counters counters_;
  std::vector<std::byte> buffer_; // one for all connections: bytes are handed on before the next are read
  poll_set polled_;
  read_pace pace_;
  bool alone_ = false; // one connection at most is readable in this turn
  descriptor waker_;
  std::unique_ptr<lws_host> lws_;
  reserved_descriptors kept_;                   // a server's, in both threads
  std::unique_ptr<tls::terminator> terminator_; // under TLS. It outlives the connections
  established connections_;
  rt::time_point now_{};
  rt::time_point lws_turn_{};

  // A server has these,
  std::uint16_t port_ = 0;
  std::optional<listener> listener_; // without TLS; else the terminator has it
  bool pause_reported_ = false;
  std::unique_ptr<policy_owner> policy_;
  std::unique_ptr<handshakes> handshakes_;
  // a client that.
  std::unique_ptr<client_attempt> attempt_;
};

epoll_transport::epoll_transport(const socket_limits& limits, poll_set polled)
    : limits_{limits},
      buffer_(std::max(limits.read_alone_bytes_max, limits.header_bytes_max) + service::tailroom_bytes),
      polled_{std::move(polled)},
      pace_{limits.read_alone_bytes_min, limits.read_alone_bytes_max},
      connections_{limits, polled_} {}

result<std::unique_ptr<epoll_transport>>
epoll_transport::prepare(const socket_limits& limits, lws_role role,
                         std::span<const std::string_view> subprotocols) {
  auto polled = poll_set::open();
  if (!polled) return polled.error();
  std::unique_ptr<epoll_transport> made{new epoll_transport{limits, std::move(*polled)}};
  made->waker_.reset(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  // Edge triggered: each write is a new event, so nobody needs to read the count.
  if (!made->waker_ || !made->polled_.add(made->waker_.get(), EPOLLIN | EPOLLET, {source::waker}))
    return errc::no_memory;
  auto lws = lws_host::open(role, subprotocols, role == lws_role::server ? limits.handshakes_max : 1,
                            limits.handshake_bytes);
  if (!lws) return lws.error();
  made->lws_ = std::move(*lws);
  return made;
}

result<std::unique_ptr<socket_transport>> epoll_transport::open(const listen_options& options) {
  if (const status good = check(options.limits); !good) return good.error();
  auto bound = listener::open(options);
  if (!bound) return bound.error();
  auto made = prepare(options.limits, lws_role::server, options.subprotocols);
  if (!made) return made.error();
  epoll_transport& one = **made;
  one.port_ = port_of(bound->address());
  one.policy_ = std::make_unique<policy_owner>(options, bound->address());
  one.handshakes_ = std::make_unique<handshakes>(one.limits_, one.policy_->policy(), one.polled_, *one.lws_,
                                                 one.connections_, one.kept_, one.counters_,
                                                 std::span<std::byte>{one.buffer_});
  const bool in_plain = options.tls.certificate.empty();
  one.kept_.keep(descriptors_reserved(options.limits, !in_plain));
  if (in_plain) {
    one.listener_ = std::move(*bound);
    if (!one.listener_->join(one.polled_)) return errc::no_memory;
  } else if (const status secured = one.secure(options.tls, {}, std::move(*bound)); !secured) {
    return secured.error();
  }
  return std::unique_ptr<socket_transport>{std::move(*made)};
}

result<std::unique_ptr<socket_transport>> epoll_transport::open(const connect_options& options) {
  if (const status good = check(options.limits); !good) return good.error();
  auto made = prepare(options.limits, lws_role::client, options.subprotocols);
  if (!made) return made.error();
  epoll_transport& one = **made;
  auto attempt = client_attempt::open(options, one.polled_, *one.lws_, one.connections_, one.counters_,
                                      std::span<std::byte>{one.buffer_}, one.waker_.get());
  if (!attempt) return attempt.error();
  one.attempt_ = std::move(*attempt);
  if (options.secure) {
    if (const status secured = one.secure(options.tls, std::string{options.host}, {}); !secured)
      return secured.error();
    one.attempt_->use(*one.terminator_);
  }
  return std::unique_ptr<socket_transport>{std::move(*made)};
}

status epoll_transport::secure(const tls_options& files, std::string remote, std::optional<listener> from) {
  auto made = tls::terminator::open(
      {.limits = limits_, .files = files, .remote = std::move(remote), .waker = waker_.get()},
      std::move(from), kept_);
  if (!made) return made.error();
  terminator_ = std::move(*made);
  connections_.use(*terminator_);
  return {};
}

void epoll_transport::poll(rt::time_point now, transport_sink& sink) noexcept {
  ++counters_.polls;
  now_ = now;
  connections_.begin_turn(now);
  if (handshakes_) handshakes_->begin_turn(now);
  connections_.report_ended(sink);

  const std::span<const socket_event> events = polled_.take();
  serve_connections(events, sink); // before strangers
  serve_others(events, sink);
  if (terminator_) take_news(sink);
  if (handshakes_) handshakes_->step(sink);

  connections_.expire(sink);
  if (handshakes_) handshakes_->expire(sink);
  if (listener_ && listener_->paused()) listener_->resume(polled_, now);
  if (attempt_) attempt_->step(now, sink);
  if (now >= next_lws_turn()) {
    ++counters_.lws_turns;
    lws_->turn();
    lws_turn_ = rt::deadline_after(now, lws_turn_period);
  }
}

// Not during an attempt: libwebsockets would read the socket's error, which we have to report.
rt::time_point epoll_transport::next_lws_turn() const noexcept {
  return attempt_ && attempt_->busy() ? rt::never : lws_turn_;
}

void epoll_transport::serve_connections(std::span<const socket_event> events, transport_sink& sink) noexcept {
  const std::span<const socket_event> held = connections_.take_held();
  const auto readable = std::count_if(events.begin(), events.end(), [](const socket_event& one) {
    return one.token.from == source::connection && (one.events & EPOLLIN);
  });
  alone_ = static_cast<std::size_t>(readable) + held.size() <= 1;
  for (const socket_event& event : events) {
    if (event.token.from != source::connection) continue;
    serve([&](std::span<std::byte> buffer) { return connections_.on_event(event, buffer, sink); });
  }
  for (const socket_event& event : held)
    serve([&](std::span<std::byte> buffer) { return connections_.read_held(event, buffer, sink); });
}

// Lets one connection be read, and measures how long that takes where the connection is alone.
template <class Read>
void epoll_transport::serve(Read&& read) noexcept {
  const std::span buffer{buffer_};
  if (!alone_) {
    (void)read(buffer.first(limits_.read_quantum_bytes));
    return;
  }
  const bool measured = pace_.measures();
  const rt::time_point begin = measured ? rt::monotonic_clock::now() : now_;
  const std::size_t bytes = read(buffer.first(pace_.bytes()));
  if (bytes != 0) pace_.note(bytes, measured ? rt::monotonic_clock::now() - begin : rt::duration{0});
}

void epoll_transport::serve_others(std::span<const socket_event> events, transport_sink& sink) noexcept {
  bool somebody_waits = false;
  for (const socket_event& event : events) {
    switch (event.token.from) {
    case source::listener: somebody_waits = true; break;
    case source::handshake: handshakes_->on_event(event); break;
    case source::attempt: attempt_->on_event(event, now_, sink); break;
    case source::connection: // served already
    case source::waker:      // its whole purpose was to end the wait
    case source::timer:
    case source::tls: // the terminator's own, as is this
    case source::pair: break;
    }
  }
  if (somebody_waits) accept_some(sink); // last: who has sent a request keeps its place
}

void epoll_transport::accept_some(transport_sink& sink) noexcept {
  for (int i = 0; i < accepts_per_turn; ++i) {
    if (handshakes_->must_wait()) return; // they are reported again in the next turn
    auto accepted = listener_->accept(polled_, kept_, now_);
    if (!accepted) break;
    ++counters_.accepted;
    const bool lent = accepted->lent;
    if (!lent) pause_reported_ = false;
    handshakes_->begin(std::move(*accepted), sink);
    if (lent && !std::exchange(pause_reported_, true)) report_pause(sink);
  }
  if (!listener_->paused()) return;
  ++counters_.accept_pauses;
  if (!std::exchange(pause_reported_, true)) report_pause(sink); // once, until somebody is accepted again
}

void epoll_transport::report_pause(transport_sink& sink) noexcept {
  sink.on_rejected({.http_status = 0,
                    .peer = {},
                    .what =
                        "only peers that come to stop can connect: this process has no file descriptor or no "
                        "memory left",
                    .remedy = "raise its limit of open files (ulimit -n) or lower connections_max"});
}

// Of the terminator: peers behind their handshake, and sessions.
void epoll_transport::take_news(transport_sink& sink) noexcept {
  for (int i = 0; i < news_per_turn; ++i) {
    const auto news = terminator_->next();
    if (!news) return;
    switch (news->what) {
    case tls::arrival::kind::newcomer:
      if (attempt_) {
        attempt_->on_secured(news->place, descriptor{news->socket}, sink);
        break;
      }
      ++counters_.accepted;
      handshakes_->begin({descriptor{news->socket}, news->peer, news->place, news->shown, news->lent}, sink);
      break;
    case tls::arrival::kind::session:
      connections_.attach(news->connection, std::unique_ptr<tls::session>{news->taken}, sink);
      break;
    case tls::arrival::kind::rejected: {
      if (attempt_ && news->place) {
        attempt_->on_not_secured(news->place, news->rejection, sink);
        break;
      }
      char address[address_text_bytes_max];
      sink.on_rejected({.http_status = news->rejection.status,
                        .peer = write_address(address, news->peer),
                        .what = news->rejection.what(),
                        .remedy = news->rejection.remedy()});
      break;
    }
    case tls::arrival::kind::warning:
      sink.on_warning(news->rejection.what(), news->rejection.remedy());
      break;
    case tls::arrival::kind::paused: ++counters_.accept_pauses; report_pause(sink);
    }
  }
}

rt::time_point epoll_transport::next_deadline() const noexcept {
  rt::time_point next = std::min(connections_.next_deadline(), next_lws_turn());
  if (handshakes_) next = std::min(next, handshakes_->next_deadline());
  if (listener_) next = std::min(next, listener_->next_deadline());
  if (attempt_) next = std::min(next, attempt_->next_deadline());
  return next;
}

void epoll_transport::wait(rt::time_point now, rt::time_point until) noexcept {
  const bool work = connections_.has_ended() || connections_.holds_input() ||
                    (handshakes_ && handshakes_->has_ready()) || (attempt_ && attempt_->asked()) ||
                    (terminator_ && terminator_->has_news());
  if (work) return; // for poll()
  const rt::time_point end = std::min(until, next_deadline());
  if (end <= now) return;
  ++counters_.waits;
  polled_.wait(now, end);
}

// Memory that cannot be had is an error like any other.
template <class Options>
result<std::unique_ptr<socket_transport>> open_transport(const Options& options) noexcept {
#if defined(__cpp_exceptions)
  try {
    return epoll_transport::open(options);
  } catch (const std::bad_alloc&) {
    return errc::no_memory;
  }
#else
  return epoll_transport::open(options);
#endif
}

} // namespace

result<std::unique_ptr<socket_transport>> socket_transport::listen(const listen_options& options) noexcept {
  return open_transport(options);
}

result<std::unique_ptr<socket_transport>> socket_transport::connect(const connect_options& options) noexcept {
  return open_transport(options);
}

} // namespace rowe::net
