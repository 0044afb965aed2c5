// SPDX-License-Identifier: Apache-2.0
// Folder reports: what the endpoint reports about itself. It changes nothing.
// The statistics, for the page and for tools: the topic /rowe/stats, and the service of that name.
// docs/concepts.md describes the members. Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/thread.hpp>

#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"
#include "service/threads/stop_rules.hpp"
#include "service/topics/topic_rates.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

struct statistics_report_needs {
  core_state& state_;
  const stop_rules& stop_rules_;
  const outbox& outbox_;
  const topic_rates& topic_rates_;
};

class statistics_report : statistics_report_needs {
 public:
  static constexpr std::size_t name_bytes_max = 64; // of the endpoint's; a longer one is cut

  // `name`: the endpoint's, copied.
  explicit statistics_report(const statistics_report_needs& parts) noexcept;

  void describe_thread(const rt::grants& granted, bool memory_locked) noexcept {
    granted_ = granted;
    memory_locked_ = memory_locked;
  }
  std::string_view name() const noexcept { return {name_.data(), name_bytes_}; }

  void write_for_topic(json::writer& into) noexcept;
  // Who reads a report.
  struct reader {
    access::subject who{};
    const connection* peer = nullptr; // none: it asks over HTTP
  };
  // The same members, and those that are too long to be published ten times a second.
  // `by` may not see all topics: it gets those that its role may subscribe to, and of the connections its
  // own. Null: this process, which sees everything.
  void write_for_service(json::writer& into, const reader* by) noexcept;

 private:
  void write_state(json::writer& into, bool of_service, const reader* by) noexcept;
  void write_topics(json::writer& into, bool of_service, const reader* by) noexcept;
  void write_losses(json::writer& into) noexcept;
  void write_loops(json::writer& into) noexcept;
  void write_connections(json::writer& into, const reader* by) noexcept;

  std::array<char, name_bytes_max> name_{};
  std::size_t name_bytes_;
  rt::time_point opened_at_;
  rt::grants granted_;
  bool memory_locked_ = false;
};

} // namespace rowe::service
