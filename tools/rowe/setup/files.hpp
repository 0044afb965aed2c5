// SPDX-License-Identifier: Apache-2.0
// Files of keys and settings: they have their mode from the start, and appear whole or not at all, whatever
// fails or wherever the power goes off. Nothing here follows a symbolic link to a file, so that root may run
// it in a folder of somebody else. What each function returns says what went wrong; empty: nothing.
#pragma once
#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rowe::tools {

struct new_file {
  std::string name;
  ::mode_t mode;
  std::string content;
};

// What is to succeed before something is put in place: it is called once all of that is on the disk.
using last_step = std::function<std::string()>;

inline constexpr ::mode_t secret_mode = 0600;
inline constexpr ::mode_t public_mode = 0644;

// Makes the folder with these files in it, mode 0700. It may be there already if it is empty. With `replace`
// it may also have files of `known` names, which go; whatever else is in it is an error. `known` has all
// names of `files`.
std::string make_folder(const std::string& path, const std::vector<new_file>& files, bool replace,
                        const std::vector<std::string>& known, const last_step& before_it_is_there = {});

// Makes a file, which must not be there. A path without a slash is in this folder.
std::string write_new(const std::string& path, ::mode_t mode, std::string_view content);

// How many files are in the folder; 0 if there is none.
std::size_t files_in(const std::string& path);

// A folder whose files are changed: nobody else does so by this class at the same time.
class folder {
 public:
  // Waits while another one has it.
  static std::optional<folder> open(const std::string& path, std::string& wrong);
  folder(folder&& other) noexcept;
  folder& operator=(folder&&) = delete;
  ~folder();

  std::string read(const std::string& name, std::string& into) const;
  bool has(const std::string& name) const noexcept;
  bool is_writable() const noexcept;

  // Replaces the file, which keeps its owner, and its mode if that is narrower.
  std::string write(const new_file& file, const last_step& before_it_is_there = {}) const;

 private:
  folder(int descriptor, std::string path) : descriptor_{descriptor}, path_{std::move(path)} {}
  int descriptor_;
  std::string path_;
};

} // namespace rowe::tools
