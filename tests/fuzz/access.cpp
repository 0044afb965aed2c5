// SPDX-License-Identifier: Apache-2.0
// Roles and identities under arbitrary options, and two of them one after the other. What is required: a
// role allows what its patterns mean, and nothing else; a token is that of its identity alone, and comes in a
// URL only where it may; whoever stays when other options take the place has no right less than before, and
// whoever keeps what it has has none more; whoever is told to go has lost something.
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/access.hpp>

#include "access/meaning.hpp"
#include "access/policy.hpp"
#include "access/token.hpp"
#include "fuzz/require.hpp"
#include "fuzz/script.hpp"
#include "wire/codec/own_names.hpp"

namespace {

using rowe::access::policy;
using rowe::access::right;
using rowe::access::subject;
using rowe::access::successor;
using rowe::fuzz::require;
using rowe::fuzz::script;
using rowe::wire::without_slash;

constexpr std::size_t pattern_bytes_max = 24; // what a pattern means is looked for by trying all
constexpr right named_rights[] = {right::subscribe, right::publish, right::advertise,
                                  right::call,      right::provide, right::set};
constexpr std::string_view tokens[] = {"first-token-of-all-", "second-token-of-all", "third-token-of-all-",
                                       "fourth-token-of-all"};

std::string some_text(script& from) { return from.text().substr(0, pattern_bytes_max); }

std::string some_name(script& from) {
  constexpr std::string_view names[] = {"observer", "driver", "arm", "anna", "bob", "peer"};
  const std::uint8_t which = from.byte();
  return which < 128 ? std::string{names[which % std::size(names)]} : some_text(from);
}

std::vector<std::string> some_patterns(script& from) {
  constexpr std::string_view common[] = {"**", "/**", "/arm/*", "/arm/**", "odom", "/*"};
  std::vector<std::string> made;
  for (int left = from.byte() % 3; left > 0; --left) {
    const std::uint8_t which = from.byte();
    made.push_back(which < 64 ? std::string{common[which % std::size(common)]} : some_text(from));
  }
  return made;
}

rowe::access_options some_options(script& from) {
  rowe::access_options made;
  for (int left = from.byte() % 4; left > 0; --left) {
    rowe::role one{.name = some_name(from)};
    for (auto* const list : {&one.subscribe, &one.publish, &one.advertise, &one.call, &one.provide, &one.set})
      *list = some_patterns(from);
    const std::uint8_t flags = from.byte();
    one.reset = (flags & 1) != 0;
    one.guard = (flags & 2) != 0;
    made.roles.push_back(std::move(one));
  }
  for (int left = from.byte() % 4; left > 0; --left) {
    rowe::identity one{.name = some_name(from), .role = some_name(from), .token_sha256 = {}};
    const std::uint8_t flags = from.byte();
    one.token_in_url = (flags & 8) != 0;
    one.token_sha256 = flags < 240 ? rowe::hash_token(tokens[flags % std::size(tokens)]) : some_text(from);
    made.identities.push_back(std::move(one));
  }
  const std::uint8_t flags = from.byte();
  if ((flags & 1) != 0) made.local_role = some_name(from);
  made.anonymous_may_stop = (flags & 2) != 0;
  return made;
}

// ---- what the options say, read anew

const rowe::role* role_of(const rowe::access_options& options, std::string_view name) {
  static const std::vector<rowe::role> built_in = rowe::access::built_in_roles();
  for (const auto* const all : {&options.roles, &built_in}) {
    const auto found = std::find_if(all->begin(), all->end(), [&](auto& one) { return one.name == name; });
    if (found != all->end()) return &*found;
  }
  return nullptr;
}

bool allows(const rowe::role& one, right what, std::string_view name) {
  if (what == right::reset) return one.reset;
  if (what == right::guard) return one.guard;
  const std::vector<std::string>* const lists[] = {&one.subscribe, &one.publish, &one.advertise,
                                                   &one.call,      &one.provide, &one.set};
  const auto& patterns = *lists[static_cast<std::size_t>(what)];
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    const std::string_view bare = without_slash(pattern);
    if (name.empty()) return bare == "**"; // what has no name is not one of some names
    return access_meaning::means(bare, without_slash(name));
  });
}

bool same_hash(std::string_view a, std::string_view b) {
  return rowe::access::hash_from_hex(a) == rowe::access::hash_from_hex(b);
}

// Of one policy and the options that made it.
struct judged {
  const rowe::access_options& options;
  const policy& by;
};

void check_rights(const judged& of, const std::vector<std::string>& names) {
  std::size_t roles = 0;
  for (std::uint16_t number = 0; of.by.role_name(number) != "nobody"; ++number, ++roles) {
    const rowe::role* const one = role_of(of.options, of.by.role_name(number));
    require(one != nullptr, "a role is one of the options or built in");
    for (const std::string& name : names) {
      for (const right what : named_rights)
        require(of.by.allows(number, what, name) == allows(*one, what, name), "a role allows what it says");
    }
    for (const right what : {right::reset, right::guard})
      require(of.by.allows(number, what) == allows(*one, what, {}), "reset and guard are as said");
  }
  require(roles >= 4, "there are the built-in roles");
  require(!of.by.allows(rowe::access::nobody, right::subscribe, "/odom"), "nobody has no right");
}

void check_tokens(const judged& of) {
  for (const std::string_view token : tokens) {
    for (const bool in_url : {false, true}) {
      const auto found = of.by.find(token, in_url);
      const auto& all = of.options.identities;
      const auto has_it = [&](const rowe::identity& one) {
        return same_hash(one.token_sha256, rowe::hash_token(token));
      };
      const auto known = std::find_if(all.begin(), all.end(), has_it);
      const bool may = known != all.end() && (known->token_in_url || !in_url);
      require(found.has_value() == may, "a token that is known lets in, where it may stand");
      if (!found) continue;
      require(of.by.identity_name(found->identity) == known->name, "it is that of its identity");
      require(of.by.role_name(found->role) == known->role, "which has its role");
    }
    std::string other{token};
    other.back() = 'x';
    require(!of.by.find(other, false), "another token lets nobody in");
  }
}

// ---- one after the other

template <class Name>
std::uint16_t number_of(std::string_view name, Name&& name_of) {
  std::uint16_t number = 0;
  while (name_of(number) != name) ++number; // it is there
  return number;
}

void check_fate(const judged& before, const judged& after, const subject& who,
                const std::vector<std::string>& names) {
  const successor next = after.by.succeed(who);
  using enum successor::fate;
  if (next.what == revoked || next.what == changed || !after.by.in_use()) return;
  for (const std::string& name : names) {
    for (const right what : named_rights) {
      const bool had = before.by.allows(who.role, what, name);
      const bool has = after.by.allows(next.who.role, what, name);
      require(has || !had, "whoever stays loses nothing");
      require(next.what == grown || has == had, "whoever is kept wins nothing");
    }
  }
  for (const right what : {right::reset, right::guard}) {
    const bool had = before.by.allows(who.role, what);
    const bool has = after.by.allows(next.who.role, what);
    require((has || !had) && (next.what == grown || has == had), "the same for reset and guard");
  }
}

void check_succession(const judged& before, const judged& after, const std::vector<std::string>& names) {
  for (const rowe::identity& one : before.options.identities) {
    const subject who{.role = number_of(one.role, [&](auto n) { return before.by.role_name(n); }),
                      .identity = number_of(one.name, [&](auto n) { return before.by.identity_name(n); })};
    check_fate(before, after, who, names);
    const successor next = after.by.succeed(who);
    const auto is_it = [&](const rowe::identity& other) {
      return other.name == one.name && same_hash(other.token_sha256, one.token_sha256);
    };
    const auto& all = after.options.identities;
    const bool stays = std::any_of(all.begin(), all.end(), is_it);
    require(!after.by.in_use() || (next.what == successor::fate::revoked) != stays,
            "an identity whose name and token are there stays known");
    require(next.what == successor::fate::revoked || !after.by.in_use() ||
                after.by.identity_name(next.who.identity) == one.name,
            "and has its name");
  }
  if (before.by.local().role != rowe::access::nobody) check_fate(before, after, before.by.local(), names);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 1024) return 0;
  script from{data, size};
  const rowe::access_options first = some_options(from);
  const bool again = from.byte() % 2 != 0;
  rowe::access_options second = again ? first : some_options(from);
  if (again && !second.roles.empty()) { // one role has other patterns
    rowe::role& one = second.roles[from.byte() % second.roles.size()];
    (from.byte() % 2 != 0 ? one.subscribe : one.provide) = some_patterns(from);
    one.reset = from.byte() % 2 != 0;
  }
  std::vector<std::string> names{"", "/odom", "odom", "/arm/a", "/arm/a/b", "/rosapi/topics"};
  for (int left = 4; left > 0 && !from.over(); --left) names.push_back(some_text(from));
  for (const rowe::role& one : first.roles) {
    if (!one.subscribe.empty()) names.push_back(one.subscribe.front()); // as a name it is not special
  }
  if (!rowe::check_access(first).empty()) return 0;
  const policy before{first};
  check_rights({first, before}, names);
  check_tokens({first, before});
  if (!rowe::check_access(second).empty()) return 0;
  const policy after{second, before};
  check_rights({second, after}, names);
  check_tokens({second, after});
  check_succession({first, before}, {second, after}, names);
  return 0;
}
