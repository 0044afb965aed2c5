// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <system_error>

#include "../rowe/text/json_values.hpp"
#include "convert.hpp"
#include "md5.hpp"

namespace rowe::ros1 {
namespace {

static_assert(std::endian::native == std::endian::little, "ROS 1 writes the lowest byte first");

class writer {
 public:
  writer(std::string_view bytes, std::string& json, std::size_t bytes_max)
      : rest_{bytes}, json_{json}, end_{json.size() + bytes_max} {}

  converted whole(const message_type& type) {
    message(type);
    if (json_.size() > end_ || (state_ == converted::too_big)) return converted::too_big;
    if (state_ == converted::done && !rest_.empty()) return converted::wrong;
    return state_;
  }

 private:
  bool good() {
    if (state_ == converted::done && json_.size() > end_) state_ = converted::too_big;
    return state_ == converted::done;
  }

  std::string_view take(std::size_t count) {
    if (rest_.size() < count) {
      state_ = converted::wrong;
      return {};
    }
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }

  template <class T>
  T scalar() {
    T value{};
    const std::string_view bytes = take(sizeof(T));
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }

  template <class T>
  void number(T value) {
    char digits[40];
    const auto written = std::to_chars(std::begin(digits), std::end(digits), value);
    json_.append(digits, written.ptr);
  }
  template <class T>
  void integer() {
    number(scalar<T>());
  }
  template <class T>
  void real() {
    const T value = scalar<T>();
    std::isfinite(value) ? number(value) : void(json_ += "null");
  }

  template <class T>
  void moment() {
    json_ += "{\"secs\":";
    integer<T>();
    json_ += ",\"nsecs\":";
    integer<T>();
    json_ += '}';
  }

  void one(const field& f) {
    switch (f.kind) {
    case field_kind::boolean: json_ += scalar<std::uint8_t>() != 0 ? "true" : "false"; break;
    case field_kind::int8: integer<std::int8_t>(); break;
    case field_kind::uint8: integer<std::uint8_t>(); break;
    case field_kind::int16: integer<std::int16_t>(); break;
    case field_kind::uint16: integer<std::uint16_t>(); break;
    case field_kind::int32: integer<std::int32_t>(); break;
    case field_kind::uint32: integer<std::uint32_t>(); break;
    case field_kind::int64: integer<std::int64_t>(); break;
    case field_kind::uint64: integer<std::uint64_t>(); break;
    case field_kind::float32: real<float>(); break;
    case field_kind::float64: real<double>(); break;
    case field_kind::time: moment<std::uint32_t>(); break;
    case field_kind::duration: moment<std::int32_t>(); break;
    case field_kind::text: text(); break;
    case field_kind::message: message(*f.type); break;
    }
  }

  void text() {
    const std::string_view bytes = take(scalar<std::uint32_t>());
    if (bytes.size() > end_) state_ = converted::too_big;
    if (good()) json_ += tools::json_string_of(bytes);
  }

  void array(const field& f) {
    const std::uint32_t count = f.many == field::how_many::fixed ? f.count : scalar<std::uint32_t>();
    if (f.base64) {
      const std::string_view bytes = take(count);
      if (bytes.size() > end_) state_ = converted::too_big;
      if (good()) json_.append("\"").append(base64_of(bytes)) += '"';
      return;
    }
    json_ += '[';
    for (std::uint32_t i = 0; i < count && good();
         ++i) { // an element may have no bytes, but has some in JSON
      if (i != 0) json_ += ',';
      one(f);
    }
    json_ += ']';
  }

  void message(const message_type& type) {
    char before = '{';
    for (const field& f : type.fields) {
      if (!good()) return;
      json_ += before;
      before = ',';
      json_.append("\"").append(f.name) += "\":";
      f.many == field::how_many::one ? one(f) : array(f);
    }
    if (before == '{') json_ += '{';
    json_ += '}';
  }

  std::string_view rest_;
  std::string& json_;
  const std::size_t end_;
  converted state_ = converted::done;
};

} // namespace

converted to_json(const message_type& type, std::string_view bytes, std::string& json,
                  std::size_t bytes_max) {
  return writer{bytes, json, bytes_max}.whole(type);
}

} // namespace rowe::ros1
