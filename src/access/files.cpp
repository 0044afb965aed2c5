// SPDX-License-Identifier: Apache-2.0
#include "access/files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

namespace rowe::access {
namespace {

// Without links and dots; empty: it is not there.
std::string real_path(const char* name) {
  char* const found = ::realpath(name, nullptr);
  std::string text{found == nullptr ? "" : found};
  std::free(found);
  return text;
}

} // namespace

bool is_credential(const std::string& path) {
  const char* const folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder == nullptr || *folder == '\0') return false;
  const std::string below = real_path(folder);
  return !below.empty() && real_path(path.c_str()).starts_with(below + "/");
}

std::uint64_t version_of(const std::string& path) noexcept {
  struct stat facts {};
  if (path.empty() || ::stat(path.c_str(), &facts) != 0) return 0;
  const auto mix = [](std::uint64_t all, std::uint64_t one) { return (all ^ one) * 0x9e3779b97f4a7c15U; };
  std::uint64_t version = 1;
  version = mix(version, static_cast<std::uint64_t>(facts.st_ino));
  version = mix(version, static_cast<std::uint64_t>(facts.st_size));
  version = mix(version, static_cast<std::uint64_t>(facts.st_mtim.tv_sec));
  return mix(version, static_cast<std::uint64_t>(facts.st_mtim.tv_nsec));
}

open_file::open_file(const std::string& path) noexcept
    : number_{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)},
      there_{number_ >= 0 && ::fstat(number_, &facts_) == 0} {}

open_file::~open_file() {
  if (number_ >= 0) ::close(number_);
}

ssize_t open_file::read(void* to, std::size_t bytes) const noexcept {
  std::size_t got = 0;
  while (got < bytes) {
    const ssize_t now = ::read(number_, static_cast<char*>(to) + got, bytes - got);
    if (now < 0 && errno == EINTR) continue;
    if (now < 0) return now;
    if (now == 0) break;
    got += static_cast<std::size_t>(now);
  }
  return static_cast<ssize_t>(got);
}

} // namespace rowe::access
