// SPDX-License-Identifier: Apache-2.0
// The answers to handshakes that the transport itself refuses, for a want of places, memory or time: all
// their texts stand here, each with the limit that was reached and what to change. Rejections of what a
// request says come from wire/http/http_request.hpp.
//
// Every function here: pure, any thread, never waits, never allocates.
#pragma once
#include <cstdint>
#include <string_view>

#include "service/base/transport.hpp"
#include "wire/http/http_answer.hpp"
#include "wire/http/http_request.hpp"

namespace rowe::net::answer {

// ---- places

wire::http_rejection too_many_handshakes(std::uint32_t handshakes_max) noexcept;
// To one whose place is given to a newer one.
wire::http_rejection evicted() noexcept;
wire::http_rejection too_many_pages(std::uint32_t pages_max) noexcept;
wire::http_rejection too_many_waiting(std::uint32_t waiting_max) noexcept;
wire::http_rejection too_many_connections(std::uint32_t ordinary_max) noexcept;
wire::http_rejection too_many_from_one_address(std::uint32_t connections_max) noexcept;
wire::http_rejection no_place_for_stop() noexcept;

// ---- the request

wire::http_rejection not_admitted(const service::admit_answer& why,
                                  const wire::http_judgement& request) noexcept;
wire::http_rejection too_many_wrong_tokens() noexcept;
wire::http_rejection header_too_large(std::uint32_t bytes_max) noexcept;
wire::http_rejection header_timed_out() noexcept;
// To one who speaks TLS. These words are for the event; their status is 0, because the answer is tls_alert.
wire::http_rejection speaks_tls() noexcept;
// To one who does not speak TLS on a port that does.
wire::http_rejection speaks_no_tls() noexcept;
// These two are for the event only: there is nothing to put words into.
wire::http_rejection tls_failed(std::string_view reason, std::string_view remedy) noexcept;
wire::http_rejection tls_timed_out() noexcept;

// The content type of a TLS client's first record (RFC 8446, 5.1). No HTTP begins with this byte.
inline constexpr char tls_handshake = 0x16;
// A record with a fatal alert, handshake_failure, as TLS 1.0 to 1.3 write it (RFC 8446, 5.1 and 6). A browser
// says at once that the site cannot provide a secure connection.
inline constexpr std::string_view tls_alert{"\x15\x03\x01\x00\x02\x02\x28", 7};

// ---- this process

wire::http_rejection no_descriptor() noexcept;
wire::http_rejection no_memory() noexcept;
wire::http_rejection page_not_written() noexcept;
wire::http_rejection upgrade_not_answered() noexcept;

} // namespace rowe::net::answer
