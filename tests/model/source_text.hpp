// SPDX-License-Identifier: Apache-2.0
// For sources that are not written against the atomics policy: a program of what they do stands in a model,
// and a test compares the accesses of both.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

namespace rowe::model {

struct source_access {
  std::string file;
  std::string_view code; // without spaces
  std::size_t times;
};

// Without spaces, line breaks and comments.
inline std::string code_of(const std::string& path) {
  std::ifstream file{ROWE_SOURCE_DIR "/" + path};
  std::string code;
  for (std::string line; std::getline(file, line);) {
    line.resize(std::min(line.find("//"), line.size()));
    for (const char c : line) {
      if (c != ' ') code += c;
    }
  }
  return code;
}
inline std::size_t count_of(std::string_view what, const std::string& in) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = in.find(what, at)) != std::string::npos; at += what.size()) ++count;
  return count;
}

inline void expect_in_sources(std::span<const source_access> expected) {
  for (const source_access& one : expected)
    EXPECT_EQ(count_of(one.code, code_of(one.file)), one.times) << one.code << " in " << one.file;
}

} // namespace rowe::model
