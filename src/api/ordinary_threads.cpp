// SPDX-License-Identifier: Apache-2.0
// endpoint::send, receive, invoke, reply and the like, for any thread: through the submission queue and the
// shared inbox.
#include <rowe/endpoint.hpp>

#include <rowe/detail/calls.hpp>
#include <rowe/detail/posting.hpp>

#include "api/endpoint_state.hpp"
#include "service/threads/shared_inbox.hpp"
#include "service/threads/submission_queue.hpp"

namespace rowe {
namespace {

using detail::endpoint_state;
using detail::entry;
using service::submission_header;

// Whether a connection is still there, as far as is known here. Errors: peer_lost, closed.
status reachable(endpoint_state& of, detail::peer_ref whom) noexcept {
  if (of.submissions().is_closed()) return errc::closed;
  return of.gone(whom) ? status{errc::peer_lost} : status{};
}

// Whether messages to it are taken, as far as is known here. Errors: those of reachable(), full.
status takes(endpoint_state& of, detail::peer_ref whom) noexcept {
  if (const status fine = reachable(of, whom); !fine) return fine;
  if (of.takes(whom)) return {};
  return error{errc::full, 0, of.submissions().slots()};
}

// Puts a request into a slot and wakes the service thread. Errors: too_big, full, closed.
result<std::uint32_t> submit(endpoint_state& to, const submission_header& header, const body& text) noexcept {
  if (text.outgrown() != 0) {
    const auto limit = static_cast<std::int64_t>(text.outgrown());
    return error{errc::too_big, limit + 1, limit}; // at least one more
  }
  auto slot = to.submissions().submit(header, text.text());
  if (slot) to.wake_service();
  return slot;
}

// Submits a request and waits for its outcome. The service thread ends it when its time is over.
status submit_and_wait(endpoint_state& to, submission_header header, const body& text) noexcept {
  header.wants_outcome = true;
  const auto slot = submit(to, header, text);
  if (!slot) return slot.error();
  if (!to.submissions().wait(*slot, rt::never)) return errc::closed; // does not happen: never has no end
  const status outcome = to.submissions().outcome(*slot);
  to.submissions().release(*slot);
  return outcome;
}

status submit_only(endpoint_state& to, const submission_header& header, const body& text) noexcept {
  const auto slot = submit(to, header, text);
  return slot ? status{} : status{slot.error()};
}

submission_header message_to(connection to, duration ttl) noexcept {
  const time_point now = rt::monotonic_clock::now();
  return {.what = entry::message,
          .peer = detail::ref_of(to),
          .stamped = now,
          .expires = detail::expiry_after(now, ttl)};
}

} // namespace

identity_name received::identity() const noexcept {
  return state_ && !state_->forked() ? state_->identity_of(from()) : identity_name{};
}

received::~received() {
  if (!state_ || state_->forked()) return;
  if (is_.reply) {
    state_->submissions().release(slot_);
  } else if (state_->inbox().release(slot_)) {
    state_->wake_service(); // a peer waits for it
  }
}

status endpoint::send(body object, duration ttl, connection to) {
  if (const status mine = usable(); !mine) return mine.error();
  if (const status fine = takes(*state_, detail::ref_of(to)); !fine) return fine.error();
  return submit_and_wait(*state_, message_to(to, ttl), object);
}

status endpoint::try_send(body object, duration ttl, connection to) {
  if (const status mine = usable(); !mine) return mine.error();
  if (const status fine = takes(*state_, detail::ref_of(to)); !fine) return fine.error();
  return submit_only(*state_, message_to(to, ttl), object);
}

status endpoint::wait_room(duration timeout, connection to) {
  if (const status mine = usable(); !mine) return mine.error();
  service::submission_queue& queue = state_->submissions();
  const detail::peer_ref whom = detail::ref_of(to);
  status known = errc::full;
  const auto ready = [&] {
    known = takes(*state_, whom);
    if (known && !queue.has_room(whom.generation == 0)) known = errc::full;
    return known || known.code() != errc::full;
  };
  if (queue.wait_room(rt::deadline_after(rt::monotonic_clock::now(), timeout), ready)) return known;
  return error{errc::timed_out, 0, timeout.count()};
}

result<received> endpoint::receive(duration timeout) {
  if (const status mine = usable(); !mine) return mine.error();
  service::shared_inbox& inbox = state_->inbox();
  const time_point now = rt::monotonic_clock::now();
  const auto slot =
      timeout == duration::zero() ? inbox.try_receive(now) : inbox.receive(rt::deadline_after(now, timeout));
  if (!slot) {
    if (slot.code() == errc::closed) return errc::closed;
    return error{errc::timed_out, 0, timeout.count()};
  }
  const service::inbound_header& header = inbox.header(*slot);
  return received{state_,
                  *slot,
                  {.text = inbox.text(*slot),
                   .peer = header.peer,
                   .call = header.call,
                   .arrived = header.stamped,
                   .expires = header.expires}};
}

result<received> endpoint::invoke(body object, duration timeout, connection to, std::string* why) {
  if (const status mine = usable(); !mine) return mine.error();
  if (const status fine = takes(*state_, detail::ref_of(to)); !fine) return fine.error();
  service::submission_queue& queue = state_->submissions();
  const time_point now = rt::monotonic_clock::now();
  const time_point deadline = rt::deadline_after(now, timeout);
  const auto slot = submit(*state_,
                           {.what = entry::invocation,
                            .wants_outcome = true,
                            .peer = detail::ref_of(to),
                            .stamped = now,
                            .expires = deadline},
                           object);
  if (!slot) return slot.error();
  if (!queue.wait(*slot, rt::deadline_after(deadline, detail::word_late_max))) {
    if (queue.is_closed()) return errc::closed;
    return error{errc::timed_out, 0, timeout.count()};
  }
  const status outcome = queue.outcome(*slot);
  const std::string_view text = queue.reply_text(*slot);
  if (outcome) {
    return received{state_, *slot, {.text = text, .arrived = rt::monotonic_clock::now(), .reply = true}};
  }
  if (why != nullptr && detail::has_diagnostic(outcome.code())) why->assign(text);
  queue.release(*slot);
  if (outcome.code() == errc::timed_out) return error{errc::timed_out, 0, timeout.count()};
  return outcome.error();
}

namespace {

// The header for an answer, if it may be sent. Errors: peer_lost, expired.
result<submission_header> answer_header(endpoint_state& of, entry what, detail::peer_ref asker,
                                        detail::call_ref call, time_point given_up, duration ttl) noexcept {
  const time_point now = rt::monotonic_clock::now();
  if (const status fine = reachable(of, asker); !fine) return fine.error();
  if (given_up <= now) return errc::expired;
  return submission_header{
      .what = what, .peer = asker, .call = call, .stamped = now, .expires = detail::expiry_after(now, ttl)};
}

} // namespace

status endpoint::reply(const received& call, body object, duration ttl) {
  if (const status mine = usable(); !mine) return mine.error();
  if (call.state_ != state_ || !call.wants_reply()) return errc::misuse;
  const auto header =
      answer_header(*state_, entry::reply, call.is_.peer, call.is_.call, call.is_.expires, ttl);
  if (!header) return header.error();
  return submit_and_wait(*state_, *header, object);
}

status endpoint::try_reply(const received& call, body object) {
  if (const status mine = usable(); !mine) return mine.error();
  if (call.state_ != state_ || !call.wants_reply()) return errc::misuse;
  const auto header =
      answer_header(*state_, entry::reply, call.is_.peer, call.is_.call, call.is_.expires, rt::for_ever);
  if (!header) return header.error();
  return submit_only(*state_, *header, object);
}

status endpoint::refuse(const received& call, std::string_view diagnostic) {
  if (const status mine = usable(); !mine) return mine.error();
  if (call.state_ != state_ || !call.wants_reply()) return errc::misuse;
  const auto header =
      answer_header(*state_, entry::refusal, call.is_.peer, call.is_.call, call.is_.expires, rt::for_ever);
  if (!header) return header.error();
  return submit_only(*state_, *header, diagnostic.substr(0, detail::diagnostic_bytes_max));
}

} // namespace rowe
