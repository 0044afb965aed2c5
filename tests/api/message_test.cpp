// SPDX-License-Identifier: Apache-2.0
#include <rowe/message.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace message_test {
namespace {

using rowe::array;
using rowe::message;
using rowe::message_of;
using rowe::object;
using rowe::raw_json;

template <class... Arguments>
concept makes_a_message = requires(const Arguments&... all) {
  message(all...);
};
template <class... Arguments>
concept makes_an_object = requires(Arguments&&... all) {
  object(all...);
};

TEST(message, is_the_one_of_the_paper) {
  EXPECT_EQ(message("service", "add-two-numbers", "a", 38, "b", 4).text(),
            R"({"service":"add-two-numbers","a":38,"b":4})");
}

TEST(message, says_every_kind_of_value) {
  const std::optional<int> none;
  const std::optional<double> some = 0.5;
  EXPECT_EQ(message("t", true, "f", false, "n", nullptr, "d", 0.1, "s", 1.5F, "e", none, "o", some).text(),
            R"({"t":true,"f":false,"n":null,"d":0.1,"s":1.5,"e":null,"o":0.5})");
}

TEST(message, says_integers_exactly) {
  EXPECT_EQ(message("min", std::numeric_limits<std::int64_t>::min(), "max",
                    std::numeric_limits<std::uint64_t>::max(), "small", std::int8_t{-128}, "byte",
                    std::uint8_t{255})
                .text(),
            R"({"min":-9223372036854775808,"max":18446744073709551615,"small":-128,"byte":255})");
}

TEST(message, says_null_where_json_has_no_number) {
  EXPECT_EQ(message("a", std::nan(""), "b", -std::numeric_limits<float>::infinity()).text(),
            R"({"a":null,"b":null})");
}

TEST(message, escapes_strings_and_names) {
  const std::string name = "quote\"";
  const std::string_view text = "line\n\xff";
  EXPECT_EQ(message(name, text).text(), "{\"quote\\\"\":\"line\\n\xEF\xBF\xBD\"}");
}

TEST(message, nests) {
  const std::vector<double> ranges{1, 2.5};
  const std::array<const char*, 2> names{"a", "b"};
  EXPECT_EQ(message("goal", object("x", 1.5, "at", object()), "path", array(1, "two", nullptr, array()), "r",
                    ranges, "names", names)
                .text(),
            R"({"goal":{"x":1.5,"at":{}},"path":[1,"two",null,[]],"r":[1,2.5],"names":["a","b"]})");
}

struct two_numbers {
  int values[2] = {1, 2};
};
const int* begin(const two_numbers& these) { return these.values; }
const int* end(const two_numbers& these) { return these.values + 2; }

TEST(message, takes_ranges_of_which_only_free_functions_know_the_ends) {
  EXPECT_EQ(message("n", two_numbers{}).text(), R"({"n":[1,2]})");
}

TEST(message, takes_text_that_is_json_already_and_other_messages) {
  EXPECT_EQ(message("raw", raw_json{R"({"n":1e3})"}, "inner", message("x", 1)).text(),
            R"({"raw":{"n":1e3},"inner":{"x":1}})");
}

TEST(message, keeps_what_nested_temporaries_held) {
  const auto nested = object("name", std::string{"a text that is too long for the small string"});
  EXPECT_EQ(message("o", nested).text(), R"({"o":{"name":"a text that is too long for the small string"}})");
}

TEST(message, is_an_empty_object_at_first_and_grows) {
  message built;
  EXPECT_EQ(built.text(), "{}");
  built.add("a", 1).add("b", array(1, 2));
  EXPECT_EQ(built.text(), R"({"a":1,"b":[1,2]})");
}

TEST(message, that_does_not_fit_says_so_and_is_an_empty_object) {
  const std::string_view whole = R"({"name":"value"})";
  for (std::size_t missing = 1; missing < whole.size(); ++missing) {
    // Sizes are compile-time, so the text grows instead.
    const std::string value(5 + missing, 'x');
    message_of<16> built{"name", value};
    EXPECT_TRUE(built.overflowed());
    EXPECT_EQ(built.text(), "{}");
    EXPECT_TRUE(built.add("more", 1).overflowed());
  }
  message_of<16> fits{"name", "value"};
  EXPECT_FALSE(fits.overflowed());
  EXPECT_EQ(fits.text(), whole);
  EXPECT_TRUE(fits.add("x", 1).overflowed());
}

TEST(message, overflows_wherever_its_buffer_ends) {
  const auto build = []<std::size_t Bytes>(std::integral_constant<std::size_t, Bytes>) {
    const message_of<Bytes> built{"a", 1.25, "b", array(true, object("c", "\n"))};
    const std::string_view whole = R"({"a":1.25,"b":[true,{"c":"\n"}]})";
    EXPECT_EQ(built.overflowed(), Bytes < whole.size()) << Bytes;
    EXPECT_EQ(built.text(), Bytes < whole.size() ? "{}" : whole) << Bytes;
  };
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (build(std::integral_constant<std::size_t, I + 2>{}), ...);
  }
  (std::make_index_sequence<40>{});
}

TEST(message, does_not_compile_from_names_without_values_or_values_json_has_not) {
  static_assert(makes_a_message<const char*, int>);
  static_assert(!makes_a_message<const char*>);
  static_assert(!makes_a_message<const char*, int, const char*>);
  static_assert(!makes_a_message<int, int>);
  static_assert(!makes_an_object<const char*>);
  static_assert(makes_an_object<>);
}

TEST(body, is_made_from_text_and_from_messages) {
  const std::string text = R"({"a":1})";
  const message built{"a", 1};
  EXPECT_EQ(rowe::body{text}.text(), text);
  EXPECT_EQ(rowe::body{text.c_str()}.text(), text);
  EXPECT_EQ(rowe::body{std::string_view{text}}.text(), text);
  EXPECT_EQ(rowe::body{built}.text(), text);
  EXPECT_EQ(rowe::body{built}.outgrown(), 0U);
  const message_of<8> small{"name", "value"};
  EXPECT_EQ(rowe::body{small}.outgrown(), 8U);
}

} // namespace
} // namespace message_test
