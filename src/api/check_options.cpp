// SPDX-License-Identifier: Apache-2.0
#include "api/check_options.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "config/keys.hpp"
#include "service/threads/stop_rules.hpp"
#include "service/topics/own_types.hpp"
#include "wire/codec/members.hpp"
#include "wire/text/utf8.hpp"

namespace rowe::detail {
namespace {

constexpr std::uint32_t depth_max = 4096;

template <class T>
status in_range(argument which, T value, T least, T most) noexcept {
  if (value >= least && value <= most) return {};
  return error{errc::bad_argument, static_cast<std::int64_t>(value),
               static_cast<std::int64_t>(value < least ? least : most), which};
}

status in_range(argument which, duration value, duration least, duration most) noexcept {
  return in_range(which, value.count(), least.count(), most.count());
}

status check_topic(const pair_request& asked, const endpoint_options& options) noexcept {
  if (service::is_own_name(asked.name)) return errc::reserved_topic;
  // A value that cannot live as long as it may wait for the service thread would never be sent.
  const bool polls = options.idle_policy == idle::poll || options.idle_policy == idle::phase;
  if (polls && asked.ttl > duration::zero() && asked.ttl <= options.poll_period)
    return error{errc::bad_argument, asked.ttl.count(), options.poll_period.count(), argument::ttl};
  if (asked.period == duration::zero()) return {};
  using namespace std::chrono_literals;
  return in_range(argument::period, asked.period, 100us, 1h);
}

// Only structs are commands, since a view of the newest text would change while it is read.
status check_lease(const pair_request& asked) noexcept {
  if (asked.lease == duration::zero()) return {};
  using namespace std::chrono_literals;
  if (asked.decoded == nullptr) return error{errc::bad_argument, asked.lease.count(), 0, argument::lease};
  if (service::is_own_name(asked.name)) return errc::reserved_topic;
  return in_range(argument::lease, asked.lease, 20ms, 10s);
}

status check_throttle(const pair_request& asked) noexcept {
  if (asked.throttle == duration::zero()) return {};
  using namespace std::chrono_literals;
  return in_range(argument::throttle, asked.throttle, 1ms, 1h);
}

// "x" and "/x" are the same service, so the slash counts in any case.
status check_service(const pair_request& asked, const endpoint_options& options) noexcept {
  if (!responds(asked.kind) && !calls(asked.kind)) return {};
  const bool slash = asked.name.front() == '/';
  const std::size_t bytes = asked.name.size() + (slash ? 0 : 1);
  const std::size_t most{options.limits.topic_bytes_max};
  if (const status ok = in_range(argument::name, bytes, std::size_t{2}, most); !ok) return ok;
  const bool own =
      asked.replaces_own ? service::is_own_name(asked.name) : service::is_own_service(asked.name);
  if (responds(asked.kind) && own) return errc::reserved_topic;
  return {};
}

} // namespace

status check_text(argument which, std::string_view text) noexcept {
  wire::utf8_check check;
  std::size_t character = 0; // where the one begins that is being read
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool good = check.feed(std::as_bytes(std::span{text.substr(i, 1)}));
    if (!good) return error{errc::not_utf8, static_cast<std::int64_t>(character), 0, which};
    if (wire::has_control_characters(text.substr(i, 1)))
      return error{errc::control_character, static_cast<std::int64_t>(i), 0, which};
    if (check.complete()) character = i + 1;
  }
  if (!check.complete()) return error{errc::not_utf8, static_cast<std::int64_t>(character), 0, which};
  return {};
}

status check_values(const endpoint_options& options) noexcept {
  for (const config::key<configuration>& one : config::keys()) {
    if (one.number == nullptr) continue;
    const status ok = in_range(one.which, one.number(options), one.what.least, one.what.most);
    if (!ok) return ok;
  }
  return {};
}

std::array<status, 5> check_relations(const endpoint_options& o) noexcept {
  using namespace std::chrono_literals;
  const bool left_open = o.stop.service_timeout == duration::zero();
  return {
      in_range(argument::small_slot_bytes, o.limits.small_slot_bytes, 0U, o.limits.message_bytes_max),
      in_range(argument::silence_max, o.silence_max, o.ping_period, rt::for_ever),
      in_range(argument::retry_max, o.retry_max, o.retry_min, rt::for_ever),
      in_range(argument::tick, o.stop.tick, duration::zero(), o.stop.guard_timeout / 2),
      left_open ? status{} : in_range(argument::service_timeout, o.stop.service_timeout, 2ms, rt::for_ever),
  };
}

status check_options(const endpoint_options& options) noexcept {
  if (const status ok = check_values(options); !ok) return ok;
  for (const status& one : check_relations(options)) {
    if (!one) return one;
  }
  return {};
}

status check_request(const pair_request& asked, const endpoint_options& options) noexcept {
  const std::uint32_t name_bytes_max = options.limits.topic_bytes_max;
  if (asked.kind == pair_kind::talk) {
    for (const auto& [which, depth] :
         {std::pair{argument::depth, asked.out_depth}, std::pair{argument::inbox_depth, asked.in_depth},
          std::pair{argument::calls, asked.completions_depth}}) {
      if (const status ok = in_range(which, depth, 1U, depth_max); !ok) return ok;
    }
    return {};
  }
  if (asked.kind == pair_kind::stop_latch) {
    using namespace std::chrono_literals;
    if (!service::stop_rules::good_name(asked.name)) {
      return error{errc::bad_argument, static_cast<std::int64_t>(asked.name.size()),
                   service::stop_rules::name_bytes_max, argument::name};
    }
    return in_range(argument::loop_timeout, asked.loop_timeout, 1ms, longest_loop_timeout);
  }
  if (asked.kind == pair_kind::record) return {};
  const std::size_t most{name_bytes_max};
  if (const status ok = in_range(argument::name, asked.name.size(), std::size_t{1}, most); !ok) return ok;
  if (const status ok = check_text(argument::name, asked.name); !ok) return ok;
  if (const status ok = in_range(argument::type, asked.type.size(), std::size_t{0}, most); !ok) return ok;
  if (const status ok = check_text(argument::type, asked.type); !ok) return ok;
  if (asked.kind == pair_kind::listen) return check_throttle(asked);
  // A responder's `out` is derived from its `in`; a caller's queues are equally deep.
  const std::uint32_t depth = asked.in_depth != 0 || responds(asked.kind) || subscribes(asked.kind)
                                  ? asked.in_depth
                                  : asked.out_depth;
  if (const status ok = in_range(argument::depth, depth, 1U, depth_max); !ok) return ok;
  if (subscribes(asked.kind)) {
    const status lease = check_lease(asked);
    return lease ? check_throttle(asked) : lease;
  }
  return publishes(asked.kind) ? check_topic(asked, options) : check_service(asked, options);
}

} // namespace rowe::detail
