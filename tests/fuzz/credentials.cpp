// SPDX-License-Identifier: Apache-2.0
// Who somebody is that sends an arbitrary header. Input: one byte that chooses the policy of handshakes, then
// the header. What is required: nobody is let in as an identity whose token does not stand in the header,
// between signs that are none of a token's; a token that may not come in a URL does not let in from one;
// neither the rejection nor what is handed to the HTTP library has it, unless it stands in the URL.
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/access.hpp>

#include "access/policy.hpp"
#include "access/token.hpp"
#include "fuzz/require.hpp"
#include "wire/http/http_request.hpp"

namespace {

using namespace rowe::wire;
using rowe::fuzz::require;

struct known {
  std::string_view name, token;
  bool in_url;
};
constexpr known all[] = {{"anna", "anna-shows-this-token", false},
                         {"bob", "bob.shows_this~token", false},
                         {"link", "link-shows-this-token", true},
                         // one token begins as another one
                         {"eve", "anna-shows-this-token-and-more", false}};

const rowe::access::policy& people() {
  static const rowe::access::policy one = [] {
    rowe::access_options options;
    for (const known& each : all) {
      options.identities.push_back(
          {std::string{each.name}, "driver", rowe::hash_token(each.token), each.in_url});
    }
    require(rowe::check_access(options).empty(), "the options are right");
    return rowe::access::policy{options};
  }();
  return one;
}

bool is_of_token(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         std::string_view{"-._~"}.find(c) != std::string_view::npos;
}

// How often the token stands there by itself. "rowe.token." may stand before it.
std::size_t count(std::string_view token, std::string_view in) {
  std::size_t found = 0;
  for (std::size_t at = in.find(token); at != std::string_view::npos; at = in.find(token, at + 1)) {
    const std::string_view before = in.substr(0, at);
    const std::string_view behind = in.substr(at + token.size());
    const bool begins = before.empty() || !is_of_token(before.back()) || before.ends_with(token_subprotocol);
    found += begins && (behind.empty() || !is_of_token(behind.front()));
  }
  return found;
}

handshake_policy policy_of(std::uint8_t choice) {
  static constexpr std::string_view subprotocols[] = {"rowe.v1"};
  handshake_policy policy{.port = 8080, .secure = (choice & 1) != 0, .any_host = (choice & 2) != 0};
  policy.subprotocols = subprotocols;
  policy.lenient = (choice & 4) != 0;
  return policy;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0 || size > 2 * http_header_bytes_max) return 0;
  const std::string header(reinterpret_cast<const char*>(data + 1), size - 1);
  const http_judgement j = judge_request(header, policy_of(data[0]));
  std::array<char, http_clean_bytes_max> buffer;
  if (j.outcome == http_outcome::rejected) {
    std::array<char, http_rejection_bytes_max> words;
    const std::string_view said = write_rejection(words, j.rejection);
    for (const known& one : all)
      require(count(one.token, said) == 0 || count(one.token, header) > 1, "a rejection quotes no token");
    return 0;
  }
  const auto who = people().find(j.token, j.token_in_url);
  const std::string_view clean = write_clean_request(buffer, j);
  for (std::size_t i = 0; i < std::size(all); ++i) {
    const known& one = all[i];
    const std::size_t there = count(one.token, header);
    const bool is_it = who && who->identity == i;
    require(!is_it || there != 0, "who shows no token is nobody");
    require(!is_it || one.in_url || !j.token_in_url, "a token comes in a URL only where it may");
    require(!is_it || people().identity_name(who->identity) == one.name, "whoever it is has that name");
    if (is_it && there == 1 && !j.token_in_url)
      require(count(one.token, clean) == 0, "a token goes no further");
  }
  require(!who || !j.token.empty(), "nobody is known without a token");
  if (who) { // each of its signs counts
    for (std::size_t at = 0; at < j.token.size(); ++at) {
      std::string other{j.token};
      other[at] = other[at] == 'q' ? 'r' : 'q';
      require(!people().find(other, false), "another token is nobody's");
    }
  }
  return 0;
}
