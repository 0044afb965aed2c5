// SPDX-License-Identifier: Apache-2.0
// Question: how many instructions does a loop's call take, and what the service thread does with JSON?
//
// Measured, by callgrind: each function of namespace steps makes one call, and is called a thousand times in
// a steady state: what it needs is there. A struct has 40 bytes, a text 16. The messages of JSON are those of
// json_write.cpp and json_read.cpp.
//
// Excluded: what the other side does in between.
//
// What would make it lie: another compiler or processor, and preset dev, which does not optimise. Nothing
// else: instructions are the same on a busy machine. They are no time: two of the publish to the newest value
// wait for a cache line each.
//
// Run: valgrind --tool=callgrind --callgrind-out-file=counts '--toggle-collect=steps::*' bench_instructions
//      callgrind_annotate --inclusive=yes counts | grep steps::          # a thousand calls of each
#include <cstring>
#include <random>
#include <string_view>
#include <vector>

#include <rowe/detail/pair_request.hpp>
#include <rowe/rowe.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/timer_wheel.hpp>

#include "api/pair_memory.hpp"
#include "json_steps.hpp"

struct counted_odometry {
  double stamp, x, y, heading, speed;
};
template <>
inline constexpr auto rowe::schema<counted_odometry> =
    rowe::fields<&counted_odometry::stamp, &counted_odometry::x, &counted_odometry::y,
                 &counted_odometry::heading, &counted_odometry::speed>{};

using odometry = counted_odometry;
using rowe::json_text;

namespace steps {

using rowe::rt::time_point;
constexpr time_point now{std::chrono::seconds{1000}};
constexpr auto ttl = std::chrono::milliseconds{20};
constexpr std::string_view text = R"({"data":"hello"})";

template <class T>
void use(T&& value) {
  asm volatile("" : : "r"(&value) : "memory");
}

#define COUNTED [[gnu::noinline]] static void
COUNTED publish_all(rowe::publisher<odometry>& to, const odometry& v) { use(to.publish(v, now)); }
COUNTED publish_newest(rowe::publisher<odometry>& to, const odometry& v) { use(to.publish(v, now)); }
COUNTED publish_to_nobody(rowe::publisher<odometry>& to, const odometry& v) { use(to.publish(v, now)); }
COUNTED publish_when_full(rowe::publisher<odometry>& to, const odometry& v) { use(to.publish(v, now)); }
COUNTED publish_text(rowe::publisher<json_text>& to) { use(to.publish(text, now)); }
COUNTED take_and_release(rowe::subscriber<odometry>& from) { use(from.try_take()); }
COUNTED take_nothing(rowe::subscriber<odometry>& from) { use(from.try_take()); }
COUNTED send(rowe::lane& by) { use(by.try_send(text, ttl, now)); }
COUNTED receive_and_release(rowe::lane& by) { use(by.try_receive(now)); }
COUNTED call_start(rowe::lane& by) { use(by.start(text, ttl, now)); }
COUNTED call_finish(rowe::lane& by) { use(by.try_finish()); }
COUNTED request_next_and_reply(rowe::responder<odometry, odometry>& by) {
  auto asked = by.try_next(now);
  use(by.reply(*asked, asked->value(), now));
}
COUNTED latch_engaged(rowe::stop_latch& latch) { use(latch.engaged(now)); }
COUNTED latch_trips_and_acknowledges(rowe::stop_latch& latch) {
  use(latch.engaged(now));
  latch.acknowledge(now);
}
// One entry of so many is cancelled, and inserted with another time to live.
COUNTED wheel_with_1k_pending(rowe::rt::timer_wheel& wheel, std::uint32_t node, time_point expiry) {
  wheel.cancel(node);
  wheel.insert(node, expiry);
}
COUNTED wheel_with_1m_pending(rowe::rt::timer_wheel& wheel, std::uint32_t node, time_point expiry) {
  wheel.cancel(node);
  wheel.insert(node, expiry);
}
#undef COUNTED

} // namespace steps

namespace rowe::bench {
namespace {

constexpr std::uint32_t depth = 64;

// A queue pair as an endpoint builds it, and this thread in the service thread's place.
class pair_harness {
 public:
  explicit pair_harness(const detail::pair_request& asked)
      : memory_{detail::pair_bytes(asked) + (1 << 12), rt::page_lock::none} {
    on.memory = memory_.carve_bytes(detail::pair_bytes(asked));
    detail::build_pair(on, asked, {});
    on.audience.set(detail::audience::somebody);
  }
  detail::pair_handle handle() { return {nullptr, on}; }

  // What the service thread puts into a queue.
  void fill(const detail::producer_end& end, detail::value_header header) {
    const std::uint32_t slot = *end.free_ring->try_take();
    header.bytes = steps::text.size();
    *end.memory.header(slot) = header;
    std::memcpy(end.memory.value(slot), steps::text.data(), steps::text.size());
    steps::use(end.ring->try_push(slot));
  }
  void arrive(detail::entry what = detail::entry::message) {
    detail::value_header header;
    header.what = what;
    header.expires_ns = rt::nanoseconds_of(rt::never);
    fill(on.service.in, header);
  }
  // Takes what was sent; calls end.
  void serve() {
    on.service.out.ring->drain(
        [&](std::uint32_t slot) {
          detail::value_header header = *on.service.out.memory.header(slot);
          on.service.out.free_ring->release(slot);
          if (header.own.generation == 0) return;
          header.what = detail::entry::completion;
          fill(on.service.completions, header);
        },
        depth);
  }

  detail::queue_pair on;

 private:
  rt::arena memory_;
};

template <class Call>
void a_thousand_times(Call&& call) {
  for (int i = 0; i < 1000; ++i) call();
}

void publishing() {
  const odometry value{1, 2, 3, 4, 5};
  pair_harness all{detail::advertise_request<odometry>("/odom", {.depth = depth})};
  pair_harness newest{detail::advertise_request<odometry>("/odom", {.keep = keep::newest})};
  pair_harness nobody{detail::advertise_request<odometry>("/odom", {.depth = depth})};
  pair_harness full{detail::advertise_request<odometry>("/odom", {.depth = depth})};
  pair_harness texts{detail::advertise_request<json_text>("/said", {.depth = depth})};
  nobody.on.audience.set(detail::audience::nobody);
  publisher<odometry> to_all{all.handle()}, to_newest{newest.handle()}, to_nobody{nobody.handle()};
  publisher<odometry> to_full{full.handle()};
  publisher<json_text> of_texts{texts.handle()};
  while (to_full.publish(value, steps::now)) continue;
  a_thousand_times([&] {
    steps::publish_all(to_all, value);
    all.serve();
    steps::publish_newest(to_newest, value);
    steps::use(newest.on.service.out.newest->begin_read());
    steps::publish_to_nobody(to_nobody, value);
    steps::publish_when_full(to_full, value);
    steps::publish_text(of_texts);
    texts.serve();
  });
}

void taking() {
  pair_harness seen{detail::subscribe_request<odometry>("/odom", {.depth = depth})};
  subscriber<odometry> from{seen.handle()};
  a_thousand_times([&] {
    seen.arrive();
    steps::take_and_release(from);
    steps::take_nothing(from);
  });
}

void talking() {
  pair_harness one{detail::talk_request({.depth = depth, .inbox_depth = depth, .calls = 16})};
  lane by{one.handle()};
  a_thousand_times([&] {
    steps::send(by);
    one.serve();
    one.arrive();
    steps::receive_and_release(by);
    steps::call_start(by);
    one.serve();
    steps::call_finish(by);
  });
}

void answering() {
  pair_harness one{detail::serve_request<odometry, odometry>("/same", {.depth = depth})};
  responder<odometry, odometry> by{one.handle()};
  a_thousand_times([&] {
    one.arrive(detail::entry::invocation);
    steps::request_next_and_reply(by);
    one.serve();
  });
}

void stopping() {
  detail::permit_word<> permit;
  pair_harness one{detail::latch_request({})};
  one.on.granted = &permit;
  stop_latch latch{one.handle()};
  detail::latch_number number = 1;
  a_thousand_times([&] {
    permit.grant(++number, rt::never);
    steps::latch_engaged(latch);
    permit.withdraw(number);
    steps::latch_trips_and_acknowledges(latch);
  });
}

void expiring(std::uint32_t pending, void (*step)(rt::timer_wheel&, std::uint32_t, rt::time_point)) {
  std::minstd_rand random;
  const auto within = [&random](std::uint32_t end) { return static_cast<std::uint32_t>(random() % end); };
  const auto expiry = [&] { return steps::now + std::chrono::microseconds{1'000 + within(9'999'000)}; };
  std::vector<rt::timer_node> nodes(pending);
  rt::timer_wheel wheel{nodes, steps::now};
  for (std::uint32_t node = 0; node < pending; ++node) wheel.insert(node, expiry());
  a_thousand_times([&] { step(wheel, within(pending), expiry()); });
}

} // namespace
} // namespace rowe::bench

int main() {
  rowe::bench::publishing();
  rowe::bench::taking();
  rowe::bench::talking();
  rowe::bench::answering();
  rowe::bench::stopping();
  rowe::bench::json_steps();
  rowe::bench::expiring(1'000, steps::wheel_with_1k_pending);
  rowe::bench::expiring(1'000'000, steps::wheel_with_1m_pending);
}
