// SPDX-License-Identifier: Apache-2.0
// The access options in a form that the service thread can ask: which role has which right, and whose a token
// is. Made at set-up, and never changed.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/access.hpp>

namespace rowe::access {

enum class right : std::uint8_t { subscribe, publish, advertise, call, provide, reset, guard };
std::string_view name_of(right which) noexcept;

// Numbers of a role and of an identity in one policy.
using role_number = std::uint16_t;
using identity_number = std::uint16_t;
inline constexpr std::uint16_t nobody = std::numeric_limits<std::uint16_t>::max();

using token_hash = std::array<unsigned char, 32>;

// Who a peer is.
struct subject {
  role_number role = nobody;
  identity_number identity = nobody; // nobody: known by its address only
  friend bool operator==(const subject&, const subject&) = default;
};

// The roles that are there without being asked for.
std::vector<role> built_in_roles();

class policy {
 public:
  // Nobody has to prove anything.
  policy() = default;
  // The options must be right: check_access().
  explicit policy(const access_options& options);

  bool in_use() const noexcept { return !identities_.empty(); }
  bool anonymous_may_stop() const noexcept { return anonymous_may_stop_; }
  subject local() const noexcept { return {.role = local_role_}; }

  // Whether the role has the right for this topic or service. Reset and guard have no name. Time grows with
  // the role's patterns, but a role that may do something everywhere is answered at once.
  bool allows(role_number role, right what, std::string_view name = {}) const noexcept;

  // How many patterns allows() may have to look at.
  std::size_t patterns(role_number role, right what) const noexcept;

  // Whose token this is. Compares with the hashes of all identities, in constant time each. Not real-time.
  std::optional<subject> find(std::string_view token, bool from_url) const noexcept;

  std::string_view role_name(role_number which) const noexcept;
  std::string_view identity_name(identity_number which) const noexcept;

 private:
  static constexpr std::size_t named_rights = 5; // the first of the rights
  struct role_entry {
    std::string name;
    std::array<std::vector<std::string>, named_rights> patterns;
    std::uint8_t everywhere = 0; // bit r: right r holds for every name
    bool reset = false;
    bool guard = false;
  };
  struct identity_entry {
    std::string name;
    token_hash hash;
    role_number role;
    bool in_url;
  };

  void add(const role& one);
  role_number number_of(std::string_view role) const noexcept;

  std::vector<role_entry> roles_;
  std::vector<identity_entry> identities_;
  role_number local_role_ = nobody;
  bool anonymous_may_stop_ = false;
};

} // namespace rowe::access
