// SPDX-License-Identifier: Apache-2.0
// The policies of a world whose peers have roles: what is chosen, what it is changed to in mid-run, and, each
// written here once more by hand, what it allows and what becomes of peers that are there when it changes.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/access.hpp>

#include "swarm_context.hpp"

namespace flow {

enum role : std::uint8_t { observer, driver, supervisor, peer_role, arm, guard, nobody };
inline constexpr std::array<std::string_view, 6> role_names = {"observer", "driver", "supervisor",
                                                               "peer",     "arm",    "guard"};
enum class verb : std::uint8_t { subscribe, publish, advertise, call, provide, plain };

// What a peer came in by.
struct ticket {
  role is = nobody;
  std::uint32_t token = 0; // the number of the token of that role; 0: it has shown none
  bool stop_only = false;
};

class policies {
 public:
  explicit policies(std::uint64_t seed) {
    swarm::seeded_choices chooses{seed ^ 0x1234567U};
    if (chooses.one_in(2)) local_ = driver;
    anonymous_ = chooses.one_in(2);
  }

  rowe::access_options options() const {
    rowe::access_options access;
    access.roles = {{.name = "arm",
                     .subscribe = {"/arm/**", "/rowe/*"},
                     .publish = {"/*", "/arm/*"},
                     .advertise = {"/arm/*"},
                     .call = {"/arm/*", "/rosapi/*"},
                     .provide = {"/arm/*"}},
                    {.name = "guard", .guard = true}};
    rowe::role& of_arm = access.roles[0];
    if (arm_ == shrunk) of_arm.publish = {"/arm/*"};
    if (arm_ == grown) of_arm.subscribe.emplace_back("/odom");
    if (local_ != nobody) access.local_role = role_names[local_];
    access.anonymous_may_stop = anonymous_;
    for (std::size_t i = 0; i < role_names.size(); ++i) {
      const std::string name{role_names[i]};
      if (tokens_[i] != 0) access.identities.push_back({name, name, rowe::hash_token(token_of(i))});
    }
    return access;
  }
  role local() const { return local_; }
  bool anonymous_may_stop() const { return anonymous_; }
  std::uint32_t number_of_token(role of) const { return tokens_[of]; } // 0: it has none now
  // The newest token of a role, also if it is not known any more.
  std::string token_of(std::size_t of) const {
    return std::string{role_names[of]} + "-shows-token-" + std::to_string(newest_[of]);
  }

  bool may(role who, verb what, std::string_view name) const {
    const bool of_arm = name == "/arm/a" || name == "/arm/open";
    switch (who) {
    case observer: return what == verb::subscribe;
    case driver:
    case supervisor: return what != verb::provide;
    case peer_role: return true;
    case arm:
      if (what == verb::subscribe) return name.starts_with("/arm/") || (arm_ == grown && name == "/odom");
      if (what == verb::publish) return of_arm || (arm_ != shrunk && (name == "/cmd" || name == "/odom"));
      return of_arm && what != verb::plain;
    case guard:
    case nobody: break;
    }
    return false;
  }

  // Whether it is told that it has this right, which may be any text, for any name.
  bool is_told(role who, std::string_view right, std::string_view said) const {
    if (who == nobody) return false;
    if (right == "reset") return who == supervisor;
    if (right == "guard") return who == supervisor || who == guard;
    if (right == "take_over") return who == driver || who == supervisor || who == peer_role;
    const std::string name = said.starts_with('/') ? std::string{said} : "/" + std::string{said};
    const bool arms = in_folder(name, "/arm/");
    const bool by_all = who == driver || who == supervisor || who == peer_role;
    if (right == "subscribe") {
      if (name == "/rowe/stop/state" || by_all || who == observer) return true;
      if (who != arm || said.empty() || name == "/rowe/stats") return false; // that one must be spelled out
      return name.starts_with("/arm/") || in_folder(name, "/rowe/") || (arm_ == grown && name == "/odom");
    }
    if (right == "call") {
      if (name.starts_with("/rowe/stop") || name == "/rowe/rights" || by_all) return true;
      if (who == observer)
        return name.starts_with("/rosapi/") || name == "/rowe/stats" || name == "/rowe/types";
      return who == arm && (arms || in_folder(name, "/rosapi/"));
    }
    if (right == "publish")
      return by_all || (who == arm && (arms || (arm_ != shrunk && !said.empty() && in_folder(name, "/"))));
    if (right == "advertise") return by_all || (who == arm && arms);
    if (right == "provide") return who == peer_role || (who == arm && arms);
    return right == "set" && who == supervisor;
  }

  // Changes one thing. Those that stay to the end of the world keep what they have.
  void change(swarm::seeded_choices& random) {
    before_ = {arm_, local_};
    switch (random.below(5)) {
    case 0: local_ = std::array{nobody, observer, driver}[random.below(3)]; break;
    case 1: anonymous_ = !anonymous_; break;
    case 2:
    case 3: arm_ = static_cast<level>(random.below(3)); break;
    default:
      const std::size_t of = std::array{observer, driver, arm, guard}[random.below(4)];
      if (tokens_[of] != 0 && random.one_in(2)) {
        tokens_[of] = 0;
      } else {
        tokens_[of] = ++newest_[of];
      }
    }
  }
  // What becomes of a peer by the last change: why it is closed, or what it is now.
  struct outcome {
    std::string_view closed;
    role is = nobody;
  };
  outcome judge(const ticket& of) const {
    const outcome revoked = of.stop_only && anonymous_ ? outcome{} : outcome{"token revoked"};
    if (of.is == nobody) return revoked; // it has come to stop only
    if (of.token != 0) {
      if (tokens_[of.is] != of.token) return revoked;
      const bool lost =
          of.is == arm && (before_.arm == grown ? arm_ != grown : before_.arm == base && arm_ == shrunk);
      return {lost && !of.stop_only ? "role changed" : "", of.is};
    }
    if (local_ == nobody) return revoked;
    const bool lost = before_.local == driver && local_ == observer;
    return {lost && !of.stop_only ? "role changed" : "", local_};
  }

 private:
  enum level : std::uint8_t { base, shrunk, grown };
  // Of the names directly in there.
  static bool in_folder(std::string_view name, std::string_view folder) {
    return name.starts_with(folder) && name.find('/', folder.size()) == name.npos;
  }
  struct before {
    level arm = base;
    role local = nobody;
  };

  role local_ = nobody;
  bool anonymous_ = false;
  level arm_ = base;
  std::array<std::uint32_t, 6> tokens_{1, 1, 1, 1, 1, 1};
  std::array<std::uint32_t, 6> newest_{1, 1, 1, 1, 1, 1};
  before before_;
};

} // namespace flow
