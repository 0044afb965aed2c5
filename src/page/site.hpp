// SPDX-License-Identifier: Apache-2.0
// What an endpoint serves over HTTP: the files of its user's folder, and where there is none of that name
// what is beneath, its own page. The files are read once, when it is opened. So the service thread never
// touches a disk, and what is served does not change while it runs.
#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "service/base/transport.hpp"

namespace rowe::page {

class site final : public service::page_source {
 public:
  static constexpr std::size_t files_max = 4096;                  // and folders
  static constexpr std::size_t bytes_max = std::size_t{64} << 20; // of all files together
  static constexpr std::size_t path_bytes_max = 255;

  using answer_function = service::http_answer (*)(const service::http_request&) noexcept;
  explicit site(answer_function beneath) noexcept : beneath_{beneath} {}

  // Reads the files of the folder and of the folders in it. Names that begin with a dot are left out, and
  // links to folders are not followed. A file that not everyone may read is refused, and so is a link that
  // leads out: who reaches the address reads what is served. Returns what is wrong, in words that name the
  // file; empty: nothing. Set-up; waits for the disk; allocates.
  std::string load(const std::string& folder);

  // `index.html` is served under its folder's path as well. Service thread, or any other; never waits, never
  // allocates.
  service::http_answer answer(const service::http_request& request) const noexcept override;

 private:
  using content = std::vector<std::byte>;
  struct file {
    std::string path;
    std::string_view type;
    std::string etag;
    std::shared_ptr<const content> body;
  };
  static std::string read(const std::string& where, std::size_t& total, content& bytes);
  std::string add(const std::string& path, const std::string& where, std::size_t& total);

  answer_function beneath_;
  std::vector<file> files_; // sorted by path
};

} // namespace rowe::page
