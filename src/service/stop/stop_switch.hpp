// SPDX-License-Identifier: Apache-2.0
// The rules of the stop, with what they change at once: the permit of the loops, before anything else, and
// the event. Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "service/base/service_limits.hpp"
#include "service/control/command_gate.hpp"
#include "service/state/core_state.hpp"
#include "service/threads/stop_rules.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {

class stop_switch {
 public:
  // Who asks: this process, or a peer.
  struct asker {
    std::string_view name = "this process";
    std::string_view identity{};
    std::string_view address{};
    bool is_peer = false;

    asker() noexcept = default;
    explicit asker(const connection* c) noexcept
        : name{c->name()}, identity{c->identity}, address{c->peer()}, is_peer{true} {}
  };

  stop_switch(core_state& state, command_gate& gate, stop_rules& rules) noexcept
      : state_{state}, command_gate_{gate}, stop_rules_{rules} {}

  const stop_rules& rules() const noexcept { return stop_rules_; }
  stop_rules& rules() noexcept { return stop_rules_; } // show() afterwards

  // Looks at loops, guards and the clock.
  void update() noexcept { stop_rules_.update(state_.cycle.now); }
  // Somebody asks for a stop.
  void request(std::string_view source, std::uint64_t key) noexcept {
    ++requests_;
    state_.counts.add(counter::stops);
    stop_rules_.request(source, key, state_.cycle.now);
  }
  // Somebody of this process, or a peer, asks for a stop, and says who it is.
  void request(const asker& by, std::string_view said, std::uint64_t key) noexcept {
    if (!by.is_peer && !said.empty()) return request(said, key);
    wire::text_of<peer_name_bytes_max> text;
    request(state_.rights.write_name(text, by.name, said).text(), key);
  }
  // How often a stop was asked for, repeats included.
  std::uint64_t requests() const noexcept { return requests_; }
  // Publishes what the rules say now to the loops, and reports it to the log if it has changed. `by` is who
  // asked for a stop or a reset.
  void show() noexcept { show({}, {}); }
  void show(std::string_view reason, const asker& by) noexcept {
    write_permit();
    if (stop_rules_.running() != reported_running_) report(reason, by);
  }
  // Publishes it to the loops only: a loop or a peer has come or gone, and the next show() reports to the
  // log. Commands that were sent before end first, so no loop that is released finds one.
  void write_permit() noexcept {
    command_gate_.note_stop();
    stop_rules_.write_permit(state_.shared.permit);
  }
  void count_refusal() noexcept { state_.counts.add(counter::stop_refusals); }

 private:
  void report(std::string_view reason, const asker& by) noexcept {
    const bool running = reported_running_ = stop_rules_.running();
    wire::text_of<event_text_bytes_max> text;
    text.add(running ? "reset: loops may move" : "stopped: ");
    if (!running) text.add(stop_rules_.cause_name());
    // Nobody asked for a stop of another cause.
    const bool asked = running || stop_rules_.cause() == stop_cause::request;
    const auto add_words = [&](std::string_view before, std::string_view said) {
      if (said.empty()) return;
      text.add(before).add("'").add_quoted(said, 2 * said.size(), '\'').add("'"); // anybody's own
    };
    if (asked && by.is_peer && !running && stop_rules_.source() != by.name)
      add_words(", by ", stop_rules_.source());
    add_words(", ", reason);
    std::array<char, stop_source_bytes_max + 3> guard; // a peer may be one, and has said its name
    const std::string_view source =
        stop_rules_.cause() == stop_cause::guard
            ? wire::text_out{guard}.add_name(stop_rules_.source(), stop_source_bytes_max).text()
            : stop_rules_.source();
    const std::string_view who = asked && by.is_peer ? by.address : running ? by.name : source;
    state_.events.report(event::kind::stop, who, text.text(), {}, asked ? by.identity : std::string_view{});
  }

  core_state& state_;
  command_gate& command_gate_;
  stop_rules& stop_rules_;
  std::uint64_t requests_ = 0;
  bool reported_running_ = false; // as of the last event
};

} // namespace rowe::service
