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

#include "service/base/listed_numbers.hpp"
#include "service/base/service_limits.hpp"
#include "service/base/transport.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

// Actions are listed beside services, and their names are other names.
enum class offer : std::uint8_t { service, action };

struct service_entry {
  std::uint64_t hash = 0; // 0: free
  pair_index pair{};
  connection_id peer{};    // where there is no pair,
  wire::codec_id speaks{}; // and how it is asked
  offer what = offer::service;
  std::uint32_t number = 0; // that no other one gets, for codecs that have those
  std::uint16_t name_bytes = 0;
  std::uint16_t type_bytes = 0;
};

class service_directory {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  // `newest_number`: services get those that follow.
  service_directory(rt::arena& memory, const limits& bounds,
                    std::uint32_t newest_number = first_service_number - 1) noexcept;

  // none: nobody provides it.
  service_index find(std::string_view name, offer what = offer::service) const noexcept;

  enum class refusal : std::uint8_t { none, taken, no_room };
  struct added {
    service_index index{};
    refusal why = refusal::none;
  };
  // `taken` is also the answer if the same provider offers it again. Names and types have at most
  // topic_bytes_max bytes.
  added add(std::string_view name, std::string_view type, pair_index pair, connection_id peer,
            offer what = offer::service) noexcept;
  void remove(service_index index) noexcept;

  service_entry& at(service_index index) noexcept { return entries_[index]; }
  const service_entry& at(service_index index) const noexcept { return entries_[index]; }
  std::string_view name(service_index index) const noexcept {
    return {names(index), entries_[index].name_bytes};
  }
  std::string_view type(service_index index) const noexcept {
    return {names(index) + name_bytes_max_, entries_[index].type_bytes};
  }
  service_index find_number(std::uint32_t number) const noexcept; // or none
  std::uint32_t newest_number() const noexcept { return numbers_.newest(); }
  // How often one was added or removed.
  std::uint64_t changes() const noexcept { return changes_; }
  // All places up to the last that is in use, for a walk; those in use have a hash.
  auto ids() const noexcept { return rows<service_index, service_entry>::numbers{used_}; }
  bool in_use(service_index index) const noexcept { return entries_[index].hash != 0; }
  bool is_service(service_index index) const noexcept {
    return in_use(index) && entries_[index].what == offer::service;
  }
  std::uint32_t count() const noexcept { return count_; }
  std::uint32_t of_peers() const noexcept { return of_peers_; }

 private:
  char* names(service_index index) const noexcept {
    return names_.data() + std::size_t{index.value} * 2 * name_bytes_max_;
  }

  rows<service_index, service_entry> entries_;
  std::span<char> names_;
  std::size_t name_bytes_max_;
  std::uint32_t used_ = 0; // one behind the last
  std::uint32_t count_ = 0;
  std::uint32_t of_peers_ = 0;
  listed_numbers numbers_;
  std::uint64_t changes_ = 0;
};

} // namespace rowe::service
