// SPDX-License-Identifier: Apache-2.0
#include "survey.hpp"

#include <algorithm>
#include <set>
#include <string_view>
#include <tuple>

#include "../text/json_values.hpp"
#include "own_topics.hpp"

namespace rowe::tools {
namespace {

// How many messages are looked at between two reports of progress.
constexpr std::uint64_t messages_between = 4096;

// What is remembered of each publisher.
struct publisher_before {
  std::uint32_t sequence = 0;
  std::int64_t published_ns = 0;
};

class surveyor {
 public:
  explicit surveyor(const recording_reader& file) {
    std::map<std::tuple<std::string, std::string, std::string>, std::size_t> rows;
    for (const recorded_topic& one : file.topics()) {
      const auto [row, is_new] = rows.try_emplace({one.name, one.type, one.encoding}, into.topics.size());
      if (is_new) into.topics.push_back({.name = one.name, .type = one.type, .encoding = one.encoding});
      into.topics[row->second].messages += one.messages;
      row_of_.push_back(row->second);
    }
    before_.resize(row_of_.size());
  }

  // Counts by itself: where a part is damaged, the summary has counted more.
  void begin_to_look() {
    into.looked_at_messages = true;
    into.messages = 0;
    for (surveyed_topic& one : into.topics) one.messages = 0;
  }

  void look_at(const recorded_message& one) {
    surveyed_topic& topic = into.topics[row_of_[one.topic]];
    if (topic.messages == 0)
      topic.first_ns = one.logged_ns;
    else
      topic.longest_gap_ns = std::max(topic.longest_gap_ns, one.logged_ns - topic.last_ns);
    topic.last_ns = one.logged_ns;
    publisher_before& before = before_[one.topic];
    const bool went_back = one.sequence != 0 && one.sequence < before.sequence;
    const bool older = one.published_ns != 0 && one.published_ns < before.published_ns;
    if (went_back || older) ++topic.out_of_order;
    before = {one.sequence, one.published_ns};
    topic.bytes += one.data.size();
    ++topic.messages;
    ++into.messages;
    if (topic.encoding != json_encoding) return;
    if (topic.name == lost_topic) {
      if (const auto loss = loss_in(read_json(one.data))) into.lost[loss->topic] += loss->messages;
    }
    if (topic.name == stop_state_topic) note_stop_state(read_json(one.data), one.logged_ns, into.stops);
  }

  survey into;

 private:
  std::vector<std::size_t> row_of_; // by the reader's places
  std::vector<publisher_before> before_;
};

void note_chunks(const recording_reader& file, survey& into) {
  std::set<std::string> kinds;
  for (const recording_chunk& one : file.chunks()) {
    kinds.insert(one.packed);
    into.packed_bytes += one.bytes;
    into.plain_bytes += one.plain_bytes;
  }
  for (const std::string& one : kinds) {
    if (!one.empty()) into.packed += into.packed.empty() ? one : " and " + one;
  }
}

void sort_by_name(std::vector<surveyed_topic>& topics) {
  std::stable_sort(topics.begin(), topics.end(), [](const surveyed_topic& one, const surveyed_topic& other) {
    return std::tie(one.name, one.type) < std::tie(other.name, other.type);
  });
}

} // namespace

std::optional<double> surveyed_topic::rate_hz() const {
  if (messages < 2 || last_ns <= first_ns) return std::nullopt;
  return static_cast<double>(messages - 1) * 1e9 / static_cast<double>(last_ns - first_ns);
}

std::uint64_t survey::lost_messages() const {
  std::uint64_t all = 0;
  for (const auto& [topic, count] : lost) all += count;
  return all;
}

std::optional<double> survey::compression_ratio() const {
  if (packed_bytes == 0) return std::nullopt;
  return static_cast<double>(plain_bytes) / static_cast<double>(packed_bytes);
}

std::optional<survey> survey_of(const std::string& path, bool quick, std::string& why,
                                const survey_progress& on_progress) {
  bool wanted = true;
  auto file = recording_reader::open(path, &why, [&](std::uint64_t bytes, std::uint64_t of) {
    wanted = on_progress(of == 0 ? 0 : static_cast<double>(bytes) / static_cast<double>(of)) && wanted;
  });
  if (!file) return std::nullopt;
  why.clear();
  if (!wanted) return std::nullopt;
  surveyor looks{*file};
  survey& into = looks.into;
  into.path = path;
  into.file_bytes = file->file_bytes();
  into.written_by = file->written_by();
  into.profile = file->profile();
  into.is_ended = file->is_ended();
  into.messages = file->messages();
  into.begin_ns = file->begin_ns();
  into.end_ns = file->end_ns();
  note_chunks(*file, into);
  if (!quick) {
    looks.begin_to_look();
    const auto span = static_cast<double>(std::max<std::int64_t>(into.end_ns - into.begin_ns, 1));
    while (const recorded_message* const one = file->next()) {
      looks.look_at(*one);
      if (into.messages % messages_between != 0) continue;
      if (!on_progress(static_cast<double>(one->logged_ns - into.begin_ns) / span)) return std::nullopt;
    }
  }
  into.metadata = file->metadata();
  into.attachments = file->attachments();
  into.damaged = file->damaged();
  sort_by_name(into.topics);
  return std::move(into);
}

} // namespace rowe::tools
