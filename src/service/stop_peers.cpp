// SPDX-License-Identifier: Apache-2.0
// Peers that came on stop_path. The carrier keeps places for them that nobody else gets, so that the robot
// can be stopped when everybody else is refused. Hence they may stop, see the state of the stop, and nothing
// else; and a place is theirs only as long as no other one needs it who may have a stop to say.
#include "service/core.hpp"

namespace rowe::service {
namespace {

// Who stopped a robot that could move keeps its place for so long: the answer, and what came of it. A stop of
// one that stands keeps nobody else out, however often it is said.
constexpr rt::duration place_kept_for = std::chrono::seconds{1};

} // namespace

bool core::is_for_stop(stop_service which) noexcept {
  return which == stop_service::stop || which == stop_service::state;
}

// Calls are refused where they are answered.
bool core::is_for_stop(const wire::request& asked) noexcept {
  using wire::verb;
  switch (asked.what) {
  case verb::call: return true;
  case verb::publish: return stop_service_named(asked.topic) == stop_service::stop;
  case verb::subscribe:
  case verb::unsubscribe: return stop_service_named(asked.topic) == stop_service::state;
  default: return false;
  }
}

bool core::may_displace(connection_id id) const noexcept {
  const connection* const c = find(id);
  return c != nullptr && c->stop_only && (!c->open() || now_ - c->stopped_at >= place_kept_for);
}

void core::displace(connection_id id) noexcept {
  connection* const c = find(id);
  if (c == nullptr) return;
  add(counter::stop_peers_displaced);
  close(*c, wire::close_code::try_again_later, "the next one needs this place for the stop");
}

} // namespace rowe::service
