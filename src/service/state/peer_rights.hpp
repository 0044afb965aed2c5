// SPDX-License-Identifier: Apache-2.0
// The policy that holds now, and what it says about peers. A new one takes its place at the beginning of a
// cycle. Decides nothing else, and refuses nobody: that is access_control. Service thread only; nothing waits
// or allocates.
#pragma once
#include <string_view>

#include <rowe/detail/mutation_points.hpp>

#include "access/policy.hpp"
#include "service/base/names.hpp"
#include "service/state/connection.hpp"
#include "service/threads/policy_handover.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {

class peer_rights {
 public:
  explicit peer_rights(policy_handover<>& source) noexcept : source_{source} { use(); }

  // Whether another policy holds from now on. Then the core judges each peer.
  bool renew() noexcept {
    if (!source_.take()) return false;
    use();
    return true;
  }
  // What becomes of a peer that the policy before let in.
  access::successor succeed(const connection& c) const noexcept {
    access::successor next = policy_->succeed(c.who);
    using enum access::successor::fate;
    // A button whose token was taken away still stops, where anybody may; and to stop needs no role.
    if (c.stop_only && next.what == revoked && policy_->anonymous_may_stop())
      next = {kept, policy_->anonymous()};
    if (c.stop_only && next.what == changed) next.what = kept;
    if (ROWE_MUTANT(role_revoked) && next.what == revoked) next.what = kept;
    if (ROWE_MUTANT(role_kept) && next.what == changed) next.what = kept;
    return next;
  }
  // Whether a policy that does not hold any more has let the peer in.
  bool outdated(const access::subject& who) const noexcept {
    return who.version != policy_->version() && !ROWE_MUTANT(role_late);
  }

  // Whether the peer has a role, and rights by it. Else it may do everything.
  bool apply_to(const connection& c) const noexcept { return in_use_ && c.ours == side::server; }
  const access::policy& policy() const noexcept { return *policy_; }

  // Whether the peer has the right for this topic or service. Everyone may see the stop's state. What
  // /rowe/stats says is about all topics, so it takes the right to all of them, or to be named.
  bool allow(const connection& c, access::right what, std::string_view name) const noexcept {
    return !apply_to(c) || allow(c.who, what, name);
  }
  // The same for who asks over HTTP.
  bool allow(const access::subject& who, access::right what, std::string_view name) const noexcept {
    if (!in_use_) return true;
    if (what == access::right::subscribe) {
      if (without_slash(name) == without_slash(wire::stop_state_name)) return true;
      if (without_slash(name) == without_slash(wire::stats_name) && !ROWE_MUTANT(role_stats))
        return policy_->names(who.role, what, name);
    }
    return policy_->allows(who.role, what, name);
  }
  bool sees(const connection& c, std::string_view topic) const noexcept {
    return ROWE_MUTANT(role_lists) || allow(c, access::right::subscribe, topic);
  }
  bool sees(const access::subject& who, std::string_view topic) const noexcept {
    return ROWE_MUTANT(role_lists) || allow(who, access::right::subscribe, topic);
  }
  // Writes how others see a peer of this name that calls itself `said`. It may say what it likes. So where
  // there are identities, its own word stands behind its identity, or its address.
  wire::text_out& write_name(wire::text_out& into, std::string_view name,
                             std::string_view said) const noexcept {
    if (said.empty()) return into.add(name);
    if (!in_use_) return into.add(said);
    return into.add(name).add(" (").add(said).add(")");
  }
  // Whether the peer may publish on a topic beside a publisher of this process that does not share it.
  bool publishes_beside(const connection& c, std::string_view topic) const noexcept {
    return c.ours == side::client || ROWE_MUTANT(own_topic) ||
           (in_use_ && policy_->spells(c.who.role, access::right::publish, topic));
  }
  // Stops are for everyone.
  static bool is_for_everyone(std::string_view service) noexcept {
    return without_slash(service) == without_slash(wire::stop_name) ||
           without_slash(service) == without_slash(wire::stop_state_name);
  }
  // What one may do, one may ask.
  static bool is_of_rights(std::string_view service) noexcept {
    return without_slash(service) == without_slash(wire::rights_name);
  }
  bool calls(const connection& c, std::string_view service) const noexcept {
    return ROWE_MUTANT(role_lists) || without_slash(service).starts_with("rowe/stop") ||
           is_of_rights(service) || allow(c, access::right::call, service);
  }
  bool sees_everything(const access::subject& who) const noexcept {
    return !in_use_ || policy_->everywhere(who.role, access::right::subscribe);
  }

 private:
  void use() noexcept {
    policy_ = &source_.in_use();
    in_use_ = policy_->in_use();
  }

  policy_handover<>& source_;
  const access::policy* policy_ = nullptr;
  bool in_use_ = false;
};

} // namespace rowe::service
