// SPDX-License-Identifier: Apache-2.0
#include "service/services.hpp"

#include <algorithm>
#include <cassert>

#include "service/names.hpp"

namespace rowe::service {
namespace {

// Never 0, which marks a free place.
std::uint64_t hash_of_service(std::string_view name) noexcept { return hash_of(without_slash(name)) | 1U; }

} // namespace

std::size_t services::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<service_entry>(bounds.services_max) +
         rt::arena::bytes_for(std::size_t{bounds.services_max} * 2 * bounds.topic_bytes_max);
}

services::services(rt::arena& memory, const limits& bounds) noexcept
    : entries_{memory.carve<service_entry>(bounds.services_max)},
      names_{memory.carve<char>(std::size_t{bounds.services_max} * 2 * bounds.topic_bytes_max)},
      name_bytes_max_{bounds.topic_bytes_max} {}

// A handful of services: a walk over their hashes is as quick as a table.
std::uint32_t services::find(std::string_view wanted) const noexcept {
  const std::uint64_t hash = hash_of_service(wanted);
  for (std::uint32_t i = 0; i < places(); ++i) {
    if (entries_[i].hash == hash && without_slash(name(i)) == without_slash(wanted)) return i;
  }
  return no_index;
}

services::added services::add(std::string_view name, std::string_view type, std::uint32_t lane,
                              connection_id peer) noexcept {
  assert(name.size() <= name_bytes_max_ && type.size() <= name_bytes_max_);
  if (find(name) != no_index) return {no_index, refusal::taken};
  const auto free =
      std::find_if(entries_.begin(), entries_.end(), [](const service_entry& e) { return e.hash == 0; });
  if (free == entries_.end()) return {no_index, refusal::no_room};
  *free = {.hash = hash_of_service(name),
           .lane = lane,
           .peer = peer,
           .name_bytes = static_cast<std::uint16_t>(name.size()),
           .type_bytes = static_cast<std::uint16_t>(type.size())};
  const auto index = static_cast<std::uint32_t>(free - entries_.begin());
  std::copy(name.begin(), name.end(), names(index));
  std::copy(type.begin(), type.end(), names(index) + name_bytes_max_);
  ++count_;
  if (lane == no_index) ++of_peers_;
  return {index, refusal::none};
}

void services::remove(std::uint32_t index) noexcept {
  assert(in_use(index));
  if (entries_[index].lane == no_index) --of_peers_;
  entries_[index] = {};
  --count_;
}

} // namespace rowe::service
