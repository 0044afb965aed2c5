// SPDX-License-Identifier: Apache-2.0
#include "service/control/driver_rules.hpp"

#include <algorithm>

#include <rowe/detail/mutation_points.hpp>

#include "json/text/utf8.hpp"

namespace rowe::service {
namespace {

constexpr std::array<std::string_view, 7> refusal_names{"",     "topic",  "action", "tick",
                                                        "role", "driven", "pause"};

} // namespace

std::string_view driver_rules::name_of(refusal why) noexcept {
  return refusal_names[static_cast<std::size_t>(why)];
}

void driver_rules::begin(rt::duration lease, rt::time_point now) noexcept {
  const std::uint64_t number = number_;
  const std::uint64_t turn = turn_;
  const std::uint64_t version = version_;
  *this = {};
  number_ = number;
  turn_ = turn + 1;
  version_ = version + 1;
  lease_ = lease;
  since_ = counts_after_ = now;
}

void driver_rules::set_lease(rt::duration lease) noexcept {
  if (lease == lease_) return;
  lease_ = lease;
  ++version_;
}

rt::duration driver_rules::kept_for() const noexcept { return std::max(lease_, kept_for_min); }

// ---- control

driver_rules::refusal driver_rules::take(const asker& by, bool over, rt::time_point issued,
                                         rt::time_point now) noexcept {
  update(now);
  if (!by.may_drive) return refusal::role;
  if (issued == rt::never || issued + tick_age_max <= now) return refusal::tick;
  if (driver_ == by.peer) {
    kept_until_ = std::max(kept_until_, issued + kept_for());
    if (set_name(by.name)) ++version_;
    return refusal::none;
  }
  if (driver_ != 0) {
    if (!over) return refusal::driven;
    if (!by.may_take_over) return refusal::role;
    if (taken_over_at_ != rt::time_point{} && now - taken_over_at_ < take_over_pause) return refusal::pause;
    taken_over_at_ = now;
    if (!ROWE_MUTANT(drive_two)) ++turn_;
  }
  give(by, now);
  kept_until_ = issued + kept_for();
  return refusal::none;
}

void driver_rules::release(std::uint64_t peer, rt::time_point now) noexcept {
  if (driven_by(peer)) end(now);
}

// The turn stays: that of the driver before has ended, and a command may be in its window already.
void driver_rules::give(const asker& to, rt::time_point now) noexcept {
  driver_ = to.peer;
  (void)set_name(to.name);
  ++number_;
  ++version_;
  since_ = now;
  kept_until_ = accepted_at_ = {};
}

void driver_rules::end(rt::time_point now) noexcept {
  driver_ = 0;
  name_bytes_ = 0;
  if (!ROWE_MUTANT(drive_on)) ++turn_;
  ++version_;
  since_ = now;
  accepted_at_ = {};
}

bool driver_rules::set_name(std::string_view name) noexcept {
  name = json::utf8_prefix(name, name_.size());
  if (name == driver()) return false;
  name_bytes_ = static_cast<std::uint8_t>(name.copy(name_.data(), name_.size()));
  return true;
}

// ---- commands

driver_rules::judged driver_rules::judge(std::uint64_t peer, rt::time_point sent,
                                         rt::time_point now) noexcept {
  update(now);
  if (driver_ != 0 && driver_ != peer && !ROWE_MUTANT(drive_refused)) return {verdict::refused};
  if (sent == rt::never) return {verdict::unproven};
  const bool too_old = sent + lease_ <= now && !ROWE_MUTANT(drive_stale);
  if (too_old || (sent <= counts_after_ && !ROWE_MUTANT(drive_reset))) return {verdict::stale};
  return {verdict::accepted, sent + lease_};
}

void driver_rules::count(const asker& by, rt::time_point sent, rt::time_point now) noexcept {
  if (driver_ == 0) give(by, now);
  accepted_at_ = now;
  kept_until_ = std::max(kept_until_, sent + kept_for());
}

void driver_rules::void_commands(rt::time_point now) noexcept {
  if (!ROWE_MUTANT(drive_again)) ++turn_;
  ++version_;
  counts_after_ = now;
}

} // namespace rowe::service
