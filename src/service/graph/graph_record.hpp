// SPDX-License-Identifier: Apache-2.0
// What was found of each topic and service, for connection_graph: its name, and who holds it, as a count of
// changes. It is compared with what there is once in each period. A change has the number of the comparison
// that found it. Names that are gone stay until all peers that know them have learnt it. Service thread only;
// nothing waits or allocates.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/graph/gone_names.hpp"
#include "service/state/core_state.hpp"
#include "service/state/service_directory.hpp"
#include "service/threads/stop_rules.hpp"
#include "service/topics/own_types.hpp"

namespace rowe::service {

// What may still be done in one cycle.
struct graph_work {
  std::uint32_t left = 0;
  void use(std::size_t more) noexcept {
    left -= static_cast<std::uint32_t>(std::min<std::size_t>(left, more));
  }
};

struct graph_record_needs {
  core_state& state_;
  const service_directory& service_directory_;
  const stop_rules& stop_rules_;
};

class graph_record : graph_record_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<row>(rows_of(bounds)) +
           rt::arena::bytes_for(named_rows_of(bounds) * gone_names::name_bytes_max(bounds)) +
           gone_names::footprint_bytes(bounds);
  }
  graph_record(rt::arena& memory, const graph_record_needs& parts) noexcept;

  // ---- rows: those of topics come first, then of services, then of the endpoint's own that have numbers

  std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(rows_.size()); }
  bool is_topic(std::uint32_t of) const noexcept { return of < state_.bounds().topics_max; }
  bool is_own_service(std::uint32_t of) const noexcept { return of >= named_rows_of(state_.bounds()); }
  service_index service_of(std::uint32_t of) const noexcept { return {of - state_.bounds().topics_max}; }
  std::string_view name(std::uint32_t of) const noexcept; // empty: there is none
  // Whether the row is of what stands there now. Else the next comparison replaces it.
  bool holds(std::uint32_t of) const noexcept;
  // The comparison in which the publishers have changed, or the provider of a service; and the subscribers.
  std::uint32_t published_at(std::uint32_t of) const noexcept { return rows_[of].published_at; }
  std::uint32_t subscribed_at(std::uint32_t of) const noexcept { return rows_[of].subscribed_at; }
  const gone_names& gone() const noexcept { return gone_; }

  // ---- comparing

  // Of the newest comparison that found a change. Never 0 once there was one.
  std::uint32_t version() const noexcept { return version_; }
  // No comparison is under way.
  bool is_whole() const noexcept { return row_ == rows_.size(); }
  // Whether something has changed since, or found no place.
  bool is_old() const noexcept { return changes() != compared_ || held_up_ || version_ == 0; }
  // When the next comparison may begin.
  rt::time_point next_at() const noexcept { return next_at_; }
  // Whoever knows something knows all up to `announced_at`; `known`: somebody does. True: places for names
  // that are gone came free.
  bool begin(bool known, std::uint32_t announced_at) noexcept;
  void go_on(graph_work& work) noexcept;
  // In the last comparison, names that are gone found no place.
  bool held_up() const noexcept { return held_up_; }

 private:
  struct row {
    std::uint32_t publishers = 0; // topic::publishers_at; of a service its number
    std::uint32_t subscribers = 0;
    std::uint32_t published_at = 0;
    std::uint32_t subscribed_at = 0;
    std::uint16_t name_bytes = 0;
  };
  static std::size_t named_rows_of(const limits& bounds) noexcept {
    return std::size_t{bounds.topics_max} + bounds.services_max;
  }
  static std::size_t rows_of(const limits& bounds) noexcept {
    return named_rows_of(bounds) + numbered_own_services;
  }
  const own_service_type& own_service_of(std::uint32_t of) const noexcept {
    return own_service_types()[of - named_rows_of(state_.bounds())];
  }
  bool is_listed(const own_service_type& own) const noexcept {
    return (!own.of_stop || stop_rules_.in_use()) && !service_directory_.find(own.name);
  }
  void set_name(std::uint32_t of, std::string_view name) noexcept;
  std::uint64_t changes() const noexcept;
  void compare_topic(std::uint32_t of, bool listed, graph_work& work) noexcept;
  void compare_service(std::uint32_t of, graph_work& work) noexcept;
  void compare_own_service(std::uint32_t of, graph_work& work) noexcept;
  bool replace(std::uint32_t of, std::string_view now, graph_work& work) noexcept;
  bool is_elsewhere(std::uint32_t of) const noexcept;

  std::span<row> rows_;
  std::span<char> names_;
  gone_names gone_;
  std::uint32_t version_ = 0;
  std::uint32_t row_;       // the next one to compare
  bool changed_ = false;    // a row, in the comparison that is under way
  bool keeps_gone_ = false; // somebody knows them
  bool held_up_ = false;
  bool stop_in_use_ = false;
  std::uint64_t comparing_ = 0; // changes() when it began,
  std::uint64_t compared_ = 0;  // and when the one before did
  rt::time_point next_at_{};
};

} // namespace rowe::service
