// SPDX-License-Identifier: Apache-2.0
// Set-up of parameters.
#include "api/check_options.hpp"
#include "api/endpoint_state.hpp"
#include "service/base/service_limits.hpp"
#include "service/parameters/parameter_values.hpp"
#include "wire/codec/own_names.hpp"

namespace rowe::detail {

result<parameter_cell*> endpoint_state::open_parameter(const parameter_request& asked) {
  const std::size_t bytes_max = options_.limits.topic_bytes_max;
  const bool slashed = asked.name.starts_with('/');
  const std::size_t bytes = asked.name.size() + (slashed ? 0 : 1);
  if (asked.name.empty() || asked.name == "/" || bytes > bytes_max)
    return error{errc::bad_argument, static_cast<std::int64_t>(asked.name.size()),
                 static_cast<std::int64_t>(bytes_max - (slashed ? 0 : 1)), argument::name};
  if (const status ok = check_text(argument::name, asked.name); !ok) return ok.error();
  if (wire::is_own_name(asked.name)) return errc::reserved_topic;
  if (!service::is_allowed(asked.what, asked.first)) return errc::out_of_range;
  const std::lock_guard set_up{set_up_};
  if (closed_) return errc::closed;
  service::parameter_table& table = shared_->parameters;
  if (table.find(asked.name) != nullptr) return errc::parameter_taken;
  // A program that replaces parameters finds the places that it had.
  parameter_cell* made = nullptr;
  table.freed.wait_until(rt::deadline_after(rt::monotonic_clock::now(), service::closing_time_max), [&] {
    const bool closing = table.any_closing(); // asked first: a place may become free in between
    made = table.open(asked, wake_descriptor());
    return made != nullptr || !closing;
  });
  if (made == nullptr) {
    const auto most = static_cast<std::int64_t>(options_.limits.parameters_max);
    return error{errc::too_many_parameters, most, most};
  }
  transport_->wake();
  return made;
}

void endpoint_state::close_parameter(parameter_cell& gone) noexcept {
  if (forked_) return;
  shared_->parameters.close(gone);
  transport_->wake();
}

void close_parameter(endpoint_state& of, parameter_cell& gone) noexcept { of.close_parameter(gone); }

} // namespace rowe::detail
