// SPDX-License-Identifier: Apache-2.0
#include "c_tables.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string_view>

#include <rowe/detail/schema.hpp>

namespace rowe::tools {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

// What no member or struct may be called, in C, in C++, or by macros of their headers.
constexpr std::string_view reserved =
    " alignas alignof and asm auto bool break case catch char class compl concept const constexpr "
    "continue decltype default delete do double else enum explicit export extern false float for "
    "friend goto if inline int linux long mutable namespace new noexcept not nullptr offsetof "
    "operator or private protected public register requires restrict return short signed sizeof "
    "static struct switch template this throw true try typedef typeid typename typeof union unix "
    "unsigned using virtual void volatile wchar_t while xor NULL and_eq or_eq not_eq xor_eq bitand "
    "bitor co_await co_yield co_return char8_t char16_t char32_t consteval constinit const_cast "
    "static_cast static_assert dynamic_cast reinterpret_cast thread_local ";
bool is_reserved(const std::string& name) {
  return reserved.find(" " + name + " ") != std::string_view::npos;
}

// An identifier that is not in `taken`, where it is put.
std::string identifier(std::string_view from, std::set<std::string>& taken) {
  std::string name;
  for (const char c : from) {
    const bool plain = is_letter(c) || is_digit(c) || c == '_';
    if (plain && !(name.empty() && (is_digit(c) || c == '_')))
      name += c;
    else if (is_digit(c))
      (name += 'n') += c;
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  if (name.empty()) name = "unnamed";
  if (is_reserved(name)) name += '_';
  std::string unique = name;
  for (int n = 2; !taken.insert(unique).second; ++n) unique = name + "_" + std::to_string(n);
  return unique;
}

// A literal of C; what is no plain ASCII is written in octal, which three digits end.
std::string literal(std::string_view text) {
  constexpr std::string_view digits = "01234567";
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= ' ' && byte < 0x7f && c != '"' && c != '\\' && c != '?') {
      quoted += c;
    } else {
      quoted += '\\';
      for (int shift = 6; shift >= 0; shift -= 3) quoted += digits[byte >> shift & 7U];
    }
  }
  return quoted + '"';
}

struct c_type {
  std::string_view type; // of C; text: char
  std::string_view row;  // rowe_member_...
};
constexpr std::array<c_type, 11> scalars{{{"bool", "bool"},
                                          {"int8_t", "int8"},
                                          {"int16_t", "int16"},
                                          {"int32_t", "int32"},
                                          {"int64_t", "int64"},
                                          {"uint8_t", "uint8"},
                                          {"uint16_t", "uint16"},
                                          {"uint32_t", "uint32"},
                                          {"uint64_t", "uint64"},
                                          {"float", "float"},
                                          {"double", "double"}}};

class tables {
 public:
  explicit tables(c_text& into) : into_{into} {}

  void add(const named_type& one) {
    const std::string_view name = one.type->type_name.empty() ? one.name : one.type->type_name;
    wrong_.clear();
    if (structure(*one.type, name, 0).empty()) into_.reasons.push_back(wrong_);
  }

 private:
  // What a member becomes: its type in C, and how many.
  struct shape {
    std::string type;
    std::string row;        // its type in the table, with forms
    std::string dimensions; // "[3]", of text "[3][64]"
    std::string table;      // of structs: the table's name
    std::string names;      // of integers by name: those of the values
    std::string plain;      // likewise: the type in the table, without forms
    bool is_array = false;
    bool counted = false;
    double bytes = 0; // about; as a double, which holds what memory does not
  };

  // The struct's name, once it is declared; empty: C has no such type, and wrong_ says why.
  std::string structure(const schema_description& type, std::string_view called, int depth) {
    if (const auto known = known_.find(&type); known != known_.end()) return known->second.name;
    if (depth == depth_max) return fail("it nests deeper than 32 levels");
    const std::string name = identifier(called, names_);
    std::set<std::string> members;
    std::string declared;
    std::string rows;
    double bytes = 0;
    for (const member_description& m : type.members) {
      const std::string member = identifier(m.name, members);
      shape its;
      if (!value(*m.type, m, name + "_" + member, depth, its)) {
        names_.erase(name);
        known_.emplace(&type, declared_type{});
        return {};
      }
      bytes += its.bytes;
      declared += "  " + its.type + " " + member + its.dimensions + ";\n";
      std::string count;
      if (its.counted) {
        count = identifier(member + "_count", members);
        declared += "  uint32_t " + count + ";\n";
      }
      rows += "    " + row(name, member, m.name, its, count) + ",\n";
    }
    write(type, name, declared, rows);
    known_.emplace(&type, declared_type{name, bytes});
    return name;
  }

  void write(const schema_description& type, const std::string& name, const std::string& declared,
             const std::string& rows) {
    std::string& to = into_.text;
    const std::string none = "  char no_member;\n"; // C has no empty structs
    to += "\nstruct " + name + " {\n" + (declared.empty() ? none : declared) + "};\n";
    if (!rows.empty()) to += "static const struct rowe_member " + name + "_members[] = {\n" + rows + "};\n";
    to += "static const struct rowe_struct " + name + "_type = {\n    " +
          (type.type_name.empty() ? "NULL" : literal(type.type_name)) + ", sizeof(struct " + name + "), " +
          (rows.empty() ? "NULL, 0" : name + "_members, " + std::to_string(type.members.size())) + "};\n";
  }

  static std::string row(const std::string& of, const std::string& member, std::string_view name,
                         const shape& its, const std::string& count) {
    const std::string where = "struct " + of + ", " + member;
    const std::string table = its.table.empty() ? "NULL" : "&" + its.table;
    if (member == name) {
      if (its.counted && its.names.empty())
        return "ROWE_COUNTED(" + where + ", " + its.row + ",\n                 " + table + ", " + count +
               ", rowe_member_uint32)";
      if (its.is_array && its.names.empty())
        return "ROWE_ARRAY(" + where + ", " + its.row + ", " + table + ")";
      // With forms a struct is a row like others, but has a table.
      if (its.row == "rowe_member_struct") return "ROWE_INSIDE(" + where + ", " + table + ")";
      if (!its.names.empty() && its.row == its.plain + " | rowe_member_by_name")
        return "ROWE_NAMED(" + where + ", " + its.plain + ", " + its.names + ")";
      if (its.table.empty() && its.names.empty()) return "ROWE_MEMBER(" + where + ", " + its.row + ")";
    }
    const std::string place = "ROWE_NOWHERE(struct " + of + ")->" + member;
    const std::string bytes = "sizeof(" + place + (its.is_array ? "[0])" : ")");
    const std::string elements = its.is_array ? "sizeof(" + place + ") / " + bytes : "0";
    const std::string counting =
        its.counted ? "rowe_member_uint32, offsetof(struct " + of + ", " + count + ")" : "0, 0";
    return "{" + literal(name) + ", " + its.row + ",\n     offsetof(" + where + "), " + bytes + ",\n     " +
           elements + ", " + counting + ", " + table + ", NULL, " +
           (its.names.empty() ? "NULL, 0}"
                              : its.names + ", sizeof " + its.names + " / sizeof *" + its.names + "}");
  }

  bool value(const value_description& d, const member_description& m, const std::string& called, int depth,
             shape& into) {
    if (d.kind == value_kind::optional) {
      if (!value(*d.element, m, called, depth, into)) return false;
      if (into.row.find("rowe_member_or_default") == std::string::npos)
        into.row += " | rowe_member_or_default";
      return true;
    }
    if (d.kind != value_kind::array) return single(d, m, called, depth, into);
    const value_description& element = *d.element;
    if (element.kind == value_kind::array || element.kind == value_kind::optional)
      return fail("the member " + std::string{m.name} + " is an array of arrays or of optionals"), false;
    if (!single(element, m, called, depth, into)) return false;
    into.is_array = true;
    into.bytes *= static_cast<double>(d.count_max);
    if (into.bytes > bytes_max)
      return fail("the member " + std::string{m.name} + " would be larger than 64 MiB"), false;
    into.counted = d.count != nullptr || m.count != nullptr;
    into.dimensions = "[" + std::to_string(d.count_max) + "]" + into.dimensions;
    if (element.kind == value_kind::uint8 && !rowe::detail::is_base64(d, m) && !m.as_string && !m.by_name)
      into.row += " | rowe_member_as_numbers";
    return true;
  }

  bool single(const value_description& d, const member_description& m, const std::string& called, int depth,
              shape& into) {
    if (d.kind == value_kind::object) {
      into.table =
          structure(*d.object, d.object->type_name.empty() ? called : d.object->type_name, depth + 1);
      if (into.table.empty()) {
        if (wrong_.empty()) (void)fail("a type inside has what C does not have");
        return false;
      }
      into.type = "struct " + into.table;
      into.bytes = known_[d.object].bytes;
      into.table += "_type";
      into.row = "rowe_member_struct";
    } else if (d.kind == value_kind::text) {
      const std::size_t bytes = d.count_max;
      into.type = "char";
      into.bytes = static_cast<double>(bytes) + 2;
      into.dimensions = "[" + std::to_string(std::max<std::size_t>(bytes, 1) + 1) + "]"; // with the '\0'
      into.row = "rowe_member_text";
    } else if (m.as_seconds || is_nanoseconds(d)) {
      into.type = "int64_t";
      into.bytes = 8;
      into.row = d.unit.since_1970 ? "rowe_member_time" : "rowe_member_duration";
      if (m.as_seconds) into.row += " | rowe_member_as_seconds";
    } else {
      const c_type& one = scalars[static_cast<std::size_t>(d.kind)];
      into.type = one.type;
      into.bytes = 8;
      (into.row = "rowe_member_") += one.row;
      if (m.by_name) {
        into.plain = into.row;
        into.row += " | rowe_member_by_name";
        into.names = identifier(called + "_names", names_);
        write_names(into.names, d);
      }
    }
    if (m.as_string && d.kind >= value_kind::int8 && d.kind <= value_kind::uint64)
      into.row += " | rowe_member_as_string";
    if (m.or_default) into.row += " | rowe_member_or_default";
    return true;
  }

  void write_names(const std::string& name, const value_description& d) {
    std::string& to = into_.text;
    to += "\nstatic const struct rowe_name " + name + "[] = {\n";
    for (const enumerator_description& e : d.enumerators) {
      const bool least = e.value == std::numeric_limits<std::int64_t>::min(); // has no literal
      to += "    {" + literal(e.name) + ", " + (least ? "INT64_MIN" : std::to_string(e.value)) + "},\n";
    }
    to += "};\n";
  }

  static bool is_nanoseconds(const value_description& d) {
    return d.kind == value_kind::int64 && d.unit.numerator == 1 && d.unit.denominator == 1'000'000'000;
  }

  std::string fail(std::string why) {
    if (wrong_.empty()) wrong_ = std::move(why);
    return {};
  }

  static constexpr int depth_max = 32;
  static constexpr double bytes_max = 64.0 * 1024 * 1024;
  c_text& into_;
  std::string wrong_;
  std::set<std::string> names_;
  struct declared_type {
    std::string name; // empty: C has no such type
    double bytes = 0;
  };
  std::map<const schema_description*, declared_type> known_;
};

} // namespace

c_text c_tables(const std::vector<named_type>& types) {
  c_text made;
  made.text = "#include <rowe/struct.h>\n";
  tables all{made};
  for (const named_type& one : types) all.add(one);
  return made;
}

} // namespace rowe::tools
