// SPDX-License-Identifier: Apache-2.0
#include "message_source.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "../console.hpp"
#include "../interrupt.hpp"
#include "json_values.hpp"

namespace rowe::tools {
namespace {

// Whether stdin has something to read, or has ended.
bool wait_for_input(rt::duration timeout) noexcept {
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(std::min(timeout, interrupt::slice));
  return ::poll(&input, 1, static_cast<int>(std::max<std::int64_t>(ms.count(), 0))) > 0;
}

// `text` with `part`, which points into it, replaced.
std::string with_part(std::string_view text, std::string_view part, std::string_view instead) {
  const auto begin = static_cast<std::size_t>(part.data() - text.data());
  return joined(text.substr(0, begin), instead, text.substr(begin + part.size()));
}

} // namespace

bool line_reader::cut_line(std::string& line) {
  const std::size_t end = buffer_.find('\n', searched_);
  searched_ = end == buffer_.npos ? buffer_.size() : 0;
  if (end == buffer_.npos && (!ended_ || buffer_.empty())) return false;
  line = buffer_.substr(0, end);
  buffer_.erase(0, end == buffer_.npos ? end : end + 1);
  if (buffer_.empty()) searched_ = 0;
  if (line.ends_with('\r')) line.pop_back();
  ++number_;
  return true;
}

line_reader::outcome line_reader::read(std::string& line, rt::time_point deadline) {
  for (;;) {
    if (cut_line(line)) return line.size() > line_bytes_max_ ? outcome::too_long : outcome::line;
    if (ended_) return outcome::end;
    if (buffer_.size() > line_bytes_max_ + 1) {
      ++number_;
      return outcome::too_long;
    }
    const auto now = rt::monotonic_clock::now();
    if (!wait_for_input(deadline - std::min(now, deadline))) {
      if (interrupt::seen() || rt::monotonic_clock::now() >= deadline) return outcome::nothing_yet;
      continue;
    }
    std::array<char, 64 * 1024> buffer;
    const ssize_t got = ::read(STDIN_FILENO, buffer.data(), buffer.size());
    if (got > 0) buffer_.append(buffer.data(), static_cast<std::size_t>(got));
    if (got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN)) ended_ = true;
  }
}

std::optional<std::string> stamped(std::string_view object, rt::duration since_1970) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(since_1970);
  const std::string stamp =
      joined(R"({"secs":)", seconds.count(), R"(,"nsecs":)", rt::duration{since_1970 - seconds}.count(), "}");
  const auto header = read_json(object).find("header");
  if (!header) return with_member(object, "header", joined(R"({"stamp":)", stamp, "}"));
  if (header->kind() != json_kind::object) return std::nullopt;
  const auto before = header->find("stamp");
  if (!before) return with_part(object, header->text(), with_member(header->text(), "stamp", stamp));
  return with_part(object, before->text(), stamp);
}

} // namespace rowe::tools
