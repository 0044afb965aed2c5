// SPDX-License-Identifier: Apache-2.0
// What `rowe plot` is asked, and its two ways to get at data: from a recording, and from a running robot.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "../console.hpp"
#include "../exit_code.hpp"
#include "../network/remote.hpp"
#include "../plot/series.hpp"

namespace rowe::tools {

struct plot_options {
  remote_place at; // its url may be a file
  std::vector<std::string> fields;
  std::vector<std::string> paths;
  std::string out;
  std::size_t format = 0;
  std::string size;
  std::vector<std::string> title;
  std::string from;
  std::string to;
  std::optional<rt::duration> time;
  std::optional<rt::duration> timeout;
  std::string topic;
  std::optional<double> rate_hz;
  std::string font;
  bool dark = false;
  bool quiet = false;
};

// What is to be plotted, at how many columns.
struct plot_request {
  std::vector<field_wish> wishes;
  std::size_t columns = 0;
};

struct plot_outcome {
  std::optional<plotted_data> data{}; // nothing: the verb ends with `end`, and the reason was printed
  exit_code end = exit_code::failed;
  bool has_faults = false; // parts could not be read, which was printed
};

plot_outcome data_of_file(const plot_options& o, const plot_request& what, const console& to);
plot_outcome data_of_robot(const plot_options& o, const plot_request& what, const console& to);

// After so many messages without a number a field counts as one that is not there.
inline constexpr std::uint64_t messages_without_number_max = 100;

// Whether a field has no number in so many messages as there are, or as are enough to say so: then that was
// printed.
bool lacks_a_field(const plotted_data& data, std::uint64_t messages_enough, const console& to);

} // namespace rowe::tools
