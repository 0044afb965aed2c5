// SPDX-License-Identifier: Apache-2.0
#include "wire/http_answer.hpp"

#include "wire/text_out.hpp"

namespace rowe::wire {
namespace {

std::string_view phrase_of(std::uint16_t status) noexcept {
  switch (status) {
  case 400: return "Bad Request";
  case 401: return "Unauthorized";
  case 403: return "Forbidden";
  case 404: return "Not Found";
  case 405: return "Method Not Allowed";
  case 408: return "Request Timeout";
  case 426: return "Upgrade Required";
  case 429: return "Too Many Requests";
  case 431: return "Request Header Fields Too Large";
  case 500: return "Internal Server Error";
  case 503: return "Service Unavailable";
  case 505: return "HTTP Version Not Supported";
  default: return "Refused";
  }
}

// Writes `text` with `%` replaced by `value`, printable ASCII only. Returns the bytes written.
std::uint8_t fill(std::span<char> into, std::string_view text, std::string_view value) noexcept {
  constexpr std::size_t value_bytes_max = 96;
  text_out out{into};
  const std::size_t place = text.find('%');
  out.add(text.substr(0, place));
  if (place != std::string_view::npos) out.add_shortened(value, value_bytes_max).add(text.substr(place + 1));
  const std::size_t bytes = out.text().size();
  for (char& c : into.first(bytes)) {
    if (c < 0x20 || c > 0x7e) c = '?';
  }
  return static_cast<std::uint8_t>(bytes);
}

} // namespace

void http_rejection::set(std::uint16_t http_status, std::string_view what, std::string_view remedy,
                         std::string_view value, std::string_view remedy_value) noexcept {
  status = http_status;
  what_bytes_ = fill(what_, what, value);
  remedy_bytes_ = fill(remedy_, remedy, remedy_value.empty() ? value : remedy_value);
}

std::string_view write_rejection(std::span<char> out, const http_rejection& rejection) noexcept {
  const std::string_view what = rejection.what();
  const std::string_view remedy = rejection.remedy();
  text_out answer{out};
  answer.add("HTTP/1.1 ").add(rejection.status).add(" ").add(phrase_of(rejection.status)).add("\r\n");
  answer.add("Content-Type: text/plain; charset=utf-8\r\nContent-Length: ");
  answer.add(static_cast<std::int64_t>(what.size() + remedy.size() + 2));
  answer.add("\r\nConnection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n");
  if (rejection.status == 401) answer.add("WWW-Authenticate: Bearer\r\n");
  if (rejection.status == 405) answer.add("Allow: GET, HEAD\r\n");
  if (rejection.status == 426) answer.add("Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n");
  answer.add("\r\n");
  if (!rejection.to_head) answer.add(what).add("\n").add(remedy).add("\n");
  return answer.cut() ? std::string_view{} : answer.text();
}

} // namespace rowe::wire
