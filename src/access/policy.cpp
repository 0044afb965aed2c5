// SPDX-License-Identifier: Apache-2.0
#include "access/policy.hpp"

#include <algorithm>

#include <rowe/detail/mutation_points.hpp>

#include "access/pattern.hpp"
#include "access/token.hpp"

namespace rowe::access {
namespace {

constexpr std::string_view right_names[] = {"subscribe", "publish", "advertise", "call",     "provide",
                                            "set",       "reset",   "guard",     "take_over"};

const std::vector<std::string>& patterns_of(const role& one, right what) noexcept {
  switch (what) {
  case right::publish: return one.publish;
  case right::advertise: return one.advertise;
  case right::call: return one.call;
  case right::provide: return one.provide;
  case right::set: return one.set;
  default: return one.subscribe;
  }
}

} // namespace

std::string_view name_of(right which) noexcept { return right_names[static_cast<std::size_t>(which)]; }

std::vector<role> built_in_roles() {
  const std::vector<std::string> all{"**"};
  return {
      {.name = "observer", .subscribe = all, .call = {"/rosapi/**", "/rowe/stats", "/rowe/types"}},
      {.name = "driver", .subscribe = all, .publish = all, .advertise = all, .call = all, .take_over = true},
      {.name = "supervisor",
       .subscribe = all,
       .publish = all,
       .advertise = all,
       .call = all,
       .set = all,
       .reset = true,
       .guard = true,
       .take_over = true},
      {.name = "peer",
       .subscribe = all,
       .publish = all,
       .advertise = all,
       .call = all,
       .provide = all,
       .take_over = true}};
}

policy::policy(const access_options& options) : anonymous_may_stop_{options.anonymous_may_stop} {
  if (!options.identities.empty())
    (void)hash_of("libcrypto sets itself up at its first hash, which must not be the service thread's");
  for (const role& one : built_in_roles()) add(one);
  for (const role& one : options.roles) add(one);
  local_role_ = number_of(options.local_role);
  for (const identity& one : options.identities) {
    identities_.push_back(
        {one.name, hash_from_hex(one.token_sha256), one.certificate, number_of(one.role), one.token_in_url});
  }
}

// ---- the place of another policy

policy::policy(const access_options& options, const policy& before) : policy{options} {
  version_ = before.version_ + 1;
  for (const identity_entry& one : before.identities_) of_identities_.push_back(successor_of(before, one));
  of_local_ = successor_of_local(before);
  of_anonymous_ = successor_of_anonymous(before);
}

successor policy::succeed(const subject& before) const noexcept {
  if (before.identity != nobody)
    return before.identity < of_identities_.size() ? of_identities_[before.identity] : successor{};
  return before.role != nobody ? of_local_ : of_anonymous_;
}

// Whether whoever has the proofs of `before` has those of `now`, too.
bool policy::keeps_proofs(const identity_entry& before, const identity_entry& now) noexcept {
  const bool same_token = !before.hash || (now.hash && equal(*before.hash, *now.hash));
  return same_token && (before.certificate.empty() || before.certificate == now.certificate);
}

// An identity is a name and its proofs: a token, a certificate, or both. If the name or a proof is replaced,
// it is another identity.
successor policy::successor_of(const policy& before, const identity_entry& one) const noexcept {
  if (!in_use()) return {successor::fate::grown, anonymous()};
  const auto is_same = [&one](const identity_entry& other) {
    return other.name == one.name && keeps_proofs(one, other);
  };
  const auto found = std::find_if(identities_.begin(), identities_.end(), is_same);
  if (found == identities_.end()) return {};
  const subject who{found->role, static_cast<identity_number>(found - identities_.begin()), version_};
  if (one.in_url && !found->in_url) return {successor::fate::changed, who}; // it may have come by a URL
  return {compare(before.roles_[one.role], found->role), who};
}

successor policy::successor_of_local(const policy& before) const noexcept {
  if (before.local_role_ == nobody) return {};
  if (!in_use()) return {successor::fate::grown, anonymous()};
  if (local_role_ == nobody) return {};
  return {compare(before.roles_[before.local_role_], local_role_), local()};
}

// Who has no role: where nobody has to prove anything that is everyone, else who may only stop.
successor policy::successor_of_anonymous(const policy& before) const noexcept {
  const bool stays = before.in_use() ? !in_use() || anonymous_may_stop_ : !in_use();
  return stays ? successor{successor::fate::kept, anonymous()} : successor{};
}

// Whether the first role has at least the rights of the second, as far as their texts say so.
bool policy::covers(const role_entry& all, const role_entry& of) noexcept {
  if ((of.reset && !all.reset) || (of.guard && !all.guard) || (of.take_over && !all.take_over)) return false;
  for (std::size_t r = 0; r < named_rights; ++r) {
    if ((all.everywhere >> r & 1) != 0) continue;
    const auto has = [&have = all.patterns[r]](const std::string& pattern) {
      return std::find(have.begin(), have.end(), pattern) != have.end();
    };
    if (!std::all_of(of.patterns[r].begin(), of.patterns[r].end(), has)) return false;
  }
  return true;
}

successor::fate policy::compare(const role_entry& before, role_number now) const noexcept {
  if (!covers(roles_[now], before)) return successor::fate::changed;
  return covers(before, roles_[now]) ? successor::fate::kept : successor::fate::grown;
}

// ---- rights

void policy::add(const role& one) {
  role_entry entry{.name = one.name,
                   .patterns = {},
                   .everywhere = 0,
                   .reset = one.reset,
                   .guard = one.guard,
                   .take_over = one.take_over};
  for (std::size_t r = 0; r < named_rights; ++r) {
    entry.patterns[r] = patterns_of(one, static_cast<right>(r));
    const auto& patterns = entry.patterns[r];
    const auto is_everything = [](const std::string& pattern) { return pattern == "**" || pattern == "/**"; };
    if (std::any_of(patterns.begin(), patterns.end(), is_everything))
      entry.everywhere = static_cast<std::uint8_t>(entry.everywhere | 1U << r);
  }
  const role_number old = number_of(one.name);
  if (old != nobody)
    roles_[old] = std::move(entry);
  else
    roles_.push_back(std::move(entry));
}

role_number policy::number_of(std::string_view role) const noexcept {
  const auto has_name = [role](const role_entry& one) { return one.name == role; };
  const auto found = std::find_if(roles_.begin(), roles_.end(), has_name);
  return found == roles_.end() ? nobody : static_cast<role_number>(found - roles_.begin());
}

bool policy::allows(role_number role, right what, std::string_view name) const noexcept {
  if (role >= roles_.size()) return false;
  const role_entry& entry = roles_[role];
  if (what == right::reset) return entry.reset;
  if (what == right::guard) return entry.guard;
  if (what == right::take_over) return entry.take_over;
  const auto index = static_cast<std::size_t>(what);
  if ((entry.everywhere >> index & 1) != 0) return true;
  if (name.empty() && !ROWE_MUTANT(role_plain)) return false; // what has no name is not one of some names
  const auto& patterns = entry.patterns[index];
  return std::any_of(patterns.begin(), patterns.end(),
                     [name](const std::string& pattern) { return matches(pattern, name); });
}

bool policy::everywhere(role_number role, right what) const noexcept {
  const auto index = static_cast<std::size_t>(what);
  return role < roles_.size() && index < named_rights && (roles_[role].everywhere >> index & 1) != 0;
}

bool policy::names(role_number role, right what, std::string_view name) const noexcept {
  return everywhere(role, what) || spells(role, what, name);
}

bool policy::spells(role_number role, right what, std::string_view name) const noexcept {
  const auto index = static_cast<std::size_t>(what);
  if (role >= roles_.size() || index >= named_rights) return false;
  const auto& patterns = roles_[role].patterns[index];
  return std::any_of(patterns.begin(), patterns.end(), [name](const std::string& pattern) {
    return wire::without_slash(pattern) == wire::without_slash(name);
  });
}

std::optional<subject> policy::find(std::string_view token, bool from_url) const noexcept {
  if (!is_token(token)) return std::nullopt;
  const auto hash = hash_of(token);
  if (!hash) return std::nullopt;
  std::optional<subject> found;
  for (std::size_t i = 0; i < identities_.size(); ++i) { // all of them, whichever it is
    const identity_entry& one = identities_[i];
    if (one.hash && equal(*one.hash, *hash) && (one.in_url || !from_url))
      found = subject{one.role, static_cast<identity_number>(i), version_};
  }
  return found;
}

// The name is no secret: no time is hidden.
std::optional<subject> policy::find_certificate(std::string_view common_name) const noexcept {
  if (common_name.empty()) return std::nullopt;
  const auto is_it = [common_name](const identity_entry& one) { return one.certificate == common_name; };
  const auto found = std::find_if(identities_.begin(), identities_.end(), is_it);
  if (found == identities_.end()) return std::nullopt;
  return subject{found->role, static_cast<identity_number>(found - identities_.begin()), version_};
}

std::size_t policy::patterns(role_number role, right what) const noexcept {
  const auto index = static_cast<std::size_t>(what);
  if (role >= roles_.size() || index >= named_rights) return 0;
  return (roles_[role].everywhere >> index & 1) != 0 ? 0 : roles_[role].patterns[index].size();
}

std::string_view policy::role_name(role_number which) const noexcept {
  return which < roles_.size() ? std::string_view{roles_[which].name} : "nobody";
}

std::string_view policy::identity_name(identity_number which) const noexcept {
  return which < identities_.size() ? std::string_view{identities_[which].name} : std::string_view{};
}

} // namespace rowe::access
