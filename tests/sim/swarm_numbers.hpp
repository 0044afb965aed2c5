// SPDX-License-Identifier: Apache-2.0
// What a peer that speaks the tests' codec with numbers (wire/numbers_codec.hpp) was told: who the server is,
// and which topics and services there are. Each frame is checked against those before it: a number is given
// once, and only what was listed is removed.
#pragma once
#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "wire/numbers_codec.hpp"

namespace swarm {

// Of topics, or of services.
class number_list {
 public:
  const std::map<std::uint32_t, std::string>& names() const { return names_; }
  const std::vector<std::uint32_t>& gone() const { return gone_; } // some of them
  std::uint32_t most() const { return given_.empty() ? 0 : *given_.rbegin(); }
  // no_number where it is not listed.
  std::uint32_t number_of(std::string_view name) const {
    for (const auto& [number, known] : names_) {
      if (known == name) return number;
    }
    return rowe::wire::no_number;
  }
  // Empty where it is not listed.
  std::string name_of(std::uint32_t number) const {
    const auto found = names_.find(number);
    return found == names_.end() ? std::string{} : found->second;
  }

  // Each returns what is wrong; empty: nothing.
  std::string add(std::uint32_t number, std::string_view name) {
    if (name.empty()) return "number " + std::to_string(number) + " has no name";
    if (!given_.insert(number).second) return "number " + std::to_string(number) + " is given again";
    if (number_of(name) != rowe::wire::no_number) return std::string{name} + " is listed twice";
    names_[number] = name;
    return {};
  }
  std::string remove(std::uint32_t number) {
    if (names_.erase(number) == 0)
      return "number " + std::to_string(number) + " is removed, and was not listed";
    if (gone_.size() == 8) gone_.erase(gone_.begin());
    gone_.push_back(number);
    return {};
  }

 private:
  std::map<std::uint32_t, std::string> names_;
  std::set<std::uint32_t> given_;
  std::vector<std::uint32_t> gone_;
};

struct number_lists {
  bool greeted = false;
  number_list topics{};
  number_list services{};

  static bool is_list(std::string_view frame) {
    return !frame.empty() && std::string_view{"hTtSs"}.find(frame.front()) != std::string_view::npos;
  }
  // Of a frame that is one: what is wrong with it; empty: nothing.
  std::string take(std::string_view frame) {
    const char kind = frame.front();
    frame.remove_prefix(1);
    if (kind == 'h') {
      if (greeted) return "it is greeted twice";
      greeted = true;
      return {};
    }
    if (!greeted) return "a list comes before the greeting";
    number_list& into = kind == 'T' || kind == 't' ? topics : services;
    const bool added = kind == 'T' || kind == 'S';
    if (frame.empty()) return "a list of nothing";
    while (!frame.empty()) {
      if (frame.size() < 8) return "a list is cut";
      const std::uint32_t number = numbers::number_at(frame);
      const std::size_t bytes = numbers::number_at(frame.substr(4));
      if (frame.size() - 8 < bytes) return "a list is cut";
      const std::string wrong = added ? into.add(number, frame.substr(8, bytes)) : into.remove(number);
      if (!wrong.empty()) return wrong;
      frame.remove_prefix(8 + bytes);
    }
    return {};
  }
};

} // namespace swarm
