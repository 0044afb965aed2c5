// SPDX-License-Identifier: Apache-2.0
#include "wire/http/http_answer.hpp"

#include "wire/http/http_login.hpp"
#include "wire/text/text_out.hpp"

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
  case 409: return "Conflict";
  case 411: return "Length Required";
  case 413: return "Content Too Large";
  case 415: return "Unsupported Media Type";
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

// What stands around the two texts, and between them.
struct frame {
  std::string_view headers;
  std::string_view begin;
  std::string_view between;
  std::string_view link; // behind it: the path of the form
  std::string_view end;
};
constexpr frame of_text{"Content-Type: text/plain; charset=utf-8\r\n", "", "\n", "", "\n"};
constexpr frame of_page{"Content-Type: text/html; charset=utf-8\r\n"
                        "Content-Security-Policy: default-src 'none'; style-src 'self'\r\n",
                        "<!doctype html><html lang=\"en\"><title>Log in</title>"
                        "<meta name=\"viewport\" content=\"width=device-width\">"
                        "<link rel=\"stylesheet\" href=\"/style.css\"><body class=\"login\"><main><h1>",
                        "</h1><p>", "</p><p><a href=\"", "\">Log in</a></p></main>\n"};

// No text becomes markup.
void add_plain(text_out& to, std::string_view text, bool in_page) noexcept {
  for (std::size_t at = 0; in_page && (at = text.find_first_of("<&")) != text.npos;) {
    to.add(text.substr(0, at)).add("?");
    text.remove_prefix(at + 1);
  }
  to.add(text);
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
  const bool page = rejection.to_form;
  const frame& around = page ? of_page : of_text;
  const std::string_view path = page ? login_path : std::string_view{};
  const std::size_t bytes = around.begin.size() + what.size() + around.between.size() + remedy.size() +
                            around.link.size() + path.size() + around.end.size();
  answer.add(around.headers).add("Content-Length: ").add(bytes);
  answer.add("\r\nConnection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n");
  if (rejection.status == 401) answer.add("WWW-Authenticate: Bearer\r\n");
  if (rejection.status == 405) answer.add("Allow: GET, HEAD\r\n");
  if (rejection.status == 426) answer.add("Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n");
  if (rejection.status == 429) answer.add("Retry-After: 1\r\n");
  answer.add("\r\n");
  if (!rejection.to_head) {
    answer.add(around.begin);
    add_plain(answer, what, page);
    answer.add(around.between);
    add_plain(answer, remedy, page);
    answer.add(around.link).add(path).add(around.end);
  }
  return answer.cut() ? std::string_view{} : answer.text();
}

} // namespace rowe::wire
