// SPDX-License-Identifier: Apache-2.0
#include "recording/recording_file.hpp"

#include <cerrno>

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

bool recording_file::rename(const std::string& path) {
  if (::link(path_.c_str(), path.c_str()) != 0) return false; // unlike rename(), it replaces nothing
  ::unlink(path_.c_str());
  path_ = path;
  return true;
}

} // namespace rowe::recording
