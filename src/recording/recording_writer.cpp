// SPDX-License-Identifier: Apache-2.0
// The public writer: checks what it is given, and puts it into a recorder's feed.
#include <rowe/recording.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <new>
#include <thread>
#include <utility>

#include <rowe/types.hpp>

#include "recording/recorder.hpp"

namespace rowe {

using recording::record_head;
using recording::record_kind;

namespace {
constexpr std::size_t topic_texts_max = 256 * 1024;
constexpr std::uint32_t topics_max = 4096;
} // namespace

std::int64_t wall_clock_ns() noexcept {
  return std::chrono::nanoseconds{std::chrono::system_clock::now().time_since_epoch()}.count();
}

struct recording_writer::parts {
  std::unique_ptr<recording::recorder> to;
  std::uint32_t topics = 0;
};

recording_writer::recording_writer(std::unique_ptr<parts> made) noexcept : parts_{std::move(made)} {}
recording_writer::recording_writer(recording_writer&&) noexcept = default;
recording_writer& recording_writer::operator=(recording_writer&& from) noexcept {
  if (this == &from) return *this;
  (void)close(); // as the destructor
  parts_ = std::move(from.parts_);
  return *this;
}
recording_writer::~recording_writer() { (void)close(); } // who wants to know what is wrong closes it first

result<recording_writer> recording_writer::create(const recording_options& options, std::string* why) {
  try {
    auto started = recording::recorder::start(options, topics_max, why);
    if (!started) return started.error();
    return recording_writer{std::make_unique<parts>(parts{.to = std::move(started).value()})};
  } catch (const std::bad_alloc&) {
    return errc::no_memory;
  }
}

result<recording_writer::topic_number>
recording_writer::add_topic(std::string_view topic, std::string_view type, std::string_view schema) {
  if (!parts_ || parts_->to->closed()) return errc::closed;
  if (parts_->topics == topics_max) return error{errc::too_many_topics, parts_->topics, topics_max};
  const std::size_t bytes = topic.size() + type.size() + schema.size();
  if (bytes > topic_texts_max) return error{errc::too_big, static_cast<std::int64_t>(bytes), topic_texts_max};
  std::array<std::uint32_t, 3> lengths{static_cast<std::uint32_t>(topic.size()),
                                       static_cast<std::uint32_t>(type.size()),
                                       static_cast<std::uint32_t>(schema.size())};
  const auto shown = [](const std::uint32_t& length) {
    return std::string_view{reinterpret_cast<const char*>(&length), sizeof length};
  };
  const std::array content{shown(lengths[0]), topic, shown(lengths[1]), type, shown(lengths[2]), schema};
  if (!parts_->to->messages().put({.kind = record_kind::topic, .topic = parts_->topics}, content))
    return errc::full;
  return parts_->topics++;
}

result<recording_writer::topic_number> recording_writer::add_topic(std::string_view topic,
                                                                   const schema_description& type) {
  return add_topic(topic, type.type_name, json_schema(type));
}

status recording_writer::add(topic_number topic, std::string_view json, std::int64_t logged_ns,
                             std::int64_t published_ns) noexcept {
  if (!parts_ || parts_->to->closed()) return errc::closed;
  if (topic >= parts_->topics) return error{errc::bad_argument, topic, parts_->topics};
  recording::feed& to = parts_->to->messages();
  if (!to.fits(json.size())) {
    to.count_lost(topic, 1);
    return error{errc::too_big, static_cast<std::int64_t>(json.size()), 0, argument::buffer_bytes};
  }
  const bool done = to.put(
      {.kind = record_kind::message, .topic = topic, .logged_ns = logged_ns, .published_ns = published_ns},
      std::array{json});
  return done ? status{} : status{errc::full};
}

void recording_writer::add_lost(topic_number topic, std::uint64_t count) noexcept {
  if (parts_ && topic < parts_->topics) parts_->to->messages().count_lost(topic, count);
}

status recording_writer::wait_room(std::size_t bytes, rt::duration timeout) {
  if (!parts_ || parts_->to->closed()) return errc::closed;
  recording::feed& to = parts_->to->messages();
  if (!to.fits(bytes))
    return error{errc::too_big, static_cast<std::int64_t>(bytes), 0, argument::buffer_bytes};
  const auto until = rt::deadline_after(rt::monotonic_clock::now(), timeout);
  while (!to.has_room(bytes)) {
    if (parts_->to->faulty()) return errc::bad_recording;
    if (rt::monotonic_clock::now() >= until) return error{errc::timed_out, 0, timeout.count()};
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
  return {};
}

status recording_writer::flush(rt::duration timeout) {
  if (!parts_ || parts_->to->closed()) return errc::closed;
  (void)parts_->to->messages().put_lost(wall_clock_ns()); // what has no room is said later
  if (parts_->to->flush(timeout)) return {};
  return parts_->to->faulty() ? status{errc::bad_recording}
                              : status{error{errc::timed_out, 0, timeout.count()}};
}

recording_figures recording_writer::figures() const {
  return parts_ ? parts_->to->figures() : recording_figures{};
}

status recording_writer::close(std::string* why) {
  if (!parts_) return {};
  if (!parts_->to->closed()) {
    (void)parts_->to->flush(rt::for_ever); // makes room
    (void)parts_->to->messages().put_lost(wall_clock_ns());
  }
  const std::string fault = parts_->to->close();
  if (fault.empty()) return {};
  if (why != nullptr) *why = fault;
  return errc::bad_recording;
}

} // namespace rowe
