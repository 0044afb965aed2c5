// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "../rowe/console.hpp"
#include "convert.hpp"
#include "md5.hpp"

namespace rowe::ros1 {
namespace {

using tools::joined;
using tools::printable;

class reader {
 public:
  reader(std::string& bytes, std::size_t bytes_max, std::string& why)
      : bytes_{bytes}, end_{bytes.size() + bytes_max}, why_{why} {}

  // Nothing: all members are left out.
  bool message(const message_type& type, std::optional<json_value> json) {
    std::vector<std::optional<json_value>> given(type.fields.size());
    if (json) {
      if (json->kind() != json_kind::object) return wrong("is no object, but " + type.name + " is one");
      for (const auto& [name, value] : json->members()) {
        std::size_t at = 0;
        while (at < given.size() && !name.says(type.fields[at].name)) ++at;
        if (at == given.size())
          return wrong(joined("has a member ", printable(name.text()), ", which ", type.name, " has not"));
        if (given[at]) return wrong(joined("has the member ", printable(name.text()), " twice"));
        given[at] = value;
      }
    }
    for (std::size_t i = 0; i < given.size(); ++i) {
      const field& f = type.fields[i];
      if (f.many == field::how_many::one ? one(f, given[i]) : array(f, given[i])) continue;
      if (!too_big_) path_ = joined(f.name, path_.empty() || path_.front() == '[' ? "" : ".", path_);
      return false;
    }
    return true;
  }

  converted outcome(bool done) {
    if (done && why_.empty()) return converted::done;
    if (too_big_) return converted::too_big;
    why_ = path_.empty() ? joined("the message ", why_) : joined("the member \"", path_, "\" ", why_);
    return converted::wrong;
  }

 private:
  bool wrong(std::string what) {
    why_ = std::move(what);
    return false;
  }

  bool put(const void* from, std::size_t count) {
    if (count > end_ - bytes_.size()) {
      too_big_ = true;
      return wrong("is too big");
    }
    bytes_.append(static_cast<const char*>(from), count);
    return true;
  }
  bool zeros(std::size_t count) {
    if (count > end_ - bytes_.size()) {
      too_big_ = true;
      return wrong("is too big");
    }
    bytes_.append(count, '\0');
    return true;
  }

  template <class T>
  bool scalar(std::optional<json_value> json) {
    T value{};
    if (json) {
      const auto read = json->get<T>();
      if (!read) return wrong(about(read.error().message(), *json));
      value = *read;
    }
    return put(&value, sizeof value);
  }
  // What a json_error says of a value without a path, to be read behind the member's name.
  static std::string about(std::string message, json_value value) {
    constexpr std::string_view itself = "the value ";
    if (message.starts_with(itself)) message.erase(0, itself.size());
    return joined("(", printable(value.text().substr(0, 40)), ") ", printable(message));
  }

  template <class T>
  bool real(std::optional<json_value> json) {
    if (json && json->kind() == json_kind::null) {
      const T value = std::numeric_limits<T>::quiet_NaN();
      return put(&value, sizeof value);
    }
    return scalar<T>(json);
  }

  bool boolean(std::optional<json_value> json) {
    std::uint8_t value = 0;
    if (json) {
      const auto read = json->get<bool>();
      if (!read) return wrong(about(read.error().message(), *json));
      value = *read ? 1 : 0;
    }
    return put(&value, 1);
  }

  template <class T>
  bool moment(std::optional<json_value> json) {
    std::array<std::optional<json_value>, 2> parts;
    if (json && json->kind() != json_kind::object) return wrong("is no object; secs and nsecs are wanted");
    if (json) {
      for (const auto& [name, value] : json->members()) {
        if (name.says("secs") || name.says("sec"))
          parts[0] = value;
        else if (name.says("nsecs") || name.says("nanosec"))
          parts[1] = value;
        else
          return wrong(joined("has a member ", printable(name.text()), "; a time has secs and nsecs"));
      }
    }
    return scalar<T>(parts[0]) && scalar<T>(parts[1]);
  }

  bool text(std::optional<json_value> json) {
    std::string value;
    if (json) {
      auto read = json->get<std::string>();
      if (!read) return wrong(about(read.error().message(), *json));
      value = std::move(*read);
    }
    const auto count = static_cast<std::uint32_t>(value.size());
    return put(&count, sizeof count) && put(value.data(), value.size());
  }

  bool one(const field& f, std::optional<json_value> json) {
    switch (f.kind) {
    case field_kind::boolean: return boolean(json);
    case field_kind::int8: return scalar<std::int8_t>(json);
    case field_kind::uint8: return scalar<std::uint8_t>(json);
    case field_kind::int16: return scalar<std::int16_t>(json);
    case field_kind::uint16: return scalar<std::uint16_t>(json);
    case field_kind::int32: return scalar<std::int32_t>(json);
    case field_kind::uint32: return scalar<std::uint32_t>(json);
    case field_kind::int64: return scalar<std::int64_t>(json);
    case field_kind::uint64: return scalar<std::uint64_t>(json);
    case field_kind::float32: return real<float>(json);
    case field_kind::float64: return real<double>(json);
    case field_kind::time: return moment<std::uint32_t>(json);
    case field_kind::duration: return moment<std::int32_t>(json);
    case field_kind::text: return text(json);
    case field_kind::message: return message(*f.type, json);
    }
    return false;
  }

  bool array(const field& f, std::optional<json_value> json) {
    const bool is_fixed = f.many == field::how_many::fixed;
    if (!json && !is_fixed) return zeros(sizeof(std::uint32_t));
    if (!json) {
      for (std::uint32_t i = 0; i < f.count; ++i) {
        const std::size_t before = bytes_.size();
        if (!one(f, std::nullopt)) return false;
        if (bytes_.size() == before) break; // the element has no bytes
      }
      return true;
    }
    if (f.base64 && json->kind() == json_kind::string) return base64(f, *json);
    if (json->kind() != json_kind::array) return wrong("is no array");
    const std::size_t length_at = bytes_.size();
    if (!is_fixed && !zeros(sizeof(std::uint32_t))) return false;
    std::uint32_t count = 0;
    for (const json_value element : json->elements()) {
      if (is_fixed && count >= f.count) return wrong(joined("has more than ", f.count, " elements"));
      if (!one(f, element)) {
        path_ = joined("[", count, "]", path_.empty() || path_.front() == '[' ? "" : ".", path_);
        return false;
      }
      ++count;
    }
    if (is_fixed && count < f.count)
      return wrong(joined("has ", tools::counted(count, "element"), "; ", f.count, " are wanted"));
    if (!is_fixed) std::memcpy(bytes_.data() + length_at, &count, sizeof count);
    return true;
  }

  bool base64(const field& f, json_value json) {
    const auto text = json.get<std::string>();
    std::string value;
    if (!text || !bytes_of_base64(*text, value)) return wrong("is no base64");
    const auto count = static_cast<std::uint32_t>(value.size());
    if (f.many == field::how_many::variable) {
      if (!put(&count, sizeof count)) return false;
    } else if (count != f.count) {
      return wrong(joined("has ", tools::counted(count, "byte"), "; ", f.count, " are wanted"));
    }
    return put(value.data(), value.size());
  }

  std::string& bytes_;
  const std::size_t end_;
  std::string& why_;
  std::string path_;
  bool too_big_ = false;
};

} // namespace

converted from_json(const message_type& type, json_value json, std::string& bytes, std::size_t bytes_max,
                    std::string& why) {
  why.clear();
  reader from{bytes, bytes_max, why};
  return from.outcome(from.message(type, json));
}

} // namespace rowe::ros1
