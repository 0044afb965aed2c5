// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/ingress.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <utility>

#include "json/reading/reader.hpp"

namespace rowe::service {
namespace {

std::size_t work_of(std::size_t frames, std::size_t bytes) noexcept {
  return ROWE_MUTANT(turn_budget) ? 0 : frames + bytes / read_work_bytes;
}

} // namespace

std::size_t ingress::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return arena::bytes_for<input>(bounds.connections_max) +
         bounds.connections_max *
             (arena::bytes_for(bounds.message_bytes_max + tailroom_bytes) + arena::bytes_for(staging_bytes)) +
         turns::footprint_bytes(bounds) + arena::bytes_for<peer_index>(bounds.connections_max);
}

ingress::ingress(rt::arena& memory, const ingress_needs& parts) noexcept
    : ingress_needs{parts},
      inputs_{memory.carve<input>(state_.bounds().connections_max)},
      turns_{memory, state_.bounds()},
      parked_{memory.carve<peer_index>(state_.bounds().connections_max)} {
  for (input& of : inputs_) {
    of.staging = memory.carve_bytes(staging_bytes);
    of.assembly = memory.carve_bytes(state_.bounds().message_bytes_max + tailroom_bytes);
  }
}

// ---- peers

void ingress::open(peer_index peer) noexcept {
  input& of = inputs_[peer];
  input fresh;
  fresh.assembly = of.assembly;
  fresh.staging = of.staging;
  fresh.in_ring = of.in_ring; // the ring may still have its place from before
  of = fresh;
  turns_.open(peer);
  of.parser.reset(state_.peers[peer].ours == side::server ? wire::role::server : wire::role::client,
                  {.message_bytes_max = state_.bounds().message_bytes_max,
                   .long_bytes_max = state_.peers[peer].stop_only ? 0 : state_.chunks.text_bytes_max(),
                   .fragments_max = state_.bounds().fragments_max,
                   .unmasked_accepted = state_.peers[peer].protocol->can.unmasked_accepted},
                  of.assembly.first(state_.bounds().message_bytes_max));
}

void ingress::forget(peer_index peer) noexcept {
  if (parked(peer)) state_.counts.add(counter::inbox_full);
  end_backlog(peer);
}

// ---- reading

// The rest of a large read must fit into the assembly buffer, behind the fragments that are assembled there
// (keep_backlog()). It is in front of its peer's next stop, so after one the next read is small.
std::size_t ingress::wanted_bytes(peer_index peer) const noexcept {
  const input& of = inputs_[peer];
  if (!of.backlog.empty() || of.parked()) return 0;
  const std::size_t left =
      state_.bounds().message_bytes_max - (ROWE_MUTANT(assembly_room) ? 0 : of.parser.assembled_bytes());
  const bool little = of.left_backlog && !ROWE_MUTANT(read_amount);
  const auto most = little ? transport_sink::read_bytes_alone_min : transport_sink::read_bytes_alone_max;
  return std::clamp(left / 2, transport_sink::read_bytes_in_turn, most);
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
  std::size_t work = 0;
  while ((of.goes_on || (!of.backlog.empty() && !of.parked())) && work < read_work_per_cycle)
    work += read_one(peer);
  turns_.charge(peer, work);
  of.left_backlog = !of.backlog.empty() || of.parked();
  if (of.left_backlog) keep_backlog(of);
  lent_ = {};
  if (!of.left_backlog) return;
  take_stops(peer);
  take_turn(peer);
}

// Stores what is left of a read into the transport's own memory, from the parked message on. If that exceeds
// the peer's staging buffer, it goes to the end of the assembly buffer. Messages that are assembled meanwhile
// do not reach that far before it is read (wanted_bytes()).
void ingress::keep_backlog(input& of) noexcept {
  const bool with_text = of.parked_text >= lent_.data() && of.parked_text < of.backlog.data();
  const std::byte* const from = with_text ? of.parked_text : of.backlog.data(); // else: in the assembly
  const auto bytes = static_cast<std::size_t>(lent_.data() + lent_.size() - from);
  const bool fits = bytes <= of.staging.size() - tailroom_bytes;
  const auto into =
      fits ? of.staging.first(bytes) : of.assembly.subspan(state_.bounds().message_bytes_max - bytes, bytes);
  if (bytes != 0) std::memcpy(into.data(), from, bytes);
  of.backlog = into.last(of.backlog.size());
  if (with_text) of.parked_text = into.data();
}

// The whole backlog is carried out; the peer is read again.
inline void ingress::end_backlog(peer_index peer) noexcept {
  input& of = inputs_[peer];
  of.backlog = {};
  of.parked_text = nullptr;
  of.goes_on = false;
  connection& c = state_.peers[peer];
  if (!std::exchange(c.unheard, false)) return;
  c.heard_at = c.unheard_until = state_.cycle.now;
  state_.seams.transport.read_enabled(c.id, true);
}

// ---- parking

inline void ingress::keep_current(peer_index peer) noexcept {
  inputs_[peer].parked_text = current_text_.data();
  inputs_[peer].parked_bytes = static_cast<std::uint32_t>(current_text_.size());
  inputs_[peer].parked_binary = current_binary_;
}

void ingress::go_on(peer_index peer) noexcept {
  keep_current(peer);
  inputs_[peer].goes_on = true;
}

void ingress::park(peer_index peer) noexcept {
  keep_current(peer);
  unparked_at_ = UINT64_MAX; // try once more: a slot may have been released meanwhile
  if (std::exchange(state_.peers[peer].unheard, true)) return;
  state_.seams.transport.read_enabled(state_.peers[peer].id, false);
  sender_.ignore_credit(peer);
}

void ingress::look_at_parked() noexcept {
  receiver_.look();
  if (std::exchange(unparked_at_, changes()) == changes()) return;
  for (std::uint32_t left = parked_.count(); left != 0; --left) {
    const peer_index peer = parked_.pop();
    const bool waits = state_.peers[peer].open() && inputs_[peer].parked();
    waits&& receiver_.admit(peer) == admission::later ? parked_.push(peer) : turns_.push(peer);
  }
}

// ---- turns

inline void ingress::take_turn(peer_index peer) noexcept {
  input& of = inputs_[peer];
  if (of.in_ring) return;
  if (of.backlog.empty() && !of.parked()) return end_backlog(peer);
  of.in_ring = true;
  of.parked() && !of.goes_on ? parked_.push(peer) : turns_.push(peer);
}

// Carries out one message, or the part of it that was read. Returns its work.
inline std::size_t ingress::read_one(peer_index peer) noexcept {
  input& of = inputs_[peer];
  if (!state_.peers[peer].open()) {
    end_backlog(peer);
    return 0;
  }
  state_.cycle.work_bytes = 0;
  if (of.parked()) {
    current_text_ = {std::exchange(of.parked_text, nullptr), of.parked_bytes};
    current_binary_ = of.parked_binary;
    const std::size_t bytes = std::exchange(of.goes_on, false) ? 0 : of.parked_bytes; // it was read once
    frame_handler_.handle_again(peer, current_text_, current_binary_);
    return work_of(1, bytes + state_.cycle.work_bytes);
  }
  const wire::frame_step step = of.parser.next(of.backlog);
  of.backlog = of.backlog.subspan(step.consumed);
  current_text_ = step.payload;
  current_binary_ = step.event == wire::frame_event::binary;
  const bool ends_message = step.event == wire::frame_event::text || step.event == wire::frame_event::binary;
  if (ends_message) of.message_began_at = rt::never;
  if (step.event != wire::frame_event::need_more) frame_handler_.handle(peer, step);
  if (!of.parser.mid_message()) {
    of.message_began_at = rt::never;
  } else if (of.message_began_at == rt::never) {
    of.message_began_at = state_.cycle.now;
    of.timed = 0;
  } else if (step.in_pieces && (of.timed += step.payload.size()) >= timed_bytes) {
    of.message_began_at = state_.cycle.now; // it has as much time for the next ones
    of.timed = 0;
  }
  return work_of(ROWE_MUTANT(fragment_work) ? 1 : step.frames, step.payload.size() + state_.cycle.work_bytes);
}

void ingress::read_backlogs() noexcept {
  for (std::size_t work = 0; !turns_.empty() && work < read_work_per_cycle;) {
    const peer_index peer = turns_.next();
    inputs_[peer].in_ring = false;
    const std::size_t turn = read_one(peer);
    if (turn > turn_work || !turns_.empty()) turns_.charge(peer, turn); // else nobody waits for it
    work += turn;
    take_turn(peer);
  }
  turns_.end();
}

// ---- stops

// Carries out the stops in what was read, and removes them. Everything else stays for its turn, also what its
// own peer sent before a stop, and what only looks like a stop. A text that looks like a stop and is none is
// parsed once more than others. Then nothing else of its peer is looked at until more is read, so no other
// peer pays for it. The first stop of each peer is carried out, and stops_ahead_max more in all; further
// stops change nothing. A stop also waits for its turn if it is fragmented or too long, or if the name of its
// service or topic comes too late in it.
inline void ingress::take_stops(peer_index peer) noexcept {
  if (!frame_handler_.stop_in_use()) return;
  input& of = inputs_[peer];
  const std::span<std::byte> all = of.backlog;
  const auto begun = of.parser.look_ahead(all);
  if (!begun || begun->rest >= all.size()) return;
  bool in_message = begun->in_message;
  // A long message would begin in the assembly buffer, where another one may be.
  const std::size_t longest = std::min<std::size_t>(stop_frame_bytes_max, state_.bounds().message_bytes_max);
  std::size_t kept = begun->rest; // the end of what stays; nothing from `at` on was looked at yet
  std::size_t at = kept;
  const auto keep = [&](std::size_t bytes) {
    if (kept != at) std::memmove(all.data() + kept, all.data() + at, bytes);
    kept += bytes;
    at += bytes;
  };
  for (bool first = true; at < all.size() && state_.peers[peer].open();) {
    const auto frame = all.subspan(at);
    const std::size_t bytes = wire::whole_frame_bytes(frame);
    const wire::opcode what = wire::opcode_of(frame[0]);
    if (bytes == 0 || what == wire::opcode::close) break;
    const bool begins = wire::is_data(what) && what != wire::opcode::continuation;
    if (wire::is_data(what) && begins == in_message) break; // a protocol error: in its turn
    if (wire::is_data(what)) in_message = !wire::is_final(frame[0]);
    std::array<char, stop_look_bytes> buffer;
    const bool may_stop = begins && bytes <= longest && (first || stops_ahead_ < stops_ahead_max);
    if (!may_stop || !state_.peers[peer].protocol->reads.may_be_stop(
                         what, wire::look_at_message(frame, std::as_writable_bytes(std::span{buffer})))) {
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

// Carries out the message of a complete frame if it is a request to stop. False: it is none, and nothing was
// done. The frame is not changed.
bool ingress::take_if_stop(peer_index peer, std::span<const std::byte> frame) noexcept {
  std::array<std::byte, stop_frame_bytes_max + tailroom_bytes> buffer;
  std::memcpy(buffer.data(), frame.data(), frame.size());
  std::memset(buffer.data() + frame.size(), 0, tailroom_bytes);
  wire::frame_parser alone = inputs_[peer].parser.anew();
  const wire::frame_step step = alone.next(std::span{buffer}.first(frame.size()));
  const bool binary = step.event == wire::frame_event::binary;
  const bool stops =
      (step.event == wire::frame_event::text || binary) && frame_handler_.is_stop(peer, step.payload, binary);
  if (stops) frame_handler_.handle(peer, step); // within the rate of its peer, like all that it says
  return stops;
}

// ---- checks

// A peer with a parked message is not read. A peer with a backlog is in one ring, once.
bool ingress::check() const noexcept {
  std::uint32_t in_rings = 0;
  for (const peer_index i : state_.peers.ids()) {
    const input& of = inputs_[i];
    in_rings += of.in_ring;
    if (state_.peers[i].state == connection::phase::free) continue;
    if (of.parked() && (!of.in_ring || !(of.goes_on || state_.peers[i].unheard))) return false;
    if (of.goes_on && !of.parked()) return false;
    if (!of.backlog.empty() && !of.in_ring) return false;
  }
  return in_rings == turns_.count() + parked_.count() && turns_.check();
}

} // namespace rowe::service
