// SPDX-License-Identifier: Apache-2.0
#include "service/parameters/parameters.hpp"

#include "service/base/counters.hpp"
#include "service/parameters/parameter_values.hpp"
#include "service/threads/shared_state.hpp"
#include "wire/codec/own_names.hpp"

namespace rowe::service {
namespace {

using phase = detail::parameter_cell::phase;

constexpr std::uint32_t own_count =
    static_cast<std::uint32_t>(limit_table.size() + counter_descriptions.size());

} // namespace

parameters::parameters(rt::arena& memory, const parameters_needs& parts) noexcept
    : parameters_needs{parts},
      rows_{memory.carve<row>(state_.bounds().parameters_max)},
      count_{rows_.size() + own_count} {}

void parameters::look() noexcept {
  for (std::uint32_t i = 0; i < rows_.size(); ++i) take(parameter_id{i});
}

void parameters::take(parameter_id which) noexcept {
  detail::parameter_cell& from = cell(which);
  row& of = rows_[which];
  // acquire: pairs with the releases in parameter_table::open() and close()
  const phase now = from.state.load(std::memory_order_acquire);
  if (now == phase::free) return;
  if (now == phase::closing) {
    of.in_use = false;
    of.changed_at = ++changes_;
    from.state.store(phase::free, std::memory_order_release); // release: pairs with parameter_table::open()
    state_.shared.parameters.freed.notify();
    return;
  }
  const bool is_new = !of.in_use || of.opened != from.opened;
  detail::parameter_value set;
  if (from.service_out->read(set) != rt::freshness::fresh) return;
  if (!is_new && set == of.value) return;
  if (is_new)
    of.name_bytes = static_cast<std::uint8_t>(from.name().copy(of.name_text.data(), name_bytes_max));
  of.in_use = true;
  of.opened = from.opened;
  of.value = set;
  of.changed_at = ++changes_;
  // The handle may have read what a peer wrote meanwhile.
  if (!is_new) from.service_in->write(set);
}

parameter_id parameters::find(std::string_view name) const noexcept {
  const std::string_view plain = without_slash(name);
  for (std::uint32_t i = 0; i < rows_.size(); ++i) {
    if (rows_[{i}].in_use && without_slash(rows_[{i}].name()) == plain) return {i};
  }
  if (!is_own_name(name)) return {};
  const auto below = [plain](std::string_view prefix) {
    prefix = without_slash(prefix);
    return plain.starts_with(prefix) ? plain.substr(prefix.size()) : std::string_view{};
  };
  std::uint32_t own = rows_.size();
  const std::string_view limit = below(wire::limit_parameters);
  for (std::size_t i = 0; i < limit_table.size(); ++i, ++own) {
    if (name_of(limit_table[i].which) == limit) return {own};
  }
  const std::string_view counted = below(wire::counter_parameters);
  for (const counter_description& one : counter_descriptions) {
    if (one.name == counted) return {own};
    ++own;
  }
  return {};
}

std::string_view parameters::name(parameter_id which, std::span<char> buffer) const noexcept {
  if (is_of_handle(which)) return rows_[which].name();
  const std::uint32_t own = which.value - rows_.size();
  wire::text_out text{buffer};
  if (own < limit_table.size())
    return text.add(wire::limit_parameters).add(name_of(limit_table[own].which)).text();
  return text.add(wire::counter_parameters).add(counter_descriptions[own - limit_table.size()].name).text();
}

void parameters::write_value(parameter_id which, json::writer& into) const noexcept {
  if (is_of_handle(which)) return service::write_value(cell(which).what, rows_[which].value, into);
  const std::uint32_t own = which.value - rows_.size();
  if (own < limit_table.size()) return into.number(limit_table[own].of(state_.bounds()));
  const auto counted = static_cast<counter>(own - limit_table.size());
  into.number(read_count(state_.shared, std::span{state_.pairs.begin(), state_.pairs.end()}, counted));
}

void parameters::write_description(parameter_id which, json::writer& into) const noexcept {
  service::write_description(cell(which).what, into);
}

bool parameters::set(parameter_id which, std::string_view json, wire::text_out& why) noexcept {
  if (!is_of_handle(which)) {
    why.add("it is one of the endpoint's own, which are read-only");
    return false;
  }
  detail::parameter_value value;
  if (!read_value(cell(which).what, json, value, why)) return false;
  row& of = rows_[which];
  if (value == of.value) return true;
  of.value = value;
  of.changed_at = ++changes_;
  cell(which).service_in->write(value);
  return true;
}

} // namespace rowe::service
