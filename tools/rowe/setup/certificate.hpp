// SPDX-License-Identifier: Apache-2.0
// The robot's certificate, and the private root that signs it. The root may vouch for this robot's names, for
// .local and for private addresses only (name constraints), so importing it on a phone opens no other door.
// All keys are ECDSA P-256: a handshake with them costs the robot least.
#pragma once
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "host_names.hpp"

namespace rowe::tools {

inline constexpr int certificate_days_default = 397; // what browsers accept of any root
inline constexpr int certificate_days_max = 824;     // a day less than what Apple's accept

using calendar_time = std::chrono::sys_seconds;

// The private key of a certificate.
class private_key {
 public:
  static std::optional<private_key> make(std::string& wrong);
  static std::optional<private_key> read(const std::string& pem, std::string& wrong);
  std::string pem() const;

 private:
  friend class certificate;
  friend class root_authority;
  explicit private_key(std::shared_ptr<void> handle) : handle_{std::move(handle)} {}
  std::shared_ptr<void> handle_; // EVP_PKEY, which overwrites itself when it is freed
};

class certificate {
 public:
  // The first one in the text.
  static std::optional<certificate> read(const std::string& pem, std::string& wrong);
  std::string pem() const;
  std::string der() const;
  calendar_time begin() const;
  calendar_time end() const;
  std::string common_name() const;
  host_names names() const;
  // SHA-256, as browsers show it: "A1:B2:...".
  std::string fingerprint() const;
  // The SHA-256 of its public key, as --pin takes it: 64 hexadecimal digits. A renewed one has the same.
  std::string pin() const;
  bool belongs_to(const private_key& key) const;

 private:
  friend class root_authority;
  explicit certificate(std::shared_ptr<void> handle) : handle_{std::move(handle)} {}
  std::shared_ptr<void> handle_; // X509
};

class root_authority {
 public:
  // A new root for a robot, whose own names it may vouch for beside private ones. Begins a day before `now`:
  // robots boot with clocks that are wrong.
  static std::optional<root_authority> make(const std::string& robot, const host_names& names,
                                            calendar_time now, int days, std::string& wrong);
  static std::optional<root_authority> read(const std::string& certificate_pem, const std::string& key_pem,
                                            std::string& wrong);

  const certificate& own() const noexcept { return own_; }
  std::string key_pem() const { return key_.pem(); }

  // Whether it may vouch for this name or address.
  bool may_vouch_for(const std::string& name) const;

  // A certificate of a server, which ends with the root at the latest. It is verified before it is returned.
  std::optional<certificate> sign(const std::string& robot, const host_names& names, const private_key& key,
                                  calendar_time now, int days, std::string& wrong) const;
  // The same for a client. Its certificate has the name as common name, and names no host.
  std::optional<certificate> sign_client(const std::string& name, const private_key& key, calendar_time now,
                                         int days, std::string& wrong) const;

 private:
  struct wanted;
  std::optional<certificate> issue(const wanted& what, const private_key& key, calendar_time now, int days,
                                   std::string& wrong) const;
  root_authority(certificate own, private_key key) : own_{std::move(own)}, key_{std::move(key)} {}
  certificate own_;
  private_key key_;
};

} // namespace rowe::tools
