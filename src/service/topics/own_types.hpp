// SPDX-License-Identifier: Apache-2.0
// The types of the endpoint's own topics and services, as schemas describe those of handles. Services that
// ROS has are called as there. What depends on how the endpoint is set up, such as the values of parameters,
// is an object of which nothing is described: it has no members. A member that is null, as the cause of a
// stop while there is none, is an optional within an optional: it may be missing, or be null.
// Constants; any thread.
#pragma once
#include <cstddef>
#include <span>
#include <string_view>

#include <rowe/schema.hpp>

#include "service/base/names.hpp"
#include "service/state/topic_table.hpp"

namespace rowe::service {

struct own_topic_type {
  std::string_view name; // of the topic
  std::string_view type;
  const schema_description* message = nullptr;
};

struct own_service_type {
  std::string_view name; // of the service
  std::string_view type;
  bool of_stop = false; // it is there only where there is a stop
  const schema_description* request = nullptr;
  const schema_description* answer = nullptr;
  const schema_description* listed = nullptr; // in lists for peers: `answer`, or less where that is long
};

std::span<const own_topic_type> own_topic_types() noexcept;
// Where services are numbered, the position of one of the first is its number, from 1 on.
inline constexpr std::size_t numbered_own_services = 10;
std::span<const own_service_type> own_service_types() noexcept;

// By either spelling of the name; null: it is none of them.
const own_topic_type* own_type_of_topic(std::string_view name) noexcept;
const own_service_type* own_type_of_service(std::string_view name) noexcept;

// Whether no peer may provide anything of this name, be it a service, an action or a topic, because the
// endpoint answers it, or may one day.
inline bool is_own_service(std::string_view name) noexcept {
  return is_own_name(name) || (is_of_rosapi(name) && own_type_of_service(name) != nullptr);
}

// Gives a topic of the endpoint, which exists, its type and its schema.
void describe_own(topic_table& topics, topic_id topic) noexcept;

} // namespace rowe::service
