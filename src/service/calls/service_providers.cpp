// SPDX-License-Identifier: Apache-2.0
#include "service/calls/service_providers.hpp"

#include <rowe/detail/mutation_points.hpp>

#include "service/base/service_limits.hpp"
#include "service/topics/own_types.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {
namespace {

bool of_action(const wire::request& asked) noexcept {
  return asked.what == wire::verb::advertise_action || asked.what == wire::verb::unadvertise_action;
}
offer kind_of(const wire::request& asked) noexcept {
  return of_action(asked) ? offer::action : offer::service;
}

} // namespace

service_providers::service_providers(rt::arena& memory, const service_providers_needs& parts) noexcept
    : service_providers_needs{parts},
      provided_{memory.carve<std::uint32_t>(state_.bounds().connections_max)},
      claims_{services_of_peers(state_.bounds()), state_.claimants()} {}

void service_providers::advertise(connection& c, const wire::request& asked) noexcept {
  if (is_own_service(asked.service) && !ROWE_MUTANT(own_service)) {
    wire::text_of<detail::diagnostic_bytes_max> why;
    why.add(asked.verb_text).add(": ").add_name(asked.service, name_bytes_shown);
    return refusals_.refuse(c, asked.id_raw, why.add(" is the endpoint's own").text());
  }
  if (const service_index found = service_directory_.find(asked.service, kind_of(asked))) {
    if (provides(c.id, found)) return; // clients that reconnect say it again
    wire::text_of<detail::diagnostic_bytes_max> why;
    why.add(asked.verb_text).add(": ").add_name(asked.service, name_bytes_shown).add(" is provided already");
    return refusals_.refuse(c, asked.id_raw, why.text());
  }
  const std::uint32_t share = services_of_peers(state_.bounds());
  const std::uint32_t left = left_of(share, service_directory_.of_peers());
  std::uint32_t& held = provided_[{c.id.index}];
  const bool may = claims_.may_take(held, left) || ROWE_MUTANT(made_up_services);
  const service_index added =
      may ? service_directory_.add(asked.service, asked.type, {}, c.id, kind_of(asked)).index
          : service_index{};
  if (!added) {
    return refusals_.refuse_share(c, asked,
                                  {.what = "services",
                                   .held = held,
                                   .left = left,
                                   .for_peers = share,
                                   .kept = claims_.kept(),
                                   .option = "services_max"});
  }
  service_directory_.at(added).speaks = asked.codec;
  claims_.take(held);
}

void service_providers::unadvertise(connection& c, const wire::request& asked) noexcept {
  const service_index found = service_directory_.find(asked.service, kind_of(asked));
  if (!found || !provides(c.id, found)) {
    return refusals_.refuse(c, asked.id_raw,
                            of_action(asked) ? "unadvertise_action: this peer does not provide the action"
                                             : "unadvertise_service: this peer does not provide the service");
  }
  remove(found);
}

void service_providers::take_from_peer(service_index service) noexcept {
  wire::text_of<detail::diagnostic_bytes_max> why;
  why.add("advertise_service: this process provides ");
  why.add_name(service_directory_.name(service), name_bytes_shown).add(" now");
  connection* const c = state_.peers.find(service_directory_.at(service).peer);
  remove(service);
  if (c != nullptr) refusals_.refuse(*c, {}, why.text());
}

void service_providers::forget(connection_id peer) noexcept {
  for (const auto i : service_directory_.ids()) {
    if (service_directory_.in_use(i) && provides(peer, i)) remove(i);
  }
}

void service_providers::remove(service_index service) noexcept {
  claims_.give_back(provided_[{service_directory_.at(service).peer.index}]);
  service_directory_.remove(service);
}

// ---- checks

// Peers are charged for what they provide, and the rest of their claims is reserved. None of them provides
// what the endpoint answers itself.
bool service_providers::check() const noexcept {
  for (const auto i : service_directory_.ids()) {
    const bool of_peer = service_directory_.in_use(i) && !service_directory_.at(i).pair;
    if (of_peer && is_own_service(service_directory_.name(i))) return false;
  }
  std::uint32_t all = 0;
  std::uint32_t unclaimed = claims_.connections() * claims_.claim();
  for (const peer_index peer : state_.peers.ids()) {
    std::uint32_t provided = 0;
    for (const auto i : service_directory_.ids())
      provided += service_directory_.in_use(i) && provides(state_.peers[peer].id, i);
    if (provided != provided_[peer]) return false;
    if (provided != 0 && state_.peers[peer].state == connection::phase::free) return false;
    all += provided;
    unclaimed -= claims_.claim() - claims_.kept_for(provided);
  }
  return all == service_directory_.of_peers() && unclaimed == claims_.unclaimed();
}

} // namespace rowe::service
