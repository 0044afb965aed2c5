// SPDX-License-Identifier: Apache-2.0
#include "mcap/files.hpp"

#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace rowe::mcap {
namespace {

constexpr mode_t new_file = 0644;

} // namespace

descriptor::~descriptor() {
  if (number_ >= 0) ::close(number_);
}

// ---- file_sink

bool file_sink::check(bool done) {
  if (!done && error_ == 0) error_ = errno != 0 ? errno : EIO;
  return done;
}

bool file_sink::open(const std::string& path, access how) {
  constexpr int flags[] = {O_CREAT | O_EXCL, O_CREAT | O_TRUNC, 0};
  file_ =
      descriptor{::open(path.c_str(), O_WRONLY | O_CLOEXEC | flags[static_cast<std::size_t>(how)], new_file)};
  return check(static_cast<bool>(file_));
}

bool file_sink::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_.number(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (!check(written > 0)) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool file_sink::sync() { return check(::fdatasync(file_.number()) == 0); }

bool file_sink::truncate(std::uint64_t bytes) {
  const auto end = static_cast<off_t>(bytes);
  return check(::ftruncate(file_.number(), end) == 0 && ::lseek(file_.number(), end, SEEK_SET) == end);
}

bool file_sink::close(bool waits) {
  const int number = file_.number();
  if (number < 0) return true;
  const bool done =
      !waits || ::fsync(number) == 0 || errno == EINVAL || errno == EROFS; // what is no file has no sync
  file_ = descriptor{};
  return check(done);
}

std::string file_sink::why() const { return std::generic_category().message(error_); }

// ---- file_source

bool file_source::open(const std::string& path) {
  file_ = descriptor{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
  struct stat about {};
  if (!file_ || ::fstat(file_.number(), &about) != 0) {
    error_ = errno;
    return false;
  }
  if (!S_ISREG(about.st_mode)) {
    error_ = S_ISDIR(about.st_mode) ? EISDIR : ESPIPE;
    return false;
  }
  bytes_ = static_cast<std::uint64_t>(about.st_size);
  return true;
}

bool file_source::read(std::uint64_t at, std::span<char> into) {
  while (!into.empty()) {
    const ssize_t taken = ::pread(file_.number(), into.data(), into.size(), static_cast<off_t>(at));
    if (taken < 0 && errno == EINTR) continue;
    if (taken <= 0) {
      error_ = taken < 0 ? errno : ENODATA;
      return false;
    }
    at += static_cast<std::uint64_t>(taken);
    into = into.subspan(static_cast<std::size_t>(taken));
  }
  return true;
}

std::string file_source::why() const { return std::generic_category().message(error_); }

} // namespace rowe::mcap
