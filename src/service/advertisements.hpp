// SPDX-License-Identifier: Apache-2.0
// What peers advertise, and whose type a topic has. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <string_view>

#include "service/advertisement_table.hpp"
#include "service/core_state.hpp"
#include "service/refusals.hpp"
#include "service/subscriptions.hpp"
#include "service/topic_places.hpp"
#include "wire/request.hpp"

namespace rowe::service {

class advertisements {
 public:
  struct needs {
    core_state& state;
    advertisement_table& table;
    refusals& refused;
    topic_places& places;
    subscriptions& readers;
  };
  explicit advertisements(const needs& parts) noexcept
      : state_{parts.state},
        table_{parts.table},
        refusals_{parts.refused},
        places_{parts.places},
        readers_{parts.readers} {}

  // A peer goes, and with it the latched values that it left.
  void forget(peer_index peer) noexcept;

  // Asked by peers; what is refused is said.
  void advertise(connection& c, const wire::request& asked) noexcept;
  void unadvertise(connection& c, const wire::request& asked) noexcept;

  // The type of a handle stands against the one that peers gave the topic before; they are told.
  void replace_type(topic_id topic, std::string_view type) noexcept;
  // Frees the place of a topic that only peers have, of whoever holds most of those, for one of this process;
  // all who hold it are told. False where there is none.
  bool take_back_topic() noexcept;

 private:
  bool withdraw(peer_index peer, topic_id topic) noexcept;

  core_state& state_;
  advertisement_table& table_;
  refusals& refusals_;
  topic_places& places_;
  subscriptions& readers_;
};

} // namespace rowe::service
