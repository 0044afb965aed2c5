// SPDX-License-Identifier: Apache-2.0
// What the kernel says of a machine in its files, /proc and /sys above all. Everything that doctor reads, it
// reads here, below a root folder, so that the files of another machine can be examined as well as ours. In a
// container or for an ordinary user many of them are missing: that is an answer, too, and never an error.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rowe::tools::fitness {

// What a file says, without blanks and line breaks at its end; or why nobody knows.
struct reading {
  std::string text;
  int error = 0; // errno of the attempt

  explicit operator bool() const noexcept { return error == 0; }
};

class facts {
 public:
  // Paths are absolute; with a root of "/a", "/proc/version" is "/a/proc/version".
  explicit facts(std::string root) : root_{std::move(root)} {}

  reading read(std::string_view path) const;
  // The whole number a file consists of.
  std::optional<std::int64_t> number(std::string_view path) const;
  bool exists(std::string_view path) const;
  // What is in a folder, in order; nothing where there is none.
  std::vector<std::string> names_in(std::string_view folder) const;
  // The last part of what a symbolic link leads to; empty where there is none.
  std::string target_of(std::string_view link) const;

 private:
  std::string root_;
};

// The lines of a text, and the words of one; what is between two separators may be empty among lines only.
std::vector<std::string_view> lines_of(std::string_view text);
std::vector<std::string_view> words_of(std::string_view line);

// What stands behind "NAME:" on the line that begins so, as in /proc/self/status; empty where none does.
std::string_view entry_of(std::string_view text, std::string_view name);

} // namespace rowe::tools::fitness
