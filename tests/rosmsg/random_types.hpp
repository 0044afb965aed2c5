// SPDX-License-Identifier: Apache-2.0
// Random definitions, and random values of them in the JSON that is written for them. Made without the code
// that is tested, but for the digits of floats.
#pragma once
#include <random>
#include <string>
#include <vector>

#include <rowe/ros_type.hpp>

#include "json/reading/base64.hpp"
#include "json/writing/writer.hpp"

namespace rosmsg_tests {

class random_types {
 public:
  random_types(std::mt19937_64& random, rowe::ros_version version)
      : random_{random}, is_ros2_{version == rowe::ros_version::ros2} {
    const std::size_t count = 1 + below(5);
    types_.resize(count);
    for (std::size_t t = 0; t < count; ++t) {
      const std::size_t members = below(t == 0 ? 12 : 6);
      for (std::size_t m = 0; m < members; ++m) types_[t].push_back(some_member(t, m));
    }
  }

  std::string definition() {
    std::string text;
    for (std::size_t t = 0; t < types_.size(); ++t) {
      if (t != 0)
        text += std::string(80, '=') + "\nMSG: test/" + (is_ros2_ && below(2) == 0 ? "msg/" : "") + "T" +
                std::to_string(t) + "\n";
      if (below(3) == 0) text += "# a comment\n";
      if (below(3) == 0) text += "uint8 CONSTANT=7\n";
      for (const member& m : types_[t]) text += m.type + m.array + " " + m.name + "\n";
    }
    return text;
  }

  // A value of the message; its members in another order if `shuffled`, which changes nothing but that.
  struct texts {
    std::string straight;
    std::string shuffled;
  };
  texts value() { return object(0); }

 private:
  struct member {
    std::string name;
    std::string type;
    std::string array;
    std::size_t least = 1; // elements; of what is no array exactly one
    std::size_t most = 1;
    std::size_t object = 0;   // its type; 0: none
    std::size_t text_max = 9; // characters of one byte
  };

  std::size_t below(std::size_t bound) { return static_cast<std::size_t>(random_() % bound); }

  member some_member(std::size_t owner, std::size_t number) {
    static constexpr const char* common[] = {"bool",    "int8",   "uint8", "int16",  "uint16",
                                             "int32",   "uint32", "int64", "uint64", "float32",
                                             "float64", "string", "byte",  "char"};
    member made;
    made.name = "m" + std::to_string(number);
    if (owner + 1 < types_.size() && below(3) == 0) {
      made.object = owner + 1 + below(types_.size() - owner - 1);
      made.type = (below(2) == 0 ? "test/T" : "T") + std::to_string(made.object);
    } else if (below(8) == 0) {
      made.type = is_ros2_ ? (below(2) == 0 ? "builtin_interfaces/Time" : "builtin_interfaces/Duration")
                           : (below(2) == 0 ? "time" : "duration");
    } else if (is_ros2_ && below(8) == 0) {
      made.type = "wstring";
    } else {
      made.type = common[below(std::size(common))];
    }
    if (is_ros2_ && made.type == "string" && below(2) == 0) {
      made.text_max = 1 + below(20);
      made.type += "<=" + std::to_string(made.text_max);
    }
    switch (below(6)) {
    case 0:
      made.array = "[]";
      made.least = 0;
      made.most = made.object != 0 ? 3 : 20;
      break;
    case 1:
      made.least = made.most = 1 + below(made.object != 0 ? 3 : 9);
      made.array = "[" + std::to_string(made.most) + "]";
      break;
    case 2:
      if (!is_ros2_) break;
      made.least = 0;
      made.most = 1 + below(made.object != 0 ? 3 : 9);
      made.array = "[<=" + std::to_string(made.most) + "]";
      break;
    default: break;
    }
    return made;
  }

  texts object(std::size_t t) {
    texts made{"{", "{"};
    std::vector<std::string> parts;
    for (const member& m : types_[t]) {
      const texts one = value(m);
      made.straight += (made.straight.size() > 1 ? ",\"" : "\"") + m.name + "\":" + one.straight;
      parts.push_back("\"" + m.name + "\":" + one.shuffled);
    }
    std::shuffle(parts.begin(), parts.end(), random_);
    for (const std::string& one : parts) made.shuffled += (made.shuffled.size() > 1 ? ", " : " ") + one;
    made.straight += "}";
    made.shuffled += " }";
    return made;
  }

  texts value(const member& m) {
    if (m.array.empty()) return one(m);
    const std::size_t count = m.least + below(m.most - m.least + 1);
    const bool is_bytes = m.type == "uint8" || m.type == "char" || (is_ros2_ && m.type == "byte");
    if (is_bytes) {
      std::string bytes;
      for (std::size_t i = 0; i < count; ++i) bytes += static_cast<char>(random_());
      std::string text(rowe::json::base64_text_bytes(count), '\0');
      rowe::json::write_base64(text.data(), bytes.data(), count);
      return {"\"" + text + "\"", "\"" + text + "\""};
    }
    texts made{"[", "["};
    for (std::size_t i = 0; i < count; ++i) {
      const texts element = one(m);
      made.straight += (i == 0 ? "" : ",") + element.straight;
      made.shuffled += (i == 0 ? "" : " ,") + element.shuffled;
    }
    made.straight += "]";
    made.shuffled += "]";
    return made;
  }

  texts one(const member& m) {
    if (m.object != 0) return object(m.object);
    const std::string text = scalar(m);
    return {text, text};
  }

  template <class T>
  std::string whole() {
    if (below(4) == 0) return std::to_string(std::numeric_limits<T>::min());
    if (below(4) == 0) return std::to_string(std::numeric_limits<T>::max());
    return std::to_string(static_cast<T>(random_()));
  }
  template <class T>
  std::string real() {
    std::uint64_t bits = random_();
    T x;
    std::memcpy(&x, &bits, sizeof x); // as it may be, not finite ones too
    if (below(3) == 0) x = static_cast<T>(static_cast<std::int64_t>(bits % 20001) - 10000) / 100;
    char digits[64];
    rowe::json::writer to{digits};
    to.number(x);
    return std::string{to.text()};
  }
  std::string string(std::size_t bytes_max) {
    std::string text;
    while (below(6) != 0) {
      static constexpr const char* some[] = {
          "a", " ", "\"", "\\", "\n", "\x01", "\xc3\xa4", "\xe2\x82\xac", "\xf0\x9f\x98\x80"};
      const std::string_view piece = some[below(std::size(some))];
      if (text.size() + piece.size() > bytes_max) break;
      text += piece;
    }
    std::string quoted(6 * text.size() + 16, '\0');
    rowe::json::writer to{quoted};
    to.string(text);
    return std::string{to.text()};
  }
  std::string scalar(const member& m) {
    const std::string_view type = m.type;
    if (type == "bool") return below(2) == 0 ? "true" : "false";
    if (type == "int8" || (type == "byte" && !is_ros2_)) return whole<std::int8_t>();
    if (type == "uint8" || type == "char" || type == "byte") return whole<std::uint8_t>();
    if (type == "int16") return whole<std::int16_t>();
    if (type == "uint16") return whole<std::uint16_t>();
    if (type == "int32") return whole<std::int32_t>();
    if (type == "uint32") return whole<std::uint32_t>();
    if (type == "int64") return whole<std::int64_t>();
    if (type == "uint64") return whole<std::uint64_t>();
    if (type == "float32") return real<float>();
    if (type == "float64") return real<double>();
    if (type == "time")
      return R"({"secs":)" + whole<std::uint32_t>() + R"(,"nsecs":)" + whole<std::uint32_t>() + "}";
    if (type == "duration")
      return R"({"secs":)" + whole<std::int32_t>() + R"(,"nsecs":)" + whole<std::int32_t>() + "}";
    if (type.starts_with("builtin_interfaces/"))
      return R"({"sec":)" + whole<std::int32_t>() + R"(,"nanosec":)" + whole<std::uint32_t>() + "}";
    return string(m.text_max);
  }

  std::mt19937_64& random_;
  const bool is_ros2_;
  std::vector<std::vector<member>> types_;
};

} // namespace rosmsg_tests
