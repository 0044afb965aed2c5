// SPDX-License-Identifier: Apache-2.0
// Bytes as text: what RFC 4648 says, what is none, and that nothing is written beyond what was promised.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <string_view>

#include <rowe/bounded_array.hpp>
#include <rowe/json_value.hpp>
#include <rowe/schema.hpp>

#include "encoded.hpp"
#include "rt/seed.hpp"
#include "json/reading/base64.hpp"

namespace base64_test {

struct image {
  std::uint32_t width = 1;
  rowe::bounded_array<std::uint8_t, 64> data;
  std::array<std::byte, 2> mark{std::byte{255}, std::byte{0}};
  std::array<std::uint8_t, 8> some{1, 2, 3};
  std::uint8_t used = 2;
  std::array<std::uint8_t, 2> numbers{7, 255};
  std::array<std::uint8_t, 2> quoted{7, 255};
};

} // namespace base64_test

template <>
inline constexpr auto rowe::schema<base64_test::image> =
    rowe::fields<&base64_test::image::width, &base64_test::image::data, &base64_test::image::mark,
                 rowe::counted<&base64_test::image::some, &base64_test::image::used>,
                 rowe::field<&base64_test::image::numbers>.as_numbers(),
                 rowe::field<&base64_test::image::quoted>.as_string()>{};

namespace rowe::json {
namespace base64_test {
using namespace ::base64_test;
namespace {

std::string written(std::string_view bytes) {
  std::string text(base64_text_bytes(bytes.size()), '?');
  const char* const end = write_base64(text.data(), bytes.data(), bytes.size());
  EXPECT_EQ(end, text.data() + text.size());
  return text;
}

// Into memory of exactly the size.
std::optional<std::string> read(std::string_view escaped) {
  const base64_text text{escaped};
  const auto bytes = text.bytes();
  if (!bytes) return std::nullopt;
  const auto exact = std::make_unique<char[]>(*bytes + 1);
  exact[*bytes] = 'x';
  const bool good = text.read(exact.get());
  EXPECT_EQ(exact[*bytes], 'x');
  if (!good) return std::nullopt;
  return std::string{exact.get(), *bytes};
}

TEST(base64, is_as_the_standard_has_it) {
  const std::array<std::array<std::string_view, 2>, 7> vectors{{{"", ""},
                                                                {"f", "Zg=="},
                                                                {"fo", "Zm8="},
                                                                {"foo", "Zm9v"},
                                                                {"foob", "Zm9vYg=="},
                                                                {"fooba", "Zm9vYmE="},
                                                                {"foobar", "Zm9vYmFy"}}};
  for (const auto& [bytes, text] : vectors) {
    EXPECT_EQ(written(bytes), text);
    EXPECT_EQ(read(text), bytes);
  }
}

TEST(base64, reads_what_is_written_of_any_bytes_with_escapes_and_without) {
  tests::seeded random;
  for (int i = 0; i < 3000; ++i) {
    std::string bytes(random() % 200, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    const std::string text = written(bytes);
    ASSERT_EQ(read(text), bytes);
    std::string escaped;
    for (const char c : text) {
      if (c == '/') {
        escaped += "\\/";
      } else if (random() % 5 == 0) {
        constexpr std::string_view hex = "0123456789abcdef";
        escaped += "\\u00";
        escaped += hex[static_cast<unsigned char>(c) >> 4];
        escaped += hex[static_cast<unsigned char>(c) & 15];
      } else {
        escaped += c;
      }
    }
    ASSERT_EQ(read(escaped), bytes) << escaped;
  }
}

TEST(base64, refuses_what_is_none) {
  for (const std::string_view wrong : {"Z", "Zg", "Zg=", "Zg===", "Z===", "====", "Zg==Zg==", "Zm9v\\n",
                                       "Zm-_", "Zm 9", "Zm9v====", "=Zm9", "Zm\xc3\xa9"})
    EXPECT_FALSE(read(wrong)) << wrong;
  std::string all(64, 'A');
  for (unsigned c = 0; c < 256; ++c) {
    for (const std::size_t at : {0U, 5U, 62U, 63U}) {
      std::string text = all;
      text[at] = static_cast<char>(c);
      const bool digit =
          std::string_view{"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"}.find(
              static_cast<char>(c)) != std::string_view::npos;
      const bool padded = c == '=' && at == 63;
      if (c == '\\') continue;
      EXPECT_EQ(read(text).has_value(), digit || padded) << c << " at " << at;
    }
  }
  EXPECT_FALSE(read("Zm9v\\")) << "a text that was not validated";
}

TEST(base64, is_how_arrays_of_bytes_are_written) {
  image shown;
  for (const char c : std::string_view{"foobar?>"}) (void)shown.data.push_back(static_cast<std::uint8_t>(c));
  const encoder e = encoder::compile(describe<image>()).value();
  const std::string text = tests::encoded_by(e, &shown);
  EXPECT_EQ(text, R"({"width":1,"data":"Zm9vYmFyPz4=","mark":"/wA=","some":"AQI=","numbers":[7,255],)"
                  R"("quoted":["7","255"]})");
  // It fits exactly, or it is said that it does not.
  for (std::size_t bytes = 0; bytes <= text.size(); ++bytes) {
    tests::expect_written_within(bytes, text, [&](writer& w) { e.encode(&shown, w); });
  }
  const auto back = json_value::parse(text).value().as<image>();
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->data.size(), 8U);
  EXPECT_EQ(back->mark, shown.mark);
  EXPECT_EQ(back->used, 2);
  const auto counted =
      json_value::parse(R"({"width":1,"data":"","mark":"/wA=","some":[1,2,3],"numbers":"AAE=",)"
                        R"("quoted":[1,"2"]})")
          .value()
          .as<image>();
  ASSERT_TRUE(counted) << counted.error().message();
  EXPECT_EQ(counted->used, 3);
  EXPECT_EQ(counted->numbers[1], 1);
}

TEST(base64, is_read_by_get) {
  const json_value all =
      json_value::parse(R"({"a":"AQID","b":[1,2,3],"c":"AQI-","d":7,"e":[256],"f":"AQIDBA=="})").value();
  using four = bounded_array<std::uint8_t, 4>;
  using three = std::array<std::byte, 3>;
  for (const std::string_view path : {"a", "b"}) {
    const auto some = all.get<four>(path);
    ASSERT_TRUE(some);
    EXPECT_EQ(some->size(), 3U);
    EXPECT_EQ((*some)[2], 3);
    ASSERT_TRUE(all.get<three>(path));
    EXPECT_EQ((*all.get<three>(path))[2], std::byte{3});
  }
  EXPECT_EQ(all.get<four>("c").error().message(),
            R"(the member "c" must be base64 of at most 4 bytes; it is "AQI-")");
  EXPECT_EQ(all.get<four>("d").code(), errc::wrong_type);
  EXPECT_EQ(all.get<four>("e").code(), errc::wrong_type);
  EXPECT_EQ(all.get<three>("f").error().message(), R"(the member "f" must be base64 of 3 bytes; it has 4)");
  EXPECT_EQ(all.get<four>("none").code(), errc::missing_member);
  EXPECT_FALSE(*all.get<std::optional<four>>("none"));
}

} // namespace
} // namespace base64_test
} // namespace rowe::json
