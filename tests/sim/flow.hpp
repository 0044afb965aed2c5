// SPDX-License-Identifier: Apache-2.0
// Worlds of links: how frames to many peers are gathered, how much is in flight to one, how much is read of
// those that say much, what the roles of peers allow, what is left of a time to live over several endpoints,
// what becomes of long messages, and what drives a robot. What peers say is simple here, and the links have
// the properties of real ones. So the invariants can be narrow: bytes, cycles and units of work. A seed is
// one of seven kinds (flow_groups.hpp, flow_credit.hpp, flow_reading.hpp, flow_roles.hpp, flow_hops.hpp,
// flow_long.hpp, flow_driving.hpp). sim_swarm runs these worlds besides those of the swarm, and shrinks their
// failures likewise.
#pragma once
#include <cstdint>
#include <cstdio>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/detail/queue_pair.hpp>

#include "swarm_context.hpp"

namespace flow {

using namespace std::chrono_literals;
using rowe::rt::duration;
using rowe::rt::time_point;
using rowe::service::connection_id;
using rowe::service::counter;
using swarm::flow_event;

// Whether the bytes are one whole text, or one whole ping, unmasked, and nothing else.
inline bool is_one_frame(std::span<const std::byte> bytes, unsigned first_byte) {
  if (bytes.size() < 2 || std::to_integer<unsigned>(bytes[0]) != first_byte) return false;
  return rowe::wire::whole_frame_bytes(bytes) == bytes.size();
}
inline bool is_one_text(std::span<const std::byte> bytes) { return is_one_frame(bytes, 0x81); }
inline bool is_one_ping(std::span<const std::byte> bytes) { return is_one_frame(bytes, 0x89); }

// A masked frame; not the last one of its message, if need be.
inline std::vector<std::byte> frame_of(rowe::wire::opcode what, std::string_view payload, bool last) {
  constexpr rowe::wire::mask_key key{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}};
  std::vector<std::byte> frame(rowe::wire::frame_header_bytes_max + payload.size());
  const std::size_t header = rowe::wire::write_frame_header(frame.data(), what, payload.size(), key);
  if (!last) frame[0] = rowe::wire::not_final(frame[0]);
  payload.copy(reinterpret_cast<char*>(frame.data() + header), payload.size());
  frame.resize(header + payload.size());
  rowe::wire::mask(std::span{frame}.subspan(header), key);
  return frame;
}

class world {
 public:
  static constexpr std::uint64_t steps = 300;

  world(std::uint64_t seed, const rowe::endpoint_options& options, swarm::coverage& seen,
        const std::set<std::string>& without, bool trace, const rowe::wire::protocol_set* protocols = nullptr)
      : on_{options, rowe::service::side::server, seed, time_point{1000s}, protocols},
        random_{seed},
        seen_{seen},
        result_{without},
        seed_{seed},
        trace_{trace} {
    on_.net.leave_trace_out();
  }
  world(const world&) = delete;
  world& operator=(const world&) = delete;
  virtual ~world() = default;

  void step(std::uint64_t number) {
    step_ = number;
    random_.restart(seed_, number + 1);
    act();
  }
  virtual void finish(std::uint64_t number) { step_ = number; }

  bool broken() const { return result_.broken(); }
  const swarm::run_result& result() const { return result_; }

 protected:
  virtual void act() = 0;

  void fail(std::string_view invariant, const std::string& what) { result_.fail(invariant, what); }
  void say(const std::string& line) const {
    if (!trace_) return;
    std::printf("%llu %s\n", static_cast<unsigned long long>(step_), line.c_str());
    std::fflush(stdout);
  }
  void cycle(duration later) {
    on_.cycle(later);
    check_structures();
  }
  void check_structures() {
    if (const auto wrong = on_.core.inconsistency(); !wrong.empty())
      fail("structures", "do not agree: " + std::string{wrong});
  }
  rowe::detail::queue_pair& publisher(std::string_view topic, std::size_t text_bytes_max,
                                      bool latched = false) {
    return on_.offer(rowe::detail::pair_kind::publish_text, topic, text_bytes_max, {.latched = latched});
  }
  // Whole microseconds, less than `most`.
  duration some_of(duration most) {
    return 1us * static_cast<std::int64_t>(random_.below(static_cast<std::uint64_t>(most / 1us)));
  }
  // False: its queue is full.
  bool publish(rowe::detail::queue_pair& by, std::string_view text) {
    const auto done = rowe::detail::publish_into(by, text.size(), on_.now, [&](std::byte* slot) {
      text.copy(reinterpret_cast<char*>(slot), text.size());
    });
    return static_cast<bool>(done);
  }

  harness::core_harness on_;
  swarm::seeded_choices random_;
  swarm::coverage& seen_;

 private:
  swarm::run_result result_;
  std::uint64_t seed_;
  std::uint64_t step_ = 0;
  bool trace_;
};

} // namespace flow
