// SPDX-License-Identifier: Apache-2.0
// Reads what a file says into settings. Goes on after a mistake, so all of them are reported at once.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include <rowe/settings.hpp>

#include "config/keys.hpp"
#include "config/toml_file.hpp"

namespace rowe {

// Mistakes, and the diagnostic and error that they make together.
class setting_faults {
 public:
  void add(std::int64_t line, std::string text);
  // Sorted by line; the error has the first one's.
  status finish(std::string* why);

 private:
  std::vector<config::fault> found_; // so many of them at most; the others are counted
  std::size_t more_ = 0;
};

struct settings_reader {
  settings& to;
  std::string file; // as diagnostics call it
  setting_faults faults = {};

  void read(const config::table& root, bool writable_by_others);

  // The value of one item; false if it is wrong, and then that was added to the faults.
  bool read_value(const config::item& from, std::string_view section, const config::form& what,
                  config::value& into);

 private:
  settings::origin origin_of(const config::item& one) const;
  void fail(const config::item& at, std::string_view section, const std::string& text);
  void read_section(const config::item& section);
  template <class Entry>
  void read_list(const config::item& section, std::span<const config::key<Entry>> keys,
                 std::vector<Entry>& into, std::vector<settings::origin>& origins);
};

} // namespace rowe
