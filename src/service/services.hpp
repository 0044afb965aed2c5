// SPDX-License-Identifier: Apache-2.0
// Who provides which service: a responder of this process or a peer that advertised it. A name has one
// provider; whoever comes second is refused. "add" and "/add" name the same service, because ROS writes the
// slash and its clients now and then forget it. Service thread only.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/transport.hpp"
#include "service/wire_slots.hpp"
#include "wire/request.hpp"

namespace rowe::service {

struct service_entry {
  std::uint64_t hash = 0; // 0: free
  std::uint32_t lane = no_index;
  connection_id peer{};    // where lane is no_index,
  wire::codec_id speaks{}; // and how it is asked
  std::uint16_t name_bytes = 0;
  std::uint16_t type_bytes = 0;
};

class services {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  services(rt::arena& memory, const limits& bounds) noexcept;

  // no_index when nobody provides it.
  std::uint32_t find(std::string_view name) const noexcept;

  enum class refusal : std::uint8_t { none, taken, no_room };
  struct added {
    std::uint32_t index = no_index;
    refusal why = refusal::none;
  };
  // `taken` is also the answer when the same provider offers it again. Names and types are as long as topics
  // may be at most.
  added add(std::string_view name, std::string_view type, std::uint32_t lane, connection_id peer) noexcept;
  void remove(std::uint32_t index) noexcept;

  service_entry& at(std::uint32_t index) noexcept { return entries_[index]; }
  const service_entry& at(std::uint32_t index) const noexcept { return entries_[index]; }
  std::string_view name(std::uint32_t index) const noexcept {
    return {names(index), entries_[index].name_bytes};
  }
  std::string_view type(std::uint32_t index) const noexcept {
    return {names(index) + name_bytes_max_, entries_[index].type_bytes};
  }
  // Places, for walking: those in use have a hash.
  std::uint32_t places() const noexcept { return static_cast<std::uint32_t>(entries_.size()); }
  bool in_use(std::uint32_t index) const noexcept { return entries_[index].hash != 0; }
  std::uint32_t count() const noexcept { return count_; }
  std::uint32_t of_peers() const noexcept { return of_peers_; }

 private:
  char* names(std::uint32_t index) const noexcept { return names_.data() + index * 2 * name_bytes_max_; }

  std::span<service_entry> entries_;
  std::span<char> names_;
  std::size_t name_bytes_max_;
  std::uint32_t count_ = 0;
  std::uint32_t of_peers_ = 0;
};

} // namespace rowe::service
