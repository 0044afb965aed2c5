// SPDX-License-Identifier: Apache-2.0
#include "definition.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <set>
#include <utility>

#include "md5.hpp"

namespace rowe::ros1 {
namespace {

struct builtin {
  std::string_view name;
  field_kind kind;
};
constexpr std::array builtins{
    builtin{"bool", field_kind::boolean},    builtin{"int8", field_kind::int8},
    builtin{"byte", field_kind::int8},       builtin{"uint8", field_kind::uint8},
    builtin{"char", field_kind::uint8},      builtin{"int16", field_kind::int16},
    builtin{"uint16", field_kind::uint16},   builtin{"int32", field_kind::int32},
    builtin{"uint32", field_kind::uint32},   builtin{"int64", field_kind::int64},
    builtin{"uint64", field_kind::uint64},   builtin{"float32", field_kind::float32},
    builtin{"float64", field_kind::float64}, builtin{"string", field_kind::text},
    builtin{"time", field_kind::time},       builtin{"duration", field_kind::duration},
};
constexpr std::string_view separator =
    "================================================================================";
constexpr std::string_view whitespace = " \t\r\n\f\v";

std::string_view stripped(std::string_view text) noexcept {
  const std::size_t first = text.find_first_not_of(whitespace);
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(whitespace) - first + 1);
}

bool is_identifier(std::string_view word) noexcept {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return !word.empty() && word.size() <= 128 && letter(word.front()) &&
         std::all_of(word.begin(), word.end(), [&](char c) { return letter(c) || (c >= '0' && c <= '9'); });
}

// Takes the next line off `rest`, without its end.
std::string_view next_line(std::string_view& rest) noexcept {
  const std::size_t end = rest.find('\n');
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == rest.npos ? rest.size() : end + 1);
  return line;
}

class reader {
 public:
  reader(const definition_source& from, std::string& why) : from_{from}, why_{why} {}

  message_type_ptr named(const std::string& name) {
    if (const auto known = known_.find(name); known != known_.end()) return known->second;
    if (known_.size() + open_.size() >= types_max)
      return fail("needs more than " + std::to_string(types_max) + " types");
    if (open_.contains(name)) return fail("the type " + name + " has itself as a member");
    if (open_.size() >= depth_max)
      return fail("the type " + name + " is nested deeper than " + std::to_string(depth_max) + " messages");
    const auto text = from_(name);
    if (!text) return fail("there is no definition of " + name);
    return known_[name] = of_text(name, *text);
  }

  message_type_ptr of_text(const std::string& name, std::string_view text) {
    open_.insert(name);
    auto type = std::make_shared<message_type>();
    type->name = name;
    type->text = text;
    std::string constants;
    std::string members;
    for (std::string_view rest = text; !rest.empty();) {
      const std::string_view whole = next_line(rest);
      const std::string_view line = stripped(whole.substr(0, whole.find('#')));
      if (line.empty()) continue;
      if (line.find('=') != line.npos) {
        if (!add_constant(whole, line, constants)) return fail("in " + name + ": " + std::string{line});
      } else if (!add_field(*type, line, members)) {
        return fail("in " + name + ": " + std::string{line});
      }
    }
    type->md5_text = std::string{stripped(constants + members)};
    type->md5 = md5_of(type->md5_text);
    open_.erase(name);
    return type;
  }

 private:
  // Keeps what was said first, which is nearest to the cause.
  std::nullptr_t fail(const std::string& what) {
    if (why_.empty()) why_ = what;
    return nullptr;
  }

  bool add_constant(std::string_view whole, std::string_view line, std::string& md5_lines) {
    const std::string_view type = line.substr(0, line.find_first_of(" \t"));
    // A text goes to the end of the line: what looks like a comment is part of it.
    const std::string_view from = type == "string" ? stripped(whole) : line;
    const std::size_t equals = from.find('=');
    if (equals <= type.size()) return fail("a constant without a type or name"), false;
    const std::string_view name = stripped(from.substr(type.size(), equals - type.size()));
    if (!is_identifier(name)) return fail("a constant without a name"), false;
    md5_lines.append(type).append(" ").append(name).append("=");
    md5_lines.append(stripped(from.substr(equals + 1))) += '\n';
    return true;
  }

  bool add_field(message_type& of, std::string_view line, std::string& md5_lines) {
    const std::size_t space = line.find_first_of(" \t");
    if (space == line.npos) return fail("a type without a name"), false;
    const std::string_view written = line.substr(0, space);
    field one;
    one.name = stripped(line.substr(space));
    if (!is_identifier(one.name)) return fail("a name that is no identifier"), false;
    if (of.fields.size() >= fields_max)
      return fail("more than " + std::to_string(fields_max) + " members"), false;
    if (std::any_of(of.fields.begin(), of.fields.end(), [&](const field& f) { return f.name == one.name; }))
      return fail("two members of one name"), false;

    std::string_view type = written;
    if (type.ends_with(']')) {
      const std::size_t bracket = type.find('[');
      if (bracket == type.npos) return fail("a ] without a ["), false;
      const std::string_view count = type.substr(bracket + 1, type.size() - bracket - 2);
      type = type.substr(0, bracket);
      one.many = count.empty() ? field::how_many::variable : field::how_many::fixed;
      const auto end = std::from_chars(count.data(), count.data() + count.size(), one.count);
      if (!count.empty() && (end.ec != std::errc{} || end.ptr != count.data() + count.size()))
        return fail("an array whose length is no number"), false;
      if (one.count > elements_max)
        return fail("an array of more than " + std::to_string(elements_max) + " elements"), false;
    }
    const auto* const basic =
        std::find_if(builtins.begin(), builtins.end(), [&](const builtin& b) { return b.name == type; });
    if (basic != builtins.end()) {
      one.kind = basic->kind;
      one.base64 = one.kind == field_kind::uint8 && one.many != field::how_many::one;
      md5_lines.append(written).append(" ").append(one.name) += '\n';
    } else {
      std::string name{type};
      if (name == "Header") name = "std_msgs/Header";
      if (name.find('/') == name.npos) name = of.name.substr(0, of.name.find('/')) + "/" + name;
      if (plain_type_name(name) != name) return fail("a type whose name is none"), false;
      one.kind = field_kind::message;
      one.type = named(name);
      if (!one.type) return false;
      of.depth = std::max(of.depth, one.type->depth + 1);
      md5_lines.append(one.type->md5).append(" ").append(one.name) += '\n';
    }
    of.fields.push_back(std::move(one));
    return true;
  }

  const definition_source& from_;
  std::string& why_;
  std::map<std::string, message_type_ptr> known_;
  std::set<std::string> open_; // being read
};

// Each type once, as deep as it goes before what comes next.
void add_needed(const message_type& type, std::vector<const message_type*>& all) {
  for (const field& f : type.fields) {
    if (f.kind != field_kind::message) continue;
    const auto same = [&](const message_type* one) { return one->name == f.type->name; };
    if (std::any_of(all.begin(), all.end(), same)) continue;
    all.push_back(f.type.get());
    add_needed(*f.type, all);
  }
}

} // namespace

message_type_ptr read_message(const std::string& name, const definition_source& from, std::string& why) {
  why.clear();
  return reader{from, why}.named(name);
}

std::optional<service_type> read_service(const std::string& name, std::string_view text,
                                         const definition_source& from, std::string& why) {
  why.clear();
  std::string_view request = text;
  std::string_view response;
  bool found = false;
  for (std::string_view rest = text; !rest.empty() && !found;) {
    const auto begin = static_cast<std::size_t>(rest.data() - text.data());
    if (!stripped(next_line(rest)).starts_with("---")) continue;
    found = true;
    request = text.substr(0, begin);
    response = rest;
  }
  if (!found) {
    why = "the definition of " + name + " has no line ---";
    return std::nullopt;
  }
  service_type service{.name = name, .request = {}, .response = {}, .md5 = {}};
  service.request = reader{from, why}.of_text(name + "Request", request);
  if (service.request) service.response = reader{from, why}.of_text(name + "Response", response);
  if (!service.response) return std::nullopt;
  service.md5 = md5_of(service.request->md5_text + service.response->md5_text);
  return service;
}

definition_source sections_of(const std::string& name, std::string_view whole) {
  std::map<std::string, std::string> sections;
  std::string at = name;
  std::string text;
  bool begins = false; // a section, with its name
  for (std::string_view rest = whole; !rest.empty();) {
    const std::string_view line = next_line(rest);
    if (stripped(line) == separator) {
      sections.try_emplace(at, text);
      text.clear();
      begins = true;
    } else if (begins && line.starts_with("MSG: ")) {
      at = stripped(line.substr(5));
      begins = false;
    } else {
      text.append(line) += '\n';
    }
  }
  sections.try_emplace(at, text);
  return [all = std::move(sections)](const std::string& wanted) -> std::optional<std::string> {
    const auto found = all.find(wanted);
    if (found == all.end()) return std::nullopt;
    return found->second;
  };
}

std::string whole_text(const message_type& type) {
  std::vector<const message_type*> needed;
  add_needed(type, needed);
  std::string text = type.text;
  for (const message_type* one : needed) {
    text.append("\n").append(separator).append("\nMSG: ").append(one->name).append("\n").append(one->text);
  }
  return text;
}

std::string plain_type_name(std::string_view type) {
  const std::size_t first = type.find('/');
  if (first == type.npos) return {};
  const std::string_view package = type.substr(0, first);
  std::string_view name = type.substr(first + 1);
  for (const std::string_view folder : {"msg/", "srv/"}) {
    if (name.starts_with(folder)) name.remove_prefix(folder.size());
  }
  if (!is_identifier(package) || !is_identifier(name)) return {};
  return std::string{package} + "/" + std::string{name};
}

} // namespace rowe::ros1
