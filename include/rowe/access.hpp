// SPDX-License-Identifier: Apache-2.0
// Who may do what at an endpoint. Ordinary threads, at set-up; allocates.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include <rowe/rt/attributes.hpp>

namespace rowe {

// What peers of one kind may do. A list has patterns, and a right holds for the names that match one of them:
// `*` stands for any text without a slash, `**` for any text, everything else for itself. Names and patterns
// mean the same with and without their first slash. Plain messages, and calls without a name, have the empty
// name, which only `**` matches. An empty list: the role does not have that right.
//
// Everyone who is known may stop the robot, whatever the role says, and see the stop's state.
struct role {
  std::string name;                        // 1 to 64 bytes: letters, digits and . _ -
  std::vector<std::string> subscribe = {}; // each list: at most 64 patterns of 128 bytes and 4 stars
  std::vector<std::string> publish = {};
  std::vector<std::string> advertise = {}; // announce a topic, as clients of rosbridge do before they publish
  std::vector<std::string> call = {};
  std::vector<std::string> provide = {}; // a service
  std::vector<std::string> set = {};     // parameters
  bool reset = false;                    // the stop
  bool guard = false;                    // be a guard of the stop; to end the guard of others takes `reset`
  bool take_over = false;                // take control of a driven topic from somebody who drives it
};

// Someone who proves by a token, or by a certificate (tls_options::client_ca), who that is. Of both, the
// token counts.
struct identity {
  std::string name;              // 1 to 64 bytes: letters, digits and . _ - @
  std::string role;              // the name of one
  std::string token_sha256 = {}; // the token's hash, as 64 hexadecimal digits; the token itself is stored
                                 // nowhere. Empty: this identity has a certificate alone
  bool token_in_url = false;     // the token may also come as `?token=`, where logs of proxies may see it
  // The common name (CN) in the subject of the client's certificate, exactly: 1 to 64 bytes of printable
  // ASCII. A subject with two common names is nobody's. Empty: no certificate is this identity's.
  std::string certificate = {};
};

struct access_options {
  // Besides `observer` (subscribes to everything, calls /rosapi/**, /rowe/stats and /rowe/types), `driver`
  // (also publishes and calls everything, and takes over), `supervisor` (also sets parameters, resets and
  // guards) and `peer` (a driver that also provides services: robots, bridges).
  // A role of one of these names replaces it. At most 64.
  std::vector<role> roles = {};
  // At most 1024. If there are none, nobody has to prove anything: whoever connects may do everything, except
  // that only peers on this machine reset and guard.
  std::vector<identity> identities = {};
  // The role of peers that connect from this machine without a token; empty: they need one, like all others.
  // Whoever comes through a proxy or a tunnel on this machine has it, too.
  std::string local_role = {};
  // Whether peers without a token may connect to stop the robot and to see the stop's state. They can do
  // nothing else.
  bool anonymous_may_stop = false;
};

// Whether a pattern, as a role has it, describes the name. Any thread; never waits, never allocates. Steps in
// proportion to the product of the lengths at most, for each byte that a `**` takes.
bool pattern_matches(std::string_view pattern, std::string_view name) noexcept;

// What is wrong with the options, in words that name the value and what is allowed; empty: nothing.
std::string check_access(const access_options& options);

// The hash of a token, as identity::token_sha256 has it. A token has 16 to 128 bytes: letters, digits and
// - . _ ~. Empty for any other text.
std::string hash_token(std::string_view token);

} // namespace rowe
