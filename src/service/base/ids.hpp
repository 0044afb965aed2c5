// SPDX-License-Identifier: Apache-2.0
// Numbers that name rows of tables. The tables are taken from one arena when an endpoint is opened and never
// grow, so a row is named by its place. Each table has its own type of number, so the number of a slot cannot
// be mistaken for the number of a topic. `none` says that there is no row.
#pragma once
#include <cassert>
#include <cstdint>
#include <span>
#include <type_traits>

namespace rowe::service {

template <class Tag>
struct id {
  static constexpr std::uint32_t none = UINT32_MAX;

  std::uint32_t value = none;

  constexpr explicit operator bool() const noexcept { return value != none; }
  friend constexpr bool operator==(id, id) noexcept = default;
};

using slot_id = id<struct slot_tag>;                 // of slot_pool
using entry_id = id<struct entry_tag>;               // of the entries of message queues
using topic_id = id<struct topic_tag>;               // of topic_table
using subscription_id = id<struct subscription_tag>; // of subscription_table
using peer_index = id<struct peer_tag>;              // of peer_table
using pair_index = id<struct pair_tag>;              // of the queue pairs of handles
using pair_slot = id<struct pair_slot_tag>;          // of one queue pair
using loop_index = id<struct loop_tag>;              // of the loops of stop_rules
using driven_index = id<struct driven_tag>;          // of the driven topics of command_gate
using call_index = id<struct call_tag>;              // of call_table
using service_index = id<struct service_tag>;        // of service_directory
using block_id = id<struct block_tag>;               // of latch_store
using latch_id = id<struct latch_tag>;               // of latched_values
using id_block_id = id<struct id_block_tag>;         // of stored_ids
using deadline_id = id<struct deadline_tag>;         // that of a subscription, with its number
using parameter_id = id<struct parameter_tag>;       // of parameters
using last_value_id = id<struct last_value_tag>;     // of last_value_store
using chunk_id = id<struct chunk_tag>;               // of chunk_store
using text_id = id<struct text_tag>;                 // of its texts

// A table: rows of type T that only an Id indexes. Does not own them. Safe to copy.
template <class Id, class T>
class rows {
 public:
  // The numbers of all rows, from 0 on, for a loop over them.
  class numbers {
   public:
    struct iterator {
      std::uint32_t at;
      constexpr Id operator*() const noexcept { return {at}; }
      constexpr iterator& operator++() noexcept {
        ++at;
        return *this;
      }
      friend constexpr bool operator==(iterator, iterator) noexcept = default;
    };
    constexpr explicit numbers(std::uint32_t count) noexcept : count_{count} {}
    constexpr iterator begin() const noexcept { return {0}; }
    constexpr iterator end() const noexcept { return {count_}; }

   private:
    std::uint32_t count_;
  };

  constexpr rows() = default;
  constexpr rows(std::span<T> all) noexcept : all_{all} { assert(all.size() < Id::none); }
  // The same rows, read only.
  constexpr operator rows<Id, const T>() const noexcept requires(!std::is_const_v<T>) {
    return {std::span<const T>{all_}};
  }

  constexpr T& operator[](Id which) const noexcept {
    assert(which.value < all_.size());
    return all_[which.value];
  }
  constexpr std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(all_.size()); }
  constexpr bool contains(Id which) const noexcept { return which.value < all_.size(); }
  constexpr numbers ids() const noexcept { return numbers{size()}; }
  constexpr auto begin() const noexcept { return all_.begin(); }
  constexpr auto end() const noexcept { return all_.end(); }

 private:
  std::span<T> all_;
};

} // namespace rowe::service
