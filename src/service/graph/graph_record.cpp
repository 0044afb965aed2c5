// SPDX-License-Identifier: Apache-2.0
#include "service/graph/graph_record.hpp"

#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/service_limits.hpp"
#include "service/topics/listed_topics.hpp"
#include "wire/codec/own_names.hpp"

namespace rowe::service {

graph_record::graph_record(rt::arena& memory, const graph_record_needs& parts) noexcept
    : graph_record_needs{parts},
      rows_{memory.carve<row>(rows_of(state_.bounds()))},
      names_{
          memory.carve<char>(named_rows_of(state_.bounds()) * gone_names::name_bytes_max(state_.bounds()))},
      gone_{memory, state_.bounds()},
      row_{static_cast<std::uint32_t>(rows_.size())} {}

std::string_view graph_record::name(std::uint32_t of) const noexcept {
  if (is_own_service(of)) return rows_[of].name_bytes == 0 ? std::string_view{} : own_service_of(of).name;
  return {names_.data() + of * gone_names::name_bytes_max(state_.bounds()), rows_[of].name_bytes};
}

void graph_record::set_name(std::uint32_t of, std::string_view name) noexcept {
  rows_[of].name_bytes = static_cast<std::uint16_t>(name.size());
  if (is_own_service(of)) return;
  name.copy(names_.data() + of * gone_names::name_bytes_max(state_.bounds()), name.size());
}

bool graph_record::holds(std::uint32_t of) const noexcept {
  if (rows_[of].name_bytes == 0) return false;
  if (is_topic(of)) return state_.topics.at({of}).holders != 0 && state_.topics.name({of}) == name(of);
  if (is_own_service(of)) return is_listed(own_service_of(of));
  const service_index service = service_of(of);
  return service_directory_.is_service(service) &&
         service_directory_.at(service).number == rows_[of].publishers;
}

std::uint64_t graph_record::changes() const noexcept {
  return service_directory_.changes() + state_.topics.changes().holders + (stop_rules_.in_use() ? 1 : 0);
}

bool graph_record::begin(bool known, std::uint32_t announced_at) noexcept {
  if (std::exchange(stop_in_use_, stop_rules_.in_use()) != stop_rules_.in_use())
    state_.topics.changes().note_publishers(state_.topics.at(state_.topics.find(wire::stop_state_name)));
  next_at_ = state_.cycle.now + graph_period;
  comparing_ = changes();
  changed_ = version_ == 0;
  keeps_gone_ = known;
  held_up_ = false;
  row_ = 0;
  return gone_.drop_until(known ? announced_at : version_);
}

void graph_record::go_on(graph_work& work) noexcept {
  const listed_topics listed{state_.topics, stop_rules_};
  for (; row_ != rows_.size() && work.left != 0; ++row_) {
    work.use(1);
    if (is_topic(row_))
      compare_topic(row_, listed({row_}), work);
    else
      is_own_service(row_) ? compare_own_service(row_, work) : compare_service(row_, work);
  }
  if (row_ != rows_.size()) return;
  compared_ = comparing_;
  if (changed_) ++version_;
}

void graph_record::compare_topic(std::uint32_t of, bool listed, graph_work& work) noexcept {
  const topic& is = state_.topics.at({of});
  row& was = rows_[of];
  const bool same = was.publishers == is.publishers_at && was.subscribers == is.subscribers_at;
  const bool known = was.name_bytes != 0;
  if (known == listed && (!known || same)) return;
  if (!replace(of, listed ? state_.topics.name({of}) : std::string_view{}, work) || !listed) return;
  if (was.publishers != is.publishers_at) was.published_at = version_ + 1;
  if (was.subscribers != is.subscribers_at) was.subscribed_at = version_ + 1;
  was.publishers = is.publishers_at;
  was.subscribers = is.subscribers_at;
}

void graph_record::compare_service(std::uint32_t of, graph_work& work) noexcept {
  const service_index service = service_of(of);
  const bool listed = service_directory_.is_service(service);
  row& was = rows_[of];
  const bool known = was.name_bytes != 0;
  const std::uint32_t number = listed ? service_directory_.at(service).number : 0;
  if (known == listed && (!known || was.publishers == number)) return;
  if (!replace(of, listed ? service_directory_.name(service) : std::string_view{}, work) || !listed) return;
  was.published_at = version_ + 1;
  was.publishers = number;
}

// One that a handle provides instead is in that one's row.
void graph_record::compare_own_service(std::uint32_t of, graph_work& work) noexcept {
  const own_service_type& own = own_service_of(of);
  const bool listed = is_listed(own);
  if ((rows_[of].name_bytes != 0) != listed) (void)replace(of, listed ? own.name : std::string_view{}, work);
}

// The row has another name from now on; empty: none. False: the name before finds no place yet, and so the
// row stays as it is. What comes again, in this row or another one, is not announced as gone.
bool graph_record::replace(std::uint32_t of, std::string_view now, graph_work& work) noexcept {
  const std::string_view before = name(of);
  if (before != now) {
    work.use(gone_.size());
    const bool moved = is_elsewhere(of) && !ROWE_MUTANT(graph_moved);
    if (!before.empty() && keeps_gone_ && !moved && !ROWE_MUTANT(graph_gone) &&
        !gone_.add(before, is_topic(of), version_ + 1)) {
      held_up_ = true;
      return false;
    }
    if (!now.empty() && !ROWE_MUTANT(graph_moved)) gone_.drop(now, is_topic(of));
    rows_[of] = {.published_at = version_ + 1, .subscribed_at = version_ + 1};
    set_name(of, now);
  }
  changed_ = true;
  return true;
}

// Whether another row has the name of this one.
bool graph_record::is_elsewhere(std::uint32_t of) const noexcept {
  if (is_topic(of)) {
    const topic_id found = state_.topics.find(name(of));
    return found && found.value != of && name(found.value) == name(of);
  }
  const service_index found = service_directory_.find(name(of));
  if (!found && !is_own_service(of)) {
    const own_service_type* const own = own_type_of_service(name(of));
    if (own != nullptr && own < own_service_types().data() + numbered_own_services && is_listed(*own))
      return true;
  }
  const std::uint32_t other = found ? state_.bounds().topics_max + found.value : of;
  return other != of && name(other) == name(of);
}

} // namespace rowe::service
