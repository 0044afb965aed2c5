// SPDX-License-Identifier: Apache-2.0
// A configuration of arbitrary text, as a file and as a variable. What is required: a mistake has a
// diagnostic and a line that is there; what is read, even beside mistakes, is in its range; and what holds,
// written as a file, is read again without mistakes and means the same.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/settings.hpp>

#include "api/settings_reader.hpp"
#include "config/keys.hpp"
#include "config/toml_file.hpp"
#include "config/values.hpp"
#include "fuzz/require.hpp"

namespace {

using rowe::fuzz::require;
namespace config = rowe::config;

constexpr std::size_t text_bytes_max = 16 * 1024;

std::string text_of(const rowe::settings& of) {
  std::string text;
  for (const rowe::setting& one : of.list()) {
    require(!one.value.empty() && !one.origin.empty(), "a value is shown, and its origin");
    if (one.first_of_section) text.append("[").append(one.section).append("]\n");
    text.append(one.name).append(" = ").append(one.value).append("\n");
  }
  return text;
}

bool has_long_line(std::string_view text) {
  while (text.size() > config::line_bytes_max) {
    const std::size_t end = text.find('\n');
    if (end > config::line_bytes_max) return true;
    text.remove_prefix(end + 1);
  }
  return false;
}

// Reads a text into settings; the number of mistakes is not zero if it returns false.
bool read_into(rowe::settings& to, std::string_view text) {
  const auto lines = std::count(text.begin(), text.end(), '\n') + 1;
  config::table root;
  config::fault wrong;
  if (!config::parse(text, root, wrong)) {
    require(!wrong.text.empty() && wrong.line > 0 && wrong.line <= lines,
            "what is no TOML is told with its line");
    return false;
  }
  rowe::settings_reader reader{to, "rowe.toml"};
  reader.read(root, false);
  std::string why;
  const rowe::status done = reader.faults.finish(&why);
  require(bool{done} == why.empty(), "a mistake has a diagnostic");
  require(done || (done.error().value > 0 && done.error().value <= lines), "a mistake has a line");
  return bool{done};
}

void check_ranges(const rowe::settings& of) {
  for (const auto& one : config::keys()) {
    if (one.number == nullptr) continue;
    require(config::check_range(one.what, one.number(of.values().endpoint)).empty(),
            "a value is in its range");
  }
}

void check_file(std::string_view text) {
  rowe::settings first;
  (void)read_into(first, text); // mistakes leave the rest
  check_ranges(first);
  std::string why;
  const rowe::status fit = first.check(&why);
  require(bool{fit} == why.empty(), "what does not go together is told");
  const std::string written = text_of(first);
  if (has_long_line(written)) return; // several lines became one
  rowe::settings second;
  require(read_into(second, written), "what holds is read again");
  require(text_of(second) == written, "and means the same");
  require(bool{second.check()} == bool{fit}, "and is judged in the same way");
}

void check_text(std::string_view text) {
  for (const auto& one : config::keys()) {
    config::value read, again;
    if (!config::read(one.what, text, read).empty()) continue;
    const auto is = one.what.is; // of texts as of files
    if (is == config::kind::text || is == config::kind::texts || is == config::kind::path) continue;
    std::string written = config::written(one.what, read);
    if (written.starts_with('"')) written = written.substr(1, written.size() - 2);
    require(config::read(one.what, written, again).empty() && read == again,
            "a value is read as it is written");
  }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > text_bytes_max) return 0;
  const std::vector<char> exact(data, data + size);
  const std::string_view text{exact.data(), exact.size()};
  check_file(text);
  check_text(text);
  return 0;
}
