// SPDX-License-Identifier: Apache-2.0
#include "net/http/http_page.hpp"

#include <libwebsockets.h>

#include <algorithm>
#include <charconv>
#include <utility>

#include "wire/text/text_out.hpp"

namespace rowe::net {

namespace {

constexpr std::size_t header_bytes_max = 2048;
constexpr unsigned not_modified = 304;

// Collects headers in a buffer of its own; remains false after one that did not fit.
class header_writer {
 public:
  header_writer(lws* wsi, unsigned status) noexcept : wsi_{wsi} {
    good_ = lws_add_http_header_status(wsi_, status | LWSAHH_FLAG_NO_SERVER_NAME, &at_, end()) == 0;
  }

  // `name` with its colon, in lower case. An empty value leaves the header out.
  void add(const char* name, std::string_view value) noexcept {
    if (!good_ || value.empty()) return;
    good_ = lws_add_http_header_by_name(wsi_, reinterpret_cast<const unsigned char*>(name),
                                        reinterpret_cast<const unsigned char*>(value.data()),
                                        static_cast<int>(value.size()), &at_, end()) == 0;
  }

  void add_length(std::size_t bytes) noexcept {
    if (good_) good_ = lws_add_http_header_content_length(wsi_, bytes, &at_, end()) == 0;
  }

  bool send() noexcept {
    return good_ && lws_finalize_write_http_header(wsi_, buffer_ + LWS_PRE, &at_, end()) == 0;
  }

 private:
  unsigned char* end() noexcept { return buffer_ + sizeof buffer_; }

  lws* wsi_;
  unsigned char buffer_[LWS_PRE + header_bytes_max];
  unsigned char* at_ = buffer_ + LWS_PRE;
  bool good_ = false;
};

std::string_view security_policy_of(service::page_kind kind) noexcept {
  switch (kind) {
  case service::page_kind::form: return form_security_policy;
  case service::page_kind::users: return users_security_policy;
  case service::page_kind::own: break;
  }
  return content_security_policy;
}

std::string_view without_weakness(std::string_view tag) noexcept {
  return tag.starts_with("W/") ? tag.substr(2) : tag;
}

} // namespace

bool etag_matches(std::string_view if_none_match, std::string_view etag) noexcept {
  if (etag.empty()) return false;
  const std::string_view wanted = without_weakness(etag);
  while (!if_none_match.empty()) {
    const std::size_t begin = if_none_match.find_first_not_of(" \t,");
    if (begin == std::string_view::npos) return false;
    if_none_match.remove_prefix(begin);
    if (if_none_match.front() == '*') return true;
    // A comma may stand within the quotes, so an entry ends at its closing quote.
    const std::size_t open = if_none_match.find('"');
    const std::size_t close = open == std::string_view::npos ? open : if_none_match.find('"', open + 1);
    if (close == std::string_view::npos) return false;
    if (without_weakness(if_none_match.substr(0, close + 1)) == wanted) return true;
    if_none_match.remove_prefix(close + 1);
  }
  return false;
}

bool write_rest(lws* wsi, std::span<const std::byte>& rest) noexcept {
  const std::span<const std::byte> piece = rest.first(std::min(rest.size(), page_piece_bytes));
  rest = rest.subspan(piece.size());
  // libwebsockets writes into the LWS_PRE bytes before a payload only for frames and HTTP/2, so it only reads
  // this one.
  auto* const bytes = reinterpret_cast<unsigned char*>(const_cast<std::byte*>(piece.data()));
  if (lws_write(wsi, bytes, piece.size(), rest.empty() ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < 0)
    return false;
  return rest.empty() || lws_callback_on_writable(wsi) >= 0;
}

bool write_page(lws* wsi, const wire::http_judgement& request, const service::http_answer& answer,
                std::span<const std::byte>& rest) noexcept {
  const bool unchanged = answer.status == 200 && etag_matches(request.if_none_match, answer.etag);
  header_writer headers{wsi, unchanged ? not_modified : answer.status};
  if (!unchanged) {
    headers.add("content-type:", answer.content_type);
    headers.add("content-encoding:", answer.content_encoding);
    headers.add_length(answer.body.size());
  }
  headers.add("etag:", answer.etag);
  if (!answer.etag.empty()) headers.add("vary:", "accept-encoding"); // what has a version may be compressed
  headers.add("cache-control:", answer.cache_control);
  char age[20];
  if (answer.age_ms >= 0)
    headers.add("rowe-age-ms:", {age, std::to_chars(age, age + sizeof age, answer.age_ms).ptr});
  headers.add("content-security-policy:", security_policy_of(answer.kind));
  if (answer.kind != service::page_kind::users) headers.add("cross-origin-resource-policy:", "same-origin");
  headers.add("x-content-type-options:", "nosniff");
  headers.add("referrer-policy:", answer.kind == service::page_kind::form ? "same-origin" : "no-referrer");
  if (answer.retry_after_s != 0)
    headers.add("retry-after:", {age, std::to_chars(age, age + sizeof age, answer.retry_after_s).ptr});
  headers.add("connection:", "close");
  if (!headers.send()) return false;
  if (unchanged || request.head || answer.body.empty()) return true;

  rest = answer.body;
  if (answer.lasts) return write_rest(wsi, rest);
  auto* const body =
      reinterpret_cast<unsigned char*>(const_cast<std::byte*>(rest.data())); // read only, as in write_rest()
  return lws_write(wsi, body, std::exchange(rest, {}).size(), LWS_WRITE_HTTP_FINAL) >= 0;
}

std::string_view write_long_page_head(std::span<char> out, const service::http_answer& answer) noexcept {
  wire::text_out head{out};
  head.add("HTTP/1.1 200 OK\r\ncontent-type: ").add(answer.content_type);
  head.add("\r\ncontent-length: ").add(answer.in_pieces.bytes);
  head.add("\r\ncache-control: ").add(answer.cache_control);
  if (answer.age_ms >= 0) head.add("\r\nrowe-age-ms: ").add(answer.age_ms);
  head.add("\r\ncontent-security-policy: ").add(security_policy_of(answer.kind));
  head.add("\r\ncross-origin-resource-policy: same-origin");
  head.add(
      "\r\nx-content-type-options: nosniff\r\nreferrer-policy: no-referrer\r\nconnection: close\r\n\r\n");
  return head.text();
}

} // namespace rowe::net
