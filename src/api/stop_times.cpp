// SPDX-License-Identifier: Apache-2.0
// How long a loop and the service thread may be silent, and what is said of it. Set-up.
#include <charconv>
#include <span>
#include <string_view>

#include <rowe/stop_latch.hpp>

#include "api/endpoint_state.hpp"

namespace rowe {
namespace {

// What does not fit is cut.
class diagnostic {
 public:
  explicit diagnostic(std::span<char> buffer) noexcept : buffer_{buffer} {}
  diagnostic& say(std::string_view text) noexcept {
    used_ += text.copy(buffer_.data() + used_, buffer_.size() - used_);
    return *this;
  }
  diagnostic& say(duration time) noexcept {
    using namespace std::chrono_literals;
    const bool whole = time % 1ms == duration::zero();
    char digits[24];
    const auto end = std::to_chars(digits, digits + sizeof digits, time / (whole ? duration{1ms} : 1us)).ptr;
    return say({digits, static_cast<std::size_t>(end - digits)}).say(whole ? " ms" : " us");
  }
  std::string_view view() const noexcept { return {buffer_.data(), used_}; }

 private:
  std::span<char> buffer_;
  std::size_t used_ = 0;
};

std::string_view words_of(stop_times::reason why) noexcept {
  switch (why) {
  case stop_times::reason::option: return "as the options say";
  case stop_times::reason::real_time_priority: return "a thread of real-time priority";
  case stop_times::reason::ordinary_priority: return "a thread without real-time priority";
  }
  return {};
}

} // namespace

std::string_view stop_times::text(std::span<char> buffer) const noexcept {
  diagnostic s{buffer};
  s.say("loop_timeout ").say(loop_timeout).say(" (").say(words_of(loop)).say("), service_timeout ");
  s.say(service_timeout).say(" (").say(words_of(service)).say(")");
  return s.view();
}

namespace detail {

stop_times endpoint_state::stop_times_of(duration loop_timeout, bool real_time) const noexcept {
  const auto reason = [](duration chosen, bool has_priority) {
    if (chosen != duration::zero()) return stop_times::reason::option;
    return has_priority ? stop_times::reason::real_time_priority : stop_times::reason::ordinary_priority;
  };
  const bool served = static_cast<bool>(granted_.fifo);
  const duration chosen = options_.stop.service_timeout;
  stop_times made{.loop_timeout = loop_timeout,
                  .loop = reason(loop_timeout, real_time),
                  .service_timeout = chosen,
                  .service = reason(chosen, served)};
  if (loop_timeout == duration::zero()) made.loop_timeout = loop_timeout_default(real_time);
  if (chosen == duration::zero()) made.service_timeout = service_timeout_default(served);
  return made;
}

} // namespace detail
} // namespace rowe
