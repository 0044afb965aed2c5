// SPDX-License-Identifier: Apache-2.0
// Between an endpoint and a recorder: takes from the service thread what is published, and knows which topics
// are wanted.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/recording.hpp>

#include "recording/recorder.hpp"
#include "service/base/record_sink.hpp"

namespace rowe::detail {

class endpoint_recorder final : public service::record_sink {
 public:
  // How long it may take to write what waits when its endpoint closes.
  static constexpr rt::duration closing_time_max = std::chrono::seconds{10};

  // Errors: as recording_writer::create().
  static result<std::unique_ptr<endpoint_recorder>> start(const record_options& options, std::size_t topics,
                                                          std::string* why);

  recording::recorder& files() noexcept { return *files_; }
  // The service thread does not use it any more: writes what waits, at most so long, and says what was lost.
  void finish(rt::duration timeout);

  // record_sink; service thread
  bool wants(std::string_view topic) const noexcept override;
  bool describe(std::uint32_t topic, std::string_view name, std::string_view type,
                const schema_description* schema) noexcept override;
  void put(std::uint32_t topic, std::span<const char> json, rt::time_point logged,
           rt::time_point published) noexcept override;
  void lose(std::uint32_t topic, std::uint64_t count) noexcept override;
  bool begin_long(std::uint32_t place, std::uint32_t topic, std::size_t bytes, rt::time_point logged,
                  rt::time_point published) noexcept override;
  void put_part(std::uint32_t place, std::span<const std::byte> part) noexcept override;
  bool is_black_box() const noexcept override { return is_black_box_; }
  bool snapshot(std::string_view cause) noexcept override;

 private:
  endpoint_recorder(const record_options& options, std::size_t topics);

  std::int64_t wall_ns(rt::time_point at) const noexcept { return rt::nanoseconds_of(at) + wall_offset_ns_; }

  // From the clock of loops to the time since 1970, once for the whole recording: a clock that is set
  // meanwhile does not make its times jump.
  const std::int64_t wall_offset_ns_;
  const bool is_black_box_;
  const std::vector<std::string> topics_;
  const std::vector<std::string> exclude_;
  std::vector<bool> described_; // by topic; false: there was no room to say what it is
  std::unique_ptr<recording::recorder> files_;
};

} // namespace rowe::detail
