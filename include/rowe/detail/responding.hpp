// SPDX-License-Identifier: Apache-2.0
// What a responder hands out with each call: the origin of the call, and the slot that is reserved for its
// answer. A responder's `out` has twice as many slots as its `in`, so it can hand out calls while answers are
// on their way. Reserved slots that were not needed stay on this side (`spare_replies`), because only the
// service thread may push a number into the free ring.
//
// For the handle's one thread; waits nowhere, allocates nothing.
#pragma once
#include <cstdint>
#include <string_view>
#include <utility>

#include <rowe/connection.hpp>
#include <rowe/detail/calls.hpp>
#include <rowe/detail/posting.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/detail/waiting.hpp>
#include <rowe/message.hpp>
#include <rowe/result.hpp>

namespace rowe::detail {

// The slots of a call: of the request, and of its answer.
struct request_slots {
  std::uint32_t in = 0;
  std::uint32_t answer = 0;
};

// A call that is handed out and not answered yet.
class open_request {
 public:
  ROWE_RT open_request(open_request&& from) noexcept
      : pair_{std::exchange(from.pair_, nullptr)},
        slots_{from.slots_},
        holds_text_{from.holds_text_},
        asked_{from.asked_} {}
  ROWE_RT open_request& operator=(open_request&& from) noexcept {
    std::swap(pair_, from.pair_);
    std::swap(slots_, from.slots_);
    std::swap(holds_text_, from.holds_text_);
    std::swap(asked_, from.asked_);
    return *this;
  }
  // If the call is unanswered, it is refused with a diagnostic that says so.
#if defined(__GNUC__) && !defined(__clang__) // gcc 12 sees pair_ read in an empty std::optional
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
  ROWE_RT ~open_request() {
    if (pair_ != nullptr) drop();
  }
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

  ROWE_RT connection from() const noexcept { return {asked_.peer.index, asked_.peer.generation}; }
  ROWE_RT time_point arrived() const noexcept { return time_point{duration{asked_.stamped_ns}}; }
  ROWE_RT time_point expires() const noexcept { return time_point{duration{asked_.expires_ns}}; }

 protected:
  // With `holds_text`, the text's slot is released with the answer, else now.
  open_request(queue_pair& on, request_slots both, bool holds_text) noexcept
      : pair_{&on}, slots_{both}, holds_text_{holds_text}, asked_{*on.user.in.memory.header(both.in)} {
    if (!holds_text) on.user.in.free_ring->release(both.in);
  }

  status answer(const pair_handle& by, entry what, const void* value, std::size_t bytes,
                time_point now) noexcept {
    if (!by || pair_ != &*by) return errc::misuse;
    queue_pair& on = *std::exchange(pair_, nullptr);
    if (holds_text_) on.user.in.free_ring->release(slots_.in);
    const bool is_gone = gone(on, asked_.peer);
    if (closed(on) || is_gone || expired_at(asked_, now)) {
      on.user.spare_replies.push(slots_.answer);
      return closed(on) ? on.closed_as : is_gone ? errc::peer_lost : errc::expired;
    }
    value_header header = message_header(what, asked_.peer, now, rt::never);
    header.call = asked_.call;
    return post_slot(on, slots_.answer, header, value, bytes) ? status{} : status{errc::misuse};
  }
  status answer(const pair_handle& by, const body& text, time_point now) noexcept {
    if (!by || pair_ != &*by) return errc::misuse;
    if (const status fits = check_fits(*pair_, text); !fits) return fits;
    return answer(by, entry::reply, text.text().data(), text.text().size(), now);
  }
  status refuse(const pair_handle& by, std::string_view diagnostic, time_point now) noexcept {
    diagnostic = diagnostic.substr(0, diagnostic_bytes_max);
    return answer(by, entry::refusal, diagnostic.data(), diagnostic.size(), now);
  }

 private:
  void drop() noexcept {
    constexpr std::string_view why = "the service did not answer";
    queue_pair& on = *std::exchange(pair_, nullptr);
    if (holds_text_) on.user.in.free_ring->release(slots_.in);
    value_header header =
        message_header(entry::refusal, asked_.peer, time_point{duration{asked_.stamped_ns}}, rt::never);
    header.call = asked_.call;
    (void)post_slot(on, slots_.answer, header, why.data(), why.size()); // after closing nobody reads it
  }

  queue_pair* pair_; // null: answered, or moved from
  request_slots slots_;
  bool holds_text_;
  value_header asked_;
};

// Reserves a slot for an answer, then takes the next call whose caller has not given up. Errors: full, empty,
// closed, misuse.
inline result<request_slots> next_request(const pair_handle& handle, time_point now) noexcept {
  if (!handle) return errc::misuse;
  queue_pair& on = *handle;
  parked_slots& spare = on.user.spare_replies;
  const bool over = closed(on); // before looking: what came before it closed is still there
  if (spare.count == 0) {
    const auto free = on.user.out.free_ring->try_take();
    if (!free) return over ? error{on.closed_as} : error{errc::full, 0, on.user.out.count};
    spare.push(*free);
  }
  const auto in = take_arrived(on, now);
  if (!in) return over ? on.closed_as : errc::empty;
  return request_slots{*in, spare.pop()};
}

} // namespace rowe::detail
