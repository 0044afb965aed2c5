// SPDX-License-Identifier: Apache-2.0
#include <rowe/access.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>

#include "access/token.hpp"

namespace rowe {
namespace {

constexpr std::size_t roles_max = 64;
constexpr std::size_t identities_max = 1024;
constexpr std::size_t patterns_max = 64;
constexpr std::size_t pattern_bytes_max = 128;
constexpr std::size_t stars_max = 4; // of one pattern: each multiplies the time of a comparison
constexpr std::size_t name_bytes_max = 64;

std::string quoted(std::string_view text) { return '`' + std::string{text.substr(0, 80)} + '`'; }

bool is_name(std::string_view text, std::string_view also) {
  const auto good = [also](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ||
           also.find(c) != std::string_view::npos;
  };
  return !text.empty() && text.size() <= name_bytes_max && std::all_of(text.begin(), text.end(), good);
}

std::string check_count(std::string_view what, std::size_t count, std::size_t most) {
  if (count <= most) return {};
  return std::to_string(count) + " " + std::string{what} + ": there may be " + std::to_string(most);
}

std::string check_patterns(const role& of, std::string_view right, const std::vector<std::string>& patterns) {
  const std::string where = "role " + quoted(of.name) + ", " + std::string{right} + ": ";
  if (std::string wrong = check_count("patterns", patterns.size(), patterns_max); !wrong.empty())
    return where + wrong;
  for (const std::string& one : patterns) {
    if (one.empty()) return where + "a pattern is empty";
    if (one.size() > pattern_bytes_max) {
      return where + "the pattern " + quoted(one) + " has " + std::to_string(one.size()) +
             " bytes; it may have " + std::to_string(pattern_bytes_max);
    }
    const auto stars = static_cast<std::size_t>(std::count(one.begin(), one.end(), '*'));
    if (stars > stars_max)
      return where + "the pattern " + quoted(one) + " has " + std::to_string(stars) + " stars; it may have 4";
    if (one.find("***") != std::string::npos)
      return where + "the pattern " + quoted(one) + " has three stars; `*` and `**` have a meaning";
  }
  return {};
}

std::string check_role(const role& one) {
  if (!is_name(one.name, "._-"))
    return "role " + quoted(one.name) + ": a name has 1 to 64 letters, digits and . _ -";
  for (const auto& [right, patterns] : {std::pair{"subscribe", &one.subscribe}, {"publish", &one.publish},
                                        {"advertise", &one.advertise}, {"call", &one.call},
                                        {"provide", &one.provide}}) {
    if (std::string wrong = check_patterns(one, right, *patterns); !wrong.empty()) return wrong;
  }
  return {};
}

// What is wrong with the name of a role; empty if there is one.
std::string check_role_name(const access_options& options, std::string_view name) {
  std::vector<role> all = access::built_in_roles();
  all.insert(all.end(), options.roles.begin(), options.roles.end());
  std::string there_are;
  for (const role& one : all) {
    if (one.name == name) return {};
    there_are += (there_are.empty() ? "" : ", ") + one.name;
  }
  return "there is no role " + quoted(name) + "; there are " + there_are;
}

std::string check_identity(const access_options& options, const identity& one) {
  if (!is_name(one.name, "._-@"))
    return "identity " + quoted(one.name) + ": a name has 1 to 64 letters, digits and . _ - @";
  if (const std::string wrong = check_role_name(options, one.role); !wrong.empty())
    return "identity " + quoted(one.name) + ": " + wrong;
  if (!access::hash_from_hex(one.token_sha256)) {
    return "identity " + quoted(one.name) + ": the hash of a token has 64 hexadecimal digits, this one has " +
           std::to_string(one.token_sha256.size()) + " bytes";
  }
  return {};
}

template <class List>
std::string check_twice(std::string_view what, const List& list) {
  for (auto one = list.begin(); one != list.end(); ++one) {
    if (std::any_of(list.begin(), one, [&](const auto& other) { return other.name == one->name; }))
      return std::string{what} + " " + quoted(one->name) + " is there twice";
  }
  return {};
}

} // namespace

std::string check_access(const access_options& options) {
  for (std::string wrong :
       {check_count("roles", options.roles.size(), roles_max), check_twice("role", options.roles),
        check_count("identities", options.identities.size(), identities_max),
        check_twice("identity", options.identities)}) {
    if (!wrong.empty()) return wrong;
  }
  for (const role& one : options.roles) {
    if (std::string wrong = check_role(one); !wrong.empty()) return wrong;
  }
  for (const identity& one : options.identities) {
    if (std::string wrong = check_identity(options, one); !wrong.empty()) return wrong;
  }
  if (!options.local_role.empty()) {
    if (const std::string wrong = check_role_name(options, options.local_role); !wrong.empty())
      return "local_role: " + wrong;
  }
  for (auto one = options.identities.begin(); one != options.identities.end(); ++one) {
    const auto same = std::find_if(options.identities.begin(), one, [&](const identity& other) {
      return access::hash_from_hex(other.token_sha256) == access::hash_from_hex(one->token_sha256);
    });
    if (same != one)
      return "identities " + quoted(same->name) + " and " + quoted(one->name) + " have one token";
  }
  const bool needs_tokens =
      !options.roles.empty() || !options.local_role.empty() || options.anonymous_may_stop;
  if (options.identities.empty() && needs_tokens)
    return "there is no identity, so everyone may do everything: roles, local_role and anonymous_may_stop "
           "mean nothing";
  return {};
}

std::string hash_token(std::string_view token) {
  const auto hash = access::is_token(token) ? access::hash_of(token) : std::nullopt;
  if (!hash) return {};
  std::string digits;
  for (const unsigned char byte : *hash) {
    char two[3];
    std::snprintf(two, sizeof two, "%02x", byte);
    digits += two;
  }
  return digits;
}

} // namespace rowe
