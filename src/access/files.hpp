// SPDX-License-Identifier: Apache-2.0
// Files that say who may do what: settings, keys, certificates, tokens. Not real-time.
#pragma once
#include <sys/stat.h>
#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace rowe::access {

// Whether the file, which is there, is below $CREDENTIALS_DIRECTORY. What systemd hands to a service is in
// that folder, and systemd knows who may read and write it.
bool is_credential(const std::string& path);

// Changes when the file is replaced or written to. 0 if it cannot be looked at.
std::uint64_t version_of(const std::string& path) noexcept;

class open_file {
 public:
  // Does not wait for who writes a pipe.
  explicit open_file(const std::string& path) noexcept;
  open_file(const open_file&) = delete;
  open_file& operator=(const open_file&) = delete;
  ~open_file();

  // False: it cannot be opened or looked at, and errno says why.
  explicit operator bool() const noexcept { return there_; }
  const struct stat& facts() const noexcept { return facts_; }
  // Reads until `to` is full or the file ends. Returns how much that was; less than 0: errno says why.
  ssize_t read(void* to, std::size_t bytes) const noexcept;

 private:
  int number_;
  struct stat facts_ {};
  bool there_;
};

} // namespace rowe::access
