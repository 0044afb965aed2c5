// SPDX-License-Identifier: Apache-2.0
// The table of keys; that no member lacks one is asserted where it is compiled.
#include "config/keys.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace keys_test {
namespace {

using namespace rowe::config;
using rowe::configuration;

// Another value of this form.
value other_than(const form& what, const value& now) {
  if (what.is == kind::boolean) return !std::get<bool>(now);
  if (what.is == kind::text || what.is == kind::path) return std::get<std::string>(now) + "x";
  if (what.is == kind::texts) return std::vector<std::string>{"x", "y"};
  return std::get<std::int64_t>(now) == what.least ? what.most : what.least;
}

TEST(keys, set_what_they_get_and_nothing_else) {
  for (const auto& one : keys()) {
    configuration all;
    const configuration untouched;
    const value wanted = other_than(one.what, one.get(all));
    one.set(all, value{wanted});
    EXPECT_EQ(one.get(all), wanted) << one.section << "." << one.name;
    if (one.number != nullptr) {
      EXPECT_EQ(one.number(all.endpoint), std::get<std::int64_t>(wanted)) << one.name;
    }
    for (const auto& other : keys()) {
      if (&other != &one) {
        EXPECT_EQ(other.get(all), other.get(untouched)) << one.name << " set " << other.name;
      }
    }
  }
}

TEST(keys, have_defaults_within_their_ranges) {
  const configuration all;
  for (const auto& one : keys()) {
    if (one.what.is == kind::integer || one.what.is == kind::size || one.what.is == kind::time) {
      EXPECT_EQ(check_range(one.what, std::get<std::int64_t>(one.get(all))), "") << one.name;
    }
  }
}

TEST(keys, are_found_by_their_names_and_by_what_errors_call_them) {
  std::set<std::string> names, options;
  for (std::size_t i = 0; i < keys().size(); ++i) {
    const auto& one = keys()[i];
    EXPECT_EQ(find(one.section, one.name), i);
    EXPECT_TRUE(names.insert(std::string{one.section} + "." + std::string{one.name}).second) << one.name;
    EXPECT_TRUE(one.option.empty() || options.insert(std::string{one.option}).second) << one.option;
    EXPECT_EQ(one.option.empty(), one.section == "limits" || one.section == "client") << one.name;
    if (one.number != nullptr) {
      EXPECT_EQ(find(one.which), i) << one.name;
    }
  }
  EXPECT_EQ(find("endpoint", "topics_max"), keys().size());
  EXPECT_EQ(find(rowe::argument::unnamed), keys().size());
  EXPECT_EQ(find(rowe::argument::depth), keys().size());
}

} // namespace
} // namespace keys_test
