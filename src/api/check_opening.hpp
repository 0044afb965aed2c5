// SPDX-License-Identifier: Apache-2.0
// What endpoint::listen() and connect() refuse before they open anything; also how a configuration is judged.
#pragma once
#include <string>
#include <vector>

#include <rowe/options.hpp>
#include <rowe/result.hpp>

#include "access/check_access.hpp"

namespace rowe::detail {

// What of the options a server reads.
tls_options server_part(const tls_options& of);

// What is wrong between who may connect and how they could prove who they are; empty: nothing.
std::vector<access::fault> check_proofs(const endpoint_options& options);

// Whether an endpoint may listen beyond loopback: what is sent can be read by those alone whom it is meant
// for, and who they are is known; or the user says that this does not matter.
bool may_be_reached(const endpoint_options& options) noexcept;

// What is wrong besides access, as check_listen() says it.
std::vector<error> listen_faults(const endpoint_options& options);

// Errors: bad_argument, bad_access, bad_address (EINVAL: not numeric), not_loopback, bad_certificate. Set-up:
// allocates, and reads the files of TLS.
status check_listen(const endpoint_options& options);

// The token that connect() sends: `token`, or what `token_file` holds; empty: none. Error: bad_access, where
// `why`, if given, is assigned what is wrong. Reads the file. Set-up.
result<std::string> token_to_show(const endpoint_options& options, std::string* why = nullptr);

} // namespace rowe::detail
