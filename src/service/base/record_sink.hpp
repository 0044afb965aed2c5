// SPDX-License-Identifier: Apache-2.0
// The seam to what records messages: the service thread gives it their texts, and another thread writes them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/rt/clock.hpp>

namespace rowe {
struct schema_description;
}

namespace rowe::service {

// Topics have numbers here, below topics_max. Service thread; nothing waits or allocates. What has no room is
// counted by the sink.
class record_sink {
 public:
  virtual bool wants(std::string_view topic) const noexcept = 0;
  // From now on the number stands for this topic. `schema`: null if it is not known; it stays valid as long
  // as the endpoint. False: there is no room; it is to be said again before the topic's next message.
  virtual bool describe(std::uint32_t topic, std::string_view name, std::string_view type,
                        const schema_description* schema) noexcept = 0;
  virtual void put(std::uint32_t topic, std::span<const char> json, rt::time_point logged,
                   rt::time_point published) noexcept = 0;
  // So many messages of it were not given, because there is no room for as many long ones at a time.
  virtual void lose(std::uint32_t topic, std::uint64_t count) noexcept = 0;

  // A message in parts; `place`, below long_places, tells several at a time apart. False: there is no room
  // for all of it; nothing was begun, and it is counted.
  static constexpr std::size_t long_places = 4;
  virtual bool begin_long(std::uint32_t place, std::uint32_t topic, std::size_t bytes, rt::time_point logged,
                          rt::time_point published) noexcept = 0;
  virtual void put_part(std::uint32_t place, std::span<const std::byte> part) noexcept = 0;

  virtual bool is_black_box() const noexcept = 0;
  // Somebody asks a black box to write what it retains. False: it is none, or has no room for that.
  virtual bool snapshot(std::string_view cause) noexcept = 0;

 protected:
  ~record_sink() = default;
};

} // namespace rowe::service
