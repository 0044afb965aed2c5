// SPDX-License-Identifier: Apache-2.0
// Checks what set-up is asked for, before anything is taken or built: the options of an endpoint, and the
// request for a queue pair. An error names the argument, its value and the bound that it exceeds.
//
// Every function here: pure, any thread, never waits, never allocates.
#pragma once
#include <array>
#include <string_view>

#include <rowe/detail/pair_request.hpp>
#include <rowe/options.hpp>
#include <rowe/result.hpp>

namespace rowe::detail {

// Errors: bad_argument.
status check_options(const endpoint_options& options) noexcept;

// Its parts: the first value that is out of its own range, and each of those that another one bounds.
status check_values(const endpoint_options& options) noexcept;
std::array<status, 5> check_relations(const endpoint_options& options) noexcept;

// Names and types are UTF-8 without control characters. Errors: not_utf8, control_character.
status check_text(argument which, std::string_view text) noexcept;

// Checks a request against the options of its endpoint, which are checked already. Errors: bad_argument,
// not_utf8, control_character, reserved_topic.
status check_request(const pair_request& asked, const endpoint_options& options) noexcept;

} // namespace rowe::detail
