// SPDX-License-Identifier: Apache-2.0
// The core's memory does not grow: private memory of the process before and after many simulated messages,
// each taken from a queue pair, encoded, queued for two peers, framed and written; some expire, some are
// throttled.
// One million by default; ROWE_GROWTH_MESSAGES asks for more (tools/test --all: 10^8).
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "rt/asked.hpp"
#include "service/core/core_harness.hpp"

struct sample {
  double stamp, x, y, heading, speed;
};
template <>
inline constexpr auto rowe::schema<sample> =
    rowe::fields<&sample::stamp, &sample::x, &sample::y, &sample::heading, &sample::speed>{};

namespace {

using namespace std::chrono_literals;

// Kilobytes that this process has written to and shares with nobody, as the kernel counts pages. Clean ones
// are left out: a library's page becomes private when another program that maps it ends.
std::uint64_t private_kilobytes() {
  std::ifstream file{"/proc/self/smaps_rollup"};
  std::uint64_t sum = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("Private_Dirty:"))
      sum += std::strtoull(line.c_str() + line.find(':') + 1, nullptr, 10);
  }
  return sum;
}

TEST(growth, is_none_however_many_messages_pass) {
  harness::core_harness on;
  auto& pair = on.offer(rowe::detail::pair_kind::publish_value, "/odom", sizeof(sample),
                        {.ttl = 1500us, .depth = 16}, &rowe::describe<sample>());
  harness::peer quick{on};
  harness::peer throttled{on};
  quick.say(R"({"op":"subscribe","topic":"/odom"})");
  throttled.say(R"({"op":"subscribe","topic":"/odom","throttle_rate":5,"queue_length":2})");
  on.cycle();

  sample value{};
  std::uint64_t published = 0;
  const auto run = [&](std::uint64_t until) {
    while (published < until) {
      for (int burst = 0; burst < 8; ++burst) {
        value.x += 0.001;
        published += rowe::detail::publish_into(pair, sizeof value, on.now, [&](std::byte* slot) {
                       std::memcpy(slot, &value, sizeof value);
                     }).has_value();
      }
      // Now and then a peer does not read for a while, so that messages wait and expire.
      const bool stalled = (published / 4096) % 8 == 7;
      on.cycle(1ms);
      for (auto* p : {&quick, &throttled}) {
        if (!stalled) p->skim();
        on.net.link_of(p->id()).capacity_bytes = stalled ? 2000 : 65536;
        p->send(rowe::wire::opcode::pong, {}); // heard of
      }
    }
  };
  const std::uint64_t wanted = rowe::tests::asked_of("ROWE_GROWTH_MESSAGES", 1'000'000);
  run(wanted / 10);
  (void)private_kilobytes(); // asking takes memory, too, the first time
  const std::uint64_t before = private_kilobytes();
  run(wanted);
  const std::uint64_t after = private_kilobytes();
  EXPECT_EQ(after, before) << "kilobytes, after " << published << " messages";
  EXPECT_GT(on.count(rowe::service::counter::expired), 0U);
  EXPECT_GT(on.count(rowe::service::counter::messages_out), wanted / 2);
}

} // namespace
