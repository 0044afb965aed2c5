// SPDX-License-Identifier: Apache-2.0
// Recordings for tests, from lines of JSON on stdin:
//
//   record_lines FILE [none|lz4|zstd] [cut]
//
// A line is {"topic":NAME,"type":NAME,"schema":TEXT,"logged_ns":N,"published_ns":N,"msg":BODY} with all
// members but topic and msg optional, or {"metadata":{NAME:TEXT}}, which comes first, or {"flush":true},
// which ends a chunk. With `cut` the file is left as by a program that was killed.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <map>
#include <optional>
#include <string>

#include <unistd.h>

#include <rowe/json_value.hpp>
#include <rowe/recording.hpp>

namespace {

std::int64_t number_in(rowe::json_value line, std::string_view member, std::int64_t otherwise) {
  const auto number = line.get<std::int64_t>(member);
  return number ? *number : otherwise;
}

int fail(const std::string& why) {
  std::fprintf(stderr, "record_lines: %s\n", why.c_str());
  return 1;
}

} // namespace

int main(int argc, char** argv) {
  using namespace std::chrono_literals;
  rowe::recording_options options{.path = argc > 1 ? argv[1] : ""};
  const std::string packed = argc > 2 ? argv[2] : "none";
  options.packed = packed == "lz4"    ? rowe::compression::lz4
                   : packed == "zstd" ? rowe::compression::zstd
                                      : rowe::compression::none;
  const bool cut = argc > 3;
  std::optional<rowe::recording_writer> file;
  std::map<std::string, rowe::recording_writer::topic_number> topics;
  std::string text, why;
  std::int64_t next_ns = 1'000'000'000;
  while (std::getline(std::cin, text)) {
    const auto read = rowe::json_value::parse(text);
    if (!read) return fail(text);
    const rowe::json_value line = *read;
    if (const auto metadata = line.find("metadata")) {
      for (const auto [name, value] : metadata->members())
        options.metadata.emplace(*name.get<std::string>(), *value.get<std::string>());
      continue;
    }
    if (!file) {
      auto made = rowe::recording_writer::create(options, &why);
      if (!made) return fail(why);
      file.emplace(std::move(*made));
    }
    if (line.find("flush")) {
      if (!file->flush(60s)) return fail("flush");
      continue;
    }
    const std::string topic = *line.get<std::string>("topic");
    const auto type = line.get<std::string>("type"), schema = line.get<std::string>("schema");
    if (!topics.contains(topic)) {
      const auto number = file->add_topic(topic, type ? *type : "", schema ? *schema : "");
      if (!number) return fail(topic);
      topics.emplace(topic, *number);
    }
    const std::int64_t logged_ns = number_in(line, "logged_ns", next_ns);
    next_ns = logged_ns + 1'000'000;
    const std::string_view body = line.find("msg")->text();
    if (!file->wait_room(body.size(), 60s)) return fail("wait_room");
    if (!file->add(topics[topic], body, logged_ns, number_in(line, "published_ns", logged_ns)))
      return fail(text);
  }
  if (!file) return fail("no line");
  if (cut) {
    const bool good = static_cast<bool>(file->flush(60s));
    ::_exit(good ? 0 : 1);
  }
  return file->close(&why) ? 0 : fail(why);
}
