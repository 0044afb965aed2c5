// SPDX-License-Identifier: Apache-2.0
// One file of a recording. Whatever ends it, what the disk took stays whole. One ordinary thread; allocates,
// and waits for the disk.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "mcap/files.hpp"
#include "mcap/writer.hpp"

namespace rowe::recording {

class recording_file {
 public:
  recording_file(std::string path, compression packed) : path_{std::move(path)}, packed_{packed} {}

  // Makes it, with metadata "rowe". False: it is there already (is_there()), or cannot be made; why() says
  // so.
  bool open(const mcap::text_map& notes);
  bool is_there() const noexcept;
  std::string why() const; // with its path

  // Between open() and end().
  mcap::writer& writes() noexcept { return *writes_; }
  const mcap::writer& writes() const noexcept { return *writes_; }
  bool works() const noexcept { return writes_->writes(); } // the disk has taken all so far
  bool sync() { return to_.sync(); }

  // Ends it; `waits`: until it lies on the disk. Empty: all is in it; else why not, and what is whole gets an
  // end if there is room for that.
  std::string end(bool waits);

  // Gives it another name. False: there is a file of that name, or it cannot be done.
  bool rename(const std::string& path);

  const std::string& path() const noexcept { return path_; }
  std::uint64_t messages() const noexcept { return writes_->written().counts.messages; } // that are whole
  std::uint64_t bytes() const noexcept { return bytes_ != 0 ? bytes_ : writes_->bytes(); }

 private:
  std::string path_;
  compression packed_;
  mcap::file_sink to_;
  std::optional<mcap::writer> writes_;
  std::uint64_t bytes_ = 0; // once it has ended
};

} // namespace rowe::recording
