// SPDX-License-Identifier: Apache-2.0
#include "wire/http/http_request.hpp"

#include <algorithm>
#include <array>

#include "wire/http/http_fields.hpp"
#include "wire/http/http_login.hpp"
#include "wire/http/http_names.hpp"
#include "wire/http/http_redaction.hpp"
#include "wire/http/http_token.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::wire {
namespace {

struct field_value {
  std::string_view text;
  bool given = false;
};

// The parts of a header that decide, as they were written.
struct fields {
  std::string_view method;
  std::string_view protocol;
  field_value host, origin, upgrade, key, version, authorization;
  field_value content_length, content_type, transfer_encoding;
  cookie_reader cookies;
  bool connection_upgrade = false; // Connection says Upgrade
  bool offers = false;             // a subprotocol was offered
  std::string_view offered;        // the first that a diagnostic may quote
  std::string_view offered_token;
  unsigned if_none_match_count = 0;
};

bool is_base64_digit(char c) noexcept {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '+' || c == '/';
}

// Whether the text is base64 of 16 bytes: 22 digits and the padding.
bool is_handshake_key(std::string_view text) noexcept {
  return text.size() == 24 && text.ends_with("==") &&
         std::all_of(text.begin(), text.begin() + 22, is_base64_digit);
}

// Whether the text is digits of base64 and at most two characters of padding. Hop's key is "ws" and a number
// of its process in base64.
bool is_lenient_key(std::string_view text) noexcept {
  if (text.empty() || text.size() > lenient_key_bytes_max) return false;
  for (int padding = 0; padding < 2 && text.ends_with('='); ++padding) text.remove_suffix(1);
  return !text.empty() && std::all_of(text.begin(), text.end(), is_base64_digit);
}

// Whether one element of Accept-Encoding says gzip, and not with a weight of zero.
bool says_gzip(std::string_view element) noexcept {
  const std::size_t semicolon = std::min(element.find(';'), element.size());
  if (!equal_ignoring_case(trimmed(element.substr(0, semicolon)), "gzip")) return false;
  const std::string_view weight = trimmed(element.substr(std::min(semicolon + 1, element.size())));
  return !(weight.starts_with("q=0") && weight.find_first_not_of("0.", 3) == std::string_view::npos);
}

// Judges one request, step by step. A step that refuses sets the rejection and returns false. What it repeats
// goes through shown::.
class judge {
 public:
  judge(const handshake_policy& policy, http_judgement& out) noexcept : policy_{policy}, out_{out} {}

  bool read(std::string_view header) noexcept;
  bool judge_request_line() noexcept;
  bool judge_host() noexcept;
  bool judge_origin() noexcept;
  bool judge_body() noexcept;
  bool is_form() const noexcept { return seen_.method == "POST"; }
  bool judge_form(std::string_view form) noexcept;
  bool judge_form_origin() noexcept;
  bool wants_upgrade() const noexcept {
    return seen_.upgrade.given || seen_.key.given || seen_.version.given;
  }
  bool judge_upgrade() noexcept;
  bool take_token() noexcept;

 private:
  bool reject(std::uint16_t status, std::string_view what, std::string_view remedy,
              std::string_view value = {}, std::string_view remedy_value = {}) noexcept {
    out_.rejection.set(status, what, remedy, value, remedy_value);
    return false;
  }
  bool reject_line(const http_lines& where) noexcept;
  bool take_once(field_value& member, const http_field& field) noexcept;
  bool take(const http_field& field) noexcept;
  bool take_offer(std::string_view list) noexcept;

  const handshake_policy& policy_;
  http_judgement& out_;
  fields seen_;
};

constexpr std::string_view check_the_client =
    "this port speaks HTTP/1.1 and WebSocket; check what connects to it";

// By its number: nobody knows what is in it.
bool judge::reject_line(const http_lines& where) noexcept {
  std::array<char, 32> number;
  const auto text = text_out{number}.add("line ").add(where.last_line_number()).text();
  return reject(400, diagnostic_of(where.fault()), check_the_client, text);
}

bool judge::read(std::string_view header) noexcept {
  http_lines lines{header};
  const auto first = lines.request_line();
  if (!first) return reject_line(lines);
  const std::size_t method_end = std::min(first->find(' '), first->size());
  const std::size_t target_end = first->find(' ', std::min(method_end + 1, first->size()));
  seen_.method = first->substr(0, method_end);
  if (target_end == std::string_view::npos || !is_token(seen_.method)) {
    return reject(400, "the request line is malformed", check_the_client);
  }
  out_.target = first->substr(method_end + 1, target_end - method_end - 1);
  seen_.protocol = first->substr(target_end + 1);
  while (const auto field = lines.next_field()) {
    if (!take(*field)) return false;
  }
  if (lines.fault() == line_fault::none) return true;
  return reject_line(lines);
}

bool judge::take_once(field_value& member, const http_field& field) noexcept {
  if (member.given)
    return reject(400, "the header % is there twice", "send it once", shown::word(field.name));
  member = {.text = field.value, .given = true};
  return true;
}

bool judge::take(const http_field& field) noexcept {
  const auto is = [&field](std::string_view name) { return equal_ignoring_case(field.name, name); };
  if (is("host")) return take_once(seen_.host, field);
  if (is("origin")) return take_once(seen_.origin, field);
  if (is("upgrade")) return take_once(seen_.upgrade, field);
  if (is("sec-websocket-key")) return take_once(seen_.key, field);
  if (is("sec-websocket-version")) return take_once(seen_.version, field);
  if (is("content-length")) return take_once(seen_.content_length, field);
  if (is("content-type")) return take_once(seen_.content_type, field);
  if (is("transfer-encoding")) return take_once(seen_.transfer_encoding, field);
  if (is("authorization")) return take_once(seen_.authorization, field);
  if (is("sec-websocket-protocol")) return take_offer(field.value);
  if (is("connection")) {
    for (std::string_view list = field.value; !list.empty();) {
      if (equal_ignoring_case(next_element(list), "upgrade")) seen_.connection_upgrade = true;
    }
  } else if (is("cookie")) {
    seen_.cookies.take(field.value, policy_);
  } else if (is("accept-encoding")) {
    for (std::string_view list = field.value; !list.empty();) {
      if (says_gzip(next_element(list))) out_.accepts_gzip = !policy_.secure;
    }
  } else if (is("if-none-match")) {
    // two of them: neither counts, and the whole page is sent
    out_.if_none_match = ++seen_.if_none_match_count == 1 ? field.value : std::string_view{};
  }
  return true;
}

// Subprotocols may be offered in several fields (RFC 6455 11.3.4), in the client's order of preference.
bool judge::take_offer(std::string_view list) noexcept {
  while (!list.empty()) {
    const std::string_view name = next_element(list);
    if (name.empty()) continue;
    if (name.starts_with(token_subprotocol)) { // no offer
      if (!seen_.offered_token.empty())
        return reject(400, "two tokens are offered as subprotocols", "offer one");
      seen_.offered_token = name.substr(token_subprotocol.size());
      continue;
    }
    if (!is_token(name)) return reject(400, "a subprotocol is malformed", "offer names without blanks");
    seen_.offers = true;
    if (seen_.offered.empty() || seen_.offered == shown::not_shown) seen_.offered = shown::word(name);
    const auto known = std::find(policy_.subprotocols.begin(), policy_.subprotocols.end(), name);
    if (out_.subprotocol.empty() && known != policy_.subprotocols.end()) out_.subprotocol = *known;
  }
  return true;
}

bool judge::judge_request_line() noexcept {
  out_.rejection.to_head = out_.head = seen_.method == "HEAD";
  if (!seen_.protocol.starts_with("HTTP/") || seen_.protocol.find_first_of(" \t") != std::string_view::npos) {
    return reject(400, "the request line is malformed: it does not end in a version of HTTP",
                  check_the_client);
  }
  if (seen_.protocol != "HTTP/1.1")
    return reject(505, "% is not spoken here", "use a client of HTTP/1.1", shown::word(seen_.protocol));
  out_.path = out_.target.substr(0, out_.target.find('?'));
  const bool posts_form = is_form() && (out_.path == login_path || out_.path == logout_path);
  if (seen_.method != "GET" && seen_.method != "HEAD" && !posts_form) {
    return reject(405, "the method % is not offered here", "use GET", shown::word(seen_.method));
  }
  const auto is_visible = [](char c) { return c > 0x20 && c < 0x7f && c != '#'; };
  if (!out_.target.starts_with('/') || !std::all_of(out_.target.begin(), out_.target.end(), is_visible)) {
    return reject(400, "the request is not for a path", "ask for a path such as /, of printable ASCII");
  }
  return true;
}

bool judge::judge_host() noexcept {
  if (!seen_.host.given) return reject(400, "the Host header is missing", "use a client of HTTP/1.1");
  out_.host = seen_.host.text;
  const auto asked = to_authority(out_.host);
  if (!asked) return reject(400, "the Host header is malformed", "send HOST or HOST:PORT");
  if (policy_.any_host || is_ours(*asked, policy_)) return true;
  const bool at_our_port = !asked->port || *asked->port == policy_.port;
  return reject(403, "Host % is not a name of this endpoint", "start rowe serve with --allow-host %",
                shown::host(out_.host), shown::host(at_our_port ? asked->host : out_.host));
}

bool judge::judge_origin() noexcept {
  if (!seen_.origin.given) return true; // no browser
  out_.origin = seen_.origin.text;
  if (equal_ignoring_case(out_.origin, "null")) {
    return reject(403, "Origin null is not allowed here",
                  "open the page over http://, not from a file or a sandbox");
  }
  if (is_own_origin(out_.origin, out_.host, policy_) || is_listed_origin(out_.origin, policy_)) return true;
  return reject(403, "Origin % is not allowed here", "start rowe serve with --allow-origin %",
                shown::origin(out_.origin));
}

bool judge::judge_body() noexcept {
  if (seen_.transfer_encoding.given) {
    return reject(400, "a request body is not taken here: Transfer-Encoding %", "send no body",
                  shown::word(seen_.transfer_encoding.text));
  }
  if (seen_.content_length.given && to_number(seen_.content_length.text) != std::uint64_t{0}) {
    return reject(400, "a request body is not taken here: Content-Length %", "send no body",
                  shown::number(seen_.content_length.text));
  }
  return true;
}

// Whoever sends a form says where it stands: every browser does. Else a page from elsewhere could log
// somebody in, as somebody else.
bool judge::judge_form_origin() noexcept {
  if (!seen_.origin.given)
    return reject(403, "the Origin header is missing, which every browser sends with a form",
                  "without a browser, send the token in the header Authorization");
  out_.secure_cookie = policy_.secure || begins_with_https(out_.origin);
  if (!out_.secure_cookie && !is_loopback_origin(out_.origin))
    return reject(403, "a token from % could be read on the way",
                  "give this endpoint a certificate, or log in on its own machine",
                  shown::origin(out_.origin));
  return true;
}

bool judge::judge_form(std::string_view form) noexcept {
  if (!judge_form_origin()) return false;
  if (seen_.transfer_encoding.given)
    return reject(411, "a form is not taken with Transfer-Encoding %", "send its Content-Length",
                  shown::word(seen_.transfer_encoding.text));
  if (!seen_.content_length.given) return reject(411, "the Content-Length of the form is missing", "send it");
  const auto length = to_number(seen_.content_length.text);
  if (!length)
    return reject(400, "the Content-Length is no number: %", "send the bytes of the form",
                  shown::number(seen_.content_length.text));
  if (*length > form_bytes_max) {
    static_assert(form_bytes_max == 512);
    return reject(413, "a form of % bytes is too long", "send 512 bytes at most",
                  shown::number(seen_.content_length.text));
  }
  if (form.size() != *length)
    return reject(400, "the form is not as long as its Content-Length says: %", "send all of it",
                  shown::number(seen_.content_length.text));
  const std::string_view type = seen_.content_type.text;
  if (*length > 0 && !equal_ignoring_case(trimmed(type.substr(0, type.find(';'))), form_type))
    return reject(415, "a form of the type % is not taken", "send application/x-www-form-urlencoded",
                  shown::word(type));
  out_.form = form;
  return true;
}

bool judge::judge_upgrade() noexcept {
  if (seen_.method != "GET")
    return reject(405, "a WebSocket handshake cannot be a % request", "use GET", shown::word(seen_.method));
  if (!seen_.upgrade.given) return reject(426, "the Upgrade header is missing", "send Upgrade: websocket");
  if (!equal_ignoring_case(seen_.upgrade.text, "websocket")) {
    return reject(400, "an upgrade to % is not offered here", "ask for websocket, or leave Upgrade out",
                  shown::word(seen_.upgrade.text));
  }
  if (!seen_.connection_upgrade) {
    return reject(400, "the Connection header does not say Upgrade",
                  "send Connection: Upgrade; a proxy in between must pass it on");
  }
  if (!seen_.version.given)
    return reject(426, "Sec-WebSocket-Version is missing", "send Sec-WebSocket-Version: 13");
  if (seen_.version.text != "13") {
    return reject(426, "WebSocket version % is not spoken here", "send Sec-WebSocket-Version: 13",
                  shown::number(seen_.version.text));
  }
  if (!seen_.key.given) return reject(400, "Sec-WebSocket-Key is missing", "send 16 random bytes in base64");
  if (policy_.lenient ? !is_lenient_key(seen_.key.text) : !is_handshake_key(seen_.key.text)) {
    return reject(400,
                  policy_.lenient ? "Sec-WebSocket-Key is not base64 of at most 64 characters"
                                  : "Sec-WebSocket-Key does not decode to 16 bytes",
                  "send 16 random bytes in base64");
  }
  out_.key = seen_.key.text;
  if (!seen_.offers || !out_.subprotocol.empty() || policy_.lenient) return true;
  const bool none_known = policy_.subprotocols.empty();
  return reject(400, "no subprotocol offered is spoken here: %",
                none_known ? "offer none" : "offer %, or no subprotocol at all", seen_.offered,
                none_known ? std::string_view{} : policy_.subprotocols.front());
}

// Other schemes than Bearer are for proxies, or for nobody: they are ignored.
bool judge::take_token() noexcept {
  const auto in_query = token_in_query(out_.target);
  if (!in_query) return reject(400, "two tokens are in the URL", "send one");
  constexpr std::string_view scheme = "bearer ";
  const std::string_view said = seen_.authorization.text;
  if (equal_ignoring_case(said.substr(0, scheme.size()), scheme)) {
    out_.token = trimmed(said.substr(scheme.size()));
  } else if (!seen_.offered_token.empty()) {
    out_.token = seen_.offered_token;
  } else {
    out_.token = *in_query;
    out_.token_in_url = !out_.token.empty();
  }
  // Last: a browser sends it unasked.
  if (out_.token.empty()) out_.token = seen_.cookies.token();
  return true;
}

} // namespace

std::size_t find_header_end(std::string_view bytes, std::size_t scanned) noexcept {
  constexpr std::size_t overlap = 2; // the last bytes that were scanned may have been "\n\r"
  std::size_t at = bytes.find('\n', scanned - std::min(scanned, overlap));
  for (; at != std::string_view::npos; at = bytes.find('\n', at + 1)) {
    const std::string_view behind = bytes.substr(at + 1, 2);
    if (behind.starts_with('\n')) return at + 2;
    if (behind == "\r\n") return at + 3;
  }
  return 0;
}

http_judgement judge_request(std::string_view request, const handshake_policy& policy) noexcept {
  if (request.size() > http_header_bytes_max) return header_too_large();
  http_judgement out;
  judge steps{policy, out};
  const std::size_t end = may_have_form(request) ? find_header_end(request) : 0;
  const std::string_view header = end == 0 ? request : request.substr(0, end);
  const bool right =
      steps.read(header) && steps.judge_request_line() && steps.judge_host() && steps.judge_origin() &&
      (steps.is_form() ? steps.judge_form(request.substr(header.size())) : steps.judge_body()) &&
      (!steps.wants_upgrade() || steps.judge_upgrade()) && (steps.is_form() || steps.take_token());
  if (!right) return out;
  if (steps.is_form()) {
    out.outcome = http_outcome::form;
    return out;
  }
  if (steps.wants_upgrade()) {
    out.outcome = http_outcome::upgrade;
    out.accepts_gzip = false;
    out.if_none_match = {};
  } else {
    out.outcome = http_outcome::page;
    out.subprotocol = {};
  }
  return out;
}

http_judgement header_too_large() noexcept {
  static_assert(http_header_bytes_max == 4096);
  http_judgement out;
  out.rejection.set(431, "the request header is larger than 4096 bytes",
                    "delete the cookies of this host, or send fewer headers");
  return out;
}

std::string_view write_clean_request(std::span<char> out, const http_judgement& judgement) noexcept {
  text_out request{out};
  request.add(judgement.head ? "HEAD " : "GET ").add(judgement.target).add(" HTTP/1.1\r\nHost: ");
  request.add(judgement.host).add("\r\n");
  if (judgement.outcome == http_outcome::upgrade) {
    request.add(
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: ");
    request.add(judgement.key).add("\r\n");
    if (!judgement.subprotocol.empty()) {
      request.add("Sec-WebSocket-Protocol: ").add(judgement.subprotocol).add("\r\n");
    }
  } else {
    request.add("Connection: close\r\n");
    if (judgement.accepts_gzip) request.add("Accept-Encoding: gzip\r\n");
    if (!judgement.if_none_match.empty())
      request.add("If-None-Match: ").add(judgement.if_none_match).add("\r\n");
  }
  request.add("\r\n");
  const bool none = judgement.outcome == http_outcome::rejected || judgement.outcome == http_outcome::form;
  return request.cut() || none ? std::string_view{} : request.text();
}

} // namespace rowe::wire
