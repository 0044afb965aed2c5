// SPDX-License-Identifier: Apache-2.0
// Texts as pixels, by FreeType.
#pragma once
#include <memory>
#include <optional>
#include <string>

#include "canvas.hpp"

namespace rowe::tools {

class lettering {
 public:
  // `path`: of a font; empty: DejaVu Sans or Liberation Sans, where Debian, Fedora and Arch have them.
  // Nothing: `why` says why not, and what helps.
  static std::optional<lettering> open(const std::string& path, std::string& why);
  lettering(lettering&&) noexcept;
  lettering& operator=(lettering&&) noexcept;
  ~lettering();

  void draw(const words& text, rgb colour, canvas& to);

 private:
  struct parts;
  explicit lettering(std::unique_ptr<parts> made) noexcept;
  std::unique_ptr<parts> parts_;
};

} // namespace rowe::tools
