// SPDX-License-Identifier: Apache-2.0
// Preloaded into a process, it shifts the clock of the day by as many seconds as the file
// ROWE_FAULTS_CLOCK_SHIFT says: eight bytes, an integer of this machine, read anew each time. The monotonic
// clock goes on as it does when somebody sets the machine's clock.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

using clock_function = int (*)(clockid_t, timespec*) noexcept;

clock_function real_clock = nullptr;
const volatile std::int64_t* shift = nullptr;

[[gnu::constructor]] void prepare() noexcept {
  real_clock = reinterpret_cast<clock_function>(::dlsym(RTLD_NEXT, "clock_gettime"));
  const char* const name = std::getenv("ROWE_FAULTS_CLOCK_SHIFT");
  const int file = name != nullptr ? ::open(name, O_RDONLY | O_CLOEXEC) : -1;
  void* const mapped =
      file >= 0 ? ::mmap(nullptr, sizeof *shift, PROT_READ, MAP_SHARED, file, 0) : MAP_FAILED;
  if (real_clock == nullptr || mapped == MAP_FAILED) std::abort(); // a test that shifts nothing tests nothing
  ::close(file);
  shift = static_cast<const volatile std::int64_t*>(mapped);
}

} // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* into) noexcept {
  if (shift == nullptr) prepare(); // another constructor asks for the time
  const int outcome = real_clock(clock, into);
  if (outcome == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) into->tv_sec += *shift;
  return outcome;
}

std::time_t time(std::time_t* into) noexcept {
  timespec now{};
  (void)clock_gettime(CLOCK_REALTIME, &now);
  if (into != nullptr) *into = now.tv_sec;
  return now.tv_sec;
}

int gettimeofday(timeval* into, void*) noexcept {
  timespec now{};
  (void)clock_gettime(CLOCK_REALTIME, &now);
  *into = {.tv_sec = now.tv_sec, .tv_usec = now.tv_nsec / 1000};
  return 0;
}

} // extern "C"
