// SPDX-License-Identifier: Apache-2.0
// The access options in a form that the service thread can ask: which role has which right, and whose a token
// is. Never changed: other options make another policy, which takes the place of the one before.
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

enum class right : std::uint8_t {
  subscribe,
  publish,
  advertise,
  call,
  provide,
  set,
  reset,
  guard,
  take_over
};
std::string_view name_of(right which) noexcept;

// Numbers of a role and of an identity in one policy.
using role_number = std::uint16_t;
using identity_number = std::uint16_t;
inline constexpr std::uint16_t nobody = std::numeric_limits<std::uint16_t>::max();

using token_hash = std::array<unsigned char, 32>;

// What the subject of a certificate may be called (RFC 5280, upper bounds).
inline constexpr std::size_t common_name_bytes_max = 64;

// Who a peer is.
struct subject {
  role_number role = nobody;
  identity_number identity = nobody; // nobody: known by its address only
  std::uint32_t version = 0;         // of the policy that says so
  friend bool operator==(const subject&, const subject&) = default;
};

// What becomes of a peer when another policy takes the place of the one that let it in.
struct successor {
  enum class fate : std::uint8_t {
    kept,    // it has the same rights
    grown,   // and more
    changed, // it has lost one
    revoked, // what it came in by means nothing any more
  };
  fate what = fate::revoked;
  subject who{}; // what it is now, unless it is revoked
};

// The roles that are there without being asked for.
std::vector<role> built_in_roles();

class policy {
 public:
  // Nobody has to prove anything.
  policy() = default;
  // The options must be right: check_access().
  explicit policy(const access_options& options);
  // The policy that takes the place of `before`.
  policy(const access_options& options, const policy& before);

  bool in_use() const noexcept { return !identities_.empty(); }
  bool anonymous_may_stop() const noexcept { return anonymous_may_stop_; }
  subject local() const noexcept { return {.role = local_role_, .version = version_}; }
  subject anonymous() const noexcept { return {.version = version_}; } // comes without a token, to stop only
  std::uint32_t version() const noexcept { return version_; }

  // What becomes of somebody whom the policy before this one let in.
  successor succeed(const subject& before) const noexcept;

  // Whether the role has the right for this topic or service. Reset, guard and take_over have no name. Time
  // grows with the role's patterns, but a role that may do something everywhere is answered at once.
  bool allows(role_number role, right what, std::string_view name = {}) const noexcept;

  // Whether it has that right everywhere, or one of its patterns is this name written out.
  bool names(role_number role, right what, std::string_view name) const noexcept;
  bool everywhere(role_number role, right what) const noexcept;
  // Whether one of its patterns is this name written out.
  bool spells(role_number role, right what, std::string_view name) const noexcept;

  // How many patterns allows() may have to look at.
  std::size_t patterns(role_number role, right what) const noexcept;

  // Whose token this is. Compares with the hashes of all identities, in constant time each. Not real-time.
  std::optional<subject> find(std::string_view token, bool from_url) const noexcept;

  // Whose certificate this is, by its common name. The transport has verified it. Empty: nobody's.
  std::optional<subject> find_certificate(std::string_view common_name) const noexcept;

  std::string_view role_name(role_number which) const noexcept;
  std::string_view identity_name(identity_number which) const noexcept;

 private:
  static constexpr std::size_t named_rights = 6; // the first of the rights
  struct role_entry {
    std::string name;
    std::array<std::vector<std::string>, named_rights> patterns;
    std::uint8_t everywhere = 0; // bit r: right r holds for every name
    bool reset = false;
    bool guard = false;
    bool take_over = false;
  };
  struct identity_entry {
    std::string name;
    std::optional<token_hash> hash;
    std::string certificate;
    role_number role;
    bool in_url;
  };

  void add(const role& one);
  role_number number_of(std::string_view role) const noexcept;
  static bool covers(const role_entry& all, const role_entry& of) noexcept;
  successor::fate compare(const role_entry& before, role_number now) const noexcept;
  static bool keeps_proofs(const identity_entry& before, const identity_entry& now) noexcept;
  successor successor_of_local(const policy& before) const noexcept;
  successor successor_of_anonymous(const policy& before) const noexcept;
  successor successor_of(const policy& before, const identity_entry& one) const noexcept;

  std::vector<role_entry> roles_;
  std::vector<identity_entry> identities_;
  role_number local_role_ = nobody;
  bool anonymous_may_stop_ = false;
  std::uint32_t version_ = 0;            // how many policies there were before
  std::vector<successor> of_identities_; // of the policy before, by their numbers
  successor of_local_;
  successor of_anonymous_;
};

} // namespace rowe::access
