// SPDX-License-Identifier: Apache-2.0
#include "memory_transport.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iterator>
#include <utility>

namespace rowe::net {

using service::close_cause;
using service::close_how;
using service::connection_id;

void memory_transport::pipe::send(std::span<const std::byte> bytes, rt::time_point arrival) {
  if (bytes.empty()) return;
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  const std::uint64_t end = forgotten_ + bytes_.size();
  last_ = std::max(last_, arrival);
  if (!batches_.empty() && batches_.back().arrival == last_) {
    batches_.back().end = end;
  } else {
    batches_.push_back({end, last_});
  }
}

std::span<const std::byte> memory_transport::pipe::arrived(rt::time_point now) const noexcept {
  const auto later = std::partition_point(batches_.begin(), batches_.end(),
                                          [&](const batch& one) { return one.arrival <= now; });
  if (later == batches_.begin()) return {};
  const auto end = static_cast<std::size_t>(std::prev(later)->end - forgotten_);
  return std::span{bytes_}.subspan(taken_, end - taken_);
}

void memory_transport::pipe::take(std::size_t bytes) noexcept {
  taken_ += bytes;
  while (!batches_.empty() && batches_.front().end <= forgotten_ + taken_) batches_.pop_front();
  if (taken_ < bytes_.size() && taken_ < 64 * 1024) return; // moving the rest costs more than it brings
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(taken_));
  forgotten_ += std::exchange(taken_, 0);
}

void memory_transport::pipe::clear() noexcept {
  bytes_.clear();
  batches_.clear();
  taken_ = 0;
}

rt::time_point memory_transport::pipe::arrival(const std::function<rt::time_point(rt::time_point)>& how,
                                               rt::time_point now) const {
  return std::max(last_, how ? how(now) : now);
}

memory_transport::memory_transport(std::uint32_t connections_max) : links_(connections_max) {}

memory_transport::link* memory_transport::find(connection_id id) noexcept {
  if (id.index >= links_.size()) return nullptr;
  link& on = links_[id.index];
  return on.state != phase::free && on.generation == id.generation ? &on : nullptr;
}

const memory_transport::link* memory_transport::find(connection_id id) const noexcept {
  return const_cast<memory_transport*>(this)->find(id);
}

connection_id memory_transport::open(service::side ours, std::string_view address, std::string_view path,
                                     std::string_view subprotocol, std::string_view token) {
  for (std::uint32_t i = 0; i < links_.size(); ++i) {
    link& on = links_[i];
    if (on.state != phase::free) continue;
    const std::uint32_t generation = on.generation + 1;
    on = link{};
    on.state = phase::opening;
    on.generation = generation;
    on.ours = ours;
    on.address = address;
    on.path = path;
    on.subprotocol = subprotocol;
    on.token = token;
    return {i, generation};
  }
  return {};
}

void memory_transport::arrive(connection_id id, std::span<const std::byte> bytes) {
  if (link* const on = find(id); on != nullptr && !on->ending) {
    on->inbound.send(bytes, on->inbound.arrival(on->conditions.to_us, now_));
  }
}

std::span<const std::byte> memory_transport::sent(connection_id id) const noexcept {
  // Also of a connection that has ended, until its place is taken again.
  if (id.index >= links_.size() || links_[id.index].generation != id.generation) return {};
  return links_[id.index].outbound.arrived(now_);
}

void memory_transport::peer_reads(connection_id id, std::size_t bytes) {
  if (id.index >= links_.size() || links_[id.index].generation != id.generation) return;
  link& on = links_[id.index];
  on.outbound.take(std::min(bytes, on.outbound.arrived(now_).size()));
}

void memory_transport::peer_closes(connection_id id, close_cause cause) {
  if (link* const on = find(id)) {
    on->ending = true;
    on->cause = cause;
    on->ends = on->inbound.arrival(on->conditions.to_us, now_);
  }
}

bool memory_transport::closed_by_us(connection_id id) const noexcept {
  const link* const on = find(id);
  return on == nullptr || on->asked;
}

void memory_transport::reject(std::string_view what) { rejections_.emplace_back(what); }

void memory_transport::poll(rt::time_point now, service::transport_sink& sink) noexcept {
  now_ = now;
  for (; !rejections_.empty(); rejections_.pop_front()) {
    sink.on_rejected({.http_status = 0, .peer = {}, .what = rejections_.front(), .remedy = {}});
  }
  for (std::uint32_t i = 0; i < links_.size(); ++i) {
    link& on = links_[i];
    const connection_id id{i, on.generation};
    if (on.state == phase::opening) {
      if (!on.admitted) {
        on.admitted.emplace();
        on.polls_left = handshake_polls_;
        if (on.ours == service::side::server)
          on.admitted = sink.admit({.address = on.address, .path = on.path, .token = on.token});
      }
      const service::admit_answer admitted = *on.admitted;
      if (admitted.status != 0) {
        on.state = phase::free;
        sink.on_rejected({.http_status = admitted.status,
                          .peer = on.address,
                          .what = admitted.what,
                          .remedy = admitted.remedy});
        continue;
      }
      if (on.polls_left != 0) {
        --on.polls_left;
        continue;
      }
      on.state = phase::open;
      sink.on_open(id, {.ours = on.ours,
                        .address = on.address,
                        .path = on.path,
                        .subprotocol = on.subprotocol,
                        .who = admitted.who});
    }
    if (on.state != phase::open) continue;
    if (on.wrote_to_none && !std::exchange(on.gone, true)) sink.on_gone(id);
    deliver(on, id, sink);
    if (on.refused && on.outbound.waiting() < on.conditions.capacity_bytes) {
      on.refused = false;
      sink.on_writable(id);
    }
    const bool drained = on.inbound.waiting() == 0;
    if (on.asked || (on.ending && on.ends <= now && (drained || on.cause == close_cause::reset))) {
      sink.on_close(id, on.asked ? close_cause::asked : on.cause);
      on.state = phase::ended;
    }
    if (on.state == phase::ended) on.state = phase::free;
  }
}

void memory_transport::deliver(link& on, connection_id id, service::transport_sink& sink) {
  std::size_t budget = on.conditions.arrive_bytes_max;
  while (budget > 0 && on.reading && !on.asked) {
    const std::span<const std::byte> there = on.inbound.arrived(now_);
    const std::size_t bytes = std::min({budget, std::max<std::size_t>(on.conditions.chunk_bytes_max, 1),
                                        there.size(), sink.wanted_bytes(id)});
    if (bytes == 0) break;
    buffer_.assign(bytes + service::tailroom_bytes, std::byte{0});
    std::memcpy(buffer_.data(), there.data(), bytes);
    on.inbound.take(bytes);
    budget -= bytes;
    sink.on_bytes(id, std::span{buffer_}.first(bytes));
  }
}

std::size_t memory_transport::write(connection_id id, std::span<const std::byte> bytes) noexcept {
  link* const on = find(id);
  if (on == nullptr || on->asked || on->state != phase::open) return 0;
  const std::size_t waiting = on->outbound.waiting();
  const std::size_t left =
      on->conditions.capacity_bytes > waiting ? on->conditions.capacity_bytes - waiting : 0;
  const std::size_t taken = std::min(left, bytes.size());
  const rt::time_point arrival = on->outbound.arrival(on->conditions.to_peer, now_);
  note("write", id, bytes.first(taken));
  on->outbound.send(bytes.first(taken), arrival);
  if (taken < bytes.size()) on->refused = true;
  if (on->ending && on->ends <= now_ && taken != 0) on->wrote_to_none = true;
  if (written) written(id, bytes, taken);
  return taken;
}

std::size_t memory_transport::write_rest(connection_id id, std::span<const std::byte> rest) noexcept {
  link* const on = find(id);
  if (on == nullptr || on->asked || on->state != phase::open) return 0;
  if (!on->refused) {
    std::fputs("write_rest() without a write() that was refused: on_writable() would not follow\n", stderr);
    std::abort();
  }
  const std::size_t bytes = std::min(rest.size(), on->conditions.rest_bytes_max);
  note("write_rest", id, rest.first(bytes));
  on->outbound.send(rest.first(bytes), on->outbound.arrival(on->conditions.to_peer, now_));
  return bytes;
}

void memory_transport::close(connection_id id, close_how how) noexcept {
  link* const on = find(id);
  if (on == nullptr) return;
  note(how == close_how::aborted ? "abort" : "close", id, {});
  on->asked = true;
  if (how == close_how::aborted) on->outbound.clear();
}

std::size_t memory_transport::send_buffer(connection_id id) const noexcept {
  const link* const on = find(id);
  return on != nullptr ? on->send_buffer : 0;
}

std::size_t memory_transport::unread(connection_id id) const noexcept {
  const link* const on = find(id);
  return on != nullptr ? on->inbound.waiting() : 0;
}

void memory_transport::limit_send_buffer(connection_id id, std::size_t bytes) noexcept {
  note("send buffer", id, std::as_bytes(std::span{&bytes, 1}));
  if (link* const on = find(id)) on->send_buffer = bytes;
}

void memory_transport::read_enabled(connection_id id, bool enabled) noexcept {
  note(enabled ? "read" : "do not read", id, {});
  if (link* const on = find(id)) on->reading = enabled;
}

// FNV-1a.
void memory_transport::note(std::string_view call, connection_id id,
                            std::span<const std::byte> bytes) noexcept {
  if (!traces_) return;
  const auto mix = [this](std::uint64_t value) { trace_ = (trace_ ^ value) * 1099511628211U; };
  for (const char each : call) mix(static_cast<unsigned char>(each));
  mix(id.index);
  mix(id.generation);
  for (const std::byte one : bytes) mix(std::to_integer<std::uint64_t>(one));
}

} // namespace rowe::net
