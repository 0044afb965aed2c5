// SPDX-License-Identifier: Apache-2.0
#include "net/handshakes/handshakes.hpp"

#include <fcntl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <utility>

#include "net/base/socket_options.hpp"
#include "net/http/handshake_answers.hpp"
#include "net/http/send_answer.hpp"
#include "wire/http/http_login.hpp"

namespace rowe::net {

using service::transport_sink;

namespace {

constexpr std::uint16_t unauthorized = 401; // the token is not known

bool is_for_stop(const wire::http_judgement& request) noexcept {
  return request.outcome == wire::http_outcome::upgrade && request.path == service::stop_path;
}

} // namespace

handshakes::handshakes(const socket_limits& limits, const wire::handshake_policy& policy, poll_set& polled,
                       lws_host& host, established& connections, reserved_descriptors& kept,
                       socket_counters& counters, std::span<std::byte> scratch)
    : limits_{limits},
      policy_{policy},
      polled_{polled},
      host_{host},
      connections_{connections},
      kept_{kept},
      counters_{counters},
      scratch_{scratch},
      handshakes_(limits.handshakes_max),
      header_{limits.header_timeout},
      waiting_{service::page_wait_max},
      page_{limits.page_timeout},
      body_{service::long_body_step_max},
      closing_{limits.close_timeout} {
  ready_.reserve(limits.handshakes_max);
}

handshakes::~handshakes() {
  for (handshake& one : handshakes_) {
    one.body = {}; // its source may be gone
    if (one.now != phase::free) leave(one);
  }
}

void handshakes::begin(accepted_socket accepted, transport_sink& sink) noexcept {
  const bool crowded = too_many_from(accepted.peer);
  const std::uint32_t before = begun_.note(accepted.peer, now_);
  handshake* one = place(accepted, crowded, before);
  const bool beyond = crowded && !accepted.lent && one == nullptr;
  if (beyond) one = free_or_closing(); // to be rejected in good order
  if (!one) {
    // There is no place for an orderly end, so a reset may destroy this answer.
    ++counters_.handshakes_cut;
    const auto rejection = answer::too_many_handshakes(limits_.handshakes_max);
    send_answer(accepted.socket.get(), rejection);
    ::shutdown(accepted.socket.get(), SHUT_WR);
    return report(accepted.peer, rejection, sink);
  }
  if (++one->generation == 0) one->generation = 1;
  one->socket = std::move(accepted.socket);
  one->peer = accepted.peer;
  one->place = accepted.place;
  one->shown = accepted.shown;
  one->watch = {};
  one->scanned = 0;
  one->events = 0;
  one->turn = turn_;
  one->before = before;
  one->welcome = false;
  one->writable_in = 0;
  one->looked_at = false;
  one->crowded = crowded;
  one->lent = accepted.lent;
  const auto index = static_cast<std::uint32_t>(one - handshakes_.data());
  send_at_once(one->socket.get());
  if (!polled_.add(one->socket.get(), EPOLLIN | EPOLLRDHUP | EPOLLET,
                   {source::handshake, index, one->generation}))
    return one->socket.reset(); // the kernel is out of memory for watches
  one->now = phase::header;
  header_.arm(*one, now_);
  if (beyond) reject(*one, answer::too_many_from_one_address(limits_.connections_per_address_max), sink);
}

service::credentials handshakes::shown_by(const handshake& one, const wire::http_judgement& request,
                                          std::span<char> address) noexcept {
  return {.address = write_address(address, one.peer),
          .path = request.path,
          .token = request.token,
          .in_url = request.token_in_url,
          .certificate = one.shown.name()};
}

// ---- phases

// Moves on to `page` or `closing`.
void handshakes::enter(handshake& one, phase next, deadline_list& deadlines, std::uint32_t events) noexcept {
  if (is_page(one.now)) --pages_;
  if (is_page(next)) ++pages_;
  if (next == phase::closing) end_body(one);
  unqueue(one);
  one.now = next;
  deadlines.arm(one, now_);
  const auto index = static_cast<std::uint32_t>(&one - handshakes_.data());
  polled_.modify(one.socket.get(), events, {source::handshake, index, one.generation});
}

// Frees the place. The socket is closed unless a connection has taken it.
void handshakes::leave(handshake& one) noexcept {
  if (is_page(one.now)) --pages_;
  end_body(one);
  host_.let_go(one.watch);
  unqueue(one);
  one.disarm();
  one.now = phase::free;
  if (!one.socket) return;
  polled_.remove(one.socket.get());
  one.socket.reset();
}

void handshakes::begin_close(handshake& one) noexcept {
  if (std::exchange(one.welcome, false)) begun_.forgive(one.peer, now_);
  ::shutdown(one.socket.get(), SHUT_WR); // libwebsockets may have done so already
  enter(one, phase::closing, closing_, EPOLLIN);
}

void handshakes::on_event(const socket_event& event) noexcept {
  handshake& one = handshakes_[event.token.index];
  if (one.generation != event.token.generation) return; // left earlier in this batch
  switch (one.now) {
  case phase::free: return;
  case phase::header:
    if (one.events == 0) ready_.push_back(event.token.index);
    one.events |= event.events;
    return;
  case phase::waiting:
    if (event.events & (EPOLLERR | EPOLLHUP)) leave(one);
    return;
  case phase::page:
  case phase::body:
    if (event.events & (EPOLLERR | EPOLLHUP)) return leave(one);
    one.writable_in = turn_;
    any_writable_ = true;
    return;
  case phase::closing:
    const ssize_t bytes = discard_input(one.socket.get());
    if (bytes == 0 || (bytes < 0 && errno != EAGAIN && errno != EINTR)) leave(one);
    return;
  }
}

// In every other turn pages that wait come first: whoever asks again and again keeps none of them waiting.
void handshakes::step(transport_sink& sink) noexcept {
  drive_next();
  if ((turn_ % 2 == 0 || ready_.empty()) && answer_waiting(sink)) return;
  if (ready_.empty()) return;
  handshake& one = handshakes_[ready_.front()];
  const std::uint32_t events = one.events;
  unqueue(one);
  read_header(one, events, sink);
}

void handshakes::unqueue(handshake& one) noexcept {
  if (std::exchange(one.events, 0) == 0) return;
  std::erase(ready_, static_cast<std::uint32_t>(&one - handshakes_.data()));
}

// ---- requests

void handshakes::read_header(handshake& one, std::uint32_t events, transport_sink& sink) noexcept {
  auto* text = reinterpret_cast<char*>(scratch_.data());
  const ssize_t peeked = ::recv(one.socket.get(), text, limits_.header_bytes_max, MSG_PEEK | MSG_DONTWAIT);
  if (peeked < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (peeked <= 0) return leave(one);
  const std::string_view seen{text, static_cast<std::size_t>(peeked)};
  if (seen.front() == answer::tls_handshake) return reject_tls(one, sink);
  const std::size_t end = wire::find_request_end(seen, one.scanned);
  if (end == 0) {
    if (seen.size() == limits_.header_bytes_max)
      return reject(one, answer::header_too_large(limits_.header_bytes_max), sink);
    if (events & (EPOLLRDHUP | EPOLLHUP | EPOLLERR)) return leave(one); // the rest will never come
    one.scanned = static_cast<std::uint32_t>(seen.size());
    one.looked_at = true;
    return;
  }
  const ssize_t taken = ::recv(one.socket.get(), text, end, MSG_DONTWAIT);
  if (taken != static_cast<ssize_t>(end)) return leave(one); // reset in between
  const wire::http_judgement judgement = wire::judge_request(seen.substr(0, end), policy_);
  if (judgement.outcome != wire::http_outcome::rejected && !is_for_stop(judgement)) {
    if (one.lent) return reject(one, answer::no_descriptor(), sink);
    if (one.crowded)
      return reject(one, answer::too_many_from_one_address(limits_.connections_per_address_max), sink);
  }
  switch (judgement.outcome) {
  case wire::http_outcome::rejected: return reject(one, judgement.rejection, sink);
  case wire::http_outcome::page: return serve(one, judgement, sink);
  case wire::http_outcome::upgrade: return upgrade(one, judgement, sink);
  case wire::http_outcome::form: return answer_form(one, judgement, sink);
  }
}

// Gives libwebsockets a duplicate of the socket, and the request as we write it anew, without its path, which
// we answer ourselves. So of what a stranger wrote it parses only a host, a key and an ETag, and all of them
// were checked.
void handshakes::hand_over(handshake& one, const wire::http_judgement& request,
                           const service::http_answer* answer) noexcept {
  char text[wire::http_clean_bytes_max];
  kept_.take_back();
  descriptor duplicate{::fcntl(one.socket.get(), F_DUPFD_CLOEXEC, 0)};
  if (!duplicate && has_no_descriptor(errno) && is_for_stop(request) && kept_.give())
    duplicate.reset(::fcntl(one.socket.get(), F_DUPFD_CLOEXEC, 0));
  wire::http_judgement pathless = request;
  pathless.target = "/";
  const std::string_view clean = wire::write_clean_request(text, pathless);
  if (!duplicate || clean.empty()) return;
  one.watch.judgement = &request;
  one.watch.answer = answer;
  host_.adopt(one.watch, std::move(duplicate), clean);
  one.watch.judgement = nullptr;
  one.watch.answer = nullptr;
}

// libwebsockets sees nothing of it.
void handshakes::answer_form(handshake& one, const wire::http_judgement& form,
                             transport_sink& sink) noexcept {
  char typed[wire::form_bytes_max];
  char address[address_text_bytes_max];
  wire::http_judgement shown = form;
  if (form.path == wire::login_path) {
    shown.token = wire::token_of_form(typed, form.form);
    service::credentials by = shown_by(one, shown, address);
    by.typed_in = true;
    const service::admit_answer known = sink.may_read(by);
    if (known.status != 0) return refuse(one, known, shown, sink);
  }
  char text[wire::login_answer_bytes_max];
  one.welcome = true;
  send_answer(one.socket.get(), wire::write_login_answer(text, form, shown.token, policy_));
  begin_close(one);
}

void handshakes::upgrade(handshake& one, const wire::http_judgement& request, transport_sink& sink) noexcept {
  char address[address_text_bytes_max];
  const service::admit_answer admitted = sink.admit(shown_by(one, request, address));
  if (admitted.status != 0) return refuse(one, admitted, request, sink);
  const bool for_stop = is_for_stop(request);
  if (for_stop && !connections_.make_room_for_stop(one.peer, one.lent, sink))
    return reject(one, answer::no_place_for_stop(), sink);
  if (!for_stop && connections_.full())
    return reject(one, answer::too_many_connections(connections_.ordinary_max()), sink);
  do {
    hand_over(one, request, nullptr);
  } while (for_stop && one.watch.starved && end_oldest_page()); // the memory of pages that are not read
  if (one.watch.duplicate < 0) return reject(one, answer::no_descriptor(), sink);
  if (one.watch.starved) return starve(one, sink);
  if (!one.watch.established) return reject(one, answer::upgrade_not_answered(), sink);
  const socket_address peer = one.peer;
  const auto why = for_stop ? established::purpose::stop : established::purpose::any;
  const service::connection_id id = one.place ? connections_.open(one.place, peer, why, one.lent)
                                              : connections_.open(std::move(one.socket), peer, why, one.lent);
  begun_.forgive(peer, now_);
  leave(one);
  ++counters_.opened;
  sink.on_open(id, {.ours = service::side::server,
                    .address = write_address(address, peer),
                    .path = request.path,
                    .subprotocol = request.subprotocol,
                    .who = admitted.who});
}

// ---- rejections

// A slow answer waits without a place.
void handshakes::refuse(handshake& one, const service::admit_answer& why, const wire::http_judgement& request,
                        transport_sink& sink) noexcept {
  const bool by_token = why.status == unauthorized && !request.token.empty();
  if (!by_token || !tries_.note_wrong(one.peer, now_))
    return reject(one, answer::not_admitted(why, request), sink);
  ++counters_.handshakes_slowed;
  report(one.peer, answer::too_many_wrong_tokens(), sink);
  polled_.remove(one.socket.get());
  connections_.answer_late(one.place);
  tries_.answer_late(std::move(one.socket), now_);
  leave(one);
}

void handshakes::starve(handshake& one, transport_sink& sink) noexcept {
  ++counters_.handshakes_starved;
  reject(one, answer::no_memory(), sink);
}

void handshakes::reject(handshake& one, const wire::http_rejection& rejection,
                        transport_sink& sink) noexcept {
  one.welcome = false;
  send_answer(one.socket.get(), rejection);
  begin_close(one);
  report(one.peer, rejection, sink);
}

void handshakes::reject_tls(handshake& one, transport_sink& sink) noexcept {
  send_answer(one.socket.get(), answer::tls_alert);
  begin_close(one);
  report(one.peer, answer::speaks_tls(), sink);
}

void handshakes::report(const socket_address& peer, const wire::http_rejection& rejection,
                        transport_sink& sink) noexcept {
  char address[address_text_bytes_max];
  sink.on_rejected({.http_status = rejection.status,
                    .peer = write_address(address, peer),
                    .what = rejection.what(),
                    .remedy = rejection.remedy()});
}

// ---- deadlines

void handshakes::expire(transport_sink& sink) noexcept {
  tries_.expire(now_);
  while (deadline_node* node = header_.take_due(now_)) {
    auto& one = static_cast<handshake&>(*node);
    // Browsers open sockets in advance and send nothing on them. That is no failed handshake.
    if (one.scanned == 0)
      leave(one);
    else
      reject(one, answer::header_timed_out(), sink);
  }
  while (deadline_node* node = page_.take_due(now_)) {
    auto& one = static_cast<handshake&>(*node);
    reset_on_close(one.socket.get());
    leave(one);
  }
  expire_bodies();
  while (deadline_node* node = closing_.take_due(now_)) leave(static_cast<handshake&>(*node));
}

rt::time_point handshakes::next_deadline() const noexcept {
  return std::min(
      {header_.next(), waiting_.next(), page_.next(), body_.next(), closing_.next(), tries_.next()});
}

} // namespace rowe::net
