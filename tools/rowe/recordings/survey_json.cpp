// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>

#include "../console.hpp"
#include "../text/json_values.hpp"
#include "../text/times.hpp"
#include "survey_text.hpp"

namespace rowe::tools {
namespace {

// A JSON object or array that grows.
class json_list {
 public:
  explicit json_list(char open) : close_{open == '{' ? '}' : ']'} { text_ = open; }

  void raw(std::string_view name, std::string_view json) {
    if (text_.size() > 1) text_ += ',';
    if (close_ == '}') text_.append(json_string_of(name)).append(":");
    text_.append(json);
  }
  void text(std::string_view name, std::string_view value) { raw(name, json_string_of(value)); }
  void number(std::string_view name, std::uint64_t value) { raw(name, std::to_string(value)); }
  void decimal(std::string_view name, std::optional<double> value, int decimals) {
    raw(name, value ? decimal_text(*value, decimals) : "null");
  }
  void seconds(std::string_view name, std::int64_t ns) { decimal(name, static_cast<double>(ns) / 1e9, 9); }
  std::string finished() { return std::move(text_ += close_); }

 private:
  std::string text_;
  char close_;
};

std::string utc_text(std::int64_t ns) { return iso_text(ns, time_zone::utc, 9); }

std::string topics_json(const survey& about) {
  json_list all{'['};
  for (const surveyed_topic& one : about.topics) {
    json_list row{'{'};
    row.text("topic", one.name);
    row.text("type", one.type);
    row.text("encoding", one.encoding);
    row.number("messages", one.messages);
    if (about.looked_at_messages) {
      row.decimal("rate_hz", one.rate_hz(), 3);
      if (one.messages > 1)
        row.seconds("longest_gap_s", one.longest_gap_ns);
      else
        row.raw("longest_gap_s", "null");
      row.number("out_of_order", one.out_of_order);
      row.number("bytes", one.bytes);
    }
    all.raw({}, row.finished());
  }
  return all.finished();
}

std::string stops_json(const survey& about) {
  json_list all{'['};
  for (const recorded_stop& one : about.stops) {
    json_list row{'{'};
    row.text("time", utc_text(one.seen_ns));
    row.raw("until", one.until_ns == 0 ? "null" : json_string_of(utc_text(one.until_ns)));
    row.number("number", one.number);
    row.text("cause", one.cause);
    row.text("source", one.source);
    all.raw({}, row.finished());
  }
  return all.finished();
}

std::string metadata_json(const survey& about) {
  json_list all{'['};
  for (const recording_notes& one : about.metadata) {
    json_list values{'{'};
    for (const auto& [name, value] : one.values) values.text(name, value);
    json_list row{'{'};
    row.text("name", one.name);
    row.raw("values", values.finished());
    all.raw({}, row.finished());
  }
  return all.finished();
}

std::string attachments_json(const survey& about) {
  json_list all{'['};
  for (const recording_attachment& one : about.attachments) {
    json_list row{'{'};
    row.text("name", one.name);
    row.text("media_type", one.media_type);
    row.number("bytes", one.bytes);
    all.raw({}, row.finished());
  }
  return all.finished();
}

std::string damaged_json(const survey& about) {
  json_list all{'['};
  for (const recording_damage& one : about.damaged) {
    json_list row{'{'};
    row.number("offset", one.offset);
    row.number("bytes", one.bytes);
    row.text("why", one.why);
    all.raw({}, row.finished());
  }
  return all.finished();
}

std::string lost_json(const survey& about) {
  json_list all{'{'};
  for (const auto& [topic, count] : about.lost) all.number(topic, count);
  return all.finished();
}

} // namespace

std::string json_of(const survey& about) {
  json_list all{'{'};
  all.text("path", about.path);
  all.number("bytes", about.file_bytes);
  all.text("written_by", about.written_by);
  all.text("profile", about.profile);
  all.raw("ended", about.is_ended ? "true" : "false");
  all.number("messages", about.messages);
  const bool any = about.messages != 0;
  all.raw("begin", any ? json_string_of(utc_text(about.begin_ns)) : "null");
  all.raw("end", any ? json_string_of(utc_text(about.end_ns)) : "null");
  all.seconds("duration_s", about.end_ns - about.begin_ns);
  all.text("packed_by", about.packed);
  all.decimal("compression_ratio", about.compression_ratio(), 3);
  all.raw("topics", topics_json(about));
  if (about.looked_at_messages) {
    all.raw("lost", lost_json(about));
    all.raw("stops", stops_json(about));
  }
  all.raw("damaged", damaged_json(about));
  all.raw("metadata", metadata_json(about));
  all.raw("attachments", attachments_json(about));
  return all.finished() + '\n';
}

std::string json_of_unreadable(std::string_view path, std::string_view why) {
  json_list all{'{'};
  all.text("path", path);
  all.text("wrong", why);
  return all.finished() + '\n';
}

} // namespace rowe::tools
