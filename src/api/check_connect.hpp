// SPDX-License-Identifier: Apache-2.0
// What connect() needs of the options besides check_options(): the token that it shows.
#pragma once
#include <string>

#include <rowe/options.hpp>
#include <rowe/result.hpp>

namespace rowe::detail {

// `token`, or what `token_file` holds; empty: none. Error: bad_access, where `why`, if given, is assigned
// what is wrong. Reads the file. Set-up.
result<std::string> token_to_show(const endpoint_options& options, std::string* why = nullptr);

} // namespace rowe::detail
