// SPDX-License-Identifier: Apache-2.0
// Endpoints: where we are reachable, or whom we try to reach. Endpoints are for set-up, handles are for
// loops.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <rowe/detail/lane.hpp>
#include <rowe/event.hpp>
#include <rowe/json_text.hpp>
#include <rowe/options.hpp>
#include <rowe/publisher.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/thread.hpp>
#include <rowe/schema.hpp>
#include <rowe/subscriber.hpp>

namespace rowe {

// One counter of an endpoint, by the name under which /rowe/stats has it too.
struct count {
  std::string_view name;
  std::string_view group;   // "loss", "chosen", "flow", "refusal", "own"
  std::string_view meaning; // a phrase
  std::uint64_t value = 0;
};

// Owns a service thread, its sockets and its memory. All calls: any thread, one at a time; they may wait,
// allocate and enter the kernel, so they are for set-up and for ordinary threads. Handles outlive their
// endpoint safely.
class endpoint {
 public:
  // Listens on `port` (0: any free one) and serves the page, rosbridge and WebSockets there. Errors:
  // address_in_use, bad_address, not_loopback, no_memory, no_thread, bad_argument (an option out of its
  // range).
  static result<endpoint> listen(std::uint16_t port, const endpoint_options& options = {});

  // Connects to `url`, "ws://HOST[:PORT][/PATH]", and again whenever the connection is lost, until closed.
  // Returns at once; wait_peer() waits for the connection. Errors: bad_url, no_memory, no_thread,
  // bad_argument.
  static result<endpoint> connect(std::string_view url, const endpoint_options& options = {});

  endpoint(endpoint&&) noexcept;
  endpoint& operator=(endpoint&&) noexcept;
  ~endpoint(); // close(0)

  // A publisher of T on `topic`, which peers see as `options.type`, else the schema's type. Errors:
  // bad_argument (a name that is empty or too long, or begins with /rowe/; a depth or ttl out of range),
  // too_many_lanes, lane_memory, too_many_topics, type_conflict, closed.
  template <class T>
  result<publisher<T>> advertise(std::string_view topic, const topic_options& options = {});

  // A subscriber to `topic`: what peers publish, and what this process publishes on the same endpoint. Of T,
  // only json_text so far. Errors as advertise().
  template <class T>
  result<subscriber<T>> subscribe(std::string_view topic, const topic_options& options = {});

  // Waits until at least one peer is connected, at most `patience` (negative: for ever). Errors: timed_out.
  status wait_peer(duration patience);
  std::uint32_t peers() const noexcept;

  // The port listened on; 0 for an endpoint that connects.
  std::uint16_t port() const noexcept;

  // What has happened and was not asked for yet, oldest first.
  std::optional<event> try_event() noexcept;

  // All counters since the endpoint was opened.
  std::vector<count> counts() const;

  // What the service thread was granted (core, priority, timer slack), and whether the endpoint's memory is
  // locked.
  const rt::grants& service_grants() const noexcept;
  bool memory_locked() const noexcept;

  // Waits up to `drain` until everything published so far is written, says goodbye to the peers, and stops
  // the service thread. Handles say errc::closed from then on. Errors: timed_out (something was not written
  // in time; it is closed all the same).
  status close(duration drain = duration::zero());

 private:
  explicit endpoint(std::shared_ptr<detail::endpoint_state> state) noexcept;
  result<detail::lane_handle> open_lane(detail::lane_kind kind, std::string_view topic,
                                        const topic_options& options, std::string_view type,
                                        std::size_t value_bytes, const schema_description* schema);

  std::shared_ptr<detail::endpoint_state> state_;
};

template <class T>
result<publisher<T>> endpoint::advertise(std::string_view topic, const topic_options& options) {
  auto lane = [&] {
    if constexpr (std::is_same_v<T, json_text>) {
      return open_lane(detail::lane_kind::publish_text, topic, options, {}, options.text_bytes_max, nullptr);
    } else {
      return open_lane(detail::lane_kind::publish_value, topic, options, schema<T>.type_name, sizeof(T),
                       &describe<T>());
    }
  }();
  if (!lane) return lane.error();
  return publisher<T>{std::move(*lane)};
}

template <class T>
result<subscriber<T>> endpoint::subscribe(std::string_view topic, const topic_options& options) {
  static_assert(std::is_same_v<T, json_text>, "only subscribers of json_text exist so far");
  auto lane =
      open_lane(detail::lane_kind::subscribe_text, topic, options, {}, options.text_bytes_max, nullptr);
  if (!lane) return lane.error();
  return subscriber<T>{std::move(*lane)};
}

} // namespace rowe
