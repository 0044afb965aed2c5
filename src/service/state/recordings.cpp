// SPDX-License-Identifier: Apache-2.0
#include "service/state/recordings.hpp"

#include <algorithm>

#include <rowe/detail/mutation_points.hpp>

namespace rowe::service {

std::uint8_t recordings::add(record_sink& sink) noexcept {
  auto* const place = std::ranges::find(sinks_, nullptr);
  if (place == sinks_.end()) return 0;
  *place = &sink;
  ++count_;
  for (const topic_id i : topics_.topic_ids()) topics_.at(i).aside |= topic::recorders_unknown;
  return static_cast<std::uint8_t>(1U << (place - sinks_.begin()));
}

void recordings::remove(record_sink& sink) noexcept {
  auto* const place = std::ranges::find(sinks_, &sink);
  if (place == sinks_.end() || ROWE_MUTANT(recorder_gone)) return;
  const auto bit = static_cast<std::uint8_t>(1U << (place - sinks_.begin()));
  *place = nullptr;
  --count_;
  for (const topic_id i : topics_.topic_ids()) {
    topic& on = topics_.at(i);
    on.aside = static_cast<std::uint8_t>(on.aside & ~bit);
  }
  for (long_value& one : long_values_) one.sinks = static_cast<std::uint8_t>(one.sinks & ~bit);
}

bool recordings::find(topic_id index) noexcept {
  topic& on = topics_.at(index);
  if ((on.aside & topic::recorders_unknown) == 0) return on.is_recorded();
  on.aside &= topic::asked_over_http;
  bool complete = true;
  for (std::size_t i = 0; i < sinks_max; ++i) {
    if (sinks_[i] == nullptr || !sinks_[i]->wants(topics_.name(index))) continue;
    on.aside |= static_cast<std::uint8_t>(1U << i);
    complete &= ROWE_MUTANT(recorder_told) ||
                sinks_[i]->describe(index.value, topics_.name(index), topics_.type(index), on.schema);
  }
  if (!complete) on.aside |= topic::recorders_unknown; // the next value tries again
  return on.is_recorded();
}

void recordings::keep(topic_id index, std::string_view json, rt::time_point now, rt::time_point published,
                      std::uint8_t only) noexcept {
  each(topics_.at(index).aside & only,
       [&](record_sink& sink, std::uint8_t) { sink.put(index.value, json, now, published); });
}

void recordings::keep_long(topic_id index, text_id value, rt::time_point now, rt::time_point published,
                           std::uint8_t only) noexcept {
  const unsigned wanted = topics_.at(index).aside & only;
  auto* const place = std::ranges::find_if(long_values_, [](const long_value& one) { return !one.text; });
  if (place == long_values_.end())
    return each(wanted, [&](record_sink& sink, std::uint8_t) { sink.lose(index.value, 1); });
  const auto number = static_cast<std::uint32_t>(place - long_values_.begin());
  std::uint8_t begun = 0;
  each(wanted, [&](record_sink& sink, std::uint8_t bit) {
    if (sink.begin_long(number, index.value, chunks_.bytes(value), now, published)) begun |= bit;
  });
  if (begun == 0) return;
  *place = {.text = value, .sinks = begun};
  if (!ROWE_MUTANT(recorded_text)) chunks_.retain(value);
  ++long_count_;
}

void recordings::copy_long(std::size_t bytes) noexcept {
  for (std::uint32_t i = 0; i < long_values_.size() && bytes != 0; ++i) {
    long_value& one = long_values_[i];
    while (one.text && bytes != 0) {
      const std::size_t all = chunks_.bytes(one.text);
      if (one.done < all && one.sinks != 0) {
        const auto part = chunks_.read(one.text, one.done, one.at);
        each(one.sinks, [&](record_sink& sink, std::uint8_t) { sink.put_part(i, part); });
        one.done += part.size();
        bytes -= std::min(bytes, part.size());
        if (one.done < all) continue;
      }
      chunks_.release(one.text);
      one = {};
      --long_count_;
    }
  }
}

std::uint32_t recordings::black_boxes() const noexcept {
  std::uint32_t found = 0;
  for (const record_sink* const sink : sinks_) found += sink != nullptr && sink->is_black_box() ? 1U : 0U;
  return found;
}

std::uint32_t recordings::snapshot(std::string_view cause) noexcept {
  std::uint32_t asked = 0;
  for (record_sink* const sink : sinks_) asked += sink != nullptr && sink->snapshot(cause) ? 1U : 0U;
  return asked;
}

} // namespace rowe::service
