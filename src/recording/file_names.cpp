// SPDX-License-Identifier: Apache-2.0
#include "recording/file_names.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <ctime>
#include <filesystem>
#include <utility>

#include <sys/statvfs.h>

#include "mcap/files.hpp"
#include "mcap/format.hpp"

namespace rowe::recording {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view ending = ".mcap";
constexpr std::size_t stamp_bytes = std::string_view{"2026-11-30T04-09-58Z"}.size();
constexpr std::string_view stamp_pattern = "dddd-dd-ddTdd-dd-ddZ";

std::string stamp_of(std::int64_t ns) {
  const auto seconds = static_cast<std::time_t>(ns / 1'000'000'000);
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  std::array<char, 64> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H-%M-%SZ", &parts)};
}

bool is_stamp(std::string_view text) noexcept {
  return std::ranges::equal(text, stamp_pattern, [](char c, char wanted) {
    return wanted == 'd' ? c >= '0' && c <= '9' : c == wanted;
  });
}

// A robot's name as a part of a file's.
std::string in_a_name(std::string_view robot) {
  std::string safe;
  for (const char c : robot) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    safe += plain || c == '-' || c == '.' ? c : '-';
  }
  if (safe.empty() || safe.front() == '.') safe.insert(0, "rowe");
  return safe.substr(0, 64);
}

} // namespace

file_names::file_names(std::string_view path, std::string_view robot) {
  std::error_code ignored; // what cannot be looked at is no folder; opening the file says what is wrong
  in_folder_ = path.ends_with('/') || fs::is_directory(fs::path{path}, ignored);
  if (in_folder_) {
    folder_ = path;
    if (!path.ends_with('/')) folder_ += '/';
    stem_ = in_a_name(robot) + '_';
    return;
  }
  const std::size_t slash = path.rfind('/');
  folder_ = slash == std::string_view::npos ? "./" : std::string{path.substr(0, slash + 1)};
  stem_ = path.substr(slash == std::string_view::npos ? 0 : slash + 1);
  if (stem_.ends_with(ending)) stem_.resize(stem_.size() - ending.size());
}

std::string file_names::name(std::int64_t begin_ns, std::uint32_t attempt) const {
  std::string text = (folder_ == "./" ? "" : folder_) + stem_;
  std::uint32_t number = attempt + 1;
  if (in_folder_) {
    const std::string stamp = stamp_of(begin_ns);
    if (stamp <= newest_) number += newest_number_; // where older ones were deleted, their names are free
    text += std::max(stamp, newest_);
  }
  if (number != 1) text += '_' + std::to_string(number);
  return text.append(ending);
}

bool file_names::read(std::string_view file, place& into) const {
  if (!file.starts_with(stem_) || !file.ends_with(ending)) return false;
  file.remove_prefix(stem_.size());
  file.remove_suffix(ending.size());
  if (in_folder_) {
    into.stamp = file.substr(0, stamp_bytes);
    if (!is_stamp(into.stamp)) return false;
    file.remove_prefix(stamp_bytes);
  }
  if (file.empty()) return true;
  if (file.front() != '_') return false;
  const char* const end = file.data() + file.size();
  const auto [behind, wrong] = std::from_chars(file.data() + 1, end, into.number);
  return wrong == std::errc{} && behind == end && into.number > 1;
}

std::vector<recorded_file> file_names::there() const {
  std::vector<std::pair<std::string, std::uint64_t>> found;
  std::error_code wrong;
  for (fs::directory_iterator at{folder_, wrong}; !wrong && at != fs::directory_iterator{};
       at.increment(wrong)) {
    std::error_code gone; // meanwhile
    place at_time;
    const std::string file = at->path().filename().string();
    if (!read(file, at_time) || !at->is_regular_file(gone)) continue;
    const std::uint64_t bytes = at->file_size(gone);
    if (gone) continue;
    found.emplace_back(file, bytes);
    if (at_time.stamp > newest_) {
      newest_ = at_time.stamp;
      newest_number_ = 0;
    }
    if (at_time.stamp == newest_) newest_number_ = std::max(newest_number_, at_time.number);
  }
  std::ranges::sort(found, {}, [this](const auto& one) {
    place at;
    (void)read(one.first, at); // it was read above
    return at;
  });
  std::vector<recorded_file> all;
  for (const auto& [file, bytes] : found) all.push_back({(folder_ == "./" ? "" : folder_) + file, bytes});
  return all;
}

bool has_end(const std::string& path) {
  mcap::file_source from;
  std::array<char, mcap::magic.size()> last{};
  return from.open(path) &&
         from.bytes() >= mcap::magic.size() + mcap::record_head_bytes + mcap::footer_bytes &&
         from.read(from.bytes() - last.size(), last) &&
         std::string_view{last.data(), last.size()} == mcap::magic;
}

std::uint64_t disk_free(const std::string& folder) noexcept {
  struct statvfs about {};
  if (::statvfs(folder.c_str(), &about) != 0) return 0;
  return std::uint64_t{about.f_bavail} * about.f_frsize;
}

} // namespace rowe::recording
