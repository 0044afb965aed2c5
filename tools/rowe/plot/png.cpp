// SPDX-License-Identifier: Apache-2.0
#include "png.hpp"

#include <png.h>

#include "../console.hpp"
#include "lettering.hpp"

namespace rowe::tools {
namespace {

class png_painter {
 public:
  png_painter(canvas& to, lettering& letters, const palette& colours)
      : to_{to}, letters_{letters}, colours_{colours} {}

  void operator()(const box& one) { to_.fill(one, of(one.colour)); }
  void operator()(const stroke& one) { to_.draw(one, of(one.colour)); }
  void operator()(const dot& one) { to_.draw(one, of(one.colour)); }
  void operator()(const words& one) { letters_.draw(one, of(one.colour), to_); }

 private:
  rgb of(tone one) const noexcept { return colours_[place_of(one)]; }

  canvas& to_;
  lettering& letters_;
  const palette& colours_;
};

std::optional<std::string> packed(const canvas& drawn, std::string& why) {
  static_assert(sizeof(rgb) == 3, "rows of pixels are handed over as they are");
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(drawn.width());
  image.height = static_cast<png_uint_32>(drawn.height());
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string text(bytes, '\0');
  const int done =
      ::png_image_write_to_memory(&image, text.data(), &bytes, 0, drawn.pixels().data(), 0, nullptr);
  if (done == 0) {
    why = joined("the PNG cannot be made: ", printable(image.message));
    ::png_image_free(&image);
    return std::nullopt;
  }
  text.resize(bytes);
  return text;
}

} // namespace

std::optional<std::string> png_of(const picture& shown, const palette& colours, const std::string& font,
                                  std::string& why) {
  auto letters = lettering::open(font, why);
  if (!letters) return std::nullopt;
  canvas to{shown.width, shown.height};
  png_painter painting{to, *letters, colours};
  for (const picture_part& part : shown.parts) std::visit(painting, part);
  return packed(to, why);
}

} // namespace rowe::tools
