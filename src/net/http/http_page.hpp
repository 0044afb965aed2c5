// SPDX-License-Identifier: Apache-2.0
// Writes the answer to a page request through libwebsockets: headers, then the body. A body whose memory
// lasts is written piece by piece, each when the socket has taken the one before. Any other is valid only
// until the next poll(): so libwebsockets gets all of it now, and keeps a copy of what the socket does not
// take. Service thread, inside a callback of libwebsockets.
#pragma once
#include <cstddef>
#include <span>
#include <string_view>

#include "service/base/transport.hpp"
#include "wire/http/http_request.hpp"

struct lws;

namespace rowe::net {

// Our page may load only from its own server, and nobody may frame it.
inline constexpr std::string_view content_security_policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

// The same for a page with a form. A browser that may send no referrer sends a form with the Origin `null`.
// So it may send one to us.
inline constexpr std::string_view form_security_policy =
    "default-src 'none'; style-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'";

// True when the value of an If-None-Match header names `etag` (RFC 9110 13.1.2: weak comparison, "*", lists).
bool etag_matches(std::string_view if_none_match, std::string_view etag) noexcept;

// A page of its user may be written as most are: with scripts and styles of its own, and pictures made there.
inline constexpr std::string_view users_security_policy =
    "default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' data: blob:; base-uri 'self'; form-action 'self'; "
    "frame-ancestors 'none'";

// What libwebsockets is given at once of a body that lasts: it copies this much at most.
inline constexpr std::size_t page_piece_bytes = std::size_t{4} << 10;

// Assigns `rest` what write_rest() has to write. False when it could not be written; the connection is of no
// use then.
bool write_page(lws* wsi, const wire::http_judgement& request, const service::http_answer& answer,
                std::span<const std::byte>& rest) noexcept;
// What stands before a body in pieces, which libwebsockets does not write: the same headers.
inline constexpr std::size_t long_page_head_bytes_max = 1024;
std::string_view write_long_page_head(std::span<char> out, const service::http_answer& answer) noexcept;
// One piece more, and asks to be called again if that was not the last. False as above.
bool write_rest(lws* wsi, std::span<const std::byte>& rest) noexcept;

} // namespace rowe::net
