// SPDX-License-Identifier: Apache-2.0
// Topics of structs in C: the handles of C++, whose queue pairs are asked for by a description in place of a
// type.
#include <cstring>
#include <string>
#include <utility>

#include <rowe/struct.h>

#include "capi/handle_options.hpp"
#include "capi/handles.hpp"

using namespace rowe::capi;
using rowe::errc;

namespace {

template <class Handle, class Request>
Handle* opened_for(const rowe_endpoint* on, const char* topic, const rowe_struct* type,
                   const rowe_topic_options* options, Request&& request_of) noexcept {
  if (on == nullptr || topic == nullptr || type == nullptr) return no(errc::misuse);
  return pointer_with_memory([&]() -> Handle* {
    std::string why;
    const auto described = on->structs->describe(*type, why);
    if (!described) return no(described.error(), why);
    const rowe::schema_description& its = **described;
    return opened<Handle>(on, options,
                          [&](rowe::endpoint& by, const rowe::topic_options& o) -> rowe::result<Handle> {
                            auto pair = rowe::detail::pair_opener::open(by, request_of(topic, o, its));
                            if (!pair) return pair.error();
                            return Handle{decltype(Handle::inside){std::move(*pair)}, its.bytes};
                          });
  });
}

using taken_struct = rowe::subscriber<raw_struct>::view;

int give(const rowe::result<taken_struct>& taken, std::size_t bytes, void* into,
         rowe_arrival* arrival) noexcept {
  if (!taken) return number_of(taken.code());
  std::memcpy(into, &taken->value(), bytes);
  if (arrival != nullptr) {
    const rowe::connection from = taken->from();
    *arrival = {rowe::rt::nanoseconds_of(taken->arrived()), {from.index, from.generation}};
  }
  return rowe_ok;
}

} // namespace

struct rowe_struct_publisher* rowe_struct_publisher_open(const struct rowe_endpoint* endpoint,
                                                         const char* topic, const struct rowe_struct* type,
                                                         const struct rowe_topic_options* options) {
  const auto request_of = [](const char* name, const rowe::topic_options& asked,
                             const rowe::schema_description& its) {
    return rowe::detail::advertise_request(name, asked, &its, its.bytes);
  };
  return opened_for<rowe_struct_publisher>(endpoint, topic, type, options, request_of);
}
void rowe_struct_publisher_free(struct rowe_struct_publisher* publisher) { delete publisher; }

int rowe_struct_publisher_publish(struct rowe_struct_publisher* publisher, const void* value,
                                  int64_t now_ns) {
  if (publisher == nullptr || value == nullptr) return rowe_error_misuse;
  return number_of(publisher->inside.publish({value, publisher->bytes}, time_of(now_ns)));
}

bool rowe_struct_publisher_wanted(const struct rowe_struct_publisher* publisher) {
  return publisher != nullptr && publisher->inside.wanted();
}

struct rowe_struct_subscriber* rowe_struct_subscriber_open(const struct rowe_endpoint* endpoint,
                                                           const char* topic, const struct rowe_struct* type,
                                                           const struct rowe_topic_options* options) {
  const auto request_of = [](const char* name, const rowe::topic_options& asked,
                             const rowe::schema_description& its) {
    return rowe::detail::subscribe_request(name, asked, &its, its.bytes);
  };
  return opened_for<rowe_struct_subscriber>(endpoint, topic, type, options, request_of);
}
void rowe_struct_subscriber_free(struct rowe_struct_subscriber* subscriber) { delete subscriber; }

int rowe_struct_subscriber_try_take(struct rowe_struct_subscriber* subscriber, void* into,
                                    struct rowe_arrival* arrival) {
  if (subscriber == nullptr || into == nullptr) return rowe_error_misuse;
  return give(subscriber->inside.try_take(), subscriber->bytes, into, arrival);
}

int rowe_struct_subscriber_latest(struct rowe_struct_subscriber* subscriber, void* into,
                                  struct rowe_arrival* arrival) {
  if (subscriber == nullptr || into == nullptr) return rowe_error_misuse;
  return give(subscriber->inside.latest(), subscriber->bytes, into, arrival);
}

int rowe_struct_subscriber_latest_within(struct rowe_struct_subscriber* subscriber, int64_t now_ns,
                                         void* into, struct rowe_arrival* arrival) {
  if (subscriber == nullptr || into == nullptr) return rowe_error_misuse;
  return give(subscriber->inside.latest_within(time_of(now_ns)), subscriber->bytes, into, arrival);
}

int rowe_struct_subscriber_take(struct rowe_struct_subscriber* subscriber, long timeout_ms, void* into,
                                struct rowe_arrival* arrival) {
  if (subscriber == nullptr || into == nullptr) return rowe_error_misuse;
  return give(subscriber->inside.take(duration_of(timeout_ms)), subscriber->bytes, into, arrival);
}
