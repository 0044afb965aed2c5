// SPDX-License-Identifier: Apache-2.0
#include "recording/recording_file.hpp"

#include <cerrno>
#include <cstdio>

#include <fcntl.h>
#include <unistd.h>

namespace rowe::recording {

bool recording_file::open(const mcap::text_map& notes) {
  if (!to_.open(path_, mcap::file_sink::access::create)) return false;
  writes_.emplace(to_, mcap::writer_options{.how = packed_, .program = "rowe"});
  writes_->add_metadata("rowe", notes);
  if (works()) return true;
  ::unlink(path_.c_str());
  return false;
}

bool recording_file::is_there() const noexcept { return to_.error() == EEXIST; }
std::string recording_file::why() const { return path_ + ": " + to_.why(); }

std::string recording_file::end(bool waits) {
  writes_->end();
  bytes_ = writes_->whole_bytes();
  if (works()) return to_.close(waits) ? std::string{} : why();
  std::string fault = why();
  (void)to_.truncate(bytes_); // else there is more behind it, which a reader leaves out
  mcap::writer ends{to_, {}, bytes_, writes_->written()};
  ends.end();
  if (ends.writes())
    bytes_ = ends.bytes();
  else
    (void)to_.truncate(bytes_); // `rowe record --repair` ends it
  (void)to_.close(waits);       // there is a fault already
  return fault;
}

namespace {

// Replaces nothing. Some file systems know the one way, and some the other: FAT has no links.
bool give_other_name(const char* from, const char* to) noexcept {
  if (::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0) return true;
  if (errno == EEXIST) return false;
  if (::link(from, to) != 0) return false;
  ::unlink(from);
  return true;
}

} // namespace

bool recording_file::rename(const std::string& path) {
  if (!give_other_name(path_.c_str(), path.c_str())) return false;
  path_ = path;
  return true;
}

} // namespace rowe::recording
