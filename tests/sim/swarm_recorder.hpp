// SPDX-License-Identifier: Apache-2.0
// What a recorder of this process hears in a swarm world. Now and then it has no room. Checked: it hears only
// of topics that it wants and was told of, whole texts, at the time of the cycle, and nothing once its handle
// is gone.
#pragma once
#include <array>
#include <map>
#include <string>
#include <string_view>

#include "service/base/record_sink.hpp"
#include "swarm_context.hpp"

namespace swarm {

class recorder final : public rowe::service::record_sink {
 public:
  explicit recorder(context& in) : in_{in}, wants_own_{in.random.one_in(2)} {}

  bool gone = false;    // nobody may call it any more
  bool is_full = false; // it has no room

  bool wants(std::string_view topic) const noexcept override {
    live("asks");
    return wants_own_ || !topic.starts_with("/rowe/");
  }
  bool describe(std::uint32_t topic, std::string_view name, std::string_view,
                const rowe::schema_description*) noexcept override {
    live("describes");
    if (topic >= in_.known.bounds.topics_max) wrong("a topic's number is beyond topics_max");
    if (!name.starts_with('/') || !wants(name)) wrong("it is told of a topic that it does not want");
    names_[topic] = is_full ? std::string{} : std::string{name};
    return !is_full;
  }
  void put(std::uint32_t topic, std::span<const char> json, time_point logged,
           time_point published) noexcept override {
    live("puts");
    told(topic, logged, published);
    if (json.empty()) wrong("it is given no text");
  }
  void lose(std::uint32_t topic, std::uint64_t) noexcept override {
    live("loses");
    told(topic, in_.on.now, in_.on.now);
  }
  bool begin_long(std::uint32_t place, std::uint32_t topic, std::size_t bytes, time_point logged,
                  time_point published) noexcept override {
    live("begins");
    told(topic, logged, published);
    if (place >= left_.size()) return wrong("a long message has a place beyond those there are"), false;
    if (left_[place] != 0) wrong("a long message begins where another one is under way");
    if (!is_full) left_[place] = bytes;
    return !is_full;
  }
  void put_part(std::uint32_t place, std::span<const std::byte> part) noexcept override {
    live("puts a part");
    if (place >= left_.size() || part.size() > left_[place] || part.empty())
      return wrong("a part of a long message is more than the message has");
    left_[place] -= part.size();
  }

  bool is_black_box() const noexcept override {
    live("asks what it is");
    return true;
  }
  bool snapshot(std::string_view cause) noexcept override {
    live("asks for a snapshot");
    if (cause.size() > 256) wrong("a cause is longer than the service lets it be");
    return !is_full;
  }

 private:
  void live(std::string_view does) const noexcept {
    if (gone) wrong("the endpoint " + std::string{does} + " when its handle is gone");
  }
  // It may hear of a topic of which it had no room to be told; then it counts what it hears.
  void told(std::uint32_t topic, time_point logged, time_point published) const noexcept {
    if (!names_.contains(topic)) wrong("it hears of a topic that it was never told of");
    if (logged != in_.on.now || published > logged) wrong("its times are not those of the cycle");
  }
  void wrong(const std::string& what) const noexcept { in_.fail("recorder", "of a recorder: " + what); }

  context& in_;
  const bool wants_own_;
  std::map<std::uint32_t, std::string> names_;
  std::array<std::size_t, long_places> left_{}; // of what is under way
};

} // namespace swarm
