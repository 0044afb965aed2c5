// SPDX-License-Identifier: Apache-2.0
#include "wire/rosbridge/png.hpp"

#include <array>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "wire/png_text.hpp"

namespace rowe::wire {
namespace png_test {
namespace {

std::string written(std::string_view text, std::size_t cut = 0) {
  std::string buffer(text.size() * 9 + 400, '\0');
  json::writer out{buffer};
  const std::array<std::string_view, 2> pieces{text.substr(0, cut), text.substr(cut)};
  write_png(out, pieces);
  EXPECT_FALSE(out.overflowed());
  return std::string{out.text()};
}

TEST(png, has_the_text_in_its_pixels) {
  for (std::size_t bytes = 1; bytes < 700; ++bytes) {
    std::string text;
    for (std::size_t i = 0; i < bytes; ++i) text += static_cast<char>('0' + (i * i + bytes) % 75);
    ASSERT_EQ(tests::png_text(written(text, bytes / 2)), text) << bytes;
  }
  EXPECT_EQ(tests::png_text(written("")), "");
}

TEST(png, stores_as_many_blocks_as_it_takes) {
  for (const std::size_t bytes : {60'000U, 65'000U, 65'534U, 65'535U, 65'600U, 131'072U, 400'000U}) {
    const std::string text(bytes, 'x');
    ASSERT_EQ(tests::png_text(written(text)), text) << bytes;
  }
}

TEST(png, escapes_what_browsers_would_read_byte_by_byte) {
  EXPECT_EQ(tests::png_text(written("\"ö 日 𝄞 \xff\"")), R"("\u00f6 \u65e5 \ud834\udd1e \ufffd")");
}

} // namespace
} // namespace png_test
} // namespace rowe::wire
