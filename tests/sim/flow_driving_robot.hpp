// SPDX-License-Identifier: Apache-2.0
// The robot of a world of drivers (flow_driving.hpp): one topic or two, whose loops have leases and a stop
// latch. A loop looks once in each of its periods, and is late at times. What the program publishes on these
// topics itself, and a handle without a lease that hears what was admitted.
#pragma once
#include <algorithm>
#include <cstring>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/stop_latch.hpp>
#include <rowe/subscriber.hpp>

#include "flow_driving_oracle.hpp"

namespace flow {

class driven_robot {
 public:
  static constexpr duration looks_every_max = 10ms;
  struct place { // what it shares with others
    swarm::core_harness& on;
    driving_oracle& oracle;
    swarm::seeded_choices& random;
  };

  explicit driven_robot(const place& in) : in_{in} {
    constexpr const char* names[] = {"/cmd_vel", "/arm"};
    const std::size_t count = 1 + in_.random.below(2);
    const std::size_t loops = count + in_.random.below(4 - count);
    std::map<std::string, duration> shortest;
    for (std::size_t i = 0; i < loops; ++i) {
      constexpr duration leases[] = {50ms, 100ms, 200ms, 300ms, 500ms, 800ms};
      const duration lease = in_.random.one_of(leases);
      const auto at = shortest.try_emplace(names[i % count], lease).first;
      at->second = std::min(at->second, lease);
      add_loop(names[i % count], lease);
    }
    for (const auto& [name, lease] : shortest) add_topic(name, lease);
  }

  const std::vector<std::string>& topics() const { return topics_; }
  const std::string& some_topic() { return topics_[in_.random.below(topics_.size())]; }

  // Each loop whose time it is looks at what is in force, and acts on it. `acting(n)`: on this command.
  template <class Acting>
  void look(Acting&& acting) {
    for (loop& one : loops_) {
      if (in_.on.now < one.next) continue;
      look(one);
      if (one.acts_on != 0) acting(one.acts_on);
    }
  }
  void be_late(duration time) { loops_[in_.random.below(loops_.size())].next = in_.on.now + time; }
  void be_in_time() {
    for (loop& one : loops_) one.next = std::min(one.next, in_.on.now + one.period);
  }
  bool any_acts(const std::string& topic) const {
    return std::any_of(loops_.begin(), loops_.end(),
                       [&](const loop& one) { return one.topic == topic && one.acts_on != 0; });
  }
  bool all_act(const std::string& topic) const {
    return std::all_of(loops_.begin(), loops_.end(),
                       [&](const loop& one) { return one.topic != topic || one.acts_on != 0; });
  }

  // This process gives a command itself.
  void publish() {
    const handles& by = handles_[in_.random.below(handles_.size())];
    const driven_command value{in_.oracle.say(driving_oracle::this_process, by.topic, in_.on.now, -1)};
    (void)rowe::detail::publish_into(*by.publisher, sizeof value, in_.on.now, [&](std::byte* slot) {
      std::memcpy(slot, &value, sizeof value); // it is dropped where there is no slot
    });
  }
  // After each cycle: what was admitted in it.
  void check_cycle() {
    for (const handles& one : handles_) in_.oracle.check_cycle(one.topic, heard(*one.listener), in_.on.now);
  }

 private:
  struct loop {
    std::string topic;
    rowe::subscriber<driven_command> commands;
    rowe::stop_latch latch;
    duration period{};
    time_point next{};
    std::int64_t acts_on = 0; // 0: it stands still
  };
  struct handles { // of a topic, without a lease
    std::string topic;
    rowe::detail::queue_pair* listener;
    rowe::detail::queue_pair* publisher;
  };

  void add_loop(const char* topic, duration lease) {
    constexpr duration periods[] = {1ms, 2ms, 5ms, looks_every_max};
    auto& pair = in_.on.offer(rowe::detail::subscribe_request<driven_command>(topic, {.lease = lease}));
    auto& latch = in_.on.offer(rowe::detail::latch_request({.name = "loop", .loop_timeout = 200ms}));
    loops_.push_back({.topic = topic,
                      .commands = rowe::subscriber<driven_command>{swarm::core_harness::handle_of(pair)},
                      .latch = rowe::stop_latch{swarm::core_harness::handle_of(latch)},
                      .period = in_.random.one_of(periods)});
  }
  void add_topic(const std::string& name, duration lease) {
    constexpr duration ttls[] = {rowe::rt::for_ever, 20ms, 0ms};
    topics_.push_back(name);
    in_.oracle.add_topic(name, lease);
    handles_.push_back({name,
                        &in_.on.offer(rowe::detail::pair_kind::subscribe_text, name, 256, {.depth = 256}),
                        &in_.on.offer(rowe::detail::pair_kind::publish_value, name, sizeof(driven_command),
                                      {.ttl = in_.random.one_of(ttls), .shared = true},
                                      &rowe::describe<driven_command>(), "sim/Driven")});
  }

  void look(loop& by) {
    by.next = in_.on.now + by.period;
    const bool engaged = by.latch.engaged(in_.on.now);
    if (engaged) by.latch.acknowledge(in_.on.now);
    const auto in_force = by.commands.latest_within(in_.on.now);
    if (!in_force && in_force.code() != rowe::errc::empty)
      in_.oracle.fail("whole", "a loop is told " + std::string{in_force.error().name()});
    if (in_force) in_.oracle.check_in_force(by.topic, in_force->value().n, in_.on.now);
    by.acts_on = in_force && !engaged ? in_force->value().n : 0;
  }

  static std::vector<std::int64_t> heard(rowe::detail::queue_pair& pair) {
    std::vector<std::int64_t> all;
    while (const auto slot = pair.user.in.ring->try_pop()) {
      const std::string_view text{reinterpret_cast<const char*>(pair.user.in.memory.value(*slot)),
                                  pair.user.in.memory.header(*slot)->bytes};
      all.push_back(swarm::integer_after(text, R"("n":)"));
      pair.user.in.free_ring->release(*slot);
    }
    return all;
  }

  place in_;
  std::vector<std::string> topics_;
  std::deque<loop> loops_;
  std::vector<handles> handles_;
};

} // namespace flow
