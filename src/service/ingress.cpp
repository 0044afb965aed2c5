// SPDX-License-Identifier: Apache-2.0
#include "service/ingress.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <iterator>
#include <utility>

#include "json/reader.hpp"

namespace rowe::service {
namespace {

// Work of one cycle: a message counts as one, and so does each kilobyte of it and of what is composed for it.
// About 100 us on a fast core.
constexpr std::size_t work_per_cycle = 100;
constexpr std::uint32_t stops_ahead_max = 64; // carried out in one cycle before their turn
constexpr std::size_t work_of(std::size_t bytes) noexcept { return 1 + bytes / 1024; }

constexpr std::size_t tailroom_bytes = transport_sink::tailroom_bytes;
// What one read of a peer takes, when others want to be read too.
constexpr std::size_t staging_bytes = transport_sink::read_bytes_in_turn + tailroom_bytes;

std::size_t assembly_bytes(const limits& bounds) noexcept {
  return bounds.message_bytes_max + tailroom_bytes;
}

// How much of a message is looked at, and how long the frame of a stop is.
constexpr std::size_t look_bytes = 160;
constexpr std::size_t stop_frame_bytes_max = transport_sink::read_bytes_in_turn;

} // namespace

std::size_t ingress::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return arena::bytes_for<input>(bounds.connections_max) +
         bounds.connections_max *
             (arena::bytes_for(assembly_bytes(bounds)) + arena::bytes_for(staging_bytes)) +
         2 * arena::bytes_for<peer_index>(bounds.connections_max);
}

ingress::ingress(rt::arena& memory, const limits& bounds, const needs& parts) noexcept
    : bounds_{bounds},
      cycle_{parts.cycle},
      counts_{parts.counts},
      peers_{parts.peers},
      carrier_{parts.carrier},
      out_{parts.out},
      writer_{parts.writer},
      inbox_{parts.inbox},
      handler_{parts.handler},
      inputs_{memory.carve<input>(bounds.connections_max)},
      backlog_{memory.carve<peer_index>(bounds.connections_max)},
      parked_{memory.carve<peer_index>(bounds.connections_max)} {
  for (input& of : inputs_) {
    of.staging = memory.carve_bytes(staging_bytes);
    of.assembly = memory.carve_bytes(assembly_bytes(bounds));
  }
}

// ---- who is there

void ingress::open(peer_index peer) noexcept {
  input& of = inputs_[peer];
  input fresh;
  fresh.assembly = of.assembly;
  fresh.staging = of.staging;
  fresh.in_ring = of.in_ring; // the ring may still have its place from before
  of = fresh;
  of.parser.reset(peers_[peer].ours == side::server ? wire::role::server : wire::role::client,
                  {.message_bytes_max = bounds_.message_bytes_max,
                   .fragments_max = bounds_.fragments_max,
                   .unmasked_accepted = peers_[peer].protocol->can.unmasked_accepted},
                  of.assembly.first(bounds_.message_bytes_max));
}

void ingress::forget(peer_index peer) noexcept {
  if (inputs_[peer].parked()) counts_.add(counter::inbox_full);
  end_backlog(peer);
}

// ---- reading

// More than a peer's own room is wanted only where it may lie behind what the parser has assembled, and
// assembles meanwhile: keep_backlog().
std::size_t ingress::wanted_bytes(peer_index peer) const noexcept {
  const input& of = inputs_[peer];
  if (!of.backlog.empty() || of.parked()) return 0;
  const std::size_t room = bounds_.message_bytes_max - of.parser.assembled_bytes();
  return room >= 2 * transport_sink::read_bytes_alone ? transport_sink::read_bytes_alone
                                                      : transport_sink::read_bytes_in_turn;
}

void ingress::receive(peer_index peer, std::span<std::byte> bytes) noexcept {
  input& of = inputs_[peer];
  if (bytes.size() > of.staging.size() - tailroom_bytes) return read_alone(peer, bytes);
  assert(of.backlog.empty() && !of.parked());
  std::memcpy(of.staging.data(), bytes.data(), bytes.size());
  of.backlog = of.staging.first(bytes.size());
  take_stops(peer);
  take_turn(peer);
}

void ingress::read_alone(peer_index peer, std::span<std::byte> bytes) noexcept {
  input& of = inputs_[peer];
  lent_ = bytes;
  of.backlog = bytes;
  // What waits may go where messages are assembled, so not in the middle of one that came in pieces.
  std::size_t work = 0;
  const auto ends_here = [&] { return work >= work_per_cycle && !of.parser.mid_message(); };
  while (!of.backlog.empty() && !of.parked() && !ends_here()) work += read_one(peer);
  const bool waits = !of.backlog.empty() || of.parked();
  if (waits) keep_backlog(of);
  lent_ = {};
  if (!waits) return;
  take_stops(peer);
  take_turn(peer);
}

// What was read into the transport's own memory, from the message on that waits. Where that is too much for
// the peer's own, it goes to the end of what messages are assembled in: of those that follow, so much at most
// lies in front of it before it is read (wanted_bytes()).
void ingress::keep_backlog(input& of) noexcept {
  const bool with_text = of.parked_text >= lent_.data() && of.parked_text < of.backlog.data();
  const std::byte* const from = with_text ? of.parked_text : of.backlog.data(); // else: in the assembly
  const auto bytes = static_cast<std::size_t>(lent_.data() + lent_.size() - from);
  const bool fits = bytes <= of.staging.size() - tailroom_bytes;
  const auto into =
      fits ? of.staging.first(bytes) : of.assembly.subspan(bounds_.message_bytes_max - bytes, bytes);
  if (bytes != 0) std::memcpy(into.data(), from, bytes);
  of.backlog = into.last(of.backlog.size());
  if (with_text) of.parked_text = into.data();
}

// Nothing of it is left.
inline void ingress::end_backlog(peer_index peer) noexcept {
  input& of = inputs_[peer];
  of.backlog = {};
  of.parked_text = nullptr;
  connection& c = peers_[peer];
  if (!std::exchange(c.unheard, false)) return;
  c.heard_at = c.unheard_until = cycle_.now;
  carrier_.read_enabled(c.id, true);
}

// ---- parking

void ingress::park(peer_index peer) noexcept {
  inputs_[peer].parked_text = current_text_.data();
  inputs_[peer].parked_bytes = static_cast<std::uint32_t>(current_text_.size());
  unparked_at_ = UINT64_MAX; // looked at once more: something may have been taken meanwhile
  if (std::exchange(peers_[peer].unheard, true)) return;
  carrier_.read_enabled(peers_[peer].id, false);
  writer_.ignore_credit(peer);
}

void ingress::look_at_parked() noexcept {
  inbox_.look();
  if (std::exchange(unparked_at_, changes()) == changes()) return;
  for (std::uint32_t left = parked_.count(); left != 0; --left) {
    const peer_index peer = parked_.pop();
    const bool waits = peers_[peer].open() && inputs_[peer].parked();
    (waits && inbox_.admit(peer) == admission::later ? parked_ : backlog_).push(peer);
  }
}

// ---- turns

inline void ingress::take_turn(peer_index peer) noexcept {
  input& of = inputs_[peer];
  if (of.in_ring) return;
  if (of.backlog.empty() && !of.parked()) return end_backlog(peer);
  of.in_ring = true;
  (of.parked() ? parked_ : backlog_).push(peer);
}

// One message, or what there is of it; returns the work it was.
inline std::size_t ingress::read_one(peer_index peer) noexcept {
  input& of = inputs_[peer];
  if (!peers_[peer].open()) {
    end_backlog(peer);
    return 0;
  }
  cycle_.work_bytes = 0;
  if (of.parked()) {
    current_text_ = {std::exchange(of.parked_text, nullptr), of.parked_bytes};
    handler_.handle_again(peer, current_text_);
    return work_of(of.parked_bytes + cycle_.work_bytes);
  }
  const wire::frame_step step = of.parser.next(of.backlog);
  of.backlog = of.backlog.subspan(step.consumed);
  current_text_ = step.payload;
  const bool ends_message = step.event == wire::frame_event::text || step.event == wire::frame_event::binary;
  if (ends_message) of.message_began_at = rt::never;
  if (step.event != wire::frame_event::need_more) handler_.handle(peer, step);
  if (!of.parser.mid_message()) {
    of.message_began_at = rt::never;
  } else if (of.message_began_at == rt::never) {
    of.message_began_at = cycle_.now;
  }
  return work_of(step.payload.size() + cycle_.work_bytes);
}

void ingress::read_backlogs() noexcept {
  for (std::size_t work = 0; !backlog_.empty() && work < work_per_cycle;) {
    const peer_index peer = backlog_.pop();
    inputs_[peer].in_ring = false;
    work += read_one(peer);
    take_turn(peer);
  }
}

// ---- stops

// Carries out the stops among what was read, and takes them out: what stands before a stop, of its own peer
// too, waits for its turn, and so does what only looks like one. A text that claims to be a stop and is none
// has cost one reading more than its turn will; until more is read nothing else of its peer is looked at, so
// that nobody pays for it. The first stop of each peer is carried out, and stops_ahead_max more of all; the
// others change nothing. A stop whose service or topic stands further behind, that is longer, or that came
// in pieces, waits for its turn.
inline void ingress::take_stops(peer_index peer) noexcept {
  if (!handler_.stop_in_use()) return;
  input& of = inputs_[peer];
  const std::span<std::byte> all = of.backlog;
  const auto begun = of.parser.look_ahead(all);
  if (!begun || begun->rest >= all.size()) return;
  bool in_message = begun->in_message;
  std::size_t kept = begun->rest; // the end of what stays; from `at` on nothing was looked at
  std::size_t at = kept;
  const auto keep = [&](std::size_t bytes) {
    if (kept != at) std::memmove(all.data() + kept, all.data() + at, bytes);
    kept += bytes;
    at += bytes;
  };
  for (bool first = true; at < all.size() && peers_[peer].open();) {
    const auto frame = all.subspan(at);
    const std::size_t bytes = wire::whole_frame_bytes(frame);
    const wire::opcode what = wire::opcode_of(frame[0]);
    if (bytes == 0 || what == wire::opcode::close) break;
    const bool begins = wire::is_data(what) && what != wire::opcode::continuation;
    if (wire::is_data(what) && begins == in_message) break; // against the protocol: in its turn
    if (wire::is_data(what)) in_message = !wire::is_final(frame[0]);
    std::array<char, look_bytes> room;
    const bool may_stop =
        begins && bytes <= stop_frame_bytes_max && (first || stops_ahead_ < stops_ahead_max);
    if (!may_stop || !peers_[peer].protocol->reads.may_be_stop(
                         wire::look_at_text(frame, std::as_writable_bytes(std::span{room})))) {
      keep(bytes);
    } else if (take_if_stop(peer, frame.first(bytes))) {
      at += bytes;
      first = false;
      ++stops_ahead_;
    } else {
      break;
    }
  }
  keep(all.size() - at);
  of.backlog = all.first(kept);
}

// A text in a whole frame, where it is a request to stop; false, and nothing was done, where it is not. The
// frame stays as it came.
bool ingress::take_if_stop(peer_index peer, std::span<const std::byte> frame) noexcept {
  std::array<std::byte, stop_frame_bytes_max + tailroom_bytes> room;
  std::memcpy(room.data(), frame.data(), frame.size());
  std::memset(room.data() + frame.size(), 0, tailroom_bytes);
  wire::frame_parser alone = inputs_[peer].parser.anew();
  const wire::frame_step step = alone.next(std::span{room}.first(frame.size()));
  const bool stops =
      step.event == wire::frame_event::text &&
      handler_.is_stop(peer, {reinterpret_cast<const char*>(step.payload.data()), step.payload.size()});
  if (stops) handler_.handle(peer, step); // within the rate of its peer, like all that it says
  return stops;
}

// ---- for tests

// Who is parked is not read; who has something stands in one ring, once.
bool ingress::check() const noexcept {
  std::uint32_t in_rings = 0;
  for (const peer_index i : peers_.ids()) {
    const input& of = inputs_[i];
    in_rings += of.in_ring;
    if (peers_[i].state == connection::phase::free) continue;
    if (of.parked() && (!of.in_ring || !peers_[i].unheard)) return false;
    if (!of.backlog.empty() && !of.in_ring) return false;
  }
  return in_rings == backlog_.count() + parked_.count();
}

} // namespace rowe::service
