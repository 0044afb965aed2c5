// SPDX-License-Identifier: Apache-2.0
// Writes the answer to a page request through libwebsockets: headers, then the body in one piece. The body's
// memory is valid only until the next poll(). So libwebsockets gets all of it now, and keeps a copy of what
// the socket does not take. Service thread, inside a callback of libwebsockets.
#pragma once
#include <string_view>

#include "service/transport.hpp"
#include "wire/http_request.hpp"

struct lws;

namespace rowe::net {

// Our page may load only from its own server, and nobody may frame it.
inline constexpr std::string_view content_security_policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

// True when the value of an If-None-Match header names `etag` (RFC 9110 13.1.2: weak comparison, "*", lists).
bool etag_matches(std::string_view if_none_match, std::string_view etag) noexcept;

// False when it could not be written; the connection is of no use then.
bool write_page(lws* wsi, const wire::http_judgement& request, const service::http_answer& answer) noexcept;

} // namespace rowe::net
