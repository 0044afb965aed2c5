// SPDX-License-Identifier: Apache-2.0
#include "page.hpp"

#include <algorithm>

#include "colour.hpp"

namespace rowe::tools {

std::size_t width_of(std::string_view text) noexcept {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & '\xc0') != '\x80'; }));
}

std::string wrapped(std::string text, std::string_view words, std::size_t indent, std::size_t width) {
  std::string lines;
  const auto end_line = [&] { lines.append(text.erase(text.find_last_not_of(' ') + 1)).append("\n"); };
  bool begun = true; // nothing stands behind what begins the line
  while (!words.empty()) {
    const std::size_t end = std::min(words.find(' '), words.size());
    const std::string_view word = words.substr(0, end);
    words.remove_prefix(std::min(end + 1, words.size()));
    const std::size_t gap = begun ? 0 : 1;
    if (width != 0 && width_of(text) + gap + width_of(word) > width && width_of(text) > indent) {
      end_line();
      text.assign(indent, ' ');
      begun = true;
    }
    text.append(begun ? "" : " ").append(word);
    begun = false;
  }
  end_line();
  return lines;
}

// ---- terms

void term_list::add(std::string term, std::string_view meaning) {
  rows_.push_back({std::move(term), meaning});
}

std::string term_list::text(std::size_t width) const {
  constexpr std::size_t meaning_columns_min = 24;
  std::size_t widest = 0;
  for (const row& one : rows_) widest = std::max(widest, width_of(one.term));
  const std::size_t indent = widest + 4;
  const bool side_by_side = width == 0 || indent + meaning_columns_min <= width;
  std::string all;
  for (const row& one : rows_) {
    if (side_by_side) {
      const std::string begin = "  " + one.term + std::string(widest - width_of(one.term) + 2, ' ');
      all += wrapped(begin, one.meaning, indent, width);
    } else {
      all += wrapped("  ", one.term, 4, width);
      all += wrapped("      ", one.meaning, 6, width);
    }
  }
  return all;
}

// ---- tables

text_table::written text_table::lines(std::size_t width) const {
  std::vector<std::size_t> widths(columns_.size());
  std::vector<bool> shown(columns_.size());
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    widths[i] = width_of(columns_[i].heading);
    shown[i] = !columns_[i].if_any;
    for (const std::vector<std::string>& row : rows_) {
      widths[i] = std::max(widths[i], width_of(row[i]));
      shown[i] = shown[i] || row[i] != "-";
    }
  }
  std::size_t all_columns = 0;
  for (std::size_t i = 0; i < columns_.size(); ++i) all_columns += shown[i] ? widths[i] + 2 : 0;
  written all;
  const auto add = [&](std::string_view text) {
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      all.lines.emplace_back(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
    }
  };
  if (width != 0 && all_columns > width + 2) {
    for (const std::vector<std::string>& row : rows_) {
      std::string others;
      for (std::size_t i = 1; i < row.size(); ++i) {
        if (!shown[i] || row[i] == "-") continue;
        others.append(others.empty() ? "" : ", ").append(columns_[i].heading).append(" ").append(row[i]);
      }
      add(wrapped("", row[0], 2, width));
      if (!others.empty()) add(wrapped("  ", others, 2, width));
    }
    return all;
  }
  const auto line_of = [&](const auto& cell_at) {
    std::string line;
    bool first = true;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (!shown[i]) continue;
      const std::string_view cell = cell_at(i);
      const std::string gap(widths[i] - width_of(cell), ' ');
      line.append(first ? "" : "  ");
      columns_[i].side == cell_side::left ? line.append(cell).append(gap) : line.append(gap).append(cell);
      first = false;
    }
    return line.erase(line.find_last_not_of(' ') + 1);
  };
  all.has_headings = true;
  all.lines.push_back(line_of([&](std::size_t i) { return columns_[i].heading; }));
  for (const std::vector<std::string>& row : rows_)
    all.lines.push_back(line_of([&](std::size_t i) -> std::string_view { return row[i]; }));
  return all;
}

std::string text_table::text(std::size_t width) const {
  const written made = lines(width);
  std::string all;
  for (const std::string& line : made.lines) {
    const bool is_heading = made.has_headings && &line == made.lines.data();
    all.append(is_heading ? colour::heading(line) : line).append("\n");
  }
  return all;
}

} // namespace rowe::tools
