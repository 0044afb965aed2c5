// SPDX-License-Identifier: Apache-2.0
// A folder of a test's own, deleted at the end with all that is in it.
#pragma once
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

namespace rowe::tests {

class folder {
 public:
  folder() : path_{(std::filesystem::temp_directory_path() / "rowe-test-XXXXXX").string()} {
    if (::mkdtemp(path_.data()) == nullptr) throw std::runtime_error{"cannot make a folder for a test"};
  }
  ~folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  folder(const folder&) = delete;
  folder& operator=(const folder&) = delete;

  const std::string& path() const noexcept { return path_; }
  std::string operator/(std::string_view name) const { return path_ + '/' + std::string{name}; }
  // Writes a file, in folders of its own if need be, and returns its path.
  std::string put(std::string_view name, std::string_view text, mode_t mode = 0644) const {
    const std::string file = *this / name;
    std::filesystem::create_directories(std::filesystem::path{file}.parent_path());
    std::ofstream{file, std::ios::binary} << text;
    ::chmod(file.c_str(), mode);
    return file;
  }

 private:
  std::string path_;
};

} // namespace rowe::tests
