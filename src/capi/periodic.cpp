// SPDX-License-Identifier: Apache-2.0
// Loops with a period for C: on the heap, the C++ loop inside.
#include <rowe/periodic.h>

#include <chrono>

#include "capi/error.hpp"
#include "capi/handles.hpp"
#include "capi/outside.hpp"

using namespace rowe::capi;
using rowe::errc;

namespace {

constexpr std::int64_t period_ns_max = rowe::rt::duration{std::chrono::hours{1}}.count();

} // namespace

struct rowe_periodic* rowe_periodic_open(int64_t period_ns, const struct rowe_periodic_options* options) {
  return pointer_with_memory([&]() -> rowe_periodic* {
    if (period_ns < 1 || period_ns > period_ns_max)
      return no({errc::bad_argument, period_ns, period_ns_max, rowe::argument::period});
    const auto given = whole(options);
    if (!given) return no(given.error());
    rowe::rt::periodic_options asked{.priority = given->priority, .cycles_max = given->cycles_max};
    if (given->pin) asked.cpu = given->cpu;
    if (given->name != nullptr) asked.name = given->name;
    return new rowe_periodic{rowe::rt::duration{period_ns}, asked};
  });
}
void rowe_periodic_free(struct rowe_periodic* loop) { delete loop; }

bool rowe_periodic_granted(const struct rowe_periodic* loop) {
  return loop != nullptr && loop->inside.grants().complete();
}
const char* rowe_periodic_granted_text(const struct rowe_periodic* loop) {
  return loop == nullptr ? "" : loop->granted.data();
}

bool rowe_periodic_wait(struct rowe_periodic* loop, int64_t* now_ns) {
  if (loop == nullptr) return false;
  const auto now = loop->inside.wait();
  if (now && now_ns != nullptr) *now_ns = rowe::rt::nanoseconds_of(*now);
  return now.has_value();
}

void rowe_periodic_stop(struct rowe_periodic* loop) {
  if (loop != nullptr) loop->inside.stop();
}

uint64_t rowe_periodic_cycles(const struct rowe_periodic* loop) {
  return loop == nullptr ? 0 : loop->inside.cycles();
}
uint64_t rowe_periodic_overruns(const struct rowe_periodic* loop) {
  return loop == nullptr ? 0 : loop->inside.overruns();
}
int64_t rowe_periodic_next_ns(const struct rowe_periodic* loop) {
  return loop == nullptr ? 0 : rowe::rt::nanoseconds_of(loop->inside.next_deadline());
}
int64_t rowe_periodic_lateness_ns(const struct rowe_periodic* loop, double percent) {
  if (loop == nullptr || !(percent >= 0)) return 0; // nor for what is no number
  const rowe::rt::histogram& lateness = loop->inside.lateness();
  return (percent < 100 ? lateness.percentile(percent) : lateness.max()).count();
}
