// SPDX-License-Identifier: Apache-2.0
// Logging in by a form, for clients that can send a token in no other way (a WebSocket of a browser that some
// library opens). The form is POSTed to login_path, and the answer sets a cookie, which the browser then
// sends with each upgrade. The cookie is the token itself, so it ends when the token does.
//
// A cookie belongs to a host, not to a port. So its name has the port, and two robots on one machine keep
// theirs apart; but every other server on that host sees it. Under TLS the name begins with `__Host-`:
// browsers then take it from this host alone, over TLS alone, so nobody on the way or under a neighbouring
// name can set another one.
//
// Every function here: pure, any thread, never waits, never allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace rowe::wire {

struct handshake_policy;
struct http_judgement;

inline constexpr std::string_view login_path = "/rowe/login";   // GET: the page with the form; POST: the form
inline constexpr std::string_view logout_path = "/rowe/logout"; // POST alone: a link could be anywhere
inline constexpr std::string_view form_type = "application/x-www-form-urlencoded";
// A token of 128 bytes, of which each is three.
inline constexpr std::size_t form_bytes_max = 512;

// Whether the request begins as one that a form may be behind.
inline bool may_have_form(std::string_view request) noexcept { return request.starts_with("POST "); }

// As find_header_end(), but with the form, which has to come first. A form whose length is missing, or wrong,
// or more than form_bytes_max, is not waited for: judge_request() then refuses the header.
std::size_t find_request_end(std::string_view bytes, std::size_t scanned = 0) noexcept;

// The token of a form `token=...`, without blanks around it, written into `out`, which has form_bytes_max.
// Empty if there is none, or more than one, or if it is malformed.
std::string_view token_of_form(std::span<char> out, std::string_view form) noexcept;

// Takes the header's Cookie fields, of which there may be several.
class cookie_reader {
 public:
  void take(std::string_view list, const handshake_policy& policy) noexcept;
  // Of our cookie. Empty if there is none, or if there are two of one name.
  std::string_view token() const noexcept {
    const cookie& shown = secure_.count > 0 ? secure_ : plain_;
    return shown.count == 1 ? shown.value : std::string_view{};
  }

 private:
  struct cookie {
    std::string_view value;
    std::uint32_t count = 0;
  };
  cookie secure_; // __Host-
  cookie plain_;
};

// Bytes that always suffice for the next.
inline constexpr std::size_t login_answer_bytes_max = 1024;
// The answer to a form that is right: it sets the cookie, or takes it away where `token` is empty, and sends
// the browser on. Empty if `out` is too small.
std::string_view write_login_answer(std::span<char> out, const http_judgement& form, std::string_view token,
                                    const handshake_policy& policy) noexcept;

} // namespace rowe::wire
