// SPDX-License-Identifier: Apache-2.0
// What peers advertise, and whose type a topic has. Service thread only; nothing waits or allocates.
#pragma once
#include <string_view>

#include "service/incoming/refusals.hpp"
#include "service/state/advertisement_table.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/subscriptions.hpp"
#include "service/topics/topic_places.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct advertisements_needs {
  core_state& state_;
  advertisement_table& advertisement_table_;
  refusals& refusals_;
  topic_places& topic_places_;
  subscriptions& subscriptions_;
};

class advertisements : advertisements_needs {
 public:
  explicit advertisements(const advertisements_needs& parts) noexcept : advertisements_needs{parts} {}

  // A peer has left. Its latched values go with it.
  void forget(peer_index peer) noexcept;

  // Requests of peers. A refusal says why.
  bool advertise(connection& c, const wire::request& asked) noexcept; // false: refused
  void unadvertise(connection& c, const wire::request& asked) noexcept;
  // For a message that says of its topic what an advertisement does. A peer that may publish there and not
  // advertise does only the first. False: refused.
  bool advertise_published(connection& c, const wire::request& asked) noexcept;

  // The type of a handle replaces the type that peers gave the topic before. The peers get a report.
  void replace_type(topic_id topic, std::string_view type) noexcept;
  // From now on the topic belongs to a publisher of this process, which does not share it. Peers that may not
  // publish there any more do not advertise it any more, and get a report.
  void withdraw_others(topic_id topic) noexcept;
  // Frees a place for a topic of this process. Among the topics that only peers hold, the peer that holds
  // most loses one, and all holders of that topic get a report. False if there is no such topic.
  bool take_back_topic() noexcept;

  // No peer advertises a topic that a publisher of this process does not share, unless its role spells it.
  bool check() const noexcept;

 private:
  bool refuse(connection& c, const wire::request& asked, std::string_view why,
              std::string_view value = {}) noexcept;
  bool withdraw(peer_index peer, topic_id topic) noexcept;
};

} // namespace rowe::service
