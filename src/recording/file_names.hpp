// SPDX-License-Identifier: Apache-2.0
// How the files of a recording are called, and which of them are there. Allocates, and waits for the disk.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace rowe::recording {

struct recorded_file {
  std::string path;
  std::uint64_t bytes = 0;
};

// In a folder: NAME_2026-11-30T04-09-58Z.mcap, then ..Z_2.mcap within the same second. Of a file's path:
// run.mcap, run_2.mcap, run_3.mcap.
class file_names {
 public:
  file_names(std::string_view path, std::string_view robot);

  bool in_folder() const noexcept { return in_folder_; }
  const std::string& folder() const noexcept { return folder_; } // with a slash at the end
  // The `attempt`th name (from 0 on) for a file that begins then. In a folder it is not before those that are
  // there already, as of the last call of there(): where a clock begins in the past, new files stay the
  // newest.
  std::string name(std::int64_t begin_ns, std::uint32_t attempt) const;
  // What has such a name, the oldest first.
  std::vector<recorded_file> there() const;

 private:
  struct place {
    std::string_view stamp; // in a folder
    std::uint32_t number = 1;
    friend auto operator<=>(const place&, const place&) = default;
  };
  bool read(std::string_view file, place& into) const;

  bool in_folder_;
  std::string folder_;
  std::string stem_;                        // "ang-01_", or "run"
  mutable std::string newest_;              // the latest stamp that is there,
  mutable std::uint32_t newest_number_ = 0; // and the highest number that has it
};

// Whether a file ends as a recording does whose program ended it.
bool has_end(const std::string& path);

// Bytes that are free on its disk for who writes there.
std::uint64_t disk_free(const std::string& folder) noexcept;

} // namespace rowe::recording
