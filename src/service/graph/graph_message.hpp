// SPDX-License-Identifier: Apache-2.0
// The messages of connection_graph: who holds what a message announces, how long it is, and its text. Service
// thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/service_limits.hpp"
#include "service/graph/graph_record.hpp"
#include "service/state/advertisement_table.hpp"
#include "service/state/core_state.hpp"
#include "service/state/peer_set.hpp"
#include "service/state/service_directory.hpp"
#include "service/threads/stop_rules.hpp"
#include "wire/codec/codec.hpp"

namespace rowe::service {

// What one message announces.
struct graph_part {
  // A row of the record, or the place of a name that is gone.
  struct entry {
    std::uint32_t at = 0;
    bool gone = false;
    bool published = false; // of a row: whether this is announced, and this
    bool subscribed = false;
  };
  std::uint32_t to = 0; // the first row, and the first place, for a later message
  std::uint32_t to_gone = 0;
  std::size_t count = 0;
  std::size_t bytes = graph_envelope_bytes;
  std::size_t bytes_max = 0; // one that is longer is alone
  std::array<entry, listed_max> which{};

  // False: it is full.
  bool add(const entry& one, std::size_t more) noexcept {
    if (count == which.size() || (count != 0 && bytes + more > bytes_max)) return false;
    bytes += more;
    which[count++] = one;
    return true;
  }
};

struct graph_message_needs {
  core_state& state_;
  const advertisement_table& advertisement_table_;
  const service_directory& service_directory_;
  const stop_rules& stop_rules_;
  const graph_record& graph_record_;
  const std::string_view endpoint_name_; // outlives this
};

class graph_message : graph_message_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<std::uint64_t>(peer_set::words_for(bounds.connections_max));
  }
  graph_message(rt::arena& memory, const graph_message_needs& parts) noexcept;

  // The bytes of one list of a row's holders; 0, counted: not even the name fits. `says`: is set if there is
  // a holder.
  std::size_t measure(std::uint32_t of, wire::graph_list which, bool& says, graph_work& work) noexcept;
  wire::message_kind write(json::writer& into, const wire::codec& codec,
                           const graph_part& what) const noexcept;

 private:
  std::size_t list_bytes_max() const noexcept {
    return (state_.bounds().message_bytes_max - graph_envelope_bytes) / 2;
  }
  bool belongs(const graph_part::entry& one, wire::graph_list to) const noexcept;
  template <class Take>
  bool for_each_told(std::uint32_t of, wire::graph_list which, const Take& take) const noexcept;
  template <class Take>
  void for_each_holder(std::uint32_t of, wire::graph_list which, const Take& take) const noexcept;

  const peer_set marked_; // scratch
};

} // namespace rowe::service
