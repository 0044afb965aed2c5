// SPDX-License-Identifier: Apache-2.0
#include "wire/http/http_login.hpp"

#include <algorithm>
#include <optional>

#include "wire/http/http_fields.hpp"
#include "wire/http/http_request.hpp"
#include "wire/text/percent.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::wire {
namespace {

constexpr std::string_view secure_prefix = "__Host-";
constexpr std::string_view cookie_prefix = "rowe-"; // then the port

// How long the form is that the header announces; nothing where none is to be waited for.
std::optional<std::size_t> form_bytes(std::string_view header) noexcept {
  http_lines lines{header};
  std::optional<std::size_t> length;
  if (!lines.request_line()) return std::nullopt;
  while (const auto field = lines.next_field()) {
    if (equal_ignoring_case(field->name, "transfer-encoding")) return std::nullopt;
    if (!equal_ignoring_case(field->name, "content-length")) continue;
    const auto number = to_number(field->value);
    if (length || !number || *number > form_bytes_max) return std::nullopt;
    length = *number;
  }
  return lines.fault() == line_fault::none ? length : std::nullopt;
}

// The next `name=value` of a list with this separator; removes it from the list.
std::string_view next_pair(std::string_view& list, char separator) noexcept {
  const std::size_t end = std::min(list.find(separator), list.size());
  const std::string_view pair = list.substr(0, end);
  list.remove_prefix(std::min(end + 1, list.size()));
  return pair;
}

} // namespace

std::size_t find_request_end(std::string_view bytes, std::size_t scanned) noexcept {
  if (!may_have_form(bytes)) return find_header_end(bytes, scanned);
  const std::size_t end = find_header_end(bytes); // it may have been seen before its form
  if (end == 0) return 0;
  const std::size_t form = form_bytes(bytes.substr(0, end)).value_or(0);
  return bytes.size() - end >= form ? end + form : 0;
}

std::string_view token_of_form(std::span<char> out, std::string_view form) noexcept {
  constexpr std::string_view name = "token=";
  std::optional<std::string_view> found;
  while (!form.empty()) {
    const std::string_view pair = next_pair(form, '&');
    if (!pair.starts_with(name)) continue;
    if (found) return {};
    found = pair.substr(name.size());
  }
  return trimmed(undo_percent(out, found.value_or(""), ' ').value_or(""));
}

void cookie_reader::take(std::string_view list, const handshake_policy& policy) noexcept {
  while (!list.empty()) {
    const std::string_view pair = trimmed(next_pair(list, ';'));
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos) continue;
    std::string_view name = pair.substr(0, equals);
    const bool secure = name.starts_with(secure_prefix);
    if (secure) name.remove_prefix(secure_prefix.size());
    if (!name.starts_with(cookie_prefix)) continue;
    name.remove_prefix(cookie_prefix.size());
    if (name.starts_with('0') || to_number(name) != policy.port) continue; // 08080 would be another cookie
    if (!secure && policy.secure) continue; // whoever is on the way of a request without TLS could set it
    cookie& one = secure ? secure_ : plain_;
    one = {pair.substr(equals + 1), one.count + 1};
  }
}

std::string_view write_login_answer(std::span<char> out, const http_judgement& form, std::string_view token,
                                    const handshake_policy& policy) noexcept {
  text_out answer{out};
  answer.add("HTTP/1.1 303 See Other\r\nLocation: ").add(token.empty() ? login_path : "/");
  answer.add("\r\nSet-Cookie: ").add(form.secure_cookie ? secure_prefix : "").add(cookie_prefix);
  answer.add(policy.port).add("=").add(token).add("; Path=/; HttpOnly; SameSite=Strict");
  if (form.secure_cookie) answer.add("; Secure");
  if (token.empty()) answer.add("; Max-Age=0");
  answer.add("\r\nContent-Length: 0\r\nConnection: close\r\nCache-Control: no-store\r\n"
             "X-Content-Type-Options: nosniff\r\n\r\n");
  return answer.cut() ? std::string_view{} : answer.text();
}

} // namespace rowe::wire
