// SPDX-License-Identifier: Apache-2.0
// The stop for threads of this process that have no loop: calls of the endpoint's own services, as a peer's.
#include <rowe/endpoint.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string_view>
#include <thread>

#include "api/endpoint_state.hpp"
#include "json/reader.hpp"

namespace rowe {
namespace {

constexpr duration look_again_after = std::chrono::milliseconds{1};

std::int64_t integer_in(std::string_view answer, std::string_view member) noexcept {
  const auto found = json::find(json::root(answer).raw, member);
  return found ? json::to_integer(*found).value_or(-1) : -1;
}
// Whether it is there, and says so.
bool says(std::string_view answer, std::string_view member, std::string_view text) noexcept {
  const auto found = json::find(json::root(answer).raw, member);
  return found && json::text_is(*found, text);
}
bool is_null(std::string_view answer, std::string_view member) noexcept {
  const auto found = json::find(json::root(answer).raw, member);
  return !found || found->type == json::kind::null;
}

} // namespace

status endpoint::stop(std::string_view source, duration timeout) {
  state_->ask_to_stop(); // first, and without any room; what follows is for the source and the answer
  const auto answer = invoke(message{"service", "/rowe/stop", "source", source}, timeout);
  if (!answer) return answer.error();
  if (!is_null(answer->value(), "observed_ns")) return {};
  return error{errc::timed_out, 0, timeout.count()};
}

status endpoint::reset_stop(duration timeout) {
  const auto deadline = rt::deadline_after(rt::monotonic_clock::now(), timeout);
  const auto left = [&] {
    if (deadline == rt::never) return rt::for_ever;
    return std::max(deadline - rt::monotonic_clock::now(), look_again_after);
  };
  std::int64_t number = -1; // of the stop that is reset: another one that comes meanwhile stays
  for (;;) {
    const auto state = invoke(message{"service", "/rowe/stop/state"}, left());
    if (!state) return state.error();
    if (number < 0) {
      if (says(state->value(), "state", "running")) return {};
      number = integer_in(state->value(), "number");
    }
    const auto answer = invoke(
        message{"service", "/rowe/stop/reset", "number", number, "tick", integer_in(state->value(), "tick")},
        left());
    if (!answer) return answer.error();
    if (is_null(answer->value(), "refused")) return {};
    if (says(answer->value(), "refused", "number") || says(answer->value(), "refused", "guards"))
      return errc::refused;
    if (rt::monotonic_clock::now() >= deadline) return error{errc::timed_out, 0, timeout.count()};
    std::this_thread::sleep_for(look_again_after);
  }
}

} // namespace rowe
