// SPDX-License-Identifier: Apache-2.0
// Recognises requests for the stop and its other services. No other file looks for their names in a request.
// The caller knows whether there is a stop, and carries it out. Pure functions.
#pragma once
#include <cstdint>
#include <string_view>

#include "service/state/call_table.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/request.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {

enum class stop_verb : std::uint8_t { none, stop, reset, guard, state };

// Who asks for one of these services.
struct stop_asker {
  call_endpoint who{};
  std::string_view id_raw{}; // peer
  detail::call_ref call{};   // of this process
  bool silent = false;       // wants no answer
};

struct stop_gate {
  // The verb of a service, or of a topic, in either spelling; none: it is not the stop's.
  static stop_verb service_named(std::string_view name) noexcept;
  static std::string_view name_of(stop_verb which) noexcept; // one that is not none

  // What a peer's request asks for. `text`: the part of its message that is JSON. A request that is refused,
  // and a plain message, asks to stop if it names the stop, whatever else is wrong with it.
  static stop_verb find(wire::decoded read, const wire::request& asked, const json::document& text) noexcept;
  // What a call of this process asks for. If the call is an object, its text names the `service`. The text
  // was validated.
  static stop_verb find(std::string_view service, const wire::call_args& what) noexcept;
  // Whether a validated text names the stop. A service's name may end in "#" and an id.
  static bool asks_to_stop(const json::document& text) noexcept;

  // What a peer on stop_path may ask.
  static bool is_for_stop_peers(stop_verb which) noexcept {
    return which == stop_verb::stop || which == stop_verb::state;
  }
  // All calls pass here; call_router refuses those that are not allowed.
  static bool is_for_stop_peers(const wire::request& asked) noexcept;
};

} // namespace rowe::service
