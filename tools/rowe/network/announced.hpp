// SPDX-License-Identifier: Apache-2.0
// Robots that are announced on the network, as `avahi-browse -rp` prints them. All of it comes from whoever
// sends multicast DNS: what is no host, port or path is left out, and texts are for printable().
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rowe::tools {

struct announced_robot {
  std::string service; // as it is announced
  std::string host;    // "ang-01.local"
  std::uint16_t port = 0;
  std::vector<std::string> addresses; // but those that need a zone
  std::vector<std::pair<std::string, std::string>> texts;

  // What was announced under this key; empty: nothing.
  std::string_view text(std::string_view key) const noexcept;
  std::string url() const;
};

class announced_robots {
 public:
  // One line, without its end. One robot may come several times: for each interface, and each address.
  void add(std::string_view line);

  const std::vector<announced_robot>& all() const noexcept { return all_; }
  // Answers that could not be read.
  std::size_t unreadable() const noexcept { return unreadable_; }
  // Robots beyond robots_max.
  std::size_t left_out() const noexcept { return left_out_; }

  static constexpr std::size_t robots_max = 1000;

 private:
  bool add_answer(std::string_view line);

  std::vector<announced_robot> all_;
  std::size_t unreadable_ = 0;
  std::size_t left_out_ = 0;
};

} // namespace rowe::tools
