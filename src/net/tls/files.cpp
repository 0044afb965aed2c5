// SPDX-License-Identifier: Apache-2.0
#include "net/tls/files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "access/files.hpp"
#include "net/base/descriptor.hpp"

namespace rowe::net::tls {
namespace {

constexpr std::size_t bytes_max = std::size_t{1} << 20;

std::string octal(unsigned mode) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "%04o", mode);
  return text.data();
}

} // namespace

std::string read_file(const std::string& path, readers allowed, std::string& text) {
  const descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (!file) return ::strerrordesc_np(errno);
  struct stat facts {};
  if (::fstat(file.get(), &facts) != 0) return ::strerrordesc_np(errno);
  if (!S_ISREG(facts.st_mode)) return "it is not a file";
  const unsigned mode = facts.st_mode & 07777U;
  if (allowed == readers::owner && (mode & 077U) != 0 && !access::is_credential(path))
    return "others can read it (mode " + octal(mode) + "): chmod 600";
  const auto bytes = static_cast<std::size_t>(facts.st_size);
  if (bytes > bytes_max) return "it has more than 1 MiB";
  text.resize(bytes);
  std::size_t got = 0;
  while (got < bytes) {
    const ssize_t now = ::read(file.get(), text.data() + got, bytes - got);
    if (now < 0 && errno == EINTR) continue;
    if (now < 0) return ::strerrordesc_np(errno);
    if (now == 0) break; // it was made shorter meanwhile
    got += static_cast<std::size_t>(now);
  }
  text.resize(got);
  return {};
}

} // namespace rowe::net::tls
