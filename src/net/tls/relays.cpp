// SPDX-License-Identifier: Apache-2.0
#include "net/tls/relays.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <span>
#include <string_view>
#include <utility>

#include "net/base/socket_options.hpp"
#include "net/http/handshake_answers.hpp"
#include "net/http/send_answer.hpp"
#include "wire/http/http_login.hpp"

namespace rowe::net::tls {

namespace {

// Read from a pair at once; one record.
constexpr std::size_t relayed_bytes = session::record_bytes_max;

// A connection that was lost may be held another time.
wire::http_rejection failure_of(const session& one) noexcept {
  wire::http_rejection why = answer::tls_failed(one.reason(), one.remedy());
  why.lasting = one.failed_by() != service::counter::tls_failed_lost;
  return why;
}

} // namespace

relays::relays(const socket_limits& limits, std::string remote, certificates& with, poll_set& polled,
               reserved_descriptors& kept, relay_outlet& outlet)
    : limits_{limits},
      remote_{std::move(remote)},
      with_{with},
      polled_{polled},
      kept_{kept},
      outlet_{outlet},
      relays_(remote_.empty() ? limits.handshakes_max : 1),
      opening_{remote_.empty() ? limits.header_timeout : limits.connect_timeout},
      draining_{limits.page_timeout},
      closing_{limits.close_timeout},
      late_{limits.page_timeout} {
  for (relay& one : relays_) one.header.resize(limits.header_bytes_max);
}

relays::~relays() {
  for (relay& one : relays_)
    if (one.now != phase::free) leave(one);
}

// ---- the handshake

void relays::on_event(const socket_event& event) {
  relay* const found = find({event.token.index, event.token.generation});
  if (found == nullptr) return; // left earlier in this batch
  relay& one = *found;
  const bool of_pair = event.token.from == source::pair;
  const bool lost = !of_pair && (event.events & (EPOLLERR | EPOLLHUP)) != 0;
  switch (one.now) {
  case phase::free:
  case phase::rejected: return;
  case phase::shaking:
    if (remote_.empty()) {
      one.waits = true;
      return;
    }
    return shake(one);
  case phase::reading: return read_header(one);
  case phase::relaying:
    if (lost) return leave(one);
    if (!of_pair && (event.events & EPOLLIN) != 0) read_header(one);
    if (one.now == phase::relaying) pump(one);
    return;
  case phase::draining:
    if (lost) return leave(one);
    return drain(one);
  case phase::closing:
    const ssize_t bytes = discard_input(one.secure->descriptor_number());
    if (bytes == 0 || (bytes < 0 && !would_block(errno))) leave(one);
    return;
  }
}

// OpenSSL would answer a client that does not speak TLS with an alert, or with nothing.
bool relays::speaks_tls(relay& one) {
  if (std::exchange(one.looked_at, true) || !remote_.empty()) return true;
  char first = 0;
  if (::recv(one.secure->descriptor_number(), &first, 1, MSG_PEEK | MSG_DONTWAIT) != 1)
    return true; // its handshake will find out
  if (first == answer::tls_handshake) return true;
  const auto rejection = answer::speaks_no_tls();
  send_answer(one.secure->descriptor_number(), rejection);
  fail(one, service::counter::tls_failed_plain);
  (void)report_rejected(one, rejection);
  begin_close(one);
  return false;
}

bool relays::shake_next() {
  relay* next = nullptr;
  (void)opening_.oldest_of([&](deadline_node& node) {
    auto& one = static_cast<relay&>(node);
    if (one.now == phase::shaking && one.waits && (next == nullptr || one.before < next->before)) next = &one;
    return next == &one && one.before == 0; // nobody comes before it
  });
  if (next == nullptr) return false;
  next->waits = false;
  shake(*next);
  return true;
}

void relays::shake(relay& one) {
  if (!speaks_tls(one)) return;
  switch (one.secure->shake()) {
  case session::progress::wants_read: one.of_socket = EPOLLIN; break;
  case session::progress::wants_write: one.of_socket = EPOLLOUT; break;
  case session::progress::failed:
    fail(one, one.secure->failed_by()); // counted before it is reported
    (void)report_rejected(one, failure_of(*one.secure));
    return begin_close(one); // the peer is to see the alert
  case session::progress::done:
    outlet_.count(service::counter::tls_handshakes);
    if (!remote_.empty()) return open_pair(one);
    one.now = phase::reading;
    one.of_socket = EPOLLIN;
    watch(one);
    return read_header(one); // it may have come with the end of the handshake
  }
  watch(one);
}

// ---- a relay

void relays::open_pair(relay& one) {
  int pair[2] = {-1, -1};
  const auto open = [&] {
    return ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, pair) == 0;
  };
  kept_.take_back();
  if (!open()) {
    one.lent = has_no_descriptor(errno) && (one.lent || may_lend()) && kept_.give(std::size(pair));
    if (!one.lent || !open()) {
      (void)report_rejected(one, answer::no_descriptor());
      return leave(one);
    }
  }
  one.pair.reset(pair[0]);
  descriptor theirs{pair[1]};
  const place_id id = id_of(one);
  one.of_pair = EPOLLIN;
  one.now = phase::relaying;
  if (!polled_.add(one.pair.get(), one.of_pair, {source::pair, id.index, id.generation})) return leave(one);
  if (one.header_passed) pass_header(one);
  client_certificate shown;
  shown.bytes = static_cast<std::uint8_t>(one.secure->client_name(shown.text).size());
  if (!outlet_.report({.what = arrival::kind::newcomer,
                       .place = id,
                       .socket = theirs.get(),
                       .peer = one.peer,
                       .shown = shown,
                       .lent = one.lent}))
    return leave(one);
  (void)theirs.release(); // it is the service thread's now
  one.disarm();           // which has deadlines of its own
  watch(one);
}

// Takes the header out of the session, or the whole of a form, and not a byte behind it.
void relays::read_header(relay& one) {
  while (!one.header_passed) {
    const std::span<char> room = std::span{one.header}.subspan(one.header_bytes);
    const ssize_t seen = one.secure->peek(std::as_writable_bytes(room), now_);
    if (seen < 0 && would_block(errno)) break;
    if (seen <= 0) return lose(one); // the rest will never come
    const std::size_t there = one.header_bytes + static_cast<std::size_t>(seen);
    const std::size_t end = wire::find_request_end({one.header.data(), there}, one.header_bytes);
    const std::size_t wanted = (end != 0 ? end : there) - one.header_bytes;
    if (one.secure->read(std::as_writable_bytes(room.first(wanted)), now_) != static_cast<ssize_t>(wanted))
      return leave(one);
    one.header_bytes += wanted;
    one.header_passed = end != 0 || one.header_bytes == one.header.size(); // too long: its reader says so
  }
  if (!one.header_passed) return;
  if (one.now == phase::reading) return open_pair(one);
  pass_header(one);
  watch(one);
}

// In TLS 1.3 a server looks at our certificate when the handshake is done for us. So what it says of that
// comes in place of its answer.
void relays::lose(relay& one) {
  const bool in_words = !remote_.empty() && errno == EPROTO;
  if (!in_words || !report_rejected(one, failure_of(*one.secure))) return leave(one);
  polled_.remove(one.secure->descriptor_number());
  if (one.of_pair != 0) polled_.remove(one.pair.get());
  one.of_pair = 0;
  one.now = phase::rejected;
  opening_.arm(one, now_);
}

// A local socket that is empty takes a header whole.
void relays::pass_header(relay& one) {
  (void)::send(one.pair.get(), one.header.data(), one.header_bytes, MSG_NOSIGNAL | MSG_DONTWAIT);
}

// Whether the answer is one to an upgrade. It must not be sent before there is a connection.
bool relays::sees_upgrade(relay& one) noexcept {
  constexpr std::string_view switching = "HTTP/1.1 101 ";
  constexpr std::size_t status_at = switching.find("101");
  if (one.answered || !remote_.empty()) return one.upgrades;
  std::array<char, switching.size()> begin;
  const ssize_t seen = ::recv(one.pair.get(), begin.data(), begin.size(), MSG_PEEK | MSG_DONTWAIT);
  one.answered = seen == static_cast<ssize_t>(begin.size());
  one.welcome = one.answered && begin[status_at] < '4';
  one.upgrades = one.answered && std::string_view{begin.data(), begin.size()} == switching;
  if (one.upgrades) opening_.arm(one, now_); // hand_over() follows, unless something goes wrong there
  return one.upgrades;
}

// Sends what the service thread has written.
void relays::pump(relay& one) {
  if (sees_upgrade(one)) return watch(one);
  std::array<std::byte, relayed_bytes> bytes;
  while (one.secure->flush()) {
    const ssize_t got = ::recv(one.pair.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (got < 0 && would_block(errno)) break;
    if (got <= 0) { // closed. If that was for an upgrade, then the request came before
      const place_id id = id_of(one);
      outlet_.take_requests();
      if (find(id) == &one && one.now == phase::relaying) begin_draining(one);
      return;
    }
    (void)one.secure->write(std::span{bytes}.first(static_cast<std::size_t>(got)));
  }
  if (one.secure->broken() != 0) return leave(one);
  watch(one);
}

// The answer to an upgrade goes along, sealed. So the peer hears of its connection when there is one.
void relays::seal_answer(relay& one) noexcept {
  std::array<std::byte, relayed_bytes> bytes;
  const ssize_t got = ::recv(one.pair.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (got > 0) one.secure->seal(std::span{bytes}.first(static_cast<std::size_t>(got)));
}

void relays::hand_over(place_id place, service::connection_id connection) {
  relay* const one = find(place);
  session* taken = nullptr;
  if (one != nullptr && one->now == phase::relaying) {
    seal_answer(*one);
    polled_.remove(one->secure->descriptor_number());
    if (one->secure->broken() == 0) taken = one->secure.release();
    begun_.forgive(one->peer, now_);
    leave(*one);
  }
  if (!outlet_.report({.what = arrival::kind::session, .connection = connection, .taken = taken}))
    delete taken;
}

void relays::answer_late(place_id place) noexcept {
  relay* const one = find(place);
  if (one != nullptr && one->now == phase::relaying) late_.arm(*one, now_);
}

// ---- the end

void relays::answer(relay& one, const wire::http_rejection& rejection) {
  char text[wire::http_rejection_bytes_max];
  const std::string_view written = wire::write_rejection(text, rejection);
  (void)one.secure->write(std::as_bytes(std::span{written}));
  (void)report_rejected(one, rejection);
  begin_draining(one);
}

// False: there is no room, and more of them were reported than anybody reads.
bool relays::report_rejected(const relay& one, const wire::http_rejection& rejection) {
  return outlet_.report(
      {.what = arrival::kind::rejected, .place = id_of(one), .peer = one.peer, .rejection = rejection});
}

void relays::begin_draining(relay& one) {
  if (one.pair && one.of_pair != 0) polled_.remove(one.pair.get());
  one.pair.reset();
  one.now = phase::draining;
  one.secure->finish();
  draining_.arm(one, now_);
  drain(one);
}

void relays::drain(relay& one) {
  const bool sent = one.secure->flush();
  if (sent && one.welcome) begun_.forgive(one.peer, now_);
  if (sent || one.secure->broken() != 0) return begin_close(one);
  watch(one);
}

// A socket that is closed with unread bytes sends a reset, and its peer may drop what it has not read.
void relays::begin_close(relay& one) {
  if (::shutdown(one.secure->descriptor_number(), SHUT_WR) != 0) return leave(one); // the peer was faster
  one.now = phase::closing;
  closing_.arm(one, now_);
  watch(one);
}

void relays::watch(relay& one) noexcept {
  std::uint32_t of_socket = one.of_socket;
  std::uint32_t of_pair = 0;
  const bool unsent = one.secure->holds_output();
  switch (one.now) {
  case phase::free:
  case phase::rejected: return;
  case phase::shaking: break;
  case phase::reading:
  case phase::closing: of_socket = EPOLLIN; break;
  case phase::draining: of_socket = EPOLLOUT; break;
  case phase::relaying:
    of_socket = (one.header_passed ? 0U : EPOLLIN) | (unsent ? EPOLLOUT : 0U);
    of_pair = unsent || one.upgrades ? 0U : EPOLLIN;
    break;
  }
  const place_id id = id_of(one);
  one.of_socket = of_socket;
  polled_.modify(one.secure->descriptor_number(), of_socket, {source::tls, id.index, id.generation});
  if (!one.pair || of_pair == std::exchange(one.of_pair, of_pair)) return;
  // The kernel reports a closed end even if it is asked for nothing.
  if (of_pair == 0) return polled_.remove(one.pair.get());
  if (!polled_.add(one.pair.get(), of_pair, {source::pair, id.index, id.generation})) leave(one);
}

// ---- deadlines

void relays::expire() {
  while (deadline_node* const node = opening_.take_due(now_)) {
    auto& one = static_cast<relay&>(*node);
    if (one.now == phase::reading && one.header_bytes != 0) {
      answer(one, answer::header_timed_out());
    } else {
      const bool spoke = one.looked_at || one.waits;
      fail(one, spoke ? service::counter::tls_failed_timeout : service::counter::tls_failed_silent);
      if (one.now == phase::shaking && spoke)
        (void)report_rejected(one, answer::tls_timed_out()); // who has said nothing expects nothing
      leave(one);
    }
  }
  while (deadline_node* const node = draining_.take_due(now_)) {
    auto& one = static_cast<relay&>(*node);
    reset_on_close(one.secure->descriptor_number());
    leave(one);
  }
  for (deadline_list* const list : {&closing_, &late_})
    while (deadline_node* const node = list->take_due(now_)) leave(static_cast<relay&>(*node));
}

rt::time_point relays::next_deadline() const noexcept {
  return std::min({opening_.next(), draining_.next(), closing_.next(), late_.next()});
}

} // namespace rowe::net::tls
