// SPDX-License-Identifier: Apache-2.0
#include "access/policy.hpp"

#include <algorithm>
#include <iterator>

#include <rowe/detail/mutation_points.hpp>

#include "access/pattern.hpp"
#include "access/token.hpp"

namespace rowe::access {
namespace {

constexpr std::string_view right_names[] = {"subscribe", "publish", "advertise", "call",
                                            "provide",   "reset",   "guard"};

const std::vector<std::string>& patterns_of(const role& one, right what) noexcept {
  switch (what) {
  case right::publish: return one.publish;
  case right::advertise: return one.advertise;
  case right::call: return one.call;
  case right::provide: return one.provide;
  default: return one.subscribe;
  }
}

} // namespace

std::string_view name_of(right which) noexcept { return right_names[static_cast<std::size_t>(which)]; }

std::vector<role> built_in_roles() {
  const std::vector<std::string> all{"**"};
  return {{.name = "observer", .subscribe = all, .call = {"/rosapi/**"}},
          {.name = "driver", .subscribe = all, .publish = all, .advertise = all, .call = all},
          {.name = "supervisor",
           .subscribe = all,
           .publish = all,
           .advertise = all,
           .call = all,
           .reset = true,
           .guard = true},
          {.name = "peer",
           .subscribe = all,
           .publish = all,
           .advertise = all,
           .call = all,
           .provide = all}};
}

policy::policy(const access_options& options) : anonymous_may_stop_{options.anonymous_may_stop} {
  if (!options.identities.empty())
    (void)hash_of("libcrypto sets itself up at its first hash, which must not be the service thread's");
  for (const role& one : built_in_roles()) add(one);
  for (const role& one : options.roles) add(one);
  local_role_ = number_of(options.local_role);
  for (const identity& one : options.identities) {
    identities_.push_back({one.name, hash_from_hex(one.token_sha256).value_or(token_hash{}),
                           number_of(one.role), one.token_in_url});
  }
}

void policy::add(const role& one) {
  role_entry entry{.name = one.name, .patterns = {}, .everywhere = 0, .reset = one.reset, .guard = one.guard};
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
  const auto index = static_cast<std::size_t>(what);
  if ((entry.everywhere >> index & 1) != 0) return true;
  if (name.empty() && !ROWE_MUTANT(role_plain)) return false; // what has no name is not one of some names
  const auto& patterns = entry.patterns[index];
  return std::any_of(patterns.begin(), patterns.end(),
                     [name](const std::string& pattern) { return matches(pattern, name); });
}

std::optional<subject> policy::find(std::string_view token, bool from_url) const noexcept {
  if (!is_token(token)) return std::nullopt;
  const auto hash = hash_of(token);
  if (!hash) return std::nullopt;
  std::optional<subject> found;
  for (std::size_t i = 0; i < identities_.size(); ++i) { // all of them, whichever it is
    const identity_entry& one = identities_[i];
    if (equal(one.hash, *hash) && (one.in_url || !from_url))
      found = subject{one.role, static_cast<identity_number>(i)};
  }
  return found;
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
