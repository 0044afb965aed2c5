// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/credit.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

namespace rowe::service {
namespace {

constexpr double growth = 1.5; // of the bound, at most, in one round trip

// A ping does not split a few messages that are written together. It goes in front of the next ones, and so
// costs no system call.
constexpr std::size_t batch_bytes = 2048;

double seconds(rt::duration time) noexcept { return std::chrono::duration<double>(time).count(); }

} // namespace

void credit::begin(std::uint64_t nonce) noexcept {
  *this = {};
  begun_ = true;
  nonce_ = nonce;
}

std::size_t credit::room(priority of) const noexcept {
  if (!begun_) return SIZE_MAX;
  const auto left = [&](std::uint64_t most, std::uint64_t of_it) {
    return static_cast<std::size_t>(most - std::min(of_it, most));
  };
  if (of == priority::urgent) return left(bound_ + least(), in_flight());
  if (settling()) return 0;
  const std::size_t within_bound = left(bound_, in_flight());
  if (pings_ != 0) return within_bound;
  return std::min(within_bound, left(ping_every_ + batch_bytes, written_ - pinged_));
}

bool credit::late(rt::time_point now) const noexcept {
  return now - under_way_[pings_ - 1U].at > 2 * round_trip_.last() + pong_late_after;
}

bool credit::wants_ping(rt::time_point now) const noexcept {
  if (!begun_ || pings_ == under_way_.size()) return false;
  if (pings_ != 0) return late(now);
  return asked_ || settling() || written_ - pinged_ >= ping_every_;
}

credit::ping_payload credit::ping(std::size_t end, rt::time_point now) noexcept {
  asked_ = false;
  pinged_ = written_ + end;
  under_way_[pings_++] = {pinged_, now};
  ping_payload payload;
  std::memcpy(payload.data(), &pinged_, sizeof pinged_);
  std::memcpy(payload.data() + sizeof pinged_, &nonce_, sizeof nonce_);
  return payload;
}

void credit::wrote(std::size_t bytes, rt::time_point now) noexcept {
  if (written_ == read_) busy_since_ = now;
  written_ += bytes;
}

bool credit::take_pong(std::span<const std::byte> payload, rt::time_point now) noexcept {
  std::uint64_t end = 0;
  std::uint64_t nonce = 0;
  if (payload.size() != ping_bytes) return false;
  std::memcpy(&end, payload.data(), sizeof end);
  std::memcpy(&nonce, payload.data() + sizeof end, sizeof nonce);
  std::uint8_t which = 0;
  while (which < pings_ && under_way_[which].end != end) ++which;
  // The peer cannot have read what was not written.
  if (which == pings_ || nonce != nonce_ || end > written_) return false;

  answered_at_ = under_way_[which].at;
  const rt::duration waited = now - answered_at_;
  // After a stall, the pongs of two pings may come at once. But reading what lies between the two took time.
  const rt::duration took = std::max(now - busy_since_, waited);
  // The first ping is sent too early to measure the peer's rate.
  if (round_trip_.known()) note_rate(end - read_, took, waited);
  read_ = end;
  busy_since_ = now;
  // Pings from before this one will not be answered any more (RFC 6455 5.5.3).
  pings_ = static_cast<std::uint8_t>(pings_ - which - 1);
  under_way_[0] = under_way_[1];
  if (settling()) held_ = false; // draining held it back, not the bound
  round_trip_.note(waited, pings_ == 0, now);
  update_bound(waited);
  return true;
}

// A fast answer to little data measures our rate, not the peer's. So does any lower rate, unless the round
// trip shows a queue. An answer to next to nothing, such as a ping that only asks whether the peer is alive,
// measures no rate at all.
void credit::note_rate(std::uint64_t bytes, rt::duration took, rt::duration waited) noexcept {
  if (bytes < rated_bytes_min && !ROWE_MUTANT(small_rate)) return;
  const double known = rates_.highest;
  double seen = static_cast<double>(bytes) / std::max(seconds(took), 1e-6);
  if (seen <= known) {
    if (waited <= round_trip_.shortest() + queue_time()) return;
    seen = std::min(known, static_cast<double>(bytes) / seconds(waited));
    // The peer is so much slower now that its old rates would count for too long.
    if (waited > 2 * (2 * round_trip_.shortest() + queue_time())) rates_.last.fill(0);
  }
  rates_.last[rates_.next] = seen;
  rates_.next = static_cast<std::uint8_t>((rates_.next + 1U) % rates_.last.size());
  rates_.highest = *std::max_element(rates_.last.begin(), rates_.last.end());
}

void credit::update_bound(rt::duration waited) noexcept {
  double bytes = rates_.highest * seconds(2 * round_trip_.shortest() + queue_time());
  // No queue at the peer, but messages wait here: the bound itself keeps the rate low.
  const bool starved = std::exchange(held_, false) && waited <= round_trip_.shortest() + queue_time() / 4;
  if (starved) bytes = std::max(bytes, growth * static_cast<double>(bound_));
  if (ROWE_MUTANT(bound_shrinks)) bytes = std::max(bytes, static_cast<double>(bound_));
  bound_ =
      static_cast<std::size_t>(std::clamp(bytes, static_cast<double>(least()), static_cast<double>(most())));
  ping_every_ = bound_ / 2;
}

std::size_t credit::send_buffer(std::size_t now) const noexcept {
  if (!low_rtt()) return ROWE_MUTANT(buffer_far) ? now : 0;
  const bool enough = bound_ <= now || (now != 0 && ROWE_MUTANT(buffer_grows)) ||
                      (now != 0 && in_flight() < now / 4); // little is written
  const bool fits = enough && (4 * bound_ > now || ROWE_MUTANT(buffer_shrinks));
  return fits ? now : std::max(std::bit_ceil(bound_), send_buffer_min);
}

} // namespace rowe::service
