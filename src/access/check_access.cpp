// SPDX-License-Identifier: Apache-2.0
#include "access/check_access.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "access/pattern.hpp"
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

// Or empty: none.
bool is_common_name(std::string_view text) {
  const auto good = [](char c) { return c >= 0x20 && c < 0x7f; };
  return text.size() <= access::common_name_bytes_max && std::all_of(text.begin(), text.end(), good);
}

// What two identities have in common that only one may have; empty: nothing.
std::string_view shared_proof(const identity& one, const identity& other) {
  const auto hash = access::hash_from_hex(one.token_sha256);
  if (hash && hash == access::hash_from_hex(other.token_sha256)) return "token";
  return !one.certificate.empty() && one.certificate == other.certificate ? "certificate" : "";
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
      return where + "the pattern " + quoted(one) +
             " has three stars in a row; only `*` and `**` have a meaning";
  }
  return {};
}

std::string check_role(const role& one) {
  if (!is_name(one.name, "._-"))
    return "role " + quoted(one.name) + ": a name has 1 to 64 letters, digits and . _ -";
  for (const auto& [right, patterns] : {std::pair{"subscribe", &one.subscribe},
                                        {"publish", &one.publish},
                                        {"advertise", &one.advertise},
                                        {"call", &one.call},
                                        {"provide", &one.provide},
                                        {"set", &one.set}}) {
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
  if (!is_common_name(one.certificate))
    return "identity " + quoted(one.name) +
           ": `certificate` is the common name of a certificate, 1 to 64 bytes of printable ASCII, not " +
           quoted(one.certificate);
  if (one.token_sha256.empty() && one.token_in_url)
    return "identity " + quoted(one.name) + ": token_in_url without a token";
  const bool has_certificate_alone = one.token_sha256.empty() && !one.certificate.empty();
  if (!has_certificate_alone && !access::hash_from_hex(one.token_sha256)) {
    return "identity " + quoted(one.name) + ": the hash of a token has 64 hexadecimal digits, this one has " +
           std::to_string(one.token_sha256.size()) + " bytes";
  }
  return {};
}

// Collects what is wrong; of one role or identity the first only.
class fault_list {
 public:
  using place = access::fault::place;

  // Empty: nothing is wrong.
  void add(place where, std::size_t index, std::string text) {
    const auto is_there = [&](const access::fault& f) { return f.where == where && f.index == index; };
    if (!text.empty() && std::none_of(found_.begin(), found_.end(), is_there))
      found_.push_back({where, index, std::move(text)});
  }
  std::vector<access::fault> take() { return std::move(found_); }

 private:
  std::vector<access::fault> found_;
};

template <class List>
void check_twice(fault_list& to, access::fault::place where, std::string_view what, const List& list) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    const auto here = list.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::any_of(list.begin(), here, [&](const auto& other) { return other.name == here->name; }))
      to.add(where, i, std::string{what} + " " + quoted(here->name) + " is defined twice");
  }
}

// Which identity before this one has the same proof.
std::string check_proof(const std::vector<identity>& all, std::size_t index) {
  const identity& one = all[index];
  const auto here = all.begin() + static_cast<std::ptrdiff_t>(index);
  const auto same = std::find_if(all.begin(), here,
                                 [&](const identity& other) { return !shared_proof(other, one).empty(); });
  if (same == here) return {};
  return "identities " + quoted(same->name) + " and " + quoted(one.name) + " have one " +
         std::string{shared_proof(*same, one)};
}

} // namespace

std::vector<access::fault> access::faults_of(const access_options& options) {
  using place = fault::place;
  const auto& [roles, identities, local_role, anonymous_may_stop] = options;
  // The counts first: what follows compares each with each.
  if (std::string wrong = check_count("roles", roles.size(), roles_max); !wrong.empty())
    return {{.text = std::move(wrong)}};
  if (std::string wrong = check_count("identities", identities.size(), identities_max); !wrong.empty())
    return {{.text = std::move(wrong)}};
  fault_list found;
  check_twice(found, place::role, "role", roles);
  check_twice(found, place::identity, "identity", identities);
  for (std::size_t i = 0; i < roles.size(); ++i) found.add(place::role, i, check_role(roles[i]));
  for (std::size_t i = 0; i < identities.size(); ++i)
    found.add(place::identity, i, check_identity(options, identities[i]));
  if (!local_role.empty()) {
    if (const std::string wrong = check_role_name(options, local_role); !wrong.empty())
      found.add(place::local_role, 0, "local_role: " + wrong);
  }
  for (std::size_t i = 0; i < identities.size(); ++i)
    found.add(place::identity, i, check_proof(identities, i));
  if (identities.empty() && (!roles.empty() || !local_role.empty() || anonymous_may_stop)) {
    found.add(place::options, 0,
              "there is no identity, so everyone may do everything: roles, local_role and anonymous_may_stop "
              "have no effect");
  }
  return found.take();
}

bool pattern_matches(std::string_view pattern, std::string_view name) noexcept {
  return access::matches(pattern, name);
}

std::string check_access(const access_options& options) {
  std::vector<access::fault> found = access::faults_of(options);
  return found.empty() ? std::string{} : std::move(found.front().text);
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
