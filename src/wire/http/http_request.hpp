// SPDX-License-Identifier: Apache-2.0
// The handshake filter: it judges the header of the first and only request of a connection, before anything
// else sees it. The transport peeks at the socket until the header is complete, and calls judge_request() on
// the service thread. Then it hands a page request or an upgrade to the HTTP library, or it answers why not
// (http_answer.hpp) and closes. The filter is strict: what it lets through has one meaning, and
// write_clean_request() writes that meaning anew, so the library never parses what a peer wrote.
//
// It guards against three things. Any page in a browser may open a WebSocket to localhost, hence the check of
// Origin. An attacker may make a name point here (DNS rebinding), hence the check of Host. Upgrades to h2c,
// and CONNECT, would pass the library's own filter.
//
// Every function here: pure, any thread, never waits, never allocates; time is linear in the header.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "wire/http/http_answer.hpp"

namespace rowe::wire {

inline constexpr std::size_t http_header_bytes_max = 4096;
inline constexpr std::size_t lenient_key_bytes_max = 64;

// Bytes that always suffice for write_clean_request().
inline constexpr std::size_t http_clean_bytes_max = http_header_bytes_max + 256;

// Where the header ends: one past its empty line, or 0 if that has not come yet. For a reader that peeks
// repeatedly: the first `scanned` bytes had no end, and are not looked at again. An empty line counts however
// it ends, so a header with bare line feeds is refused at once, and not only at a deadline.
std::size_t find_header_end(std::string_view bytes, std::size_t scanned = 0) noexcept;

// What a transport allows. The views need to be valid only during the calls, except `subprotocols`, to which
// judgements refer.
struct handshake_policy {
  std::uint16_t port = 0; // the one we listen on
  // It speaks TLS alone. So our own pages are https, and nothing is compressed: the length of a compressed
  // answer would say something of what is in it (BREACH).
  bool secure = false;
  // Our names besides localhost, 127.0.0.1 and [::1]. `robot.local` is accepted with our port or without one,
  // `robot.local:9000` only with that port (a forwarded one).
  std::span<const std::string_view> hosts{};
  bool any_host = false;
  // Origins besides our own, as browsers write them: `http://lab.example:8000`. `null` is refused even if it
  // is listed, because every sandboxed frame of every page has it.
  std::span<const std::string_view> origins{};
  // The subprotocols that we speak. If a client offers none, none is chosen; if it offers only others, it is
  // refused.
  std::span<const std::string_view> subprotocols{};
  // For clients that are less strict than RFC 6455, such as Hop's. The key may be any base64 of 1 to
  // lenient_key_bytes_max characters instead of 16 bytes. A client that offers only other subprotocols is
  // answered without one. Everything else is as strict as before.
  bool lenient = false;
};

enum class http_outcome : std::uint8_t {
  page,    // GET or HEAD of a path
  upgrade, // a WebSocket handshake that is right in every point
  form,    // POST of login_path or logout_path (http_login.hpp)
  rejected,
};

// The views point into the header that was judged, except `subprotocol`, which points into the policy.
struct http_judgement {
  http_outcome outcome = http_outcome::rejected;
  bool head = false;         // page: HEAD, not GET
  bool accepts_gzip = false; // page; never where the policy is `secure`
  std::string_view target;   // as it stands in the request line
  std::string_view path;     // the same without the query
  std::string_view host;
  std::string_view origin;        // empty when absent
  std::string_view if_none_match; // page; empty when absent
  std::string_view key;           // upgrade
  std::string_view subprotocol;   // upgrade: the first one offered that we speak, or empty
  std::string_view token;         // what the client proves by who it is; empty: nothing
  bool token_in_url = false;
  std::string_view form;      // form: what was typed in, as it was sent
  bool secure_cookie = false; // form: a cookie goes back over TLS alone
  http_rejection rejection;   // rejected
};

// A browser cannot set headers, so its token may be an offered subprotocol that begins with this.
inline constexpr std::string_view token_subprotocol = "rowe.token.";

// Judges a complete header, with its empty line, and the form behind it where there is one
// (find_request_end()). A text longer than http_header_bytes_max is refused with
// 431. So a reader whose buffer of that size is full, without an end, passes one byte more, or calls
// header_too_large(). A token is taken from `Authorization: Bearer`, else from an offered subprotocol, else
// from `?token=`, else from our cookie. Whose it is, is not judged, and no rejection quotes it.
http_judgement judge_request(std::string_view request, const handshake_policy& policy) noexcept;
http_judgement header_too_large() noexcept;

// Writes the request anew, only with what was judged, and returns it; empty if `out` is too small. It has
// Host; for an upgrade, the handshake with the chosen subprotocol; for a page, If-None-Match and
// Accept-Encoding. Empty, too, for a form, which no library sees.
std::string_view write_clean_request(std::span<char> out, const http_judgement& judgement) noexcept;

} // namespace rowe::wire
