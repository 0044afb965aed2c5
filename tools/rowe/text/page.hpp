// SPDX-License-Identifier: Apache-2.0
// Text for terminals: words that are wrapped at their width, and tables. A width of 0 is none: stdout is no
// terminal, and nothing is wrapped, so that other programs find each row on one line.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace rowe::tools {

// The columns that a text in UTF-8 takes; wide characters count as one.
std::size_t width_of(std::string_view text) noexcept;

// `text`, which begins the line, and words behind it. Further lines are indented. Ends in a newline.
std::string wrapped(std::string text, std::string_view words, std::size_t indent, std::size_t width);

// Rows of a term and what it means: side by side, or where that is too wide, below each other.
class term_list {
 public:
  void add(std::string term, std::string_view meaning);
  std::string text(std::size_t width) const;

 private:
  struct row {
    std::string term;
    std::string_view meaning;
  };
  std::vector<row> rows_;
};

enum class cell_side : std::uint8_t { left, right };

struct table_column {
  std::string_view heading;
  cell_side side = cell_side::left;
  bool if_any = false; // left out where no row has more than "-"
};

// A table. Where it is wider than the terminal, each row is written as lines of their own: its first cell,
// and below it the others with their headings.
class text_table {
 public:
  explicit text_table(std::vector<table_column> columns) : columns_{std::move(columns)} {}
  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  bool empty() const noexcept { return rows_.empty(); }
  // The first line has the headings, unless the table is written otherwise.
  struct written {
    std::vector<std::string> lines;
    bool has_headings = false;
  };
  written lines(std::size_t width) const;
  // The same as one text, with colours.
  std::string text(std::size_t width) const;

 private:
  std::vector<table_column> columns_;
  std::vector<std::vector<std::string>> rows_;
};

} // namespace rowe::tools
