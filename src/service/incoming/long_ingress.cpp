// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/long_ingress.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/service_limits.hpp"
#include "service/incoming/member_list.hpp"

namespace rowe::service {
namespace {

std::size_t receipt_count(const limits& bounds) noexcept {
  return chunk_store::in_use(bounds) ? std::min(bounds.connections_max, bounds.long_slots) : 0;
}

auto copy_from(std::span<const std::byte> text) noexcept {
  return [text](json::stretch from, std::span<std::byte> into) {
    std::copy_n(text.begin() + static_cast<std::ptrdiff_t>(from.at), into.size(), into.begin());
  };
}

} // namespace

std::size_t long_ingress::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return arena::bytes_for<sender_row>(bounds.connections_max) +
         arena::bytes_for<receipt>(receipt_count(bounds)) +
         arena::bytes_for(long_envelope_bytes_max + tailroom_bytes);
}

long_ingress::long_ingress(rt::arena& memory, core_state& state) noexcept
    : state_{state},
      senders_{memory.carve<sender_row>(state.bounds().connections_max)},
      receipts_{memory.carve<receipt>(receipt_count(state.bounds()))},
      free_{receipts_},
      envelope_{memory.carve_bytes(long_envelope_bytes_max + tailroom_bytes)} {}

// ---- pieces

void long_ingress::take(peer_index peer, const wire::frame_step& step) noexcept {
  take(peer, way::frames, step.payload, step.known_bytes,
       step.event == wire::frame_event::binary || step.message == wire::opcode::binary);
}

void long_ingress::take(peer_index peer, std::string_view text) noexcept {
  take(peer, way::messages, std::as_bytes(std::span{text}), in(peer, way::messages).bytes + text.size(),
       false);
}

void long_ingress::take(peer_index peer, way by, std::span<const std::byte> piece, std::uint64_t known_bytes,
                        bool binary) noexcept {
  incoming& from = in(peer, by);
  state_.cycle.work_bytes += long_work_times * piece.size();
  receipt* of = from.receipt ? &receipts_[from.receipt] : nullptr;
  const auto bytes = static_cast<std::size_t>(known_bytes);
  if (of == nullptr && !from.dropped) of = begin(peer, by, bytes, binary);
  from.bytes = static_cast<std::uint32_t>(known_bytes);
  if (of == nullptr) return;
  const std::uint32_t had = of->chunks;
  const std::uint32_t wanted = chunk_store::chunks_for(bytes);
  if (wanted > had) { // a further frame of it
    if (!make_room(peer, wanted - had, false) || !state_.chunks.grow(of->text, bytes))
      return drop(from.receipt);
    state_.chunks.begin_receiving(wanted - had);
    of->chunks = wanted;
  }
  const auto body = of->binary ? take_head(*of, piece) : piece;
  if (of->unsupported) return;
  state_.chunks.append(of->text, body);
  // If it is wrong, the rest is taken only because it comes.
  (void)of->scanner.feed({reinterpret_cast<const char*>(body.data()), body.size()});
  if (ROWE_MUTANT(long_scan))
    (void)of->scanner.feed({reinterpret_cast<const char*>(body.data()), body.size()});
}

// The first piece of a message. None: there is no room for it.
auto long_ingress::begin(peer_index peer, way by, std::size_t bytes, bool binary) noexcept -> receipt* {
  incoming& from = in(peer, by);
  from.dropped = true;
  settle(senders_[peer]);
  if (!make_room(peer, std::max(chunk_store::chunks_for(bytes), 1U), true)) return nullptr;
  const text_id text = state_.chunks.begin(bytes);
  if (!text) return nullptr;
  from.dropped = false;
  from.receipt = free_.take();
  receipt& begun = receipts_[from.receipt];
  begun = {};
  begun.peer = peer;
  begun.by = by;
  begun.text = text;
  begun.began = state_.cycle.now;
  begun.binary = binary;
  begun.scanner = json::scanner{state_.bounds().depth_max};
  begun.chunks = state_.chunks.chunks_of(text);
  state_.chunks.begin_receiving(begun.chunks);
  return &begun;
}

// Stores what stands in front of the body of a binary message. Returns the rest.
std::span<const std::byte> long_ingress::take_head(receipt& of, std::span<const std::byte> payload) noexcept {
  if (of.head_have == 0 && !payload.empty()) {
    const std::size_t bytes = state_.peers[of.peer].protocol->reads.body_begins(payload.front());
    of.unsupported = bytes == 0 || bytes > of.head.size();
    of.head_bytes = of.unsupported ? 0 : static_cast<std::uint8_t>(bytes);
  }
  const std::size_t here = std::min<std::size_t>(of.head_bytes - of.head_have, payload.size());
  std::copy_n(payload.begin(), here, of.head.begin() + of.head_have);
  of.head_have = static_cast<std::uint8_t>(of.head_have + here);
  return payload.subspan(here);
}

// ---- room

std::uint64_t long_ingress::ms_since(rt::time_point then) const noexcept {
  const auto passed = std::chrono::duration_cast<std::chrono::milliseconds>(state_.cycle.now - then);
  return static_cast<std::uint64_t>(std::max<std::int64_t>(passed.count(), 0));
}

// Chunks that a message counts for: no fewer than its place among the messages that are not complete.
std::uint64_t long_ingress::cost_of(const receipt& one) const noexcept {
  return std::max(one.chunks, state_.chunks.receiving_max() / std::max(receipts_.size(), 1U));
}

// What a message has used so far.
std::uint64_t long_ingress::used_by(const receipt& one) const noexcept {
  return (ms_since(one.began) + 1) * cost_of(one);
}

std::uint64_t long_ingress::used_by(peer_index peer) const noexcept {
  const sender_row& one = senders_[peer];
  const std::uint64_t halvings = std::min<std::uint64_t>(ms_since(one.used_until) / long_use_half_ms, 63);
  std::uint64_t used = one.chunk_ms >> halvings;
  for (const incoming& its : one.in) {
    if (its.receipt) used += used_by(receipts_[its.receipt]);
  }
  return used;
}

// Forgets what was used long ago.
void long_ingress::settle(sender_row& of) noexcept {
  const std::uint64_t halvings = ms_since(of.used_until) / long_use_half_ms;
  of.chunk_ms = halvings > 63 ? 0 : of.chunk_ms >> halvings;
  of.used_until += std::chrono::milliseconds{halvings * long_use_half_ms};
}

// Makes room for so many chunks more, and for a message more.
bool long_ingress::make_room(peer_index newcomer, std::uint32_t chunks, bool needs_row) noexcept {
  const chunk_store& store = state_.chunks;
  if (chunks > store.receiving_max()) return false;
  const auto has_room = [&] {
    const bool in_share = store.receiving() + chunks <= store.receiving_max() || ROWE_MUTANT(long_share);
    return in_share && store.free() >= chunks && !(needs_row && free_.empty());
  };
  while (!has_room()) {
    receipt_id most{};
    std::uint64_t used = 0;
    for (const receipt_id i : receipts_.ids()) {
      const receipt& one = receipts_[i];
      if (!one.text || one.peer == newcomer) continue;
      const std::uint64_t its = used_by(one.peer);
      if (its > used && its > 2 * used_by(newcomer) + long_grace_ms * cost_of(one)) {
        most = i;
        used = its;
      }
    }
    if (!most || ROWE_MUTANT(long_siege)) return false;
    drop(most);
  }
  return true;
}

// A message is dropped; what still comes of it is ignored.
void long_ingress::drop(receipt_id which) noexcept {
  const receipt& of = receipts_[which];
  in(of.peer, of.by).dropped = true;
  state_.chunks.release(of.text);
  close(which);
}

// Its text belongs to somebody else, or is gone.
void long_ingress::close(receipt_id which) noexcept {
  receipt& of = receipts_[which];
  sender_row& its = senders_[of.peer];
  settle(its);
  its.chunk_ms += used_by(of);
  state_.chunks.end_receiving(std::exchange(of.chunks, 0));
  in(of.peer, of.by).receipt = {};
  of.text = {};
  of.peer = {};
  free_.give_back(which);
}

void long_ingress::forget(peer_index peer) noexcept {
  sender_row& of = senders_[peer];
  for (const incoming& its : of.in) {
    if (its.receipt && ROWE_MUTANT(long_left)) state_.chunks.retain(receipts_[its.receipt].text);
    if (its.receipt) drop(its.receipt);
  }
  // Who comes to its place has used as much, so nobody gains by coming again and again.
  of = {.chunk_ms = of.chunk_ms, .used_until = of.used_until};
}

bool long_ingress::began_by(peer_index peer, rt::time_point then) const noexcept {
  return std::ranges::any_of(senders_[peer].in, [&](const incoming& its) {
    return its.receipt && receipts_[its.receipt].began <= then;
  });
}

// ---- texts that come in messages

auto long_ingress::text_of(peer_index peer) const noexcept -> so_far {
  const incoming& of = in(peer, way::messages);
  return {.bytes = of.bytes,
          .closed = of.receipt && receipts_[of.receipt].scanner.is_closed(),
          .lost = of.dropped};
}

void long_ingress::copy_text(peer_index peer, std::span<std::byte> into) const noexcept {
  chunk_store::place place;
  state_.chunks.copy(receipts_[in(peer, way::messages).receipt].text, 0, place, into);
}

void long_ingress::drop_text(peer_index peer) noexcept {
  incoming& of = in(peer, way::messages);
  if (of.receipt) drop(of.receipt);
  of = {};
}

// ---- the end

long_arrival long_ingress::end(peer_index peer, way by, bool binary,
                               std::span<const std::byte> front) noexcept {
  incoming& from = in(peer, by);
  const std::size_t bytes = std::exchange(from.bytes, 0);
  if (std::exchange(from.dropped, false) || !from.receipt) {
    long_arrival lost{
        .is = long_arrival::verdict::no_room, .binary = binary, .bytes = bytes, .envelope = front};
    if (!binary) {
      json::scanner scanned{state_.bounds().depth_max};
      (void)scanned.feed(
          {reinterpret_cast<const char*>(front.data()), front.size()}); // wrong where it is cut
      lost.envelope = list(scanned.members(), copy_from(front));
    }
    return lost;
  }
  receipt& of = receipts_[from.receipt];
  const text_id text = of.text;
  long_arrival made = put_together(of);
  made.binary = of.binary;
  const json::scanner& scanned = of.scanner;
  if (made.is != long_arrival::verdict::fine) {
    made.bytes = bytes;
    made.envelope = front;
    chunk_store::place place;
    if (!of.binary) {
      made.envelope = list(scanned.members(), [&](json::stretch at, std::span<std::byte> into) {
        state_.chunks.copy(text, at.at, place, into);
      });
    }
    if (made.is == long_arrival::verdict::malformed) {
      const std::size_t at = scanned.found().at;
      const std::size_t there = std::min(made.wrong_text.size(), state_.chunks.bytes(text) - at);
      place = {};
      state_.chunks.copy(text, at, place, std::as_writable_bytes(std::span{made.wrong_text}).first(there));
    }
    state_.chunks.release(text);
  }
  close(from.receipt);
  return made;
}

long_arrival long_ingress::malformed(std::string_view text, const error& why) noexcept {
  const auto at = std::min(static_cast<std::size_t>(why.value), text.size());
  long_arrival made{.is = long_arrival::verdict::malformed, .wrong = why, .bytes = text.size()};
  text.substr(at, made.wrong_text.size()).copy(made.wrong_text.data(), made.wrong_text.size());
  made.envelope =
      list(state_.seams.validator.members_before_fault(), copy_from(std::as_bytes(std::span{text})));
  return made;
}

template <class Copy>
std::span<const std::byte> long_ingress::list(std::span<const json::placed_member> members,
                                              const Copy& copy) noexcept {
  const std::size_t most = std::min<std::size_t>(long_envelope_bytes_max, state_.bounds().message_bytes_max);
  const std::size_t used = list_members(members, envelope_.first(most), copy);
  std::memset(envelope_.data() + used, 0, tailroom_bytes);
  return envelope_.first(used);
}

long_arrival long_ingress::put_together(receipt& of) noexcept {
  using verdict = long_arrival::verdict;
  if (of.unsupported || of.head_have != of.head_bytes) return {.is = verdict::unsupported};
  if (!of.scanner.finish()) {
    const json::fault& found = of.scanner.found();
    const auto at = static_cast<std::int64_t>(found.at);
    return {.is = verdict::malformed,
            .wrong = found.what == json::fault_kind::too_deep
                         ? error{errc::too_deep, at, state_.bounds().depth_max}
                         : error{errc::malformed, at}};
  }
  const auto members = of.scanner.members();
  if (members.empty()) return {.is = verdict::no_object};
  long_arrival made{.is = verdict::fine, .bytes = state_.chunks.bytes(of.text) + of.head_bytes};
  std::size_t used = 0;
  const auto add = [&](std::span<const std::byte> bytes) {
    std::memcpy(envelope_.data() + used, bytes.data(), bytes.size());
    used += bytes.size();
  };
  if (of.binary) {
    add(std::span{of.head}.first(of.head_bytes));
    made.stand_in_at = used;
    made.body = {of.text, stand_in_for(json::kind::object)};
    add(std::as_bytes(std::span{made.body.stand_in}));
  } else {
    const auto& longest =
        *std::ranges::max_element(members, {}, [](const json::placed_member& one) { return one.raw.bytes; });
    const std::size_t end = longest.raw.at + longest.raw.bytes;
    const std::size_t all = state_.chunks.bytes(of.text);
    const std::string_view stand_in = stand_in_for(longest.type);
    if (const std::size_t others = all - longest.raw.bytes;
        others + stand_in.size() > long_envelope_bytes_max)
      return {.is = of.scanner.has_more_members() ? verdict::far_behind : verdict::other_long,
              .others = others};
    chunk_store::place place;
    state_.chunks.copy(of.text, 0, place, envelope_.first(longest.raw.at));
    used = made.stand_in_at = longest.raw.at;
    made.body = {of.text, stand_in};
    add(std::as_bytes(std::span{stand_in}));
    state_.chunks.copy(of.text, end, place, envelope_.subspan(used, all - end));
    used += all - end;
    state_.chunks.cut(of.text, longest.raw.at, longest.raw.bytes);
  }
  std::memset(envelope_.data() + used, 0, tailroom_bytes);
  made.envelope = envelope_.first(used);
  return made;
}

// ---- checks

bool long_ingress::check() const noexcept {
  std::uint32_t chunks = 0;
  for (const receipt_id i : receipts_.ids()) {
    const receipt& of = receipts_[i];
    if (!of.text) continue;
    chunks += of.chunks;
    if (of.chunks != state_.chunks.chunks_of(of.text) || in(of.peer, of.by).receipt != i) return false;
  }
  return chunks == state_.chunks.receiving() && chunks <= state_.chunks.receiving_max() &&
         free_.check([](const receipt& of) { return !of.text; });
}

} // namespace rowe::service
