// SPDX-License-Identifier: Apache-2.0
// QR codes on a terminal, for a phone's camera.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rowe::tools {

class qr_code {
 public:
  // Nothing: the text is too long for one, or memory is.
  static std::optional<qr_code> of(std::string_view text);

  // Modules from one side to the other, the light frame around the code included.
  std::size_t width() const noexcept { return width_; }
  bool dark(std::size_t row, std::size_t column) const noexcept;

  // Two rows of modules a line, by half blocks. Black and white are set by name, since a code in the
  // terminal's own colours is inverted on one of two terminals, and many readers do not read it then.
  std::string drawn() const;

 private:
  explicit qr_code(std::size_t width) : width_{width}, dark_(width * width) {}
  std::size_t width_;
  std::vector<bool> dark_;
};

} // namespace rowe::tools
