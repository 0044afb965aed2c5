// SPDX-License-Identifier: Apache-2.0
#include "net/tls/files.hpp"

#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "access/files.hpp"

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
  const access::open_file file{path};
  if (!file) return ::strerrordesc_np(errno);
  if (!S_ISREG(file.facts().st_mode)) return "it is not a file";
  const unsigned mode = file.facts().st_mode & 07777U;
  if (allowed == readers::owner && (mode & 077U) != 0 && !access::is_credential(path))
    return "others can read it (mode " + octal(mode) + "): chmod 600";
  const auto bytes = static_cast<std::size_t>(file.facts().st_size);
  if (bytes > bytes_max) return "it has more than 1 MiB";
  text.resize(bytes);
  const ssize_t got = file.read(text.data(), bytes);
  if (got < 0) return ::strerrordesc_np(errno);
  text.resize(static_cast<std::size_t>(got)); // it may have been made shorter meanwhile
  return {};
}

} // namespace rowe::net::tls
