// SPDX-License-Identifier: Apache-2.0
#include "api/settings_reader.hpp"

#include <algorithm>

namespace rowe {
namespace {

using config::form;
using config::item;
using config::kind;
using config::value;

// A name as diagnostics quote it: not every key of TOML is made of ASCII signs.
std::string shown(std::string_view name) {
  const bool bare = !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
  return bare && name.size() <= 80 ? std::string{name} : config::quoted(name.substr(0, 80));
}

// Of [[role]] and of [[identity]]; access::faults_of() compares each with each, and allows as many at most.
constexpr std::size_t entries_max = 1024;

// The path of a file that another one names.
std::string beside(const std::string& other, const std::string& path) {
  const std::size_t folder = other.rfind('/') + 1; // 0: there is none
  return path.empty() || path.front() == '/' ? path : other.substr(0, folder) + path;
}

std::string known_sections() {
  std::string text;
  std::string_view last;
  for (const auto& one : config::keys()) {
    if (one.section != last) text.append("[").append(one.section).append("], ");
    last = one.section;
  }
  return text + "[[role]] and [[identity]]";
}

template <class Owner>
std::string known_keys(std::span<const config::key<Owner>> keys, std::string_view section) {
  std::string text;
  for (const auto& one : keys) {
    if (one.section == section) text.append(text.empty() ? "" : ", ").append(one.name);
  }
  return text;
}

} // namespace

void setting_faults::add(std::int64_t line, std::string text) {
  constexpr std::size_t kept_max = 1000; // a file of nothing but mistakes must not take a multiple of itself
  if (found_.size() == kept_max) {
    ++more_;
  } else {
    found_.push_back({line, std::move(text)});
  }
}

status setting_faults::finish(std::string* why) {
  if (found_.empty()) return {};
  constexpr std::size_t shown_max = 20;
  std::stable_sort(found_.begin(), found_.end(), [](const config::fault& one, const config::fault& other) {
    return one.line < other.line;
  });
  if (why != nullptr) {
    why->clear();
    for (std::size_t i = 0; i < std::min(found_.size(), shown_max); ++i)
      why->append(i == 0 ? "" : "\n").append(found_[i].text);
    if (found_.size() > shown_max) {
      const std::size_t hidden = found_.size() - shown_max + more_;
      why->append("\nand ").append(std::to_string(hidden)).append(" more mistakes");
    }
  }
  return error{errc::bad_config, found_.front().line};
}

settings::origin settings_reader::origin_of(const item& one) const {
  return {setting_source::file, file + ":" + std::to_string(one.line), one.line};
}

void settings_reader::fail(const item& at, std::string_view section, const std::string& text) {
  std::string key = section.empty() ? shown(at.name) : std::string{section} + "." + shown(at.name);
  faults.add(at.line, file + ":" + std::to_string(at.line) + ": " + key + " " + text);
}

bool settings_reader::read_value(const item& from, std::string_view section, const form& what, value& into) {
  std::string wrong;
  const auto* const text = std::get_if<std::string>(&from.is);
  const auto* const number = std::get_if<std::int64_t>(&from.is);
  if (what.is == kind::boolean && std::holds_alternative<bool>(from.is)) {
    into = std::get<bool>(from.is);
  } else if ((what.is == kind::integer || what.is == kind::size) && number != nullptr) {
    into = *number;
    wrong = config::check_range(what, *number);
  } else if (what.is == kind::path && text != nullptr) {
    wrong = config::check_text(*text);
    into = beside(file, *text);
  } else if ((what.is == kind::time || what.is == kind::size || what.is == kind::word ||
              what.is == kind::text) &&
             text != nullptr) {
    wrong = config::read(what, *text, into);
  } else if (const auto* const list = std::get_if<config::array>(&from.is);
             what.is == kind::texts && list != nullptr) {
    std::vector<std::string> members;
    for (const item& one : list->of) {
      const auto* const member = std::get_if<std::string>(&one.is);
      if (wrong.empty())
        wrong = member == nullptr ? "needs a list of texts, not one with " + config::described(one)
                                  : config::check_text(*member);
      if (wrong.empty()) members.push_back(*member);
    }
    into = std::move(members);
  } else {
    wrong = config::needs(what, config::described(from));
  }
  if (wrong.empty()) return true;
  fail(from, section, wrong);
  return false;
}

void settings_reader::read_section(const item& section) {
  const auto known = [&](const config::key<configuration>& one) { return one.section == section.name; };
  if (std::ranges::none_of(config::keys(), known))
    return fail(section, "", "is no section; there are " + known_sections());
  const auto* const members = std::get_if<config::table>(&section.is);
  if (members == nullptr) return fail(section, "", "needs a table, not " + config::described(section));
  for (const item& one : members->of) {
    const std::size_t at = config::find(section.name, one.name);
    if (at == config::keys().size()) {
      fail(one, section.name, "is no key; there are " + known_keys(config::keys(), section.name));
      continue;
    }
    const config::key<configuration>& key = config::keys()[at];
    settings::origin& now = to.origins_[at];
    value found;
    if (!read_value(one, section.name, key.what, found) || now.source > setting_source::file) continue;
    key.set(to.values_, std::move(found));
    now = origin_of(one);
  }
}

template <class Entry>
void settings_reader::read_list(const item& section, std::span<const config::key<Entry>> keys,
                                std::vector<Entry>& into, std::vector<settings::origin>& origins) {
  const auto* const list = std::get_if<config::array>(&section.is);
  const auto is_table = [](const item& one) { return std::holds_alternative<config::table>(one.is); };
  if (list == nullptr || !std::ranges::all_of(list->of, is_table))
    return fail(section, "", "needs tables: each begins with [[" + section.name + "]]");
  if (list->of.size() > entries_max) {
    return fail(section, "",
                "has " + std::to_string(list->of.size()) + " entries; it may have " +
                    std::to_string(entries_max));
  }
  into.clear();
  origins.clear();
  for (const item& entry : list->of) {
    Entry& made = into.emplace_back();
    origins.push_back(origin_of(entry));
    for (const item& one : std::get<config::table>(entry.is).of) {
      const auto key = std::ranges::find(keys, one.name, &config::key<Entry>::name);
      value found;
      if (key == keys.end()) {
        fail(one, section.name, "is no key; there are " + known_keys(keys, section.name));
      } else if (read_value(one, section.name, key->what, found)) {
        key->set(made, std::move(found));
      }
    }
  }
}

void settings_reader::read(const config::table& root, bool writable_by_others) {
  for (const item& section : root.of) {
    access_options& access = to.values_.endpoint.access;
    if (section.name == "role") {
      read_list(section, config::role_keys(), access.roles, to.roles_);
    } else if (section.name == "identity") {
      if (writable_by_others) {
        faults.add(0, file + ": a file with identities may be written by its owner only (chmod go-w)");
      }
      read_list(section, config::identity_keys(), access.identities, to.identities_);
    } else {
      read_section(section);
    }
  }
}

} // namespace rowe
