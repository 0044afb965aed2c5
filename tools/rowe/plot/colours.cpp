// SPDX-License-Identifier: Apache-2.0
#include "colours.hpp"

#include <charconv>
#include <optional>

#include "page_files.hpp"

namespace rowe::tools {
namespace {

constexpr std::array<std::string_view, tones> variables{"--surface", "--line",   "--grid", "--quiet",
                                                        "--ink",     "--accent", "--two",  "--three",
                                                        "--four",    "--stop",   "--warn"};
constexpr std::size_t line_colours = 4;

// "#fff" or "#12161b".
std::optional<rgb> rgb_of(std::string_view text) {
  if (!text.starts_with('#')) return std::nullopt;
  const std::size_t end = std::min(text.find_first_not_of("0123456789abcdefABCDEF", 1), text.size());
  std::string digits{text.substr(1, end - 1)};
  if (digits.size() == 3) digits = {digits[0], digits[0], digits[1], digits[1], digits[2], digits[2]};
  if (digits.size() != 6) return std::nullopt;
  unsigned value = 0;
  (void)std::from_chars(digits.data(), digits.data() + digits.size(), value, 16); // these are digits
  return rgb{static_cast<std::uint8_t>(value >> 16U), static_cast<std::uint8_t>(value >> 8U & 255U),
             static_cast<std::uint8_t>(value & 255U)};
}

std::optional<rgb> colour_in(std::string_view css, std::string_view variable) {
  const std::size_t at = css.find(std::string{variable} + ":");
  if (at == css.npos) return std::nullopt;
  const std::size_t value = css.find_first_not_of(' ', at + variable.size() + 1);
  return value == css.npos ? std::nullopt : rgb_of(css.substr(value));
}

} // namespace

std::string rgb::text() const {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string all = "#";
  for (const unsigned one : {red, green, blue}) all.append({digits[one >> 4U], digits[one & 15U]});
  return all;
}

palettes palettes_in(std::string_view css) {
  palettes all;
  const std::size_t night = std::min(css.find("prefers-color-scheme"), css.size());
  for (std::size_t i = 0; i < tones; ++i) {
    all.light[i] = colour_in(css.substr(0, night), variables[i]).value_or(rgb{});
    all.dark[i] = colour_in(css.substr(night), variables[i]).value_or(all.light[i]);
  }
  return all;
}

const palettes& page_palettes() {
  static const palettes all = palettes_in(page_files::colours());
  return all;
}

tone colour_of_line(std::size_t n) noexcept {
  return static_cast<tone>(place_of(tone::one) + n % line_colours);
}

dashes dashes_of_line(std::size_t n) noexcept { return static_cast<dashes>(n / line_colours % 3); }

} // namespace rowe::tools
