// SPDX-License-Identifier: Apache-2.0
// Another text with the same meaning: members in another order, other white space, characters as escapes,
// numbers spelt otherwise. And, where asked for, a text with other meanings: members left out, doubled,
// added, values swapped for others.
#pragma once
#include <algorithm>
#include <array>
#include <cstdio>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "json/reading/reader.hpp"

namespace rowe::tests {

class respelling {
 public:
  using random = std::mt19937_64;

  // `damage`: how often, in ten thousand, something is changed that matters.
  respelling(random& r, unsigned damage) : random_{r}, damage_{damage} {}

  std::string text(const json::value& v) {
    if (chance(damage_)) return other_value();
    switch (v.type) {
    case json::kind::object: return object(v);
    case json::kind::array: return array(v);
    case json::kind::string: return '"' + characters(v.raw.substr(1, v.raw.size() - 2)) + '"';
    case json::kind::number: return number(v.raw);
    default: return std::string{v.raw};
    }
  }

 private:
  bool chance(unsigned in_ten_thousand) { return random_() % 10'000 < in_ten_thousand; }
  std::string space() { return chance(1000) ? std::string(random_() % 3, " \t\n\r"[random_() % 4]) : ""; }

  std::string object(const json::value& v) {
    std::vector<std::string> members;
    json::object_walk walk{v.raw};
    for (json::member m; walk.next(m);) {
      if (chance(damage_)) continue;
      const auto member = [&] {
        return space() + '"' + characters(m.name_raw) + '"' + space() + ':' + space() + text(m.what) +
               space();
      };
      members.push_back(member());
      if (chance(damage_)) members.push_back(member());
    }
    if (chance(1000)) members.push_back("\"unknown\":" + other_value());
    if (chance(300)) members.push_back("\"\\u0075nknown, and longer than most\":" + other_value());
    if (chance(3000)) std::shuffle(members.begin(), members.end(), random_);
    return '{' + joined(members) + '}';
  }

  std::string array(const json::value& v) {
    std::vector<std::string> elements;
    json::array_walk walk{v.raw};
    for (json::value e; walk.next(e);) {
      if (chance(damage_ / 8)) continue;
      elements.push_back(space() + text(e) + space());
      if (chance(damage_ / 8)) elements.push_back(text(e));
    }
    return '[' + joined(elements) + ']';
  }

  std::string joined(const std::vector<std::string>& pieces) {
    std::string all = pieces.empty() ? space() : "";
    for (const std::string& p : pieces) {
      if (!all.empty()) all += ',';
      all += p;
    }
    return all;
  }

  // Some ASCII letters become escapes; escapes that are there stay.
  std::string characters(std::string_view escaped) {
    std::string all;
    const bool some = chance(2000);
    for (std::size_t i = 0; i < escaped.size(); ++i) {
      const char c = escaped[i];
      if (c == '\\') {
        const std::size_t bytes = escaped[i + 1] == 'u' ? 6 : 2;
        all += escaped.substr(i, bytes);
        i += bytes - 1;
      } else if (some && static_cast<unsigned char>(c) < 0x80 && chance(3000)) {
        std::array<char, 8> text{};
        std::snprintf(text.data(), text.size(), chance(5000) ? "\\u%04x" : "\\u%04X",
                      static_cast<unsigned>(c));
        all += text.data();
      } else {
        all += c;
      }
    }
    return all;
  }

  std::string number(std::string_view raw) {
    std::string all{raw};
    const bool has_exponent = all.find_first_of("eE") != std::string::npos;
    const bool has_point = all.find('.') != std::string::npos;
    if (has_exponent || !chance(1500)) return all;
    if (chance(3000)) return all + (has_point ? "" : ".") + std::string(1 + random_() % 25, '0');
    if (chance(5000)) return all + (chance(5000) ? "E+" : "e-") + std::string(1 + random_() % 3, '0');
    if (has_point) { // one digit to the left
      const std::size_t point = all.find('.');
      if (point + 2 < all.size() && all[point - 1] != '0') {
        std::swap(all[point], all[point + 1]);
        all += "e-1";
      }
      return all;
    }
    return all == "0" || all == "-0" ? all : all + "000e-3";
  }

  std::string other_value() {
    static const std::vector<std::string_view> values = [] {
      std::vector<std::string_view> all;
      json::array_walk walk{
          R"([null,true,false,{},[],"",0,-1,1.5,128,-129,256,32768,-32769,65536,1e3,1e21,"12","-7","007",)"
          R"("1.0",3.0,300e-2,1e39,1e-400,-0,-0.0,2147483648,4294967296,9223372036854775808,)"
          R"(-9223372036854775809,18446744073709551616,18446744073709552000,18446744073709551615,)"
          R"("18446744073709551616","\u0031\u0032",{"x":1,"y":2},[1,2],[null,3],)"
          R"("a text that is longer than what is there","\u00fc\ud83d\ude00",[1,2,3,4,5,6,7],)"
          R"({"x":1,"\u0078":2,"y":3},[[1,2],[3,4]],["a","b"],3.4028235677973366e38,)"
          R"(3.4028235677973365e38,16777217,16777217.0000000000000001,1e-46,1.17549429e-38])"};
      for (json::value v; walk.next(v);) all.push_back(v.raw);
      return all;
    }();
    return std::string{values[random_() % values.size()]};
  }

  random& random_;
  unsigned damage_;
};

} // namespace rowe::tests
