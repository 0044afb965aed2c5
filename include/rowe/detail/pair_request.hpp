// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/detail/calls.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/json_text.hpp>
#include <rowe/options.hpp>
#include <rowe/schema.hpp>

namespace rowe::detail {

// What a handle asks of set-up: a queue pair of this kind, with queues of this size. Depths and bytes of
// queues that the kind does not have stay 0.
struct pair_request {
  pair_kind kind = pair_kind::publish_value;
  std::string_view name = {}; // of the topic or service
  std::string_view type = {};
  rowe::keep keep = rowe::keep::all; // of the one queue that a topic's handle has
  rowe::priority priority = rowe::priority::normal;
  bool latched = false;
  bool shared = false;       // topic: peers may publish on it, too
  bool replaces_own = false; // service: of the endpoint
  duration ttl = rt::for_ever;
  duration period = {};
  duration lease = {};                  // subscribe: of commands; 0: they are none
  duration throttle = {};               // subscribe, listen: at a server; 0: there is none
  bool receives = false;                // talk
  duration loop_timeout = rt::for_ever; // stop_latch

  std::uint32_t out_depth = 0; // slots of each queue, 1 to 4096
  std::uint32_t in_depth = 0;
  std::uint32_t completions_depth = 0;
  std::size_t out_bytes = 0; // of the largest value
  std::size_t in_bytes = 0;
  std::size_t completions_bytes = 0;

  const schema_description* encoded = nullptr; // of the values that go out
  const schema_description* decoded = nullptr; // of those that come in
  bool fill_missing = false;                   // where they leave out members

  service::record_sink* sink = nullptr; // record
};

// Opens queue pairs for types that only run time knows (src/capi).
struct pair_opener;

// The bytes of a slot for a T, or for text of at most so many bytes.
template <class T>
constexpr std::size_t slot_bytes(std::uint32_t text_bytes_max) noexcept {
  if constexpr (is_text<T>) {
    return text_bytes_max;
  } else {
    return sizeof(T);
  }
}
// The same, but a refusal's diagnostic must fit too.
template <class T>
constexpr std::size_t answer_bytes(std::uint32_t text_bytes_max) noexcept {
  const auto bytes = slot_bytes<T>(text_bytes_max);
  return bytes > diagnostic_bytes_max ? bytes : diagnostic_bytes_max;
}

// If the options do not say it, a queue has as many slots as fill so many bytes, but not fewer than a burst
// needs, nor more than are useful.
struct usual_depth {
  std::size_t bytes;
  std::uint32_t least;
  std::uint32_t most;

  constexpr std::uint32_t or_asked(std::uint32_t asked, std::size_t value_bytes) const noexcept {
    if (asked != 0) return asked;
    if (value_bytes * most <= bytes) return most;
    const auto fit = static_cast<std::uint32_t>(bytes / value_bytes);
    return fit < least ? least : fit;
  }
};
inline constexpr usual_depth of_topics{64 * 1024, 4, 64};
inline constexpr usual_depth of_services{32 * 1024, 8, 16};

template <class T>
constexpr const schema_description* description_of() noexcept {
  if constexpr (is_text<T>) {
    return nullptr;
  } else {
    return &describe<T>();
  }
}

// `type`: of the values; null: text. `bytes`: of a slot.
constexpr pair_request topic_request(std::string_view topic, const topic_options& options,
                                     const schema_description* type) noexcept {
  pair_request asked{.name = topic,
                     .type = options.type,
                     .keep = options.keep,
                     .priority = options.priority,
                     .latched = options.latched,
                     .shared = options.shared,
                     .ttl = options.ttl};
  if (type != nullptr && asked.type.empty()) asked.type = type->type_name;
  return asked;
}

constexpr pair_request advertise_request(std::string_view topic, const topic_options& options,
                                         const schema_description* type, std::size_t bytes) noexcept {
  pair_request asked = topic_request(topic, options, type);
  asked.kind = type == nullptr ? pair_kind::publish_text : pair_kind::publish_value;
  asked.out_bytes = bytes;
  asked.out_depth = of_topics.or_asked(options.depth, bytes);
  asked.encoded = type;
  asked.period = options.period;
  return asked;
}

constexpr pair_request subscribe_request(std::string_view topic, const topic_options& options,
                                         const schema_description* type, std::size_t bytes) noexcept {
  pair_request asked = topic_request(topic, options, type);
  asked.kind = type == nullptr ? pair_kind::subscribe_text : pair_kind::subscribe_value;
  // A view of the newest text would change while it is read.
  if (type == nullptr) asked.keep = keep::all;
  asked.lease = options.lease;
  asked.throttle = options.throttle;
  if (asked.lease != duration{} && type != nullptr) asked.keep = keep::newest;
  asked.in_bytes = bytes;
  asked.in_depth = of_topics.or_asked(options.depth, bytes);
  asked.decoded = type;
  asked.fill_missing = options.fill_missing.value_or(is_ros_type(asked.type));
  return asked;
}

template <class T>
constexpr pair_request advertise_request(std::string_view topic, const topic_options& options) noexcept {
  return advertise_request(topic, options, description_of<T>(), slot_bytes<T>(options.text_bytes_max));
}
template <class T>
constexpr pair_request subscribe_request(std::string_view topic, const topic_options& options) noexcept {
  return subscribe_request(topic, options, description_of<T>(), slot_bytes<T>(options.text_bytes_max));
}

template <class Q, class A>
constexpr std::uint32_t service_depth(const service_options& options) noexcept {
  const auto request = slot_bytes<Q>(options.text_bytes_max);
  const auto answer = answer_bytes<A>(options.text_bytes_max);
  return of_services.or_asked(options.depth, request > answer ? request : answer);
}

template <class Q, class A>
constexpr pair_request serve_request(std::string_view name, const service_options& options) noexcept {
  const std::uint32_t depth = service_depth<Q, A>(options);
  return {.kind = is_text<Q> ? pair_kind::respond_text : pair_kind::respond_value,
          .name = name,
          .type = options.type,
          .replaces_own = options.replaces_own,
          .out_depth = 2 * depth, // on their way, and reserved
          .in_depth = depth,
          .out_bytes = answer_bytes<A>(options.text_bytes_max),
          .in_bytes = slot_bytes<Q>(options.text_bytes_max),
          .encoded = description_of<A>(),
          .decoded = description_of<Q>()};
}

template <class Q, class A>
constexpr pair_request client_request(std::string_view name, const service_options& options) noexcept {
  const std::uint32_t depth = service_depth<Q, A>(options);
  return {.kind = is_text<Q> ? pair_kind::call_text : pair_kind::call_value,
          .name = name,
          .type = options.type,
          .out_depth = depth,
          .completions_depth = depth,
          .out_bytes = slot_bytes<Q>(options.text_bytes_max),
          .completions_bytes = answer_bytes<A>(options.text_bytes_max),
          .encoded = description_of<Q>(),
          .decoded = description_of<A>()};
}

constexpr pair_request latch_request(const latch_options& options) noexcept {
  const bool left_open = options.loop_timeout == duration::zero();
  return {.kind = pair_kind::stop_latch,
          .name = options.name,
          .loop_timeout = left_open ? loop_timeout_default(false) : options.loop_timeout};
}

constexpr pair_request record_request(service::record_sink& sink) noexcept {
  return {.kind = pair_kind::record, .sink = &sink};
}
constexpr pair_request listen_request(std::string_view topic, std::string_view type,
                                      const schema_description* schema, duration throttle) noexcept {
  return {.kind = pair_kind::listen, .name = topic, .type = type, .throttle = throttle, .decoded = schema};
}

constexpr pair_request talk_request(const lane_options& options) noexcept {
  const std::size_t bytes = answer_bytes<json_text>(options.text_bytes_max);
  return {.kind = pair_kind::talk,
          .priority = options.priority,
          .receives = options.receive,
          .out_depth = options.depth,
          .in_depth = options.inbox_depth,
          .completions_depth = options.calls,
          .out_bytes = bytes,
          .in_bytes = bytes,
          .completions_bytes = bytes};
}

} // namespace rowe::detail
