// SPDX-License-Identifier: Apache-2.0
// What is plotted: the numbers of each field, and what happened meanwhile. Messages are taken one by one, and
// the memory that they need does not depend on how many they are.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/json_value.hpp>

#include "../recordings/stops.hpp"
#include "envelope.hpp"
#include "fields.hpp"
#include "gaps.hpp"

namespace rowe::tools {

// The times of a picture, and in how many columns they are looked at.
struct plotted_span {
  std::int64_t zero_ns = 0; // from there the axis counts
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
  std::size_t columns = 1;
};

// One field.
class plotted_series {
 public:
  plotted_series(field_wish wish, const plotted_span& span);

  void take(json_value message, std::int64_t time_ns);

  const field_wish& wish() const noexcept { return wish_; }
  std::string unit{};
  // What the legend says.
  std::string label() const;

  std::uint64_t samples() const noexcept { return over_y_.samples(); }
  std::uint64_t messages() const noexcept { return messages_; }
  double lowest() const noexcept { return over_y_.lowest(); }
  double highest() const noexcept { return over_y_.highest(); }
  // Of the numbers to the right, where the time is not.
  double x_lowest() const noexcept { return over_x_ ? over_x_->lowest() : 0; }
  double x_highest() const noexcept { return over_x_ ? over_x_->highest() : 0; }

  // What is drawn: lines, that are broken where a gap is.
  std::vector<std::vector<sample>> lines() const;
  std::vector<gap> gaps() const { return pauses_.gaps(); }
  // How many samples are drawn.
  std::size_t kept() const;

  // "7 messages have no number there (5 a text, 2 nothing)"; empty: all have one.
  std::string oddities() const;
  // Why there is not a single number in what came so far; empty: there is one, or nothing came.
  std::string nothing_found() const;

 private:
  enum class is_no_number : std::size_t { missing, null, text, object, array, huge, count };
  static constexpr auto kinds = static_cast<std::size_t>(is_no_number::count);

  std::optional<double> number_at(json_value message, std::string_view path);
  std::vector<sample> drawn() const;

  field_wish wish_;
  envelope over_y_;
  std::optional<envelope> over_x_; // of a path: its turning points to the left and right
  gap_finder pauses_;
  std::uint64_t messages_ = 0;
  std::array<std::uint64_t, kinds> no_numbers_{};
  std::string example_; // a message that had no number there
};

// Messages of one topic that a recording lacks, by when that was said.
using plotted_losses = std::map<std::int64_t, std::uint64_t>;

// All that a picture shows.
class plotted_data {
 public:
  plotted_data(const std::vector<field_wish>& wishes, const plotted_span& span);

  std::vector<plotted_series> series;
  std::vector<recorded_stop> stops;
  std::map<std::string, plotted_losses> losses; // by topic
  const plotted_span& span() const noexcept { return span_; }
  // Ends the picture earlier than it was meant to.
  void end_at(std::int64_t time_ns) noexcept { span_.end_ns = time_ns; }

  // The places in `series` of a topic's fields.
  std::vector<std::size_t> fields_of_topic(std::string_view topic) const;
  void take(const std::vector<std::size_t>& fields, json_value message, std::int64_t time_ns);
  void take_stop_state(json_value said, std::int64_t time_ns) { note_stop_state(said, time_ns, stops); }
  void take_loss(json_value said, std::int64_t time_ns);

  std::size_t lanes() const noexcept;
  bool is_over_time() const noexcept;
  double seconds_of(std::int64_t time_ns) const noexcept {
    return static_cast<double>(time_ns - span_.zero_ns) / 1e9;
  }
  std::uint64_t lost_messages() const;
  // Where a topic paused, once each, whichever of its fields show it.
  std::vector<gap> gaps_of_topic(std::string_view topic) const;
  std::size_t gaps() const;
  const std::string& topic_of_lane(std::size_t lane) const noexcept;

 private:
  plotted_span span_;
};

} // namespace rowe::tools
