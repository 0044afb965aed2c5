// SPDX-License-Identifier: Apache-2.0
#include "installed.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>
#include <utility>

#include "../rowe/console.hpp"

namespace rowe::ros1 {
namespace {

constexpr std::size_t file_bytes_max = 256 * 1024;

std::optional<std::string> contents(const std::filesystem::path& of) {
  std::error_code unreadable;
  if (!std::filesystem::is_regular_file(of, unreadable)) return std::nullopt;
  if (std::filesystem::file_size(of, unreadable) > file_bytes_max) return std::nullopt;
  std::ifstream from{of, std::ios::binary};
  if (!from) return std::nullopt;
  return std::string{std::istreambuf_iterator<char>{from}, {}};
}

} // namespace

installed_definitions::installed_definitions(std::vector<std::string> first) : folders_{std::move(first)} {
  if (const char* const path = std::getenv("ROS_PACKAGE_PATH"); path != nullptr) {
    std::istringstream all{path};
    for (std::string one; std::getline(all, one, ':');) {
      if (!one.empty()) folders_.push_back(one);
    }
  }
  std::error_code none;
  for (const auto& one : std::filesystem::directory_iterator{"/opt/ros", none})
    folders_.push_back((one.path() / "share").string());
  folders_.emplace_back("/usr/share");
}

message_type_ptr installed_definitions::message(const std::string& type, std::string& why) const {
  auto read = read_message(type, source(), why);
  if (!read) why += " (looked below --messages, $ROS_PACKAGE_PATH, /opt/ros and /usr/share)";
  return read;
}

std::optional<service_type> installed_definitions::service(const std::string& type, std::string& why) const {
  const auto all = text(type, "srv");
  if (all) return read_service(type, *all, source(), why);
  why = tools::joined("there is no definition of the service type ", tools::printable(type),
                      " (looked below --messages, $ROS_PACKAGE_PATH, /opt/ros and /usr/share)");
  return std::nullopt;
}

definition_source installed_definitions::source() const {
  return [this](const std::string& name) { return text(name, "msg"); };
}

std::optional<std::string> installed_definitions::text(const std::string& type,
                                                       const std::string& kind) const {
  if (plain_type_name(type) != type) return std::nullopt; // it would be a path
  const std::size_t slash = type.find('/');
  const std::string package = type.substr(0, slash);
  const std::string file = type.substr(slash + 1) + "." + kind;
  for (const std::filesystem::path folder : folders_) {
    if (auto found = contents(folder / package / kind / file)) return found;
    if (folder.filename() != package) continue;
    if (auto found = contents(folder / kind / file)) return found;
  }
  return std::nullopt;
}

} // namespace rowe::ros1
