// SPDX-License-Identifier: Apache-2.0
#include "net/http/handshake_answers.hpp"

#include <charconv>

namespace rowe::net::answer {
namespace {

constexpr std::uint16_t bad_request = 400;
constexpr std::uint16_t request_timeout = 408;
constexpr std::uint16_t header_fields_too_large = 431;
constexpr std::uint16_t internal_error = 500;
constexpr std::uint16_t service_unavailable = 503;

struct decimal {
  explicit decimal(std::uint64_t number) noexcept
      : end{std::to_chars(digits, digits + sizeof digits, number).ptr} {}
  std::string_view text() const noexcept { return {digits, static_cast<std::size_t>(end - digits)}; }
  char digits[20];
  char* end;
};

wire::http_rejection rejection_of(std::uint16_t status, std::string_view what, std::string_view remedy,
                                  std::string_view value = {}) noexcept {
  wire::http_rejection rejection;
  rejection.set(status, what, remedy, value);
  return rejection;
}

} // namespace

wire::http_rejection too_many_handshakes(std::uint32_t handshakes_max) noexcept {
  return rejection_of(service_unavailable, "% handshakes are under way, which is the limit",
                      "try again in a moment, or raise handshakes_max", decimal{handshakes_max}.text());
}

wire::http_rejection evicted() noexcept {
  return rejection_of(service_unavailable, "too many handshakes are under way",
                      "try again, with the whole request at once");
}

wire::http_rejection too_many_pages(std::uint32_t pages_max) noexcept {
  return rejection_of(service_unavailable, "% pages are under way, which is the limit",
                      "try again in a moment, or raise handshakes_max", decimal{pages_max}.text());
}

wire::http_rejection too_many_waiting(std::uint32_t waiting_max) noexcept {
  return rejection_of(service_unavailable, "% pages wait for a value, which is the limit",
                      "try again in a moment, or raise handshakes_max", decimal{waiting_max}.text());
}

wire::http_rejection too_many_connections(std::uint32_t ordinary_max) noexcept {
  return rejection_of(service_unavailable, "all % connections are taken",
                      "close another one, or raise connections_max; to stop, connect to /rowe/stop",
                      decimal{ordinary_max}.text());
}

wire::http_rejection too_many_from_one_address(std::uint32_t connections_max) noexcept {
  return rejection_of(service_unavailable, "your address holds all % connections that one address may hold",
                      "close another one, or raise connections_per_address_max",
                      decimal{connections_max}.text());
}

wire::http_rejection no_place_for_stop() noexcept {
  return rejection_of(service_unavailable,
                      "the places reserved for the stop have just been given to others, or used to stop",
                      "try again within a second");
}

wire::http_rejection not_admitted(const service::admit_answer& why,
                                  const wire::http_judgement& request) noexcept {
  wire::http_rejection rejection = rejection_of(why.status, why.what, why.remedy, why.value);
  rejection.to_head = request.head;
  rejection.to_form = request.outcome == wire::http_outcome::form;
  return rejection;
}

wire::http_rejection too_many_wrong_tokens() noexcept {
  return rejection_of(service::rejection::slowed,
                      "this token is not known here, and many unknown tokens came from this address",
                      "ask whoever runs this endpoint for one");
}

wire::http_rejection header_too_large(std::uint32_t bytes_max) noexcept {
  return rejection_of(header_fields_too_large, "the request header is larger than % bytes",
                      "delete the cookies of this host, or send fewer headers", decimal{bytes_max}.text());
}

wire::http_rejection header_timed_out() noexcept {
  return rejection_of(request_timeout, "the header of the request did not end in time", "send it at once");
}

wire::http_rejection speaks_tls() noexcept {
  return rejection_of(0, "the client speaks TLS, and this port does not",
                      "open http:// or ws:// in place of https:// or wss://");
}

wire::http_rejection speaks_no_tls() noexcept {
  return rejection_of(bad_request, "this port speaks TLS, and the client does not",
                      "open https:// or wss:// in place of http:// or ws://");
}

wire::http_rejection tls_failed(std::string_view reason, std::string_view remedy) noexcept {
  return rejection_of(0, "the TLS handshake failed: %", remedy, reason);
}

wire::http_rejection tls_timed_out() noexcept {
  return rejection_of(0, "the TLS handshake did not end in time", "check the network between the two");
}

wire::http_rejection no_descriptor() noexcept {
  return rejection_of(service_unavailable, "this process has no file descriptor left",
                      "raise its limit of open files (ulimit -n) or lower connections_max");
}

wire::http_rejection no_memory() noexcept {
  return rejection_of(service_unavailable, "no memory is left for another handshake or page",
                      "try again in a moment, or raise handshake_bytes");
}

wire::http_rejection page_not_written() noexcept {
  return rejection_of(internal_error, "the page could not be written", "report this with the request");
}

wire::http_rejection upgrade_not_answered() noexcept {
  return rejection_of(internal_error, "the upgrade could not be answered", "report this with the request");
}

} // namespace rowe::net::answer
