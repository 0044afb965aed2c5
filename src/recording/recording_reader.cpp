// SPDX-License-Identifier: Apache-2.0
// The public reader and repair, on the room mcap.
#include <rowe/recording.hpp>

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

#include "mcap/files.hpp"
#include "mcap/reader.hpp"
#include "mcap/record_reader.hpp"
#include "mcap/repair.hpp"

namespace rowe {
namespace {

constexpr std::size_t schema_bytes_max = 64 << 20; // of all topics; the others are not described

std::int64_t as_time(std::uint64_t ns) noexcept {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(ns, INT64_MAX));
}

std::vector<recording_damage> listed(const std::vector<mcap::damage>& all) {
  std::vector<recording_damage> texts;
  for (const mcap::damage& one : all) texts.push_back({one.offset, one.bytes, one.why});
  return texts;
}

} // namespace

struct recording_reader::parts {
  mcap::file_source from;
  mcap::reader reads{from};
  std::vector<recorded_topic> topics;
  std::map<mcap::channel_number, std::size_t> place_of;
  std::vector<mcap::channel_number> channels; // by their places
  recorded_message message;
  std::uint64_t undescribed = 0; // messages so far of channels that nothing describes
};

recording_reader::recording_reader(std::unique_ptr<parts> made) noexcept : parts_{std::move(made)} {}
recording_reader::recording_reader(recording_reader&&) noexcept = default;
recording_reader& recording_reader::operator=(recording_reader&&) noexcept = default;
recording_reader::~recording_reader() = default;

result<recording_reader> recording_reader::open(const std::string& path, std::string* why,
                                                recording_progress on_progress) {
  const auto fail = [&](const std::string& reason) {
    if (why != nullptr) *why = path + ": " + reason;
    return errc::bad_recording;
  };
  auto made = std::make_unique<parts>();
  if (!made->from.open(path)) return fail(made->from.why());
  std::function<void(std::uint64_t)> progress;
  if (on_progress) progress = [&, of = made->from.bytes()](std::uint64_t bytes) { on_progress(bytes, of); };
  if (!made->reads.open(progress)) return fail(made->reads.wrong());
  const mcap::summary& all = made->reads.all();
  std::size_t schema_bytes = 0;
  for (const auto& [id, one] : all.channels) {
    recorded_topic topic;
    topic.name = one.topic;
    topic.encoding = one.encoding;
    topic.metadata = {one.metadata.begin(), one.metadata.end()};
    if (const auto schema = all.schemas.find(one.schema); schema != all.schemas.end()) {
      topic.type = schema->second.name;
      schema_bytes += schema->second.data.size();
      if (schema_bytes <= schema_bytes_max) {
        topic.schema = schema->second.data;
        topic.schema_encoding = schema->second.encoding;
      }
    }
    if (const auto count = all.counts.messages_of.find(id); count != all.counts.messages_of.end())
      topic.messages = count->second;
    made->place_of.emplace(id, made->topics.size());
    made->topics.push_back(std::move(topic));
    made->channels.push_back(id);
  }
  return recording_reader{std::move(made)};
}

const std::vector<recorded_topic>& recording_reader::topics() const noexcept { return parts_->topics; }
std::uint64_t recording_reader::messages() const noexcept { return parts_->reads.all().counts.messages; }
std::int64_t recording_reader::begin_ns() const noexcept {
  const mcap::time_span& times = parts_->reads.all().counts.times;
  return times.empty() ? 0 : as_time(times.earliest_ns);
}
std::int64_t recording_reader::end_ns() const noexcept {
  const mcap::time_span& times = parts_->reads.all().counts.times;
  return times.empty() ? 0 : as_time(times.latest_ns);
}
std::uint64_t recording_reader::file_bytes() const noexcept { return parts_->from.bytes(); }
const std::string& recording_reader::written_by() const noexcept { return parts_->reads.head().program; }
const std::string& recording_reader::profile() const noexcept { return parts_->reads.head().profile; }
bool recording_reader::is_ended() const noexcept { return parts_->reads.has_summary(); }
std::vector<recording_damage> recording_reader::damaged() const {
  auto all = listed(parts_->reads.damaged());
  if (parts_->undescribed != 0)
    all.push_back(
        {.why = std::to_string(parts_->undescribed) + " messages of channels that nothing describes"});
  return all;
}

std::vector<recording_chunk> recording_reader::chunks() const {
  std::vector<recording_chunk> all;
  for (const mcap::chunk_index& one : parts_->reads.all().chunks) {
    const bool none = one.times.empty();
    all.push_back({.begin_ns = none ? 0 : as_time(one.times.earliest_ns),
                   .end_ns = none ? 0 : as_time(one.times.latest_ns),
                   .bytes = one.bytes,
                   .plain_bytes = one.plain_bytes,
                   .packed = one.compression});
  }
  return all;
}

std::vector<recording_notes> recording_reader::metadata() const {
  std::vector<recording_notes> all;
  for (const mcap::metadata_index& one : parts_->reads.all().metadata) {
    recording_notes notes{.name = one.name, .values = {}};
    if (parts_->reads.read_metadata(one, notes.values)) all.push_back(std::move(notes));
  }
  return all;
}

std::vector<recording_attachment> recording_reader::attachments() const {
  std::vector<recording_attachment> all;
  for (const mcap::attachment_index& one : parts_->reads.all().attachments)
    all.push_back({.name = one.name, .media_type = one.media_type, .bytes = one.data_bytes});
  return all;
}

void recording_reader::select(const selection& wanted) {
  mcap::reader::selection chosen{
      .begin_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(wanted.from_ns, 0)),
      .end_ns = wanted.until_ns == std::numeric_limits<std::int64_t>::max()
                    ? std::numeric_limits<std::uint64_t>::max()
                    : static_cast<std::uint64_t>(std::max<std::int64_t>(wanted.until_ns, 1) - 1)};
  for (const std::size_t place : wanted.topics)
    if (place < parts_->channels.size()) chosen.channels.insert(parts_->channels[place]);
  parts_->reads.select(std::move(chosen));
}

const recorded_message* recording_reader::next() {
  while (const mcap::message* const one = parts_->reads.next()) {
    const auto place = parts_->place_of.find(one->channel);
    if (place == parts_->place_of.end()) {
      ++parts_->undescribed;
      continue;
    }
    parts_->message = {.topic = place->second,
                       .sequence = one->sequence,
                       .logged_ns = as_time(one->logged_ns),
                       .published_ns = as_time(one->published_ns),
                       .data = one->data};
    return &parts_->message;
  }
  return nullptr;
}

// ---- repair

result<recording_repair> repair_recording(const std::string& path, std::string* why,
                                          recording_progress on_progress) {
  std::function<void(std::uint64_t, std::uint64_t)> progress;
  if (on_progress) progress = on_progress;
  mcap::repair_result done = mcap::repair(path, progress);
  if (!done.wrong.empty()) {
    if (why != nullptr) *why = path + ": " + done.wrong;
    return errc::bad_recording;
  }
  return recording_repair{.path = done.path,
                          .was_whole = done.was_whole,
                          .in_place = done.in_place,
                          .messages = done.messages,
                          .damaged = listed(done.found.damaged)};
}

} // namespace rowe
