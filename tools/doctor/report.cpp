// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"


#include "../rowe/console.hpp"
#include "../rowe/text/json_values.hpp"

namespace rowe::tools::fitness {
namespace {

constexpr std::array<std::string_view, 4> marks{"ok", "info", "warn", "fail"};
constexpr std::size_t indent = 6; // of what belongs to a line

std::string_view mark_of(const finding& one) { return marks[static_cast<std::size_t>(one.mark)]; }

// Adds `text`, broken between words so that no line is longer than `columns`, with the lines after the first
// one indented. `used`: what stands on the line already.
void append_wrapped(std::string& to, std::string_view text, std::size_t used, std::size_t columns,
                    std::size_t further_indent) {
  bool first = true;
  for (const std::string_view word : words_of(text)) {
    if (!first && columns != 0 && used + 1 + word.size() > columns) {
      to.append("\n").append(further_indent, ' ');
      used = further_indent;
    } else if (!first) {
      to.append(" ");
      ++used;
    }
    to.append(word);
    used += word.size();
    first = false;
  }
  to.append("\n");
}

void append_labelled(std::string& to, std::string_view label, std::string_view text, std::size_t columns) {
  to.append(indent, ' ').append(label);
  append_wrapped(to, text, indent + label.size(), columns, indent + label.size());
}

std::string json_of(const group& in, const check& about, const finding& found) {
  std::string values;
  for (const value& one : found.values) {
    values.append(joined(values.empty() ? "" : ",", "\"", one.name, "\":", one.number));
  }
  std::string commands;
  for (const std::string& one : found.commands) {
    commands.append(joined(commands.empty() ? "" : ",", json_string_of(one)));
  }
  return joined("{\"check\":", json_string_of(about.name), ",\"group\":", json_string_of(in.name),
                ",\"level\":", json_string_of(mark_of(found)),
                ",\"visible\":", found.visible ? "true" : "false", ",\"title\":", json_string_of(about.title),
                ",\"found\":", json_string_of(found.found), ",\"wanted\":", json_string_of(about.wanted),
                ",\"why\":", json_string_of(about.why), ",\"change\":", json_string_of(about.change),
                ",\"commands\":[", commands, "],\"values\":{", values, "}}\n");
}

} // namespace

std::string report::heading(const machine& on) {
  const reading version = on.files.read("/proc/version");
  const auto words = fitness::words_of(version.text);
  const std::string_view kernel =
      words.size() > 2 ? words[2] : std::string_view{"of a version not visible here"};
  return joined("Linux ", printable(kernel), "; cores looked at: ", on.cpus.text(), "\n");
}

std::string report::text_of(const group& in, const check& about, const finding& found) {
  ++counts_[static_cast<std::size_t>(found.mark)];
  if (!found.visible) ++unseen_;
  if (!found.visible && about.vital) ++vital_unseen_;
  return how_.json ? json_of(in, about, found) : lines_of(in, about, found);
}

std::string report::lines_of(const group& in, const check& about, const finding& found) {
  const bool bad = found.mark >= level::warn;
  if (how_.only_bad && !bad) return {};
  std::string text;
  if (group_ != in.name) text.append(joined("\n", in.name, "\n"));
  group_ = in.name;

  const std::string_view mark = mark_of(found);
  text.append(mark).append(indent - mark.size(), ' ');
  const bool reasons = bad || how_.reasons;
  append_wrapped(text,
                 joined(about.title, ": ", printable(found.found),
                        reasons ? joined(" (wanted: ", about.wanted, ")") : ""),
                 indent, how_.columns, indent);
  if (reasons) {
    append_labelled(text, "why: ", about.why, how_.columns);
    append_labelled(text, "do:  ", about.change, how_.columns);
  }
  // They are there to be copied: no line is broken.
  if (how_.commands) {
    for (const std::string& one : found.commands)
      text.append(indent, ' ').append(joined("how: ", printable(one), "\n"));
  }
  for (const std::string_view line : fitness::lines_of(found.details)) text.append(joined(line, "\n"));
  return text;
}

std::string report::summary() const {
  return joined(count(level::fail), " fail, ", count(level::warn), " warn, ", count(level::info), " info, ",
                count(level::ok), " ok", unseen_ == 0 ? "" : joined("; ", unseen_, " not visible here"));
}

std::string_view report::verdict() const {
  if (count(level::fail) != 0) return "not fit for real time: see what fails";
  if (vital_unseen_ != 0) return "cannot be judged: see what warns and is not visible here";
  if (count(level::warn) != 0) return "fit for real time, with reservations: see what warns";
  return "fit for real time";
}

} // namespace rowe::tools::fitness
