// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

namespace rowe::ros1 {

// The md5sum of a text, 32 hexadecimal digits: what ROS 1 tells types apart by, and no secret. Empty where
// the machine's libcrypto is set up to refuse it.
std::string md5_of(std::string_view text);

// As rosbridge writes bytes.
std::string base64_of(std::string_view bytes);
// False: it is none.
bool bytes_of_base64(std::string_view text, std::string& into);

} // namespace rowe::ros1
