// SPDX-License-Identifier: Apache-2.0
#include "wire/codec/ros_typedefs.hpp"

#include <array>
#include <cstdint>

#include "json/structs/description.hpp"
#include "json/text/ros_names.hpp"

namespace rowe::wire {
namespace {

// The value in arrays and optionals, which is no such itself.
const value_description& innermost(const value_description& d) noexcept {
  const value_description* at = &d;
  while (at->element != nullptr) at = at->element;
  return *at;
}

// ROS's fixed length: -1 where it is no array, 0 where its length varies.
std::int64_t array_length(const member_description& m) noexcept {
  const value_description* at = m.type;
  while (at->kind == value_kind::optional) at = at->element;
  if (at->kind != value_kind::array) return -1;
  const json::array_count count = json::count_of(*at, &m);
  return count.fixed ? static_cast<std::int64_t>(count.most) : 0;
}

std::string_view example_of(std::string_view type) noexcept {
  if (type == "string") return "";
  if (type == "bool") return "False";
  return type.starts_with("float") ? "0.0" : "0";
}

class typedefs {
 public:
  typedefs(json::writer& into, std::string_view called) noexcept : into_{into}, called_{called} {}

  bool write(const schema_description& type) noexcept {
    types_[count_++] = {.type = &type};
    into_.begin_array();
    for (std::size_t i = 0; i < count_; ++i) {
      if (!add_inside_of(i)) return false;
      write_one(i);
    }
    into_.end_array();
    return true;
  }

 private:
  struct known {
    const schema_description* type = nullptr;
    std::size_t owner = 0;     // of one without a name,
    std::string_view member{}; // and where it is
  };

  // Where a type inside is listed; count_: it is not.
  std::size_t find(const schema_description& type) const noexcept {
    std::size_t i = 1;
    for (; i < count_; ++i) {
      if (types_[i].type == &type) return i;
      if (!type.type_name.empty() && types_[i].type->type_name == type.type_name) return i;
    }
    return count_;
  }
  bool add_inside_of(std::size_t owner) noexcept {
    for (const member_description& m : types_[owner].type->members) {
      const value_description& d = innermost(*m.type);
      if (d.kind != value_kind::object || find(*d.object) != count_) continue;
      if (count_ == types_.size()) return false;
      types_[count_++] = {.type = d.object, .owner = owner, .member = m.name};
    }
    return true;
  }
  // The piece of a string that a name is.
  void append_name(std::size_t of) noexcept {
    const known& one = types_[of];
    if (of == 0) return append_escaped(called_);
    if (!one.type->type_name.empty()) return append_escaped(one.type->type_name);
    append_name(one.owner);
    into_.append("_");
    append_escaped(one.member);
  }
  // Names of types and members come from the program; characters that JSON escapes are none of theirs.
  void append_escaped(std::string_view text) noexcept {
    for (const char& c : text) {
      const bool plain = static_cast<unsigned char>(c) >= ' ' && c != '"' && c != '\\';
      into_.append(plain ? std::string_view{&c, 1} : std::string_view{"_"});
    }
  }
  void write_name(std::size_t of) noexcept {
    into_.raw("\"");
    append_name(of);
    into_.append("\"");
  }
  template <class Write>
  void list(std::string_view key, std::size_t of, const Write& write) noexcept {
    into_.begin_array(key);
    for (const member_description& m : types_[of].type->members) write(m);
    into_.end_array();
  }
  void write_one(std::size_t of) noexcept {
    into_.begin_object();
    into_.key("type");
    write_name(of);
    list("fieldnames", of, [&](const member_description& m) { into_.string(m.name); });
    list("fieldtypes", of, [&](const member_description& m) {
      const value_description& d = innermost(*m.type);
      d.kind == value_kind::object ? write_name(find(*d.object)) : into_.string(json::ros_scalar_name(d, m));
    });
    list("fieldarraylen", of, [&](const member_description& m) { into_.number(array_length(m)); });
    list("examples", of, [&](const member_description& m) {
      const value_description& d = innermost(*m.type);
      if (array_length(m) >= 0) return into_.string("[]");
      into_.string(d.kind == value_kind::object ? "{}" : example_of(json::ros_scalar_name(d, m)));
    });
    constants("constnames", of, [&](const enumerator_description& e) { into_.string(e.name); });
    constants("constvalues", of, [&](const enumerator_description& e) {
      into_.raw("\"");
      json::writer digits{number_};
      digits.number(e.value);
      into_.append(digits.text());
      into_.append("\"");
    });
    into_.end_object();
  }
  // What the enums of its members have.
  template <class Write>
  void constants(std::string_view key, std::size_t of, const Write& write) noexcept {
    list(key, of, [&](const member_description& m) {
      if (m.by_name) return; // the names are the values
      for (const enumerator_description& e : innermost(*m.type).enumerators) write(e);
    });
  }

  json::writer& into_;
  const std::string_view called_;
  std::array<known, typedefs_max> types_{};
  std::array<char, 24> number_{};
  std::size_t count_ = 0;
};

} // namespace

bool write_typedefs(json::writer& into, const schema_description& type, std::string_view called) noexcept {
  return typedefs{into, called}.write(type);
}

const schema_description* find_type(const schema_description& type, std::string_view called) noexcept {
  if (type.type_name == called) return &type;
  for (const member_description& m : type.members) {
    const value_description& d = innermost(*m.type);
    if (d.kind != value_kind::object) continue;
    if (const schema_description* found = find_type(*d.object, called)) return found;
  }
  return nullptr;
}

} // namespace rowe::wire
