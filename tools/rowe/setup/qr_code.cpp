// SPDX-License-Identifier: Apache-2.0
#include "qr_code.hpp"

#include <qrencode.h>

#include <memory>

namespace rowe::tools {
namespace {

constexpr std::size_t frame = 4; // modules; readers may count on it

struct code_free {
  void operator()(QRcode* one) const noexcept { ::QRcode_free(one); }
};

} // namespace

std::optional<qr_code> qr_code::of(std::string_view text) {
  // The least correction: nothing wears off on a screen, and the smaller the code, the larger its modules.
  const auto* const bytes = reinterpret_cast<const unsigned char*>(text.data());
  const std::unique_ptr<QRcode, code_free> made{
      ::QRcode_encodeData(static_cast<int>(text.size()), bytes, 0, QR_ECLEVEL_L)};
  if (!made) return std::nullopt;
  const auto inner = static_cast<std::size_t>(made->width);
  qr_code code{inner + 2 * frame};
  for (std::size_t at = 0; at < inner * inner; ++at) {
    const std::size_t row = at / inner + frame;
    const std::size_t column = at % inner + frame;
    code.dark_[row * code.width_ + column] = (made->data[at] & 1) != 0;
  }
  return code;
}

bool qr_code::dark(std::size_t row, std::size_t column) const noexcept {
  return row < width_ && column < width_ && dark_[row * width_ + column];
}

std::string qr_code::drawn() const {
  constexpr std::string_view black_on_white = "\x1b[38;5;16;48;5;231m";
  constexpr std::string_view as_before = "\x1b[0m\n";
  std::string text;
  for (std::size_t row = 0; row < width_; row += 2) {
    text += black_on_white;
    for (std::size_t column = 0; column < width_; ++column) {
      const bool upper = dark(row, column);
      const bool lower = dark(row + 1, column);
      text += upper && lower ? "█" : upper ? "▀" : lower ? "▄" : " ";
    }
    text += as_before;
  }
  return text;
}

} // namespace rowe::tools
