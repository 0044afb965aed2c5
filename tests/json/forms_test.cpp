// SPDX-License-Identifier: Apache-2.0
// Enums by name, durations and times: written and read.
#include <array>
#include <chrono>
#include <limits>
#include <random>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "checked_decoder.hpp"
#include "decodable.hpp"
#include "encoded.hpp"
#include "respelled.hpp"
#include "rt/seed.hpp"
#include "texts.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/decoder.hpp"

namespace rowe::json {
namespace forms_test {
namespace {

using namespace std::chrono_literals;
using tests::anything;
using tests::concat;
using tests::rank;
using tests::repeat;
using tests::stance;

// What the encoder writes, in buffers of every size.
std::string encoded(const anything& x) {
  static const encoder e = encoder::compile(describe<anything>()).value();
  std::string whole = tests::encoded(x);
  for (std::size_t room = 0; room <= whole.size() + 48; ++room) {
    tests::expect_written_within(room, whole, [&](writer& w) { e.encode(&x, w); });
  }
  return whole;
}

anything read(std::string_view text) { return tests::decoded<anything>(text); }
error refused(std::string_view text) { return tests::refused<anything>(text); }
std::string diagnosis_of(std::string_view text) { return tests::diagnosis_of<anything>(text); }

template <class Value>
std::string with(Value anything::*member, const Value& value) {
  anything x;
  x.*member = value;
  return encoded(x);
}

// ---- enums ----

TEST(enum_names, are_written_for_values_that_have_one) {
  EXPECT_EQ(with(&anything::stance, std::optional{stance::sitting}), R"({"stance":"sitting"})");
  EXPECT_EQ(with(&anything::stance, std::optional{stance::standing}), R"({"stance":"standing"})");
  EXPECT_EQ(with(&anything::stance, std::optional{stance::lying}), R"({"stance":"on the \"ground\""})");
  EXPECT_EQ(with(&anything::rank, std::optional{rank::most}), R"({"rank":"most"})");
  anything x;
  x.stances.emplace();
  ASSERT_TRUE(x.stances->push_back(stance::lying) && x.stances->push_back(stance::standing));
  EXPECT_EQ(encoded(x), R"({"stances":["on the \"ground\"","standing"]})");
}

TEST(enum_names, give_way_to_the_number_of_a_value_without_one) {
  EXPECT_EQ(with(&anything::stance, std::optional{static_cast<stance>(-32768)}), R"({"stance":-32768})");
  EXPECT_EQ(with(&anything::stance, std::optional{static_cast<stance>(7)}), R"({"stance":7})");
  EXPECT_EQ(with(&anything::rank, std::optional{static_cast<rank>(1)}), R"({"rank":1})");
  EXPECT_EQ(refused(R"({"stance":7})"), (error{errc::out_of_range, 10}));
}

TEST(enum_names, are_read_and_so_are_their_numbers) {
  EXPECT_EQ(read(R"({"stance":"standing"})").stance, stance::standing);
  EXPECT_EQ(read(R"({"stance":"on the \u0022ground\""})").stance, stance::lying);
  EXPECT_EQ(read(R"({"stance":"\u0073itting"})").stance, stance::sitting);
  EXPECT_EQ(read(R"({"stance":200})").stance, stance::standing);
  EXPECT_EQ(read(R"({"stance":-3.0})").stance, stance::lying);
  EXPECT_EQ(read(R"({"stance":null})").stance, std::nullopt);
  EXPECT_EQ(read(R"({"rank":18446744073709551615})").rank, rank::most);
  EXPECT_EQ(read(R"({"rank":"least"})").rank, rank::least);
  const auto list = read(R"({"stances":["sitting",-3]})").stances;
  ASSERT_EQ(list->size(), 2U);
  EXPECT_EQ((*list)[0], stance::sitting);
  EXPECT_EQ((*list)[1], stance::lying);
}

TEST(enum_names, are_all_that_is_read) {
  for (const std::string_view unknown : {"\"\"", "\"Sitting\"", "\"sitting \"", "\"sittin\"", "\"200\"",
                                         "\"on the ground\"", "0", "199", "32768", "1e9", "\"\\u0000\""}) {
    EXPECT_EQ(refused(concat({R"({"stance":)", unknown, "}"})), (error{errc::out_of_range, 10})) << unknown;
  }
  for (const std::string_view other : {"true", "1.5", "[]", "{}", "[\"sitting\"]"}) {
    EXPECT_EQ(refused(concat({R"({"stance":)", other, "}"})), (error{errc::wrong_type, 10})) << other;
  }
  EXPECT_EQ(refused(R"({"stances":["sitting","flying"]})"), (error{errc::out_of_range, 22}));
  EXPECT_EQ(refused(concat({R"({"stance":")", repeat("\\u0073", 9000), "\"}"})).code, errc::out_of_range);
}

TEST(enum_names, are_told_to_whoever_sends_another) {
  EXPECT_EQ(
      diagnosis_of(R"({"stance":"flying"})"),
      R"(the member "stance" must be "standing", "on the "ground"" or "sitting" or null; it is "flying")");
  EXPECT_EQ(diagnosis_of(R"({"stances":[0]})"),
            R"(the member "stances[0]" must be "standing", "on the "ground"" or "sitting"; it is 0)");
}

// ---- durations and times ----

TEST(durations, are_written_as_their_count_or_exactly_in_seconds) {
  EXPECT_EQ(with(&anything::age, std::optional{-1500ms}), R"({"age":-1500})");
  EXPECT_EQ(with(&anything::wait, std::optional{std::chrono::duration<float, std::milli>{0.1F}}),
            R"({"wait":0.1})");
  const auto seconds = [](std::chrono::nanoseconds t) {
    const std::string text = with(&anything::age_s, std::optional{t});
    return text.substr(9, text.size() - 10);
  };
  EXPECT_EQ(seconds(0ns), "0");
  EXPECT_EQ(seconds(1ns), "0.000000001");
  EXPECT_EQ(seconds(-1ns), "-0.000000001");
  EXPECT_EQ(seconds(1500ms), "1.5");
  EXPECT_EQ(seconds(-2s), "-2");
  EXPECT_EQ(seconds(1'700'000'000'123'456'789ns), "1700000000.123456789");
  EXPECT_EQ(seconds(std::chrono::nanoseconds::min()), "-9223372036.854775808");
  EXPECT_EQ(seconds(std::chrono::nanoseconds::max()), "9223372036.854775807");
  anything x;
  x.laps = {std::chrono::duration<std::uint16_t, std::deci>{65535},
            std::chrono::duration<std::uint16_t, std::deci>{10}};
  x.whole = std::chrono::duration<std::int8_t>{-128};
  x.born = std::chrono::sys_time<std::chrono::microseconds>{1'700'000'000'000'001us};
  EXPECT_EQ(encoded(x), R"({"laps":[6553.5,1],"whole":-128,"born":1700000000.000001})");
}

TEST(durations, are_read_and_rounded_to_their_unit) {
  EXPECT_EQ(read(R"({"age":-1500})").age, -1500ms);
  EXPECT_EQ(refused(R"({"age":1.5})").code, errc::wrong_type);
  const auto nanoseconds = [](std::string_view text) {
    return read(concat({R"({"age_s":)", text, "}"})).age_s->count();
  };
  EXPECT_EQ(nanoseconds("1700000000.123456789"), 1'700'000'000'123'456'789);
  EXPECT_EQ(nanoseconds("1.7e9"), 1'700'000'000'000'000'000);
  EXPECT_EQ(nanoseconds("0.30000000000000004"), 300'000'000);
  EXPECT_EQ(nanoseconds("0.9999999995"), 1'000'000'000);
  EXPECT_EQ(nanoseconds("-0.0000000005"), -1);
  EXPECT_EQ(nanoseconds("0.00000000049999999999999999999"), 0);
  EXPECT_EQ(nanoseconds("-1e-400"), 0);
  EXPECT_EQ(nanoseconds("5e-10"), 1);
  EXPECT_EQ(nanoseconds("5e-11"), 0);
  EXPECT_EQ(nanoseconds("-9223372036.8547758084"), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(read(R"({"whole":1.5})").whole->count(), 2);
  EXPECT_EQ(read(R"({"whole":-127.7})").whole->count(), -128);
  EXPECT_EQ(read(R"({"laps":[0.14,0.15]})").laps->at(1).count(), 2);
  EXPECT_EQ(read(R"({"born":1700000000.0000014})").born->time_since_epoch(), 1'700'000'000'000'001us);
}

TEST(durations, are_refused_beyond_their_range) {
  for (const std::string_view beyond :
       {"9223372036.8547758075", "-9223372036.8547758085", "1e300", "1e11", "18446744073.7095516155",
        "18446744073709551615", "99999999999999999999999999e-9"}) {
    EXPECT_EQ(refused(concat({R"({"age_s":)", beyond, "}"})), (error{errc::out_of_range, 9})) << beyond;
  }
  EXPECT_EQ(refused(R"({"laps":[6553.55,0]})"), (error{errc::out_of_range, 9}));
  EXPECT_EQ(refused(R"({"laps":[-0.1,0]})"), (error{errc::out_of_range, 9}));
  EXPECT_EQ(refused(R"({"age_s":"1"})"), (error{errc::wrong_type, 9}));
  EXPECT_EQ(diagnosis_of(R"({"age_s":1e10})"),
            R"(the member "age_s" must be a number of seconds from -9223372036 to 9223372036 or null; )"
            R"(it is 1e10)");
  EXPECT_EQ(diagnosis_of(R"({"laps":[1,-1]})"),
            R"(the member "laps[1]" must be a number of seconds from 0 to 6553; it is -1)");
  EXPECT_EQ(diagnosis_of(R"({"whole":true})"),
            R"(the member "whole" must be a number of seconds from -127 to 127 or null; it is true)");
}

// ---- at random ----

TEST(forms, are_read_back_as_they_were_however_the_text_is_spelt) {
  tests::seeded random;
  constexpr std::array stances{stance::lying, stance::sitting, stance::standing};
  const auto integer = [&] { return static_cast<std::int64_t>(random()) >> random() % 64; };
  const auto leave_out_some = [&](auto&... of) { ((random() % 4 == 0 ? of.reset() : void()), ...); };
  tests::respelling other{random, 0};
  for (int i = 0; i < 1000; ++i) {
    anything x;
    x.stance = stances[random() % 3];
    x.stances.emplace();
    while (random() % 2 == 0 && x.stances->push_back(stances[random() % 3])) {
    }
    x.rank = random() % 2 == 0 ? rank::least : rank::most;
    x.age = std::chrono::milliseconds{integer()};
    x.age_s = std::chrono::nanoseconds{integer()};
    for (auto& lap : x.laps.emplace()) {
      lap = std::chrono::duration<std::uint16_t, std::deci>{static_cast<std::uint16_t>(random())};
    }
    x.whole = std::chrono::duration<std::int8_t>{static_cast<std::int8_t>(random())};
    x.born = std::chrono::sys_time<std::chrono::microseconds>{std::chrono::microseconds{integer()}};
    leave_out_some(x.stance, x.stances, x.rank, x.age, x.age_s, x.laps, x.whole, x.born);
    const std::string text = encoded(x);
    ASSERT_EQ(encoded(read(text)), text);
    ASSERT_EQ(encoded(read(other.text(root(text)))), text);
    tests::respelling faulty{random, 100};
    (void)tests::decode(faulty.text(root(text)), x); // as the reference reads it
    ASSERT_FALSE(HasFailure());
  }
}

// ---- descriptions ----

// Hand-made, for what no type of reasonable size can provoke.
TEST(schema, gives_an_enum_no_more_names_than_can_be_told_apart) {
  constexpr std::size_t count = decoder::members_max + 1;
  std::vector<std::string> names(count);
  std::vector<enumerator_description> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    names[i] = "n" + std::to_string(i);
    values[i] = {names[i], static_cast<std::int64_t>(i * 7 % count)};
  }
  value_description type{.kind = value_kind::uint16, .bytes = 2};
  const member_description m{
      .name = "a", .type = &type, .address = [](const void* at) noexcept { return at; }, .by_name = true};
  const schema_description schema{.type_name = {},
                                  .bytes = 2,
                                  .alignment = 2,
                                  .members = {&m, 1},
                                  .set_default = [](void* at) noexcept { std::memset(at, 0, 2); },
                                  .decodable = true};
  type.enumerators = values;
  const auto refused = decoder::compile(schema);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error(), (error{errc::bad_argument, count, decoder::members_max}));

  type.enumerators = std::span{values}.first(count - 1);
  const decoder d = decoder::compile(schema).value();
  const encoder e = encoder::compile(schema).value();
  for (std::size_t i = 0; i < count - 1; ++i) {
    const std::string text = concat({"{\"a\":\"", names[i], "\"}"});
    std::uint16_t value = 0;
    ASSERT_TRUE(d.decode(text, &value));
    ASSERT_EQ(value, values[i].value);
    ASSERT_EQ(tests::encoded_by(e, &value), text);
  }
  const std::string number = "{\"a\":" + std::to_string(values[count - 1].value) + "}";
  std::uint16_t value = 0;
  decoder::diagnosis why;
  ASSERT_EQ(d.decode(number, &value, &why).code(), errc::out_of_range);
  std::array<char, decoder::diagnosis::text_bytes_max> words;
  const std::string_view said = why.text(words);
  EXPECT_NE(said.find(" or one of 10"), std::string_view::npos) << said;
  EXPECT_LT(said.size(), 300U);
}

} // namespace
} // namespace forms_test
} // namespace rowe::json
