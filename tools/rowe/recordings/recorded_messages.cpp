// SPDX-License-Identifier: Apache-2.0
#include "recorded_messages.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>

#include "../console.hpp"
#include "../text/times.hpp"

namespace rowe::tools {
namespace {

constexpr std::string_view recording_begin = "\x89MCAP0\r\n";

class kept_recording final : public recorded_messages {
 public:
  explicit kept_recording(recording_reader from) : from_{std::move(from)} {}

  const std::vector<recorded_topic>& topics() const noexcept override { return from_.topics(); }
  std::uint64_t messages() const noexcept override { return from_.messages(); }
  std::int64_t begin_ns() const noexcept override { return from_.begin_ns(); }
  std::int64_t end_ns() const noexcept override { return from_.end_ns(); }
  std::size_t message_bytes_max() const override {
    std::uint64_t most = 0;
    for (const recording_chunk& one : from_.chunks()) most = std::max(most, one.plain_bytes);
    return static_cast<std::size_t>(most == 0 ? from_.file_bytes() : most);
  }

  void select(std::int64_t from_ns, std::int64_t until_ns, const std::vector<std::size_t>& topics) override {
    from_.select({.from_ns = from_ns, .until_ns = until_ns, .topics = topics});
  }
  std::optional<kept_message> next() override {
    const recorded_message* const one = from_.next();
    if (one == nullptr) return std::nullopt;
    return kept_message{one->topic, one->logged_ns, one->data};
  }
  std::vector<std::string> faults() override {
    std::vector<std::string> said;
    for (const recording_damage& one : from_.damaged()) {
      if (!named_.insert(one.offset).second) continue;
      said.push_back(joined("damaged at byte ", one.offset, " (", counted(one.bytes, "byte"),
                            "): ", printable(one.why)));
    }
    return said;
  }

 private:
  recording_reader from_;
  std::set<std::uint64_t> named_; // where something is damaged: once, however often it is read
};

} // namespace

std::optional<kept_as> kind_of_file(const std::string& path, std::string& why) {
  std::array<char, 4096> begin{};
  errno = 0;
  std::ifstream file{path, std::ios::binary};
  if (file.is_open()) file.read(begin.data(), begin.size());
  if (!file.is_open() || errno != 0) {
    why = joined(printable(path), ": ", std::strerror(errno));
    return std::nullopt;
  }
  const std::string_view text{begin.data(), static_cast<std::size_t>(file.gcount())};
  if (text.starts_with(recording_begin.substr(0, std::min(text.size(), std::size_t{5}))) && !text.empty())
    return kept_as::recording;
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != text.npos && text[first] == '{' ? kept_as::lines : kept_as::trajectory;
}

std::unique_ptr<recorded_messages> open_recording(const std::string& path, std::string& why,
                                                  const opening_progress& on_progress) {
  auto file = recording_reader::open(path, &why, [&](std::uint64_t bytes, std::uint64_t of) {
    on_progress(of == 0 ? 0 : static_cast<double>(bytes) / static_cast<double>(of));
  });
  if (!file) {
    why = printable(why);
    return nullptr;
  }
  return std::make_unique<kept_recording>(std::move(*file));
}

} // namespace rowe::tools
