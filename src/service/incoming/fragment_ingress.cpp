// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/fragment_ingress.hpp"

#include <array>
#include <cstring>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/names.hpp"
#include "service/base/service_limits.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {
namespace {

using why_buffer = std::array<char, 224>;

} // namespace

std::size_t fragment_ingress::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<row>(bounds.connections_max);
}

fragment_ingress::fragment_ingress(rt::arena& memory, const fragment_ingress_needs& parts) noexcept
    : fragment_ingress_needs{parts}, rows_{memory.carve<row>(state_.bounds().connections_max)} {}

// ---- fragments

// As many as frames of a long message.
std::int64_t fragment_ingress::count_max() const noexcept {
  const limits& bounds = state_.bounds();
  const std::int64_t times = 1 + bounds.long_message_bytes_max / bounds.message_bytes_max;
  return times * bounds.fragments_max;
}

fragment_ingress::due fragment_ingress::take(connection& c, const wire::request& asked,
                                             std::span<const std::byte> message) noexcept {
  const peer_index peer{c.id.index};
  if (in_whole_) {
    refusals_.refuse(c, asked.id_raw, "a fragment must not hold another one");
    return due::next_fragment;
  }
  if (!belongs(c, asked)) return due::next_fragment;
  row& of = rows_[peer];
  ++of.next;
  if (of.is == phase::lost) return due::next_fragment;
  const auto* const text = reinterpret_cast<const char*>(message.data());
  of.at = static_cast<std::uint32_t>(asked.body_raw.data() + 1 - text); // behind its quote
  of.end = static_cast<std::uint32_t>(of.at + asked.body_raw.size() - 2);
  of.is = phase::taking;
  return go_on(c, message);
}

fragment_ingress::due fragment_ingress::go_on(connection& c, std::span<const std::byte> message) noexcept {
  const peer_index peer{c.id.index};
  row& of = rows_[peer];
  const auto* const text = reinterpret_cast<const char*>(message.data());
  std::array<char, part_bytes_max> unescaped;
  std::string_view escaped{text + of.at, of.end - of.at};
  const std::string_view part = json::unescape_some(escaped, unescaped);
  of.at = of.end - static_cast<std::uint32_t>(escaped.size());
  if (const std::size_t bytes = long_ingress_.text_of(peer).bytes + part.size();
      bytes > state_.chunks.text_bytes_max()) {
    why_buffer buffer;
    wire::text_out why{buffer};
    why.add("a message in fragments has ").add(bytes);
    why.add(" bytes or more; the limit long_message_bytes_max is ")
        .add(state_.bounds().long_message_bytes_max);
    state_.counts.add(counter::too_big);
    refuse(c, {}, "too_big", why);
    return due::next_fragment;
  }
  long_ingress_.take(peer, part);
  of.timed += static_cast<std::uint32_t>(part.size());
  if (of.timed >= timed_bytes) { // it has as much time for the next ones
    of.timed = 0;
    of.since = state_.cycle.now;
  }
  if (of.at != of.end) return due::rest;
  of.is = phase::open;
  return is_complete(peer) ? due::whole : due::next_fragment;
}

// A count is known exactly, or only about: then the message is complete when its JSON is. If that is not
// stored, nobody looks at it.
bool fragment_ingress::is_complete(peer_index peer) const noexcept {
  const row& of = rows_[peer];
  if (of.exact) return of.next == of.count;
  const long_ingress::so_far text = long_ingress_.text_of(peer);
  return text.closed || of.next > of.count || (text.lost && of.next == of.count);
}

// Whether the fragment is the one that is due. Else it is refused, and, if it has the id of the message that
// is under way, this message is lost.
bool fragment_ingress::belongs(connection& c, const wire::request& asked) noexcept {
  row& of = rows_[{c.id.index}];
  const std::uint32_t number = asked.fragment_number;
  const bool same = of.is != phase::none && of.id == hash_of(asked.id_raw);
  if (number == 0 && (same || of.is != phase::open)) return begins(c, asked);
  if (same && of.is == phase::lost) return false;
  why_buffer buffer;
  wire::text_out why{buffer};
  if (of.is == phase::open && !same) {
    why.add("another message in fragments is under way: its fragment ").add(of.next).add(" of ");
    why.add(of.count).add(" is expected; send one message after the other");
    refusals_.refuse(c, asked.id_raw, why.text());
    return false;
  }
  if (of.is != phase::open) { // nothing is under way
    why.add("num is ").add(number).add(", but no message in fragments is under way: the first num is 0");
  } else if (number != of.next && !ROWE_MUTANT(fragments_order)) {
    why.add("num is ").add(number).add(", but ").add(of.next).add(" is expected");
  } else if (asked.fragment_count != of.count) {
    why.add("total is ").add(asked.fragment_count).add(", but was ").add(of.count);
  } else {
    return true;
  }
  of.id = hash_of(asked.id_raw);
  refuse(c, asked.id_raw, "refused", why);
  return false;
}

bool fragment_ingress::begins(connection& c, const wire::request& asked) noexcept {
  const peer_index peer{c.id.index};
  row& of = rows_[peer];
  why_buffer buffer;
  wire::text_out why{buffer};
  if (of.is == phase::open) {
    why.add("a message in fragments begins again: fragment ").add(of.next).add(" of ").add(of.count);
    refuse(c, asked.id_raw, "refused", why.add(" was missing"));
  }
  of = {.is = phase::open,
        .exact = asked.fragment_count_exact,
        .id = hash_of(asked.id_raw),
        .count = asked.fragment_count,
        .since = state_.cycle.now};
  wire::text_out wrong{buffer};
  if (state_.chunks.text_bytes_max() == 0) {
    wrong.add("fragments need room for long messages: long_message_bytes_max is ");
    wrong.add(state_.bounds().long_message_bytes_max).add(", and should be more than message_bytes_max");
  } else if (const std::int64_t most = count_max(); asked.fragment_count > most) {
    wrong.add("total is ").add(asked.fragment_count).add(", and may be ").add(most);
    wrong.add(" (fragments_max for each message_bytes_max): send longer ones");
  } else {
    return true;
  }
  refuse(c, asked.id_raw, "refused", wrong);
  return false;
}

void fragment_ingress::refuse(connection& c, std::string_view id_raw, std::string_view code,
                              const wire::text_out& why) noexcept {
  lose({c.id.index});
  refusals_.refuse(c, c.protocol->topics.id(), id_raw, {.code = code, .text = why.text()});
}

// What still comes of the message is ignored.
void fragment_ingress::lose(peer_index peer) noexcept {
  if (rows_[peer].is == phase::open || rows_[peer].is == phase::taking)
    state_.counts.add(counter::fragments_lost);
  rows_[peer].is = phase::lost;
  long_ingress_.drop_text(peer);
}

// ---- complete messages

std::span<std::byte> fragment_ingress::text(peer_index peer) noexcept {
  in_whole_ = true;
  const long_ingress::so_far so_far = long_ingress_.text_of(peer);
  if (so_far.lost || so_far.bytes > state_.bounds().message_bytes_max) return {};
  const std::span<std::byte> place = state_.chunks.whole();
  const auto text = place.first(so_far.bytes);
  long_ingress_.copy_text(peer, text);
  std::memset(place.data() + so_far.bytes, 0, tailroom_bytes);
  return text;
}

void fragment_ingress::end(peer_index peer, bool parked) noexcept {
  in_whole_ = false;
  rows_[peer].is = parked ? phase::parked : phase::none;
  if (!parked) long_ingress_.drop_text(peer);
}

// ---- peers

void fragment_ingress::look_at_time(connection& c) noexcept {
  const peer_index peer{c.id.index};
  const row& of = rows_[peer];
  if (state_.cycle.waited_since(of.since) <= state_.options.message_time_max) return;
  why_buffer buffer;
  wire::text_out why{buffer};
  why.add("a message in fragments was not finished in time: number ").add(of.next).add(" of ").add(of.count);
  refuse(c, {}, "timed_out", why.add(" did not come"));
}

void fragment_ingress::forget(peer_index peer) noexcept {
  if (rows_[peer].is == phase::open || rows_[peer].is == phase::taking)
    state_.counts.add(counter::fragments_lost);
  rows_[peer] = {};
  long_ingress_.forget(peer);
}

bool fragment_ingress::check() const noexcept {
  for (const peer_index i : state_.peers.ids()) {
    const row& of = rows_[i];
    const bool none = of.is == phase::none || of.is == phase::lost;
    if (none && long_ingress_.text_of(i).bytes != 0) return false;
    if (of.is == phase::taking && of.at > of.end) return false;
  }
  return true;
}

} // namespace rowe::service
