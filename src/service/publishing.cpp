// SPDX-License-Identifier: Apache-2.0
// Who holds topics, and the values that are kept for those who come late.
#include "service/publishing.hpp"

#include "service/core.hpp"

namespace rowe::service {

// What is lost is counted; where nothing was written there is nothing to say.
void core::send_direct(connection& c, const json::writer& written) noexcept {
  if (written.overflowed()) return add(counter::outbox_full);
  if (written.bytes() == 0) return;
  (void)answer(c, [&](json::writer& into) { into.append(written.text()); });
}

void core::remove_subscription(connection& c, std::uint32_t index) noexcept {
  const std::uint32_t topic = router_.subscription_at(index).topic;
  outbox_.drop(index);
  router_.remove_subscription(index, c.first_subscription);
  subscription_claims_.give_back(c.subscriptions);
  update_wanted(topic);
  let_go_topic(topic);
}

// A value of a latched topic, for those who come late. What a handle of this process latches is not replaced
// by peers.
void core::keep_latched(topic& on, std::uint32_t slot, latch_owner owner) noexcept {
  if (owner.who == latch_owner::kind::peer && on.last.owner.who == latch_owner::kind::handle) return;
  const std::span<const char> body = slots_.body(slot);
  if (latches_.store(on.last, {body.data(), body.size()}, owner, slots_.expires(slot))) return;
  add(counter::not_latched);
}

void core::forget_latched(topic& on, latch_owner owner) noexcept {
  if (on.last.owner == owner) latches_.clear(on.last);
}

void core::let_go_topic(std::uint32_t index) noexcept {
  if (router_.at(index).holders == 1) latches_.clear(router_.at(index).last);
  (void)router_.let_go(index); // whether it was the last one matters to nobody here
}

// Of a handle of this process.
void core::let_go_own_topic(std::uint32_t index) noexcept {
  if (router_.at(index).holders == 1) latches_.clear(router_.at(index).last);
  (void)router_.let_go_as_own(index); // likewise
}

} // namespace rowe::service
