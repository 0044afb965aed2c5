// SPDX-License-Identifier: Apache-2.0
#include "status_line.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <string>

#include "output.hpp"

namespace rowe::tools {
namespace {

constexpr std::string_view back_and_erase = "\r\x1b[K";

std::atomic<bool> line_is_shown{false};

std::size_t columns_of(int stream) noexcept {
  winsize size{};
  if (::isatty(stream) == 0 || ::ioctl(stream, TIOCGWINSZ, &size) != 0) return 0;
  return size.ws_col;
}

// As much of a text in UTF-8 as so many columns hold.
std::string_view cut_to(std::string_view text, std::size_t columns) noexcept {
  std::size_t at = 0;
  for (; at < text.size(); ++at) {
    const bool begins = (text[at] & '\xc0') != '\x80';
    if (begins && columns-- == 0) break;
  }
  return text.substr(0, at);
}

} // namespace

bool status_line::is_possible() noexcept {
  const char* const kind = std::getenv("TERM");
  return ::isatty(STDERR_FILENO) == 1 && (kind == nullptr || std::string_view{kind} != "dumb");
}

void status_line::show(std::string_view text) {
  constexpr std::size_t columns_usual = 80;
  const std::size_t columns = columns_of(STDERR_FILENO);
  // The last column stays free: some terminals go to the next line there.
  std::string line{back_and_erase};
  line.append(cut_to(text, (columns == 0 ? columns_usual : columns) - 1));
  line_is_shown.store(false, std::memory_order_seq_cst);
  write_to_stderr(line);
  line_is_shown.store(true, std::memory_order_seq_cst);
}

std::string_view status_line::taken_away() noexcept {
  return line_is_shown.exchange(false, std::memory_order_seq_cst) ? back_and_erase : std::string_view{};
}

void status_line::clear() noexcept { write_to_stderr({}); }

std::size_t columns_of_stdout() noexcept { return columns_of(STDOUT_FILENO); }

} // namespace rowe::tools
