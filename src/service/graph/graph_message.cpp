// SPDX-License-Identifier: Apache-2.0
#include "service/graph/graph_message.hpp"

#include <algorithm>
#include <span>

#include "service/base/names.hpp"
#include "service/graph/topic_holders.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

using wire::graph_list;

graph_message::graph_message(rt::arena& memory, const graph_message_needs& parts) noexcept
    : graph_message_needs{parts},
      marked_{memory.carve<std::uint64_t>(peer_set::words_for(state_.bounds().connections_max))} {}

// Calls `take(name)` with each: this endpoint first, then peers.
template <class Take>
void graph_message::for_each_holder(std::uint32_t of, graph_list which, const Take& take) const noexcept {
  const auto take_peer = [&](peer_index peer) {
    if (state_.peers[peer].open()) take(state_.peers[peer].peer());
  };
  if (graph_record_.is_own_service(of)) return take(endpoint_name_);
  if (which == graph_list::advertised_services) {
    const service_entry& one = service_directory_.at(graph_record_.service_of(of));
    if (one.pair) return take(endpoint_name_);
    if (const connection* const c = state_.peers.find(one.peer)) take_peer({c->id.index});
    return;
  }
  const topic_id topic{of};
  const topic_holders here{state_, stop_rules_};
  if (which == graph_list::published_topics) {
    if (here.published_here(topic)) take(endpoint_name_);
    return advertisement_table_.publishers_of(topic).for_each(take_peer);
  }
  if (here.subscribed_here(topic)) take(endpoint_name_);
  marked_.clear();
  for (subscription_id i = state_.topics.at(topic).subscriptions.head; i;
       i = state_.subscriptions.at(i).next_on_topic)
    marked_.add(state_.subscriptions.at(i).peer); // once, by whichever spelling
  marked_.for_each(take_peer);
}

// The same for as many as fit into half a message, so that both lists of a topic fit into one. False: not all
// do.
template <class Take>
bool graph_message::for_each_told(std::uint32_t of, graph_list which, const Take& take) const noexcept {
  std::size_t left = list_bytes_max();
  left -= std::min(left, graph_entry_bytes + bytes_in_json(graph_record_.name(of)));
  bool all = true;
  for_each_holder(of, which, [&](std::string_view holder) {
    const std::size_t bytes = graph_holder_bytes + bytes_in_json(holder);
    all = all && bytes <= left;
    if (!all) return;
    left -= bytes;
    take(holder);
  });
  return all;
}

std::size_t graph_message::measure(std::uint32_t of, graph_list which, bool& says,
                                   graph_work& work) noexcept {
  std::size_t bytes = graph_entry_bytes + bytes_in_json(graph_record_.name(of));
  work.use(marked_.words());
  if (graph_record_.is_topic(of)) {
    work.use(state_.topics.at({of}).subscriptions.count);
    work.use(state_.topics.of_peers({of}) ? 0 : state_.pairs.size());
  }
  if (bytes > list_bytes_max()) {
    state_.counts.add(counter::too_big);
    return 0;
  }
  const bool all = for_each_told(of, which, [&](std::string_view holder) {
    work.use(1);
    says = true;
    bytes += graph_holder_bytes + bytes_in_json(holder);
  });
  if (!all) state_.counts.add(counter::too_big);
  return bytes;
}

bool graph_message::belongs(const graph_part::entry& one, graph_list to) const noexcept {
  switch (to) {
  case graph_list::published_topics: return one.published && graph_record_.is_topic(one.at);
  case graph_list::subscribed_topics: return one.subscribed;
  case graph_list::advertised_services: return one.published && !graph_record_.is_topic(one.at);
  case graph_list::removed_topics: return one.gone && graph_record_.gone().is_topic(one.at);
  case graph_list::removed_services: break;
  }
  return one.gone && !graph_record_.gone().is_topic(one.at);
}

wire::message_kind graph_message::write(json::writer& into, const wire::codec& codec,
                                        const graph_part& what) const noexcept {
  codec.begin_graph(into);
  for (std::size_t i = 0; i < wire::graph_lists; ++i) {
    const auto list = static_cast<graph_list>(i);
    codec.begin_graph_list(into, list);
    for (const graph_part::entry& one : std::span{what.which}.first(what.count)) {
      if (!belongs(one, list)) continue;
      const auto holders = [&](json::writer& out) {
        out.begin_array();
        (void)for_each_told(one.at, list, [&](std::string_view holder) { out.string(holder); });
        out.end_array();
      };
      const std::string_view name = one.gone ? graph_record_.gone().name(one.at) : graph_record_.name(one.at);
      codec.add_to_graph(into, list, name, wire::body{holders});
    }
    codec.end_graph_list(into);
  }
  return codec.end_graph(into);
}

} // namespace rowe::service
