// SPDX-License-Identifier: Apache-2.0
// Interfaces for TypeScript, each in the namespace that its type's name says. They are declarations only, so
// nothing is left of them in the JavaScript, and compilers that only strip types take them, too.
#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include <rowe/types.hpp>

#include "words.hpp"

namespace rowe {
namespace {

using namespace describe_words;

bool is_reserved(std::string_view name) {
  static const std::set<std::string_view> words{
      "any",      "as",     "async",      "await",    "bigint",   "boolean",    "break",     "case",
      "catch",    "class",  "const",      "continue", "debugger", "declare",    "default",   "delete",
      "do",       "else",   "enum",       "export",   "extends",  "false",      "finally",   "for",
      "function", "if",     "implements", "import",   "in",       "instanceof", "interface", "let",
      "never",    "new",    "null",       "number",   "object",   "package",    "private",   "protected",
      "public",   "return", "static",     "string",   "super",    "switch",     "symbol",    "this",
      "throw",    "true",   "try",        "type",     "typeof",   "undefined",  "unknown",   "var",
      "void",     "while",  "with",       "yield"};
  return words.contains(name);
}

// One part of a name, as an identifier; different parts may become the same.
std::string identifier(std::string_view part) {
  std::string name;
  for (const char c : part) name += is_name({&c, 1}) || (c >= '0' && c <= '9') ? c : '_';
  if (is_reserved(name)) name += '_';
  return is_name(name) ? name : "_" + name;
}

// "nav_msgs/Odometry" and "robot::odometry": namespaces, and the name of an interface.
std::vector<std::string> path_of(std::string_view name) {
  std::vector<std::string> path;
  while (!name.empty()) {
    const std::size_t end = std::min(name.find_first_of("/:"), name.size());
    const std::string_view part = name.substr(0, end);
    name.remove_prefix(std::min(end + 1, name.size()));
    const bool has_no_name = part.starts_with('{') || part.starts_with('('); // an anonymous namespace
    if (!part.empty() && !has_no_name) path.push_back(identifier(part));
  }
  return path;
}

class declarations {
 public:
  void add(const schema_description& type, std::string_view name) {
    const std::vector<std::string> path = path_of(name);
    if (path.empty() || names_.contains(&type)) return;
    std::string whole;
    for (const std::string& part : path) whole += (whole.empty() ? "" : ".") + part;
    if (!taken_.insert(whole).second) return;
    const std::size_t dot = whole.rfind('.');
    const bool is_inside = dot != std::string::npos;
    spaces_[is_inside ? whole.substr(0, dot) : ""].push_back({&type, path.back()});
    names_[&type] = whole;
    add_members(type);
  }

  // Of a type that is called as another one is.
  void add_members(const schema_description& type) {
    for (const member_description& m : type.members) {
      const value_description* d = m.type;
      while (d->element != nullptr) d = d->element;
      if (d->kind != value_kind::object) continue;
      if (d->object->type_name.empty()) {
        add_members(*d->object);
      } else {
        add(*d->object, d->object->type_name);
      }
    }
  }

  // Names that no type may have.
  void reserve(std::string_view name) { taken_.emplace(name); }

  std::string text() const {
    std::string all;
    for (const auto& [space, types] : spaces_) {
      const std::string indent = space.empty() ? "" : "  ";
      if (!all.empty()) all += "\n";
      if (!space.empty()) all += "export namespace " + space + " {\n";
      bool first = true;
      for (const auto& [type, name] : types) {
        if (!first) all += "\n";
        first = false;
        all += indent + "export interface " + name + " " + object(*type, indent) + "\n";
      }
      if (!space.empty()) all += "}\n";
    }
    return all;
  }

  // The type as a member of an interface that is in no namespace.
  std::string used(const schema_description* type) const {
    if (type == nullptr) return "unknown";
    const auto known = names_.find(type);
    return known == names_.end() ? inlined(*type, "  ") : known->second;
  }

 private:
  struct interface {
    const schema_description* type;
    std::string name;
  };

  // Where it has no interface of its own.
  std::string inlined(const schema_description& type, const std::string& indent) const {
    return type.members.empty() ? "Record<string, unknown>" : object(type, indent);
  }

  std::string object(const schema_description& type, const std::string& indent) const {
    std::string text = "{\n";
    for (const member_description& m : type.members) {
      const bool may_miss = m.type->kind == value_kind::optional;
      const value_description& d = may_miss ? *m.type->element : *m.type;
      if (const std::string what = comment(d, m, !may_miss); !what.empty()) {
        text += indent + "  /** " + what + " */\n";
      }
      text += indent + "  " + (is_name(m.name) ? std::string{m.name} : quoted(m.name));
      text += (may_miss ? "?: " : ": ") + value(d, m, indent + "  ") + ";\n";
    }
    return text + indent + "}";
  }

  std::string value(const value_description& d, const member_description& m,
                    const std::string& indent) const {
    switch (d.kind) {
    case value_kind::boolean: return "boolean";
    case value_kind::float32:
    case value_kind::float64: return "number";
    case value_kind::text: return "string";
    case value_kind::object: {
      const auto known = names_.find(d.object);
      return known == names_.end() ? inlined(*d.object, indent) : known->second;
    }
    case value_kind::array: {
      if (detail::is_base64(d, m)) return "string";
      const std::string element = value(*d.element, m, indent);
      const bool is_one_word = element.find_first_of(" |") == std::string::npos;
      return is_one_word ? element + "[]" : "(" + element + ")[]";
    }
    case value_kind::optional: return value(*d.element, m, indent) + " | null";
    default: break;
    }
    if (m.by_name) {
      std::string names;
      for (const enumerator_description& e : d.enumerators)
        names += (names.empty() ? "" : " | ") + quoted(e.name);
      return names;
    }
    return m.as_string ? "string" : "number";
  }

  // What the type does not say: units, lengths, the values of an enum.
  static std::string comment(const value_description& member, const member_description& m, bool is_member) {
    std::string text;
    const auto add = [&](const std::string& piece) {
      if (!piece.empty()) text += (text.empty() ? "" : "; ") + piece;
    };
    const value_description* d = &member;
    for (bool outermost = is_member; d->element != nullptr; d = d->element, outermost = false) {
      if (d->kind != value_kind::array) continue;
      const element_count count = count_of(*d, outermost ? &m : nullptr);
      const bool is_base64 = detail::is_base64(*d, m);
      add((is_base64 ? "base64 of " : "") + std::string{count.is_fixed ? "" : "at most "} +
          std::to_string(count.most) + (is_base64 ? " bytes" : " elements"));
    }
    if (d->kind == value_kind::text) add("at most " + std::to_string(d->count_max) + " bytes");
    add(unit(*d, m.as_seconds));
    if (m.as_string) add("an integer");
    if (!m.by_name) {
      std::string names;
      for (const enumerator_description& e : d->enumerators) {
        if (!is_name(e.name)) continue; // could end the comment
        names += (names.empty() ? "" : ", ") + number(e.value, d->kind) + ": " + std::string{e.name};
      }
      add(names);
    }
    return text;
  }

  std::map<std::string, std::vector<interface>>
      spaces_; // by their names; of each, the types as they were met
  std::map<const schema_description*, std::string> names_;
  std::set<std::string> taken_;
};

void add_all(declarations& into, std::span<const named_type> types) {
  for (const named_type& one : types) {
    into.add(*one.type, one.type->type_name.empty() ? one.name : one.type->type_name);
  }
}

} // namespace

std::string typescript(std::span<const named_type> types) {
  declarations all;
  add_all(all, types);
  return all.text();
}

std::string typescript(std::span<const named_type> types, std::span<const typed_topic> topics,
                       std::span<const typed_service> services) {
  declarations all;
  all.reserve("topics");
  all.reserve("services");
  add_all(all, types);
  std::string text = all.text();
  text += (text.empty() ? "" : "\n") + std::string{"export interface topics {\n"};
  for (const typed_topic& one : topics) text += "  " + quoted(one.name) + ": " + all.used(one.type) + ";\n";
  text += "}\n\nexport interface services {\n";
  for (const typed_service& one : services) {
    text += "  " + quoted(one.name) + ": { request: " + all.used(one.request);
    text += "; response: " + all.used(one.response) + " };\n";
  }
  return text + "}\n";
}

} // namespace rowe
