// SPDX-License-Identifier: Apache-2.0
#include "facts.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>

#include "../rowe/arguments/values.hpp"
#include "../rowe/console.hpp"

namespace rowe::tools::fitness {
namespace {

constexpr std::string_view blanks = " \t\n\r";
constexpr std::size_t file_bytes_max = 1 << 20; // /proc/interrupts of a large server is a tenth of it

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

} // namespace

reading facts::read(std::string_view path) const {
  reading result;
  // O_NONBLOCK: whatever stands in the place of a file, a pipe say, nobody waits for it.
  const int file = ::open(joined(root_, path).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return {.text = {}, .error = errno};
  std::array<char, 4096> piece;
  while (result.text.size() < file_bytes_max) {
    const ssize_t bytes = ::read(file, piece.data(), piece.size());
    if (bytes < 0 && errno == EINTR) continue;
    if (bytes < 0) result.error = errno;
    if (bytes <= 0) break;
    result.text.append(piece.data(), static_cast<std::size_t>(bytes));
  }
  ::close(file);
  // Files of the device tree end with a zero.
  while (!result.text.empty() &&
         (blanks.find(result.text.back()) != std::string_view::npos || result.text.back() == '\0'))
    result.text.pop_back();
  return result;
}

std::optional<std::int64_t> facts::number(std::string_view path) const {
  const reading file = read(path);
  return file ? integer_of(trimmed(file.text)) : std::nullopt;
}

bool facts::exists(std::string_view path) const {
  struct stat found;
  return ::stat(joined(root_, path).c_str(), &found) == 0;
}

std::vector<std::string> facts::names_in(std::string_view folder) const {
  std::vector<std::string> names;
  DIR* const opened = ::opendir(joined(root_, folder).c_str());
  if (opened == nullptr) return names;
  while (const dirent* const entry = ::readdir(opened)) {
    const std::string_view name = entry->d_name;
    if (name != "." && name != "..") names.emplace_back(name);
  }
  ::closedir(opened);
  std::ranges::sort(names);
  return names;
}

std::string facts::target_of(std::string_view link) const {
  std::array<char, PATH_MAX> target;
  const ssize_t bytes = ::readlink(joined(root_, link).c_str(), target.data(), target.size());
  if (bytes <= 0) return {};
  const std::string_view path{target.data(), static_cast<std::size_t>(bytes)};
  return std::string{path.substr(path.rfind('/') + 1)};
}

std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    lines.push_back(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
  }
  return lines;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(blanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(blanks, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(blanks, end);
  }
  return words;
}

std::string_view entry_of(std::string_view text, std::string_view name) {
  for (const std::string_view line : lines_of(text)) {
    const std::size_t colon = line.find(':');
    if (colon != std::string_view::npos && trimmed(line.substr(0, colon)) == name)
      return trimmed(line.substr(colon + 1));
  }
  return {};
}

} // namespace rowe::tools::fitness
