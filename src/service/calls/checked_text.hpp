// SPDX-License-Identifier: Apache-2.0
// Checks the texts of users, before anything else reads them.
#pragma once
#include <cstdint>
#include <string_view>

#include <rowe/result.hpp>

#include "wire/codec/object_form.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {

// A text must be one JSON object without the members that are reserved. `ttl_ms` is reserved where the text
// has a time to live, which is written there. Errors: malformed and its kin, not_an_object, reserved_member.
// Time is linear in the text.
inline status check_object_text(json::reader& validator, std::string_view text, bool timed = false) noexcept {
  if (const status valid = validator.validate(text); !valid) return valid;
  if (!json::is_object(text)) return errc::not_an_object;
  if (const auto at = wire::find_reserved(text, timed))
    return error{errc::reserved_member, static_cast<std::int64_t>(*at)};
  return {};
}

} // namespace rowe::service
