// SPDX-License-Identifier: Apache-2.0
// Preloaded into a process, it makes the disk slow: each write to a file that has a name takes
// ROWE_FAULTS_WRITE_MS longer.
#include <dlfcn.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>

namespace {

using write_function = ssize_t (*)(int, const void*, size_t);

bool is_of_a_disk(int file) noexcept {
  struct stat about {};
  return ::fstat(file, &about) == 0 && S_ISREG(about.st_mode);
}

} // namespace

extern "C" ssize_t write(int file, const void* bytes, size_t count) {
  static const auto real_write = reinterpret_cast<write_function>(::dlsym(RTLD_NEXT, "write"));
  static const char* const asked = std::getenv("ROWE_FAULTS_WRITE_MS");
  if (real_write == nullptr || asked == nullptr) std::abort(); // a test that slows nothing tests nothing
  if (is_of_a_disk(file)) {
    (void)::poll(nullptr, 0, std::atoi(asked)); // what is waited for is the time itself
  }
  return real_write(file, bytes, count);
}
