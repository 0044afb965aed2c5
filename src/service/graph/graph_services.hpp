// SPDX-License-Identifier: Apache-2.0
// What ROS's clients ask their server about nodes: who publishes, subscribes and provides what, and what has
// which type. A node is this endpoint, by its name, or a peer, by its address. A peer whose role does not see
// everything learns of other peers only who publishes, subscribes or provides what it may see or call.
// Service thread only; nothing waits or allocates.
#pragma once
#include <string_view>

#include "service/reports/statistics_report.hpp"
#include "service/state/advertisement_table.hpp"
#include "service/state/core_state.hpp"
#include "service/state/service_directory.hpp"
#include "service/threads/stop_rules.hpp"
#include "service/topics/listed_topics.hpp"
#include "service/topics/own_types.hpp"
#include "wire/codec/request.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

struct graph_services_needs {
  core_state& state_;
  const advertisement_table& advertisement_table_;
  const service_directory& service_directory_;
  const stop_rules& stop_rules_;
  statistics_report& statistics_report_;
};

class graph_services : graph_services_needs {
 public:
  explicit graph_services(const graph_services_needs& parts) noexcept : graph_services_needs{parts} {}

  listed_topics listed() const noexcept { return {state_.topics, stop_rules_}; }

  // ---- services: those of the directory, then the endpoint's own. `c` as below

  struct listed_service {
    std::string_view name{}; // empty: there is none, or the peer may not call it
    std::string_view type{};
    bool own = false; // of this process
    const connection* provider = nullptr;
  };
  std::uint32_t services_max() const noexcept;
  listed_service service(const connection* c, std::uint32_t number) const noexcept;
  listed_service find(const connection* c, std::string_view service) const noexcept;

  // Writes the members of the answer. `c`: a peer with a role; null: whoever asks sees everything.
  void write(json::writer& into, std::string_view service, const wire::call_args& what,
             const connection* c) const noexcept;

 private:
  // A peer, or this endpoint.
  struct node {
    const connection* peer = nullptr;
    bool known = false;
  };

  bool sees(const connection* c, topic_id topic) const noexcept;
  listed_service given(const connection* c, service_index service) const noexcept;
  listed_service own(const connection* c, const own_service_type& service) const noexcept;
  bool sees_node(const connection* c, const connection& peer) const noexcept;
  node find_node(const connection* c, std::string_view name) const noexcept;
  bool is_published(const node& by, topic_id topic) const noexcept;
  bool is_subscribed(const node& by, topic_id topic) const noexcept;

  template <class Shown>
  void write_topics(json::writer& into, std::string_view key, const connection* c,
                    const Shown& shown) const noexcept;
  template <class Shown>
  void write_services(json::writer& into, std::string_view key, const connection* c,
                      const Shown& shown) const noexcept;
  template <class Shown>
  void write_nodes(json::writer& into, std::string_view key, const Shown& shown) const noexcept;
  void write_details(json::writer& into, const connection* c, std::string_view name) const noexcept;
  void write_interfaces(json::writer& into, const connection* c) const noexcept;
  void write_version(json::writer& into) const noexcept;
  void write_raw_types(json::writer& into, const connection* c) const noexcept;
  void write_time(json::writer& into) const noexcept;
};

} // namespace rowe::service
