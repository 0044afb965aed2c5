// SPDX-License-Identifier: Apache-2.0
#include "service/state/service_directory.hpp"

#include <algorithm>
#include <cassert>

#include "service/base/names.hpp"

namespace rowe::service {
namespace {

// Never 0, which marks a free place.
std::uint64_t hash_of_service(std::string_view name) noexcept { return hash_of(without_slash(name)) | 1U; }

} // namespace

std::size_t service_directory::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<service_entry>(bounds.services_max) +
         rt::arena::bytes_for(std::size_t{bounds.services_max} * 2 * bounds.topic_bytes_max);
}

service_directory::service_directory(rt::arena& memory, const limits& bounds,
                                     std::uint32_t newest_number) noexcept
    : entries_{memory.carve<service_entry>(bounds.services_max)},
      names_{memory.carve<char>(std::size_t{bounds.services_max} * 2 * bounds.topic_bytes_max)},
      name_bytes_max_{bounds.topic_bytes_max},
      numbers_{first_service_number, newest_number} {}

// A handful of services: a walk over their hashes is as quick as a table.
service_index service_directory::find(std::string_view wanted, offer what) const noexcept {
  const std::uint64_t hash = hash_of_service(wanted);
  for (const service_index i : ids()) {
    if (entries_[i].hash == hash && entries_[i].what == what &&
        without_slash(name(i)) == without_slash(wanted))
      return i;
  }
  return {};
}

service_index service_directory::find_number(std::uint32_t number) const noexcept {
  for (const service_index i : ids()) {
    if (in_use(i) && entries_[i].number == number) return i;
  }
  return {};
}

service_directory::added service_directory::add(std::string_view name, std::string_view type, pair_index pair,
                                                connection_id peer, offer what) noexcept {
  assert(name.size() <= name_bytes_max_ && type.size() <= name_bytes_max_);
  if (find(name, what)) return {{}, refusal::taken};
  const auto free =
      std::find_if(entries_.begin(), entries_.end(), [](const service_entry& e) { return e.hash == 0; });
  if (free == entries_.end()) return {{}, refusal::no_room};
  *free = {.hash = hash_of_service(name),
           .pair = pair,
           .peer = peer,
           .what = what,
           .number = numbers_.take([this](std::uint32_t n) { return static_cast<bool>(find_number(n)); }),
           .name_bytes = static_cast<std::uint16_t>(name.size()),
           .type_bytes = static_cast<std::uint16_t>(type.size())};
  const service_index index{static_cast<std::uint32_t>(free - entries_.begin())};
  std::copy(name.begin(), name.end(), names(index));
  std::copy(type.begin(), type.end(), names(index) + name_bytes_max_);
  used_ = std::max(used_, index.value + 1);
  ++count_;
  ++changes_;
  if (!pair) ++of_peers_;
  return {index, refusal::none};
}

void service_directory::remove(service_index index) noexcept {
  assert(in_use(index));
  if (!entries_[index].pair) --of_peers_;
  entries_[index] = {};
  while (used_ != 0 && entries_[service_index{used_ - 1}].hash == 0) --used_;
  --count_;
  ++changes_;
}

} // namespace rowe::service
