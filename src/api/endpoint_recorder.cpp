// SPDX-License-Identifier: Apache-2.0
#include "api/endpoint_recorder.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "access/pattern.hpp"
#include "recording/triggers.hpp"
#include "service/base/chunk_store.hpp"

namespace rowe::detail {

using recording::record_head;
using recording::record_kind;

static_assert(recording::long_places == service::record_sink::long_places);

endpoint_recorder::endpoint_recorder(const record_options& options, std::size_t topics)
    : wall_offset_ns_{wall_clock_ns() - rt::nanoseconds_of(rt::monotonic_clock::now())},
      is_black_box_{options.file.black_box.before > rt::duration{0}},
      topics_{options.topics},
      exclude_{options.exclude},
      described_(topics) {}

result<std::unique_ptr<endpoint_recorder>> endpoint_recorder::start(const record_options& options,
                                                                    std::size_t topics, std::string* why) {
  auto files = recording::recorder::start(options.file, topics, why);
  if (!files) return files.error();
  std::unique_ptr<endpoint_recorder> made{new endpoint_recorder{options, topics}};
  made->files_ = std::move(files).value();
  return made;
}

void endpoint_recorder::finish(rt::duration timeout) {
  (void)files_->flush(timeout); // figures().fault says what is wrong
  (void)files_->messages().put_lost(wall_ns(rt::monotonic_clock::now()));
}

bool endpoint_recorder::wants(std::string_view topic) const noexcept {
  using recording::triggers;
  if (is_black_box_ && (topic == triggers::stop_topic || topic == triggers::control_topic)) return true;
  const auto matches = [topic](const std::string& pattern) { return access::matches(pattern, topic); };
  return (topics_.empty() || std::ranges::any_of(topics_, matches)) &&
         std::ranges::none_of(exclude_, matches);
}

bool endpoint_recorder::describe(std::uint32_t topic, std::string_view name, std::string_view type,
                                 const schema_description* schema) noexcept {
  const auto shown = [](const auto& value) {
    return std::string_view{reinterpret_cast<const char*>(&value), sizeof value};
  };
  const auto name_bytes = static_cast<std::uint32_t>(name.size());
  const auto type_bytes = static_cast<std::uint32_t>(type.size());
  const std::uint32_t schema_bytes = schema == nullptr ? 0 : sizeof schema;
  const std::array content{shown(name_bytes),   name,
                           shown(type_bytes),   type,
                           shown(schema_bytes), shown(schema).substr(0, schema_bytes)};
  // What was lost of the topic that had this number before is said under that one's name.
  const std::int64_t now_ns = wall_ns(rt::monotonic_clock::now());
  const bool done =
      files_->messages().put_lost_of(topic, now_ns) &&
      files_->messages().put(
          {.kind = schema == nullptr ? record_kind::topic : record_kind::typed, .topic = topic}, content);
  described_[topic] = done;
  return done;
}

void endpoint_recorder::put(std::uint32_t topic, std::span<const char> json, rt::time_point logged,
                            rt::time_point published) noexcept {
  if (!described_[topic]) return lose(topic, 1);
  (void)files_->messages().put(
      {.kind = record_kind::message,
       .topic = topic,
       .logged_ns = wall_ns(logged),
       .published_ns = wall_ns(published)},
      std::array{std::string_view{json.data(), json.size()}}); // it counts what is lost
}

void endpoint_recorder::lose(std::uint32_t topic, std::uint64_t count) noexcept {
  files_->messages().count_lost(topic, count);
}

bool endpoint_recorder::begin_long(std::uint32_t place, std::uint32_t topic, std::size_t bytes,
                                   rt::time_point logged, rt::time_point published) noexcept {
  if (!described_[topic]) {
    lose(topic, 1);
    return false;
  }
  return files_->messages().begin_long({.place = static_cast<std::uint16_t>(place),
                                        .topic = topic,
                                        .logged_ns = wall_ns(logged),
                                        .published_ns = wall_ns(published)},
                                       bytes, service::chunk_store::chunk_bytes);
}

void endpoint_recorder::put_part(std::uint32_t place, std::span<const std::byte> part) noexcept {
  files_->messages().put_part(static_cast<std::uint16_t>(place),
                              {reinterpret_cast<const char*>(part.data()), part.size()});
}

bool endpoint_recorder::snapshot(std::string_view cause) noexcept {
  return is_black_box_ && files_->messages().ask_for_snapshot(cause, wall_ns(rt::monotonic_clock::now()));
}

} // namespace rowe::detail
