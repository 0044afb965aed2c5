// SPDX-License-Identifier: Apache-2.0
#include "net/tls/terminator.hpp"

#include <fcntl.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include <openssl/crypto.h>

#include "net/base/helper_thread.hpp"

namespace rowe::net::tls {

namespace {

constexpr int niceness = 10;
constexpr int accepts_per_turn = 4; // so that who has connected is heard before others push it out
constexpr rt::duration look_period = std::chrono::seconds{1};

// Each place may have a newcomer and its session under way, and the rejection of its former user.
std::size_t news_max(const socket_limits& limits) noexcept {
  return std::size_t{4} * limits.handshakes_max + 8;
}

// No more than these are alive at a time.
std::size_t requests_max(const socket_limits& limits) noexcept {
  return std::size_t{limits.connections_max} + std::size_t{4} * limits.handshakes_max + 8;
}

} // namespace

terminator::terminator(const terminator_options& options, std::optional<listener> from,
                       reserved_descriptors& kept, poll_set polled, std::shared_ptr<const context> first)
    : options_{options},
      news_places_(news_ring::places_for(news_max(options.limits))),
      request_places_(request_ring::places_for(requests_max(options.limits))),
      news_{news_places_},
      requests_{request_places_},
      news_in_{news_.take_producer()},
      news_out_{news_.take_consumer()},
      requests_in_{requests_.take_producer()},
      requests_out_{requests_.take_consumer()},
      listener_{std::move(from)},
      polled_{std::move(polled)},
      kept_{kept},
      certificates_{options.remote.empty() ? end::server : end::client, options.files, std::move(first)},
      relays_{options.limits, options.remote, certificates_, polled_, kept_, *this} {}

result<std::unique_ptr<terminator>> terminator::open(const terminator_options& options,
                                                     std::optional<listener> from,
                                                     reserved_descriptors& kept) {
  auto first = context::open(options.remote.empty() ? end::server : end::client, options.files, nullptr);
  if (!first) return errc::bad_certificate;
  auto polled = poll_set::open();
  if (!polled) return polled.error();
  std::unique_ptr<terminator> made{
      new terminator{options, std::move(from), kept, std::move(*polled), std::move(first)}};
  made->service_waker_.reset(::fcntl(options.waker, F_DUPFD_CLOEXEC, 0));
  made->waker_.reset(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  if (!made->service_waker_ || !made->waker_) return errc::no_memory;
  if (!made->polled_.add(made->waker_.get(), EPOLLIN | EPOLLET, {source::waker})) return errc::no_memory;
  if (made->listener_ && !made->listener_->join(made->polled_)) return errc::no_memory;
  if (const int failure = start_helper(made->thread_, "rowe-tls", &terminator::run, made.get()); failure != 0)
    return error{errc::no_thread, failure};
  made->started_ = true;
  return made;
}

terminator::~terminator() {
  if (!started_) return;
  ending_.store(true, std::memory_order_release); // pairs with the acquire load in serve()
  (void)::eventfd_write(waker_.get(), 1);
  ::pthread_join(thread_, nullptr);
  take_requests(); // what was given back last
  while (const auto one = news_out_->try_pop()) {
    if (one->what == arrival::kind::newcomer) ::close(one->socket);
    delete one->taken;
  }
}

// ---- the service thread

bool terminator::ask(const request& what) noexcept {
  if (!requests_in_->try_push(what)) return false;
  (void)::eventfd_write(waker_.get(), 1); // fails only if it is rung already
  return true;
}

bool terminator::connect(descriptor socket, std::uint32_t attempt) noexcept {
  if (!ask({.what = request::kind::connect, .socket = socket.get(), .attempt = attempt})) return false;
  (void)socket.release();
  return true;
}

void terminator::destroy(std::unique_ptr<session> ended) noexcept {
  if (ask({.what = request::kind::destroy, .given = ended.get()})) (void)ended.release();
}

// ---- its own thread

void* terminator::run(void* self) {
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), niceness);
  static_cast<terminator*>(self)->serve();
  OPENSSL_thread_stop();
  return nullptr;
}

void terminator::serve() {
  note_certificate();
  while (!ending_.load(std::memory_order_acquire)) { // pairs with the release store in the destructor
    now_ = rt::monotonic_clock::now();
    relays_.begin_turn(now_);
    bool somebody_waits = false;
    for (const socket_event& event : polled_.take()) {
      take_requests();
      if (event.token.from == source::listener) somebody_waits = true;
      if (event.token.from == source::tls || event.token.from == source::pair) relays_.on_event(event);
    }
    take_requests();
    if (somebody_waits) accept_some(); // last: who has sent something keeps its place
    const bool shook = relays_.shake_next();
    relays_.expire();
    if (listener_ && listener_->paused()) listener_->resume(polled_, now_);
    if (now_ >= look_at_) look_after_certificates();
    rt::time_point until = shook ? now_ : std::min(relays_.next_deadline(), look_at_); // another may wait
    if (listener_) until = std::min(until, listener_->next_deadline());
    polled_.wait(now_, until);
  }
}

void terminator::accept_some() {
  bool scarce = pause_reported_;
  for (int i = 0; i < accepts_per_turn; ++i) {
    auto accepted = listener_->accept(polled_, kept_, now_);
    if (!accepted) break;
    scarce = accepted->lent;
    relays_.accept(std::move(*accepted));
  }
  scarce = scarce || listener_->paused();
  if (scarce && !pause_reported_) (void)report({.what = arrival::kind::paused});
  pause_reported_ = scarce;
}

void terminator::look_after_certificates() {
  look_at_ = rt::deadline_after(now_, look_period);
  const auto before = certificates_.current();
  if (const auto fault = certificates_.look()) {
    counters_.add(service::counter::tls_reload_faults);
    notice("the new certificate is not used: %", fault->what, "correct %; until then the old one is in use",
           fault->file);
  }
  if (certificates_.current() != before) {
    counters_.add(service::counter::tls_reloads);
    note_certificate();
  }
  if (const int days = certificates_.days_left(std::time(nullptr)); days >= 0)
    notice("the certificate ends in % days", std::to_string(days), "renew it, and replace %",
           options_.files.certificate);
}

void terminator::note_certificate() noexcept {
  counters_.set(service::counter::tls_certificate_end,
                static_cast<std::uint64_t>(std::max<std::time_t>(certificates_.current()->ends_at(), 0)));
}

void terminator::notice(std::string_view what, std::string_view value, std::string_view remedy,
                        std::string_view remedy_value) {
  arrival news{.what = arrival::kind::warning};
  news.rejection.set(0, what, remedy, value, remedy_value);
  (void)report(news);
}

bool terminator::report(const arrival& news) noexcept {
  // Nobody waits for a rejection, so there is room left for what somebody waits for.
  const bool waited_for = news.what == arrival::kind::newcomer || news.what == arrival::kind::session;
  if (!waited_for && news_in_->room_at_least() <= news_places_.size() / 2) return false;
  if (!news_in_->try_push(news)) return false;
  (void)::eventfd_write(service_waker_.get(), 1);
  return true;
}

void terminator::note_eviction() noexcept {
  evictions_.fetch_add(1, std::memory_order_relaxed); // read by evictions()
}

void terminator::take_requests() noexcept {
  while (const auto one = requests_out_->try_pop()) carry_out(*one);
}

void terminator::carry_out(const request& one) {
  switch (one.what) {
  case request::kind::hand_over: return relays_.hand_over(one.place, one.connection);
  case request::kind::late: return relays_.answer_late(one.place);
  case request::kind::destroy:
    if (one.given->cut_by()) counters_.add(*one.given->cut_by());
    delete one.given;
    return;
  case request::kind::connect: return relays_.connect(descriptor{one.socket}, one.attempt);
  case request::kind::drop: return relays_.drop(one.place);
  }
}

} // namespace rowe::net::tls
