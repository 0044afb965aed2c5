// SPDX-License-Identifier: Apache-2.0
// A message's text: a line for each member, and behind it the types that it needs, each once, in the order in
// which they are met. The first thing that ROS does not have ends it, with the member's path.
#include <algorithm>
#include <vector>

#include <rowe/types.hpp>

#include "words.hpp"
#include "json/text/ros_names.hpp"

namespace rowe {
namespace {

using namespace describe_words;

// "package/Name" of either ROS; empty if it is neither's.
std::string type_name(const schema_description& type) {
  const std::string_view all = type.type_name;
  const std::size_t first = all.find('/');
  if (first == std::string_view::npos) return {};
  const std::string_view package = all.substr(0, first);
  std::string_view name = all.substr(first + 1);
  if (name.starts_with("msg/")) name.remove_prefix(4);
  if (!is_name(package) || !is_name(name)) return {};
  return std::string{package} + "/" + std::string{name};
}

// ROS 1 has types for time that are no messages.
std::string_view built_in(const schema_description& type) {
  const auto all_are = [&](value_kind kind) {
    return type.members.size() == 2 && std::all_of(type.members.begin(), type.members.end(),
                                                   [&](const auto& m) { return m.type->kind == kind; });
  };
  if (type.type_name == "std_msgs/Time" && all_are(value_kind::uint32)) return "time";
  if (type.type_name == "std_msgs/Duration" && all_are(value_kind::int32)) return "duration";
  return {};
}

class message {
 public:
  ros_text text_of(const schema_description& type) {
    if (!built_in(type).empty()) {
      return {{}, "the type " + quoted(type.type_name) + " is built into ROS 1 and no message"};
    }
    if (type_name(type).empty()) return {{}, "the type " + wrong_name(type)};
    names_.push_back({&type, type_name(type)});
    for (std::size_t i = 0; i < names_.size() && reason_.empty(); ++i) add(i);
    if (!reason_.empty()) return {{}, reason_};
    std::string text;
    append(0, text);
    return {text, {}};
  }

 private:
  struct definition {
    const schema_description* type;
    std::string name;
    std::string path{}; // of the first member of this type
    std::string text{};
    std::vector<std::size_t> needs{};
    bool is_written = false;
  };

  static std::string wrong_name(const schema_description& type) {
    constexpr std::string_view advice = R"(; give its schema one: .type("package/Name"))";
    if (type.type_name.empty()) return "has no name" + std::string{advice};
    return "is called " + quoted(type.type_name) + ", which is no name in ROS" + std::string{advice};
  }

  void fail(const std::string& path, const std::string& why) {
    if (reason_.empty()) reason_ = "the member " + quoted(path) + " " + why;
  }

  void add(std::size_t index) {
    for (const member_description& m : names_[index].type->members) {
      const std::string& outer = names_[index].path;
      const std::string path = (outer.empty() ? "" : outer + ".") + std::string{m.name};
      if (!is_name(m.name)) fail(path, "has a name that is none in ROS; letters, digits and _ are allowed");
      const value_description* d = m.type;
      std::string suffix;
      if (d->kind == value_kind::array) {
        const element_count count = count_of(*d, &m);
        suffix = count.is_fixed ? "[" + std::to_string(count.most) + "]" : "[]";
        d = d->element;
      }
      const std::string type = scalar(*d, m, path + (suffix.empty() ? "" : "[]"), index);
      if (!reason_.empty()) return;
      names_[index].text += type + suffix + " " + std::string{m.name} + comment(*d, m) + "\n";
    }
  }

  std::string scalar(const value_description& d, const member_description& m, const std::string& path,
                     std::size_t index) {
    if (const std::string_view name = json::ros_scalar_name(d, m); !name.empty()) return std::string{name};
    switch (d.kind) {
    case value_kind::object: return object(*d.object, path, index);
    case value_kind::array: fail(path, "is an array within an array, which ROS does not have"); break;
    case value_kind::optional: fail(path, "is optional, which ROS does not have"); break;
    default: break;
    }
    return {};
  }

  std::string object(const schema_description& type, const std::string& path, std::size_t index) {
    if (const std::string_view name = built_in(type); !name.empty()) return std::string{name};
    const std::string name = type_name(type);
    if (name.empty()) {
      fail(path, "is of a type that " + wrong_name(type));
      return {};
    }
    auto known =
        std::find_if(names_.begin(), names_.end(), [&](const definition& one) { return one.name == name; });
    if (known != names_.end() && known->type != &type) {
      fail(path, "is of a type called " + quoted(name) + ", as another type is");
      return {};
    }
    const auto place = static_cast<std::size_t>(known - names_.begin());
    if (known == names_.end()) names_.push_back({&type, name, path});
    names_[index].needs.push_back(place);
    return name;
  }

  // What the number stands for; only what cannot end the line.
  static std::string comment(const value_description& d, const member_description& m) {
    if (const std::string what = unit(d, m.as_seconds); !what.empty()) return " # " + what;
    std::string names;
    for (const enumerator_description& e : d.enumerators) {
      if (!is_name(e.name)) continue;
      names += (names.empty() ? " # " : ", ") + std::string{e.name};
      if (!m.by_name) names += "=" + number(e.value, d.kind);
    }
    return names;
  }

  // A definition, and what it needs, as deep as it goes before what comes next.
  void append(std::size_t index, std::string& text) {
    definition& d = names_[index];
    if (d.is_written) return;
    d.is_written = true;
    if (!text.empty()) text += "\n" + std::string(80, '=') + "\nMSG: " + d.name + "\n";
    text += d.text;
    const std::vector<std::size_t> needs = d.needs;
    for (const std::size_t one : needs) append(one, text);
  }

  std::vector<definition> names_; // those that are met, in turn; the message is the first
  std::string reason_;
};

} // namespace

ros_text ros_message(const schema_description& type) { return message{}.text_of(type); }

} // namespace rowe
