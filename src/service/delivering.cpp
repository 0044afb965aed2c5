// SPDX-License-Identifier: Apache-2.0
// What this process is given: what became of calls and of sends that wait, and what peers say, decoded where
// a handle reads values. Who receives plain messages is decided here.
#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/core.hpp"
#include "service/publishing.hpp"
#include "json/decoder.hpp"
#include "json/utf8.hpp"

namespace rowe::service {
namespace {

using detail::entry;

} // namespace

// ---- what senders and askers are told

void core::tell(const party& whom, detail::call_ref own, const status& outcome,
                std::string_view text) noexcept {
  if (whom.who == party::kind::lane) end_at_lane(whom, own, outcome, text);
  if (whom.who == party::kind::door) door_.settle(whom.index, outcome, text);
}

// The end of a call, or of a send that waits, at the lane that began it. Of an error, `text` is the sentence.
void core::end_at_lane(const party& whom, detail::call_ref own, status outcome,
                       std::string_view text) noexcept {
  const lane_view& view = views_[whom.index];
  if (own.generation == 0 || !view.attached || view.generation != whom.generation) return;
  detail::lane& lane = lanes_[whom.index];
  const detail::filling_end& path = lane.service.ends;
  const auto slot = path.home->try_take();
  if (!slot)
    return add(counter::inbox_full); // a place of the lane's table reserves one: only misuse gets here
  std::byte* const value = path.slots.value(*slot);
  std::size_t bytes = 0;
  std::array<char, json::decoder::diagnosis::text_bytes_max> room;
  if (outcome && lane.decoder != nullptr && !text.empty()) {
    bytes = path.slots.bytes_max;
    json::decoder::diagnosis why;
    outcome = lane.decoder->decode(text, value, &why);
    if (!outcome) {
      add(counter::undecodable);
      bytes = 0;
      text = why.text(room);
    }
  } else if (outcome && text.size() > path.slots.bytes_max) {
    add(counter::too_big);
    outcome = error{errc::too_big, static_cast<std::int64_t>(text.size()),
                    static_cast<std::int64_t>(path.slots.bytes_max)};
    text = {};
  }
  if (bytes == 0) {
    bytes = json::utf8_prefix(text, path.slots.bytes_max).size(); // a sentence may be cut
    if (bytes != 0) std::memcpy(value, text.data(), bytes);
  }
  *path.slots.header(*slot) = {.stamped_ns = rt::nanoseconds_of(now_),
                               .expires_ns = rt::nanoseconds_of(rt::never),
                               .bytes = static_cast<std::uint32_t>(bytes),
                               .what = entry::end,
                               .failed = !outcome,
                               .outcome = outcome ? errc::misuse : outcome.code(),
                               .own = own,
                               .outcome_value = outcome ? 0 : outcome.error().value,
                               .outcome_limit = outcome ? 0 : outcome.error().limit};
  if (path.out->try_push(*slot)) lane.news.notify(); // there is a place for every slot
}

// ---- in

// The lane that gets what no other handle takes: of those that receive, the one that was attached first.
std::uint32_t core::find_receiver(std::uint32_t but) const noexcept {
  std::uint32_t first = no_index;
  for (std::uint32_t i = 0; i < lanes_.size(); ++i) {
    if (i == but || !views_[i].attached || lanes_[i].kind != detail::lane_kind::talk || !lanes_[i].receives)
      continue;
    if (first == no_index || views_[i].order < views_[first].order) first = i;
  }
  return first;
}

// Whether somebody waits for calls that no handle serves.
bool core::received() const noexcept {
  return receiver() != no_index || options_.answers_any || door_.manned();
}

rt::time_point core::inbound_expiry(std::int64_t ttl_ns) const noexcept {
  const rt::time_point by_peer = rt::deadline_after(now_, rt::duration{ttl_ns}); // negative: never
  return std::min(by_peer, rt::deadline_after(now_, options_.inbound_ttl));
}

// ---- shares
//
// Whoever receives has so many slots, of which a peer may have its share: a quarter is kept for claims, for
// who receives gives slots back all the time. A peer's are those of its messages that were not taken or are
// still in the receiver's hands, and those of what is put aside on the way to it: so who answers each message
// with one finds room for the answer.

namespace {

// Of an absent receiver what finds no room is dropped, as it is where nobody receives.
constexpr rt::duration absent_after = std::chrono::seconds{8};

} // namespace

// The counts are of another receiver from now on, with whom no message is yet; of the front door's old ones
// nobody needs to know.
void core::begin_receiver() noexcept {
  receives_ = receiver();
  for (connection& c : peers_) c.untaken = c.answers_held = 0;
  untaken_ = answers_held_ = 0;
  inbox_claims_ = claims_to(receiver_slots(), 4);
  marked_ = false;
  door_.forget_senders();
  taken_at_ = now_;
  ++places_freed_;
}

void core::note_taken(detail::peer_ref from) noexcept {
  taken_at_ = now_;
  ++places_freed_;
  connection* const c = find({from.index, from.generation});
  if (c == nullptr || c->untaken == 0) return;
  inbox_claims_.give_back(c->untaken);
  --untaken_;
}

// Whoever answers a message does so before its slot goes home: such a slot counts until all that was handed
// over before it came home has been taken, and is counted where it is put aside.
void core::mark_taken() noexcept {
  if (receiver() != receives_) begin_receiver();
  if (marked_) return;
  marked_ = true;
  if (receives_ == no_index) {
    door_.mark_inbound();
    before_mark_ = door_.submitted();
  } else {
    home_mark_ = lanes_[receives_].service.in.home->mark_home();
    before_mark_ = lanes_[receives_].service.out.out->waiting_at_least();
  }
}

void core::collect_taken(std::size_t entries) noexcept {
  before_mark_ -= std::min<std::uint64_t>(before_mark_, entries);
  if (before_mark_ != 0) return;
  marked_ = false;
  // What came home since the mark was made is seen by the next one only.
  if (entries != 0 && !parked_.empty()) unparked_at_ = UINT64_MAX;
  if (receives_ == no_index) {
    (void)door_.collect_marked([this](detail::peer_ref from) { note_taken(from); });
    return;
  }
  const detail::filling_end& path = lanes_[receives_].service.in;
  path.home->see(home_mark_, [&](std::uint32_t slot) { note_taken(path.slots.header(slot)->peer); });
}

bool core::has_place() const noexcept {
  return receives_ == no_index ? door_.free_inbound() != 0
                               : lanes_[receives_].service.in.home->seen_by_owner() != 0;
}

// Those of the inbox, or of the way out where these are fewer.
std::uint32_t core::receiver_slots() const noexcept {
  if (receives_ == no_index) return door_.slots();
  const detail::lane& by = lanes_[receives_];
  return std::min(by.service.in.count, by.user.out.count);
}

bool core::has_inbox_share(const connection& c) const noexcept {
  // Answers to its calls have fewer places while it does not read.
  const peer_queues& queues = queues_of(c);
  const bool few = queues.backpressured();
  if (c.told_full || (few && queues.replies.count + c.calls_asked >= outbox::replies_max_backpressured))
    return false;
  const std::uint32_t left = left_of(receiver_slots(), untaken_ + answers_held_);
  return inbox_claims_.may_take(c.untaken + c.answers_held, left) && has_place();
}

bool core::receiver_is_absent() const noexcept {
  return !received() || (untaken_ != 0 && now_ - taken_at_ > absent_after);
}

core::admission core::admit(const connection& c) noexcept {
  if (receiver() != receives_) begin_receiver();
  if (has_inbox_share(c) || ROWE_MUTANT(inbox_share)) return admission::now;
  if (!received()) return admission::now;              // nobody has shares where nobody receives
  if (receives_ == no_index) door_.drop_expired(now_); // so that they come home
  mark_taken();
  collect_taken(0); // what is home, unless something was handed over before
  if (has_inbox_share(c)) return admission::now;
  return !receiver_is_absent() ? admission::later : admission::never;
}

// To the one who receives.
status core::deliver_message(const detail::value_header& header, std::string_view text) noexcept {
  if (receiver() != receives_) begin_receiver();
  status done = errc::full;
  if (receives_ != no_index) {
    json::decoder::diagnosis nothing; // who receives takes texts
    if (has_place()) done = fill_inbox(receives_, header, text, nothing);
  } else {
    done = door_.deliver(
        {.what = header.what == entry::invocation ? door_request::invocation : door_request::message,
         .peer = header.peer,
         .call = header.call,
         .stamped = now_,
         .expires = time_of(header.expires_ns)},
        text, [this](detail::peer_ref from) { note_taken(from); });
  }
  if (!done) {
    add(done.code() == errc::too_big ? counter::too_big : counter::inbox_full);
    return done;
  }
  connection* const c = find({header.peer.index, header.peer.generation});
  if (c == nullptr) return done;
  if (untaken_ == 0) taken_at_ = now_;
  inbox_claims_.take(c->untaken);
  ++untaken_;
  return done;
}

// Into the inbox of a lane, decoded where that reads values. When that fails, `why` says how.
status core::fill_inbox(std::uint32_t index, const detail::value_header& header, std::string_view body,
                        json::decoder::diagnosis& why) noexcept {
  detail::lane& lane = lanes_[index];
  const detail::filling_end& path = lane.service.in;
  if (lane.decoder == nullptr && body.size() > path.slots.bytes_max) {
    return error{errc::too_big, static_cast<std::int64_t>(body.size()),
                 static_cast<std::int64_t>(path.slots.bytes_max)};
  }
  std::uint32_t slot = no_index;
  if (path.newest != nullptr) {
    slot = path.newest->begin_write();
  } else if (views_[index].spare != no_index) {
    slot = std::exchange(views_[index].spare, no_index);
  } else if (const auto free = path.home->try_take()) {
    slot = *free;
  } else {
    return errc::full;
  }
  std::byte* const value = path.slots.value(slot);
  std::size_t bytes = body.size();
  if (lane.decoder != nullptr) {
    bytes = path.slots.bytes_max;
    if (const status read = lane.decoder->decode(body, value, &why); !read) {
      if (path.newest == nullptr) views_[index].spare = slot;
      return read;
    }
  } else {
    std::memcpy(value, body.data(), bytes);
  }
  *path.slots.header(slot) = header;
  path.slots.header(slot)->bytes = static_cast<std::uint32_t>(bytes);
  if (path.newest != nullptr) {
    path.newest->end_write(slot);
    lane.news.notify();
  } else if (path.out->try_push(slot)) { // there is a place for every slot
    lane.news.notify();
  }
  return {};
}

} // namespace rowe::service
