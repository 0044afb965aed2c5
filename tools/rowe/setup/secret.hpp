// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

namespace rowe::tools {

// 256 random bits of the kernel as 43 letters, digits, - and _ (base64url, RFC 4648); empty if the kernel has
// none to give.
std::string new_token();

// RFC 4648, section 5, without padding.
std::string base64url(std::string_view bytes);

} // namespace rowe::tools
