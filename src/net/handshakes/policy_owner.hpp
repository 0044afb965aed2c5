// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "net/base/address.hpp"
#include "net/base/settings.hpp"
#include "wire/http/http_request.hpp"

namespace rowe::net {

// The policy of the handshake filter, made from the options at set-up, and the texts that it refers to.
class policy_owner {
 public:
  policy_owner(const listen_options& options, const socket_address& bound);
  policy_owner(const policy_owner&) = delete;
  policy_owner& operator=(const policy_owner&) = delete;

  const wire::handshake_policy& policy() const noexcept { return policy_; }

 private:
  void add_own_names();

  std::vector<std::string> texts_;
  std::vector<std::string_view> views_; // of texts_
  wire::handshake_policy policy_;       // of views_
};

} // namespace rowe::net
