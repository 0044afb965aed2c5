// SPDX-License-Identifier: Apache-2.0
// The options of `rowe serve` as a configuration: every key of rowe/settings.hpp has one, beside --config,
// --listen and --limit. `rowe config show` takes the same.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include <rowe/settings.hpp>

#include "../console.hpp"
#include "../exit_code.hpp"
#include "command_line.hpp"

namespace rowe::tools {

// What was given on the command line.
class configuration_options {
 public:
  configuration_options();

  // Entries of a verb's table; they point into this object.
  std::vector<option> table();

  // The file to read; empty: $ROWE_CONFIG, or none.
  void use_file(const std::string& path) { file_ = path; }

  // The file that read_all() reads; empty: none.
  std::string file() const;

  // All sources together, checked. Nothing: something is wrong; stderr says what, and `verb` ends with
  // exit_code::usage.
  std::optional<settings> read_all(std::string_view verb);
  // The same, not checked together. Nothing: `why` has a line for each thing that cannot be read.
  std::optional<settings> read_unchecked(std::string& why) const;
  static void say_lines(const console& to, severity how, std::string_view why);

 private:
  std::string set_all(settings& in) const;
  std::string set_listen(settings& in) const;

  std::vector<setting_key> keys_ = settings::keys();
  std::vector<std::string> meanings_;           // of each key, with its default
  std::vector<std::vector<std::string>> given_; // of each key
  std::string file_;
  std::string listen_;
  std::vector<std::string> limits_;
};

} // namespace rowe::tools
