// SPDX-License-Identifier: Apache-2.0
// The handshake filter under arbitrary bytes. Input: one byte that chooses the policy, then the header. What
// is required: the end of the header is found wherever the reads end; a rejection is printable, complete and
// fits its buffer, and quotes no token; what is accepted is a whole header, and written anew it is accepted
// with the same meaning; only the hosts and origins that the policy names pass.
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "fuzz/require.hpp"
#include "wire/http/http_login.hpp"
#include "wire/http/http_request.hpp"

namespace {

using namespace rowe::wire;
using rowe::fuzz::require;

constexpr std::string_view hosts[] = {"robot.local", "[fe80::1]:9000"};
constexpr std::string_view origins[] = {"http://lab.example:8000"};
constexpr std::string_view subprotocols[] = {"rowe.v1", "foxglove.sdk.v1"};

handshake_policy policy_of(std::uint8_t choice) {
  handshake_policy policy{.port = static_cast<std::uint16_t>((choice & 1) != 0 ? 80 : 8080)};
  if ((choice & 2) != 0) policy.hosts = hosts;
  policy.any_host = (choice & 4) != 0;
  if ((choice & 8) != 0) policy.origins = origins;
  if ((choice & 16) != 0) policy.subprotocols = subprotocols;
  policy.secure = (choice & 32) != 0;
  return policy;
}

void check_rejection(const http_rejection& rejection) {
  require(rejection.status >= 400 && rejection.status < 600, "a rejection has a status");
  require(!rejection.what().empty() && !rejection.remedy().empty(), "a rejection says what and the remedy");
  std::array<char, http_rejection_bytes_max> buffer;
  const std::string_view answer = write_rejection(buffer, rejection);
  require(!answer.empty(), "a rejection fits its buffer");
  for (const char c : answer)
    require(c == '\r' || c == '\n' || (c >= 0x20 && c < 0x7f), "a rejection is printable");
  const std::size_t end = find_header_end(answer);
  require(end > 0, "an answer has a header");
  const std::string length = "Content-Length: " + std::to_string(answer.size() - end) + "\r\n";
  require(rejection.to_head || answer.find(length) != std::string_view::npos, "its length is stated");
}

// A rejection says the same whatever the token is.
void check_secrets(std::string_view header, const http_rejection& rejection, const handshake_policy& policy) {
  constexpr std::size_t changed = 8;
  constexpr std::string_view marks[] = {"Authorization: Bearer ", "rowe.token.",
                                        "?token=", "Cookie: rowe-80="};
  for (const std::string_view mark : marks) {
    const std::size_t at = header.find(mark);
    if (at == std::string_view::npos) continue;
    const std::string_view secret = header.substr(at + mark.size(), changed);
    const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
    if (secret.size() < changed || !std::all_of(secret.begin(), secret.end(), is_letter)) continue;
    std::string other{header};
    other.replace(at + mark.size(), changed, "qqqqqqqq");
    const http_judgement j = judge_request(other, policy);
    if (j.outcome != http_outcome::rejected || j.rejection.status != rejection.status) continue;
    require(j.rejection.what() == rejection.what() && j.rejection.remedy() == rejection.remedy(),
            "a rejection quotes no token");
  }
}

void check_form(const http_judgement& j) {
  require(j.path == login_path || j.path == logout_path, "a form has a path of its own");
  require(!j.origin.empty() && j.origin != "null", "a form says where it stands");
  require(j.form.size() <= form_bytes_max, "a form is small");
  std::array<char, form_bytes_max> typed;
  const std::string_view token = token_of_form(typed, j.form);
  require(token.size() <= j.form.size(), "a token is no longer than its form");
  std::array<char, http_clean_bytes_max> buffer;
  require(write_clean_request(buffer, j).empty(), "no library sees a form");
}

void check_acceptance(std::string_view header, const http_judgement& j, const handshake_policy& policy) {
  require(find_request_end(header) == header.size(), "what is accepted is a whole request");
  require(j.path.starts_with('/') && j.target.starts_with(j.path), "a path is a path");
  if (j.outcome == http_outcome::form) return check_form(j);
  std::array<char, http_clean_bytes_max> buffer;
  const std::string_view clean = write_clean_request(buffer, j);
  require(!clean.empty(), "the clean request fits its buffer");
  const http_judgement again = judge_request(clean, policy);
  require(again.outcome == j.outcome && again.target == j.target && again.host == j.host &&
              again.key == j.key && again.subprotocol == j.subprotocol && again.head == j.head &&
              again.accepts_gzip == j.accepts_gzip && again.if_none_match == j.if_none_match,
          "written anew it means the same");
  std::array<char, http_clean_bytes_max> second_buffer;
  require(write_clean_request(second_buffer, again) == clean, "written anew twice it is the same");
  require(!j.accepts_gzip || !policy.secure, "under TLS nothing is compressed");
  require(j.token.empty() || (j.token.data() >= header.data() &&
                              j.token.data() + j.token.size() <= header.data() + header.size()),
          "a token stands in the header");
  require(j.outcome == http_outcome::page || j.key.size() == 24, "an upgrade has a key");
  if (!j.origin.empty()) {
    require(j.origin != "null" && j.origin.find("://") != std::string_view::npos, "an origin has a scheme");
    require(policy.any_host || j.origin.find("evil") == std::string_view::npos,
            "a foreign origin does not pass");
  }
  require(policy.any_host || j.host.find("evil") == std::string_view::npos, "a foreign host does not pass");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const handshake_policy policy = policy_of(data[0]);
  const std::string_view header{reinterpret_cast<const char*>(data + 1), size - 1};

  const std::size_t end = find_request_end(header);
  require(end <= header.size(), "a request ends within the text");
  for (std::size_t seen = 0; seen < std::min<std::size_t>(header.size(), 256); ++seen) {
    const std::size_t early = find_request_end(header.substr(0, seen));
    require(early == (end != 0 && end <= seen ? end : 0), "the end is found when it has come, not before");
    require(early != 0 || find_request_end(header, seen) == end, "the end is found wherever the reads end");
  }

  const http_judgement j = judge_request(header, policy);
  if (j.outcome == http_outcome::rejected) {
    check_rejection(j.rejection);
    check_secrets(header, j.rejection, policy);
  } else {
    check_acceptance(header, j, policy);
  }
  if (end > 0 && end < header.size()) { // as a reader does that found the end
    const http_judgement whole = judge_request(header.substr(0, end), policy);
    if (whole.outcome != http_outcome::rejected) check_acceptance(header.substr(0, end), whole, policy);
  }
  return 0;
}
