// SPDX-License-Identifier: Apache-2.0
// scale_steps KIND COUNT: for tests/instructions.cmake, which counts the instructions of the function
// scale_steps() under callgrind. A core with COUNT peers, topics, handles, calls … does the same work as one
// with few of them: 10'000 messages, calls or cycles, whatever the count.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string_view>

#include "scale_kinds.hpp"

namespace {

constexpr std::uint32_t steps = 10'000; // CMakeLists.txt says so, too: tests/instructions.cmake divides by it

struct kind {
  std::string_view name;
  int (*run)(std::uint32_t count);
};

} // namespace

extern "C" [[gnu::noinline]] void scale_steps(const std::function<void()>& step) {
  for (std::uint32_t i = 0; i < steps; ++i) step();
}

namespace {

template <class Kind>
int run(std::uint32_t count) {
  Kind does{count};
  const std::uint64_t before = does.on.net.frames;
  scale_steps([&] { does.step(); });
  const std::uint64_t given = does.on.net.frames - before;
  const std::uint64_t due = std::uint64_t{does.frames_a_step} * steps;
  const bool right = does.on.core.check() && (due == 0 || given == due);
  if (!right)
    std::fprintf(stderr, "%llu messages instead of %llu\n", static_cast<unsigned long long>(given),
                 static_cast<unsigned long long>(due));
  return right ? 0 : 1;
}

constexpr kind kinds[] = {{"quiet_peers", run<scale::quiet>},
                          {"sending_peers", run<scale::sending>},
                          {"receiving_peers", run<scale::receiving>},
                          {"topics", run<scale::topics>},
                          {"topics_at_once", run<scale::topics_at_once>},
                          {"handles", run<scale::handles>},
                          {"calls", run<scale::calls>},
                          {"full_peers", run<scale::waiting>},
                          {"readers", run<scale::slow>},
                          {"pages", run<scale::shown>}};

} // namespace

int main(int count, char** arguments) {
  const auto many = static_cast<std::uint32_t>(count == 3 ? std::strtoul(arguments[2], nullptr, 10) : 0);
  for (const kind& one : kinds) {
    if (many != 0 && one.name == arguments[1]) return one.run(many);
  }
  std::fprintf(stderr, "scale_steps KIND COUNT\n");
  return 1;
}
