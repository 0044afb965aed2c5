// SPDX-License-Identifier: Apache-2.0
// Pictures: what is drawn comes back from the PNG's pixels, and the colours from the page's style.
#include <gtest/gtest.h>
#include <png.h>

#include <vector>

#include "tools/rowe/plot/chart.hpp"
#include "tools/rowe/plot/page_files.hpp"
#include "tools/rowe/plot/png.hpp"
#include "tools/rowe/plot/svg.hpp"

namespace rowe::tools {
namespace picture_test {
namespace {

struct pixels {
  std::size_t width = 0, height = 0;
  std::vector<rgb> all{};

  rgb at(std::size_t x, std::size_t y) const { return all[y * width + x]; }
  std::size_t count(rgb colour) const {
    return static_cast<std::size_t>(
        std::count_if(all.begin(), all.end(), [&](rgb one) { return one.text() == colour.text(); }));
  }
};

pixels read_back(const std::string& png) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(::png_image_begin_read_from_memory(&image, png.data(), png.size()), 0) << image.message;
  image.format = PNG_FORMAT_RGB;
  pixels read{image.width, image.height, std::vector<rgb>(std::size_t{image.width} * image.height)};
  EXPECT_NE(::png_image_finish_read(&image, nullptr, read.all.data(), 0, nullptr), 0) << image.message;
  return read;
}

const palette& light() { return page_palettes().light; }
rgb colour(tone one) { return light()[place_of(one)]; }

pixels drawn(std::vector<picture_part> parts) {
  picture shown{.width = 100, .height = 60};
  shown.parts.push_back(box{.width = 100, .height = 60, .colour = tone::surface});
  for (picture_part& one : parts) shown.parts.push_back(std::move(one));
  std::string why;
  const auto png = png_of(shown, light(), {}, why);
  EXPECT_TRUE(png) << why;
  return png ? read_back(*png) : pixels{};
}

TEST(a_png, has_the_pixels_of_a_box) {
  const pixels read = drawn({box{.corner = {10, 20}, .width = 30, .height = 5, .colour = tone::stop}});
  ASSERT_EQ(read.width, 100U);
  ASSERT_EQ(read.height, 60U);
  EXPECT_EQ(read.count(colour(tone::stop)), 30U * 5);
  EXPECT_EQ(read.at(10, 20).text(), colour(tone::stop).text());
  EXPECT_EQ(read.at(39, 24).text(), colour(tone::stop).text());
  EXPECT_EQ(read.at(40, 24).text(), colour(tone::surface).text());
}

TEST(a_png, has_a_line_where_it_is_and_nowhere_else) {
  const pixels read = drawn({stroke{.points = {{10, 10}, {90, 50}}, .colour = tone::one, .width = 3}});
  const rgb line = colour(tone::one), ground = colour(tone::surface);
  for (std::size_t x = 12; x < 88; ++x) {
    const auto y = static_cast<std::size_t>(10 + (static_cast<double>(x) + 0.5 - 10) / 2);
    EXPECT_EQ(read.at(x, y).text(), line.text()) << x;
    EXPECT_EQ(read.at(x, y - 4).text(), ground.text()) << x;
    EXPECT_EQ(read.at(x, y + 4).text(), ground.text()) << x;
  }
}

TEST(a_png, leaves_out_parts_of_a_dashed_line) {
  const auto count = [](dashes broken) {
    return drawn({stroke{.points = {{0, 30}, {50, 30}, {100, 30}},
                         .colour = tone::two,
                         .width = 2,
                         .broken = broken}})
        .count(colour(tone::two));
  };
  EXPECT_EQ(count(dashes::none), 200U);
  EXPECT_LT(count(dashes::long_ones), 170U);
  EXPECT_GT(count(dashes::long_ones), 100U);
  EXPECT_LT(count(dashes::short_ones), count(dashes::long_ones));
}

TEST(a_png, has_texts_on_the_side_that_they_are_to_be_on) {
  const auto columns = [](side anchor) {
    const pixels read = drawn({words{.base = {50, 40}, .text = "µ 12", .anchor = anchor, .size = 14}});
    std::pair<std::size_t, std::size_t> found{100, 0};
    for (std::size_t i = 0; i < read.all.size(); ++i) {
      if (read.all[i].text() == colour(tone::surface).text()) continue;
      found = {std::min(found.first, i % 100), std::max(found.second, i % 100)};
    }
    return found;
  };
  EXPECT_GE(columns(side::left).first, 49U);
  EXPECT_LE(columns(side::right).second, 50U);
  EXPECT_LT(columns(side::middle).first, 45U);
  EXPECT_GT(columns(side::middle).second, 55U);
}

TEST(a_png, bears_what_lies_outside) {
  const pixels read = drawn({stroke{.points = {{-500, -20}, {600, 90}}, .colour = tone::one, .width = 2},
                             box{.corner = {90, 50}, .width = 50, .height = 50, .colour = tone::stop},
                             dot{.centre = {0, 0}, .radius = 5}, words{.base = {95, 5}, .text = "outside"}});
  EXPECT_EQ(read.count(colour(tone::stop)), 100U);
}

TEST(a_png, says_that_a_font_is_missing_or_none) {
  std::string why;
  EXPECT_FALSE(png_of({.width = 10, .height = 10}, light(), "/dev/null", why));
  EXPECT_EQ(why, "/dev/null is no font that can be read (TrueType or OpenType)");
}

TEST(colours, are_those_of_the_page) {
  const palettes& all = page_palettes();
  EXPECT_EQ(all.light[place_of(tone::surface)].text(), "#ffffff");
  EXPECT_NE(all.light[place_of(tone::one)].text(), all.dark[place_of(tone::one)].text());
  EXPECT_EQ(all.light[place_of(tone::warn)].text(), all.dark[place_of(tone::warn)].text()) << "said once";
  for (const palette& one : {all.light, all.dark}) {
    std::vector<std::string> lines;
    for (std::size_t n = 0; n < 4; ++n) lines.push_back(one[place_of(colour_of_line(n))].text());
    std::sort(lines.begin(), lines.end());
    EXPECT_EQ(std::unique(lines.begin(), lines.end()), lines.end());
    EXPECT_EQ(std::count(lines.begin(), lines.end(), rgb{}.text()), 0) << "one is not in the style";
  }
}

TEST(colours, of_lines_and_their_dashes_differ_for_as_many_as_there_are_looks) {
  std::vector<std::pair<tone, dashes>> looks;
  for (std::size_t n = 0; n < looks_max; ++n) looks.emplace_back(colour_of_line(n), dashes_of_line(n));
  std::sort(looks.begin(), looks.end());
  EXPECT_EQ(std::unique(looks.begin(), looks.end()), looks.end());
}

TEST(a_chart, keeps_its_lines_inside_of_its_frame) {
  constexpr std::int64_t second = 1'000'000'000;
  plotted_data data{{{.topic = "/a", .path = "v"}}, {.begin_ns = 0, .end_ns = 10 * second, .columns = 500}};
  for (int i = 0; i <= 1000; ++i) {
    const std::string text = R"({"v":)" + std::to_string(i % 7 == 0 ? -1e9 : i * 1e3) + "}";
    data.take({0}, *json_value::parse(text), i * second / 100);
  }
  const picture shown = chart_of(data, {.width = 640, .height = 300, .title = "t"});
  std::size_t lines = 0;
  for (const picture_part& part : shown.parts) {
    const auto* const line = std::get_if<stroke>(&part);
    if (line == nullptr) continue;
    if (!line->of.empty()) ++lines;
    for (const place& at : line->points) {
      EXPECT_TRUE(at.x >= 0 && at.x <= 640 && at.y >= 0 && at.y <= 300);
    }
  }
  EXPECT_EQ(lines, 1U);
}

TEST(an_svg, has_what_others_call_things_as_texts_only) {
  const picture shown{
      .width = 10, .height = 10, .title = "<b>&\"", .parts = {words{.text = "</svg><script>"}}};
  const std::string text = svg_of(shown, page_palettes(), false);
  EXPECT_NE(text.find("<title>&lt;b&gt;&amp;&quot;</title>"), text.npos);
  EXPECT_EQ(text.find("<script>"), text.npos);
}

} // namespace
} // namespace picture_test
} // namespace rowe::tools
