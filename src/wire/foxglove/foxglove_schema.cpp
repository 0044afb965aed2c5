// SPDX-License-Identifier: Apache-2.0
#include "wire/foxglove/foxglove_schema.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <rowe/detail/schema.hpp>

#include "json/structs/times.hpp"
#include "json/text/digits.hpp"

namespace rowe::wire {
namespace {

// JSON text for a JSON string, and how many bytes it has; without a writer, it only counts. Each peer of a
// long list gets it, so all that is known beforehand is written escaped.
class escaped_text {
 public:
  explicit escaped_text(json::writer* into) noexcept : into_{into} {}

  // What is escaped already.
  void add(std::string_view escaped) noexcept {
    bytes_ += escaped.size();
    if (into_ != nullptr) into_->append(escaped);
  }
  void add_name(std::string_view name) noexcept {
    add(R"(\")");
    const auto is_plain = [](char c) {
      return c != '"' && c != '\\' && static_cast<unsigned char>(c) >= ' ';
    };
    if (std::all_of(name.begin(), name.end(), is_plain)) {
      add(name);
    } else {
      add_characters(name);
    }
    add(R"(\")");
  }
  std::size_t bytes() const noexcept { return bytes_; }

 private:
  // JSON's escapes, escaped once more.
  void add_characters(std::string_view name) noexcept {
    for (const char& c : name) {
      if (c == '"' || c == '\\') {
        add(c == '"' ? R"(\\\")" : R"(\\\\)");
      } else if (static_cast<unsigned char>(c) >= ' ') {
        add({&c, 1});
      } else {
        const auto code = static_cast<unsigned char>(c);
        const std::array<char, 7> escape{
            '\\', '\\', 'u', '0', '0', json::hex_digits[code >> 4], json::hex_digits[code & 15U]};
        add({escape.data(), escape.size()});
      }
    }
  }

  json::writer* into_;
  std::size_t bytes_ = 0;
};

class schema_text {
 public:
  schema_text(json::writer* into, foxglove_times times) noexcept : to_{into}, times_{times} {}

  void add(const schema_description* type) noexcept {
    if (type != nullptr) return add_object(*type);
    to_.add(R"({\"type\":\"object\",\"properties\":{}})");
  }
  std::size_t bytes() const noexcept { return to_.bytes(); }

 private:
  void add_value(const value_description& d, const member_description& m, bool in_array) noexcept {
    switch (d.kind) {
    case value_kind::boolean: return to_.add(R"({\"type\":\"boolean\"})");
    case value_kind::float32:
    case value_kind::float64: return to_.add(R"({\"type\":\"number\"})");
    case value_kind::text: return to_.add(R"({\"type\":\"string\"})");
    case value_kind::object: return add_object(*d.object);
    case value_kind::optional: return add_value(*d.element, m, in_array);
    case value_kind::array:
      if (rowe::detail::is_base64(d, m))
        return to_.add(R"({\"type\":\"string\",\"contentEncoding\":\"base64\"})");
      if (in_array) return to_.add(R"({\"type\":\"object\",\"properties\":{}})");
      to_.add(R"({\"type\":\"array\",\"items\":)");
      add_value(*d.element, m, true);
      return to_.add("}");
    default: break;
    }
    if (times_ == foxglove_times::sec_nsec && json::is_time(d)) return add_time();
    if (m.as_string || m.by_name) return to_.add(R"({\"type\":\"string\"})");
    to_.add(m.as_seconds ? R"({\"type\":\"number\"})" : R"({\"type\":\"integer\"})");
  }

  void add_time() noexcept {
    to_.add(R"({\"title\":\"time\",\"type\":\"object\",\"properties\":)"
            R"({\"sec\":{\"type\":\"integer\"},\"nsec\":{\"type\":\"integer\"}}})");
  }

  void add_object(const schema_description& type) noexcept {
    if (times_ == foxglove_times::sec_nsec && json::is_time(type)) return add_time();
    to_.add("{");
    if (!type.type_name.empty()) {
      to_.add(R"(\"title\":)");
      to_.add_name(type.type_name);
      to_.add(",");
    }
    to_.add(R"(\"type\":\"object\",\"properties\":{)");
    bool first = true;
    for (const member_description& m : type.members) {
      if (!first) to_.add(",");
      first = false;
      to_.add_name(m.name);
      to_.add(":");
      add_value(*m.type, m, false);
    }
    to_.add("}}");
  }

  escaped_text to_;
  const foxglove_times times_;
};

} // namespace

void write_foxglove_schema(json::writer& into, const schema_description* type,
                           foxglove_times times) noexcept {
  into.raw("\"");
  schema_text to{&into, times};
  to.add(type);
  into.append("\"");
}

std::size_t foxglove_schema_bytes(const schema_description* type, foxglove_times times) noexcept {
  schema_text to{nullptr, times};
  to.add(type);
  return to.bytes() + 2;
}

} // namespace rowe::wire
