// SPDX-License-Identifier: Apache-2.0
// Where the messages have been kept that are played again: in a recording (MCAP), or in lines of JSON. They
// come in the order of their times, those of the same time in that of the file. One thread at a time.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/recording.hpp>

namespace rowe::tools {

struct kept_message {
  std::size_t topic = 0; // the place in topics()
  std::int64_t time_ns = 0;
  std::string_view data; // until the next one is read
};

class recorded_messages {
 public:
  recorded_messages() = default;
  recorded_messages(const recorded_messages&) = delete;
  recorded_messages& operator=(const recorded_messages&) = delete;
  virtual ~recorded_messages() = default;

  virtual const std::vector<recorded_topic>& topics() const noexcept = 0;
  virtual std::uint64_t messages() const noexcept = 0;
  virtual std::int64_t begin_ns() const noexcept = 0;
  virtual std::int64_t end_ns() const noexcept = 0;
  // As many bytes as any message has, or more.
  virtual std::size_t message_bytes_max() const = 0;

  // What next() gives: those in [from_ns, until_ns) of the topics at these places.
  virtual void select(std::int64_t from_ns, std::int64_t until_ns,
                      const std::vector<std::size_t>& topics) = 0;
  // Nothing: there are no more.
  virtual std::optional<kept_message> next() = 0;
  // What could not be read and was not named by an earlier call, a sentence each.
  virtual std::vector<std::string> faults() = 0;
};

enum class kept_as : std::uint8_t { recording, lines, trajectory };

// What a file is, by how it begins. Nothing: it cannot be read, and `why` says why.
std::optional<kept_as> kind_of_file(const std::string& path, std::string& why);

// How far a file was looked through, from 0 to 1.
using opening_progress = std::function<void(double)>;

// Null: `why` says why not.
std::unique_ptr<recorded_messages> open_recording(const std::string& path, std::string& why,
                                                  const opening_progress& on_progress);

struct lines_options {
  std::string topic;             // of all lines, which are bodies then; empty: each names its topic
  std::optional<double> rate_hz; // where lines have no times
};
// Lines such as `rowe echo --json` prints: {"topic":NAME,"msg":BODY}, each with a "time" (seconds since 1970,
// or in ISO 8601) or none. Null: `why` says why not.
std::unique_ptr<recorded_messages> open_lines(const std::string& path, const lines_options& how,
                                              std::string& why, const opening_progress& on_progress);

// A TUM trajectory, as nav_msgs/Odometry on `topic` without the members that the file does not know. Null:
// `why` says why not.
std::unique_ptr<recorded_messages> open_trajectory(const std::string& path, const std::string& topic,
                                                   std::string& why);

} // namespace rowe::tools
