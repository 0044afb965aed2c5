// SPDX-License-Identifier: Apache-2.0
// A client for the stop alone, which sleeps until it is answered.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "listener.hpp"

namespace rowe::bench {

// What call_stops() calls by.
class probe_client {
 public:
  explicit probe_client(std::uint16_t port) : connection_{port, "/rowe/stop"} {}
  bool ok() const { return connection_.ok(); }
  void send(const std::string& bytes) { (void)connection_.send(bytes); } // ok() says it
  rt::time_point came_at() const { return connection_.came_at(); }
  // The next answer to a call.
  bool hear() {
    bool answered = false;
    while (!answered && connection_.take([&](const wire::frame_step& step) {
      answered = answered || text_of(step).find("service_response") != std::string_view::npos;
    })) {
    }
    return answered;
  }

 private:
  listener connection_;
};

} // namespace rowe::bench
