// SPDX-License-Identifier: Apache-2.0
#include "survey_text.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "../console.hpp"
#include "../text/amounts.hpp"
#include "../text/times.hpp"

namespace rowe::tools {
namespace {

constexpr std::size_t label_columns = 14; // two blanks, and the longest label
constexpr int damage_shown_max = 20;

// "0.021 s"; from a minute on "1:23.4".
std::string span_text(std::int64_t ns) {
  constexpr std::int64_t minute_ns = 60'000'000'000;
  if (ns >= minute_ns) return clock_text(rt::duration{ns}, 1);
  return joined(decimal_text(static_cast<double>(ns) / 1e9, 3), " s");
}

std::string hertz_text(double hz) {
  return joined(decimal_text(hz, hz >= 100 ? 0 : hz >= 10 ? 1 : 2), " Hz");
}

std::string or_dash(std::string_view text) { return text.empty() ? "-" : printable(text); }

// The lines of one recording, wrapped at blanks.
class page {
 public:
  explicit page(std::size_t columns) : columns_{columns} {}

  void line(std::string_view label, std::string_view value) {
    std::string text = joined("  ", label);
    text.append(text.size() < label_columns ? label_columns - text.size() : 1, ' ');
    wrap(text, value, narrow() ? 4 : label_columns);
  }
  // Below one.
  void below(std::string_view value) {
    const std::size_t indent = narrow() ? 4 : label_columns;
    wrap(std::string(indent, ' '), value, indent + 2);
  }
  // Words after `text`, which begins the line; further lines are indented.
  void wrap(std::string text, std::string_view words, std::size_t indent) {
    bool begun = true; // nothing stands behind what begins the line
    while (!words.empty()) {
      const std::size_t end = std::min(words.find(' '), words.size());
      const std::string_view word = words.substr(0, end);
      words.remove_prefix(std::min(end + 1, words.size()));
      if (columns_ != 0 && width_of(text) + !begun + width_of(word) > columns_ && width_of(text) > indent) {
        raw(text.erase(text.find_last_not_of(' ') + 1));
        text = std::string(indent, ' ');
        begun = true;
      }
      text.append(begun ? "" : " ").append(word);
      begun = false;
    }
    raw(text.erase(text.find_last_not_of(' ') + 1));
  }
  void raw(std::string_view line) { text_.append(line).append("\n"); }
  std::size_t columns() const { return columns_; }
  std::string finished() { return std::move(text_); }

  // Of a text in UTF-8; wide characters count as one.
  static std::size_t width_of(std::string_view text) {
    return static_cast<std::size_t>(
        std::count_if(text.begin(), text.end(), [](char c) { return (c & '\xc0') != '\x80'; }));
  }

 private:
  bool narrow() const { return columns_ != 0 && columns_ < 60; }

  std::size_t columns_;
  std::string text_;
};

void add_head(const survey& about, page& to) {
  const auto ratio = about.compression_ratio();
  std::string size = bytes_text(about.file_bytes);
  if (!about.packed.empty() && ratio)
    size.append(joined(", compressed ", decimal_text(*ratio, 1), " to 1 by ", printable(about.packed)));
  to.line("size", size);
  if (!about.written_by.empty() || !about.profile.empty())
    to.line("written by",
            joined(or_dash(about.written_by),
                   about.profile.empty() ? "" : joined(", profile ", printable(about.profile))));
  to.line("messages", std::to_string(about.messages));
  if (about.messages != 0) {
    to.line("begin", iso_text(about.begin_ns, time_zone::local));
    to.line("end", iso_text(about.end_ns, time_zone::local));
    to.line("duration", span_text(about.end_ns - about.begin_ns));
  }
  for (const recording_notes& notes : about.metadata) {
    std::string pairs;
    for (const auto& [name, value] : notes.values)
      pairs.append(joined(pairs.empty() ? "" : ", ", printable(name), ": ", printable(value)));
    if (!pairs.empty()) to.line(or_dash(notes.name), pairs);
  }
  for (const recording_attachment& one : about.attachments)
    to.line("attachment",
            joined(or_dash(one.name), ", ", or_dash(one.media_type), ", ", bytes_text(one.bytes)));
}

void add_stops(const survey& about, page& to) {
  if (about.stops.empty()) return;
  to.line("stops", std::to_string(about.stops.size()));
  for (const recorded_stop& one : about.stops) {
    const std::string lasted = one.until_ns == 0 ? std::string{", until the end"}
                                                 : joined(", for ", span_text(one.until_ns - one.seen_ns));
    to.below(joined("at ", clock_text(rt::duration{one.seen_ns - about.begin_ns}), ": number ", one.number,
                    ", ", or_dash(one.cause), one.source.empty() ? "" : joined(" by ", printable(one.source)),
                    lasted));
  }
}

void add_lost(const survey& about, page& to) {
  if (about.lost.empty()) return;
  std::string topics;
  for (const auto& [topic, count] : about.lost)
    topics.append(joined(topics.empty() ? ": " : ", ", printable(topic), " ", count));
  to.line("lost", joined(counted(about.lost_messages(), "message"), topics));
}

void add_damage(const survey& about, page& to) {
  if (!about.damaged.empty()) {
    to.line("damaged", counted(about.damaged.size(), "part"));
    int shown = 0;
    for (const recording_damage& one : about.damaged) {
      if (shown++ == damage_shown_max) {
        to.below(joined("and ", about.damaged.size() - damage_shown_max, " more"));
        break;
      }
      to.below(joined("at byte ", one.offset, ", ", counted(one.bytes, "byte"), ": ", printable(one.why)));
    }
  }
  if (!about.is_ended)
    to.line("not ended", joined("the program that wrote it did not come to its end. `rowe record --repair ",
                                printable(about.path), "` makes it whole"));
  else if (!about.damaged.empty())
    to.line("repair", joined("`rowe record --repair ", printable(about.path), "` saves the rest"));
}

// ---- the topics

constexpr std::array<std::string_view, 7> headings{"TOPIC",       "TYPE",         "MESSAGES", "RATE",
                                                   "LONGEST GAP", "OUT OF ORDER", "SIZE"};
constexpr std::size_t first_number = 2; // from there on columns are set to the right
using cells = std::array<std::string, headings.size()>;

cells cells_of(const surveyed_topic& topic, bool looked_at) {
  const auto rate = topic.rate_hz();
  const bool gaps = looked_at && topic.messages > 1;
  const std::string encoding =
      topic.encoding == "json" || topic.encoding.empty() ? "" : joined(" (", printable(topic.encoding), ")");
  return {printable(topic.name),
          joined(or_dash(topic.type), encoding),
          std::to_string(topic.messages),
          rate ? hertz_text(*rate) : "-",
          gaps ? span_text(topic.longest_gap_ns) : "-",
          looked_at ? std::to_string(topic.out_of_order) : "-",
          looked_at ? bytes_text(topic.bytes) : "-"};
}

std::string row_text(const cells& row, const std::array<std::size_t, headings.size()>& widths) {
  std::string text = "  ";
  for (std::size_t i = 0; i < row.size(); ++i) {
    const std::string gap(widths[i] - page::width_of(row[i]), ' ');
    text.append(i == 0 ? "" : "  ").append(i < first_number ? row[i] + gap : gap + row[i]);
  }
  return text;
}

// A topic by itself, where the table is too wide.
void add_topic(const surveyed_topic& topic, bool looked_at, page& to) {
  const cells row = cells_of(topic, looked_at);
  to.wrap("  ", row[0], 4);
  std::string figures = joined(row[1] == "-" ? "" : joined(row[1], ", "), counted(topic.messages, "message"));
  if (row[3] != "-") figures.append(joined(", ", row[3]));
  if (row[4] != "-") figures.append(joined(", longest gap ", row[4]));
  if (topic.out_of_order != 0) figures.append(joined(", ", row[5], " out of order"));
  if (looked_at) figures.append(joined(", ", row[6]));
  to.wrap("    ", figures, 4);
}

void add_topics(const survey& about, page& to) {
  if (about.topics.empty()) return;
  std::vector<cells> rows{cells{}};
  std::copy(headings.begin(), headings.end(), rows.front().begin());
  for (const surveyed_topic& topic : about.topics) rows.push_back(cells_of(topic, about.looked_at_messages));
  std::array<std::size_t, headings.size()> widths{};
  for (const cells& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], page::width_of(row[i]));
  std::size_t width = 2 * headings.size();
  for (const std::size_t one : widths) width += one;
  to.raw("");
  if (to.columns() == 0 || width <= to.columns()) {
    for (const cells& row : rows) to.raw(row_text(row, widths));
    return;
  }
  for (const surveyed_topic& topic : about.topics) add_topic(topic, about.looked_at_messages, to);
}

} // namespace

std::string text_of(const survey& about, std::size_t columns) {
  page to{columns};
  to.raw(printable(about.path));
  add_head(about, to);
  add_lost(about, to);
  add_stops(about, to);
  add_damage(about, to);
  add_topics(about, to);
  return to.finished();
}

} // namespace rowe::tools
