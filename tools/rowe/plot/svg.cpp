// SPDX-License-Identifier: Apache-2.0
#include "svg.hpp"

#include <array>
#include <charconv>
#include <optional>
#include <string_view>

#include "../console.hpp"

namespace rowe::tools {
namespace {

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
    case '&': safe += "&amp;"; break;
    case '<': safe += "&lt;"; break;
    case '>': safe += "&gt;"; break;
    case '"': safe += "&quot;"; break;
    default: safe += c;
    }
  }
  // U+FFFE and U+FFFF are in no XML.
  for (const std::string_view none : {"\xEF\xBF\xBE", "\xEF\xBF\xBF"})
    for (std::size_t at = 0; (at = safe.find(none, at)) != safe.npos;) safe.replace(at, 3, "\xEF\xBF\xBD");
  return safe;
}

// In hundredths of a pixel.
std::string number_text(double number) {
  std::array<char, 64> text{};
  const auto written =
      std::to_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed, 2);
  std::string_view all{text.data(), static_cast<std::size_t>(written.ptr - text.data())};
  while (all.ends_with('0')) all.remove_suffix(1);
  if (all.ends_with('.')) all.remove_suffix(1);
  return std::string{all == "-0" ? "0" : all};
}

// Colours are classes, so that those of the night can take the place of those of the day.
std::string class_of(tone colour) { return joined("t", place_of(colour)); }

std::string rules_of(const palette& colours) {
  std::string rules;
  for (std::size_t i = 0; i < tones; ++i) {
    rules += joined(".f.t", i, "{fill:", colours[i].text(), "}");
    rules += joined(".s.t", i, "{stroke:", colours[i].text(), "}");
  }
  return rules;
}

class svg_writer {
 public:
  std::string text;

  void operator()(const box& one) {
    add("rect", "f ", one.colour);
    member("x", one.corner.x), member("y", one.corner.y);
    member("width", one.width), member("height", one.height);
    if (one.opacity < 1) member("fill-opacity", one.opacity);
    text += "/>\n";
  }
  void operator()(const stroke& one) {
    add("polyline", "s ", one.colour);
    if (one.width != 1) member("stroke-width", one.width);
    if (one.broken != dashes::none)
      text += one.broken == dashes::long_ones ? " stroke-dasharray=\"8 4\"" : " stroke-dasharray=\"2 3\"";
    text += " points=\"";
    for (const place& at : one.points)
      text.append(&at == &one.points.front() ? "" : " ")
          .append(number_text(at.x))
          .append(",")
          .append(number_text(at.y));
    text += "\"/>\n";
  }
  void operator()(const dot& one) {
    add("circle", "f ", one.colour);
    member("cx", one.centre.x), member("cy", one.centre.y), member("r", one.radius);
    text += "/>\n";
  }
  void operator()(const words& one) {
    add("text", "f ", one.colour);
    member("x", one.base.x), member("y", one.base.y), member("font-size", one.size);
    if (one.anchor != side::left)
      text += one.anchor == side::middle ? " text-anchor=\"middle\"" : " text-anchor=\"end\"";
    text.append(">").append(escaped(one.text)).append("</text>\n");
  }

  // What belongs to one series is a group with its name.
  void enter(const std::string& series) {
    if (series == series_) return;
    if (!series_.empty()) text += "</g>\n";
    if (!series.empty()) text += joined("<g class=\"series\"><title>", escaped(series), "</title>\n");
    series_ = series;
  }

 private:
  void add(std::string_view element, std::string_view kind, tone colour) {
    text += joined("<", element, " class=\"", kind, class_of(colour), "\"");
  }
  void member(std::string_view name, double value) {
    text += joined(" ", name, "=\"", number_text(value), "\"");
  }

  std::string series_;
};

} // namespace

std::string svg_of(const picture& shown, const palettes& colours, bool dark) {
  svg_writer to;
  to.text = joined("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"", shown.width, "\" height=\"",
                   shown.height, "\" viewBox=\"0 0 ", shown.width, " ", shown.height,
                   "\" font-family=\"'DejaVu Sans',Verdana,sans-serif\">\n<title>", escaped(shown.title),
                   "</title>\n<style>.s{fill:none;stroke-linejoin:round;stroke-linecap:round}",
                   rules_of(dark ? colours.dark : colours.light));
  if (!dark) to.text += joined("@media(prefers-color-scheme:dark){", rules_of(colours.dark), "}");
  to.text += "</style>\n";
  for (const picture_part& part : shown.parts) {
    const auto* const line = std::get_if<stroke>(&part);
    to.enter(line == nullptr ? std::string{} : line->of);
    std::visit(to, part);
  }
  to.enter({});
  return to.text + "</svg>\n";
}

} // namespace rowe::tools
