// SPDX-License-Identifier: Apache-2.0
#include "lettering.hpp"

#include <ft2build.h>
#include FT_FREETYPE_H

#include <unistd.h>

#include <array>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "../console.hpp"

namespace rowe::tools {
namespace {

constexpr std::array usual_fonts{
    "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf",
    "/usr/share/fonts/TTF/DejaVuSans.ttf", "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf",
    "/usr/share/fonts/liberation-sans/LiberationSans-Regular.ttf"};
constexpr double units_a_pixel = 64; // FreeType counts in these

std::string usual_font() {
  for (const char* const path : usual_fonts)
    if (::access(path, R_OK) == 0) return path;
  return {};
}

// The characters of a text that is UTF-8, as printable() makes it.
std::vector<char32_t> characters_of(std::string_view text) {
  std::vector<char32_t> all;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0U) == 0x80U && !all.empty())
      all.back() = (all.back() << 6U) | (byte & 0x3FU);
    else
      all.push_back(byte < 0x80U   ? byte
                    : byte < 0xE0U ? byte & 0x1FU
                    : byte < 0xF0U ? byte & 0x0FU
                                   : byte & 7U);
  }
  return all;
}

} // namespace

struct lettering::parts {
  FT_Library library = nullptr;
  FT_Face face = nullptr;

  parts() = default;
  parts(const parts&) = delete;
  parts& operator=(const parts&) = delete;
  ~parts() {
    if (face != nullptr) ::FT_Done_Face(face);
    if (library != nullptr) ::FT_Done_FreeType(library);
  }
};

lettering::lettering(std::unique_ptr<parts> made) noexcept : parts_{std::move(made)} {}
lettering::lettering(lettering&&) noexcept = default;
lettering& lettering::operator=(lettering&&) noexcept = default;
lettering::~lettering() = default;

std::optional<lettering> lettering::open(const std::string& path, std::string& why) {
  const std::string chosen = path.empty() ? usual_font() : path;
  if (chosen.empty()) {
    why = "there is no font for the texts of a PNG: install fonts-dejavu-core, or give one by --font FILE "
          "(svg and html need none)";
    return std::nullopt;
  }
  auto made = std::make_unique<parts>();
  const bool opened = ::FT_Init_FreeType(&made->library) == 0 &&
                      ::FT_New_Face(made->library, chosen.c_str(), 0, &made->face) == 0 &&
                      FT_IS_SCALABLE(made->face);
  if (!opened) {
    why = joined(printable(chosen), " is no font that can be read (TrueType or OpenType)");
    return std::nullopt;
  }
  return lettering{std::move(made)};
}

void lettering::draw(const words& text, rgb colour, canvas& to) {
  const FT_Face face = parts_->face;
  if (::FT_Set_Char_Size(face, 0, std::lround(text.size * units_a_pixel), 72, 72) != 0) return;
  const std::vector<char32_t> all = characters_of(text.text);
  double width = 0;
  for (const char32_t one : all)
    if (::FT_Load_Char(face, one, FT_LOAD_DEFAULT) == 0)
      width += static_cast<double>(face->glyph->advance.x) / units_a_pixel;
  const double share = text.anchor == side::left ? 0 : text.anchor == side::middle ? 0.5 : 1;
  double at = text.base.x - width * share;
  for (const char32_t one : all) {
    if (::FT_Load_Char(face, one, FT_LOAD_RENDER) != 0) continue;
    const FT_Bitmap& drawn = face->glyph->bitmap;
    const std::ptrdiff_t left = std::lround(at) + face->glyph->bitmap_left;
    const std::ptrdiff_t top = std::lround(text.base.y) - face->glyph->bitmap_top;
    for (unsigned row = 0; row < drawn.rows; ++row) {
      for (unsigned column = 0; column < drawn.width; ++column) {
        const unsigned char grey = drawn.buffer[static_cast<std::ptrdiff_t>(row) * drawn.pitch + column];
        if (grey != 0) to.cover(left + column, top + row, grey / 255.0, colour);
      }
    }
    at += static_cast<double>(face->glyph->advance.x) / units_a_pixel;
  }
}

} // namespace rowe::tools
