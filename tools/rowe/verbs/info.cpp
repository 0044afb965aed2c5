// SPDX-License-Identifier: Apache-2.0
// rowe info: what is in recordings. Files only so far; a word that is neither a file nor looks like one is
// left for topics and services of a robot.
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "../arguments/command_line.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../output.hpp"
#include "../recordings/survey_text.hpp"
#include "../status_line.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

struct info_options {
  std::vector<std::string> files;
  bool quick = false;
  bool json = false;
  bool quiet = false;
};

command table_of(info_options& o) {
  return {
      .verb = "info",
      .examples = {{{"rowe info run.mcap", "its topics, rates, gaps, losses and stops"},
                    {"rowe info --json *.mcap | jq .duration_s", "for scripts: a line for each file"}}},
      .description =
          "Prints what is in recordings (MCAP), also in those that others wrote. RATE is the number of\n"
          "messages a second between the first and the last one of the topic. OUT OF ORDER are messages "
          "that\n"
          "were published before the one in front of them, or have a lower number.\n"
          "\n"
          "Every message is looked at. With --quick only the summary at the end of the file is read: this\n"
          "takes no time, however large the file is, and says nothing of rates, gaps, sizes, losses and\n"
          "stops. A file without a summary is looked through all the same.\n"
          "\n"
          "It exits with 1 if a file cannot be read. Damaged parts are listed, and are no failure.\n",
      .operands = {{.name = "FILE", .meaning = "recordings, such as run.mcap", .into = &o.files}},
      .options = {{"--quick", "", "", "read the summary only", &o.quick},
                  {"--json", "", "", "one JSON object for each file, on one line", &o.json},
                  {"--quiet", "-q", "", "print errors only on stderr", &o.quiet}}};
}

// Whether a word is meant as a file.
bool is_meant_as_file(const std::string& word) {
  struct stat found {};
  if (::stat(word.c_str(), &found) == 0) return true;
  const std::size_t name = word.rfind('/') == word.npos ? 0 : word.rfind('/') + 1;
  const std::size_t point = word.rfind('.');
  return point != word.npos && point > name && point + 1 < word.size();
}

// Shows how far a file was looked through, once that takes long.
class progress_of {
 public:
  progress_of(const std::string& path, bool quiet)
      : path_{path}, shown_{!quiet && status_line::is_possible()} {}
  ~progress_of() { status_line::clear(); }
  progress_of(const progress_of&) = delete;
  progress_of& operator=(const progress_of&) = delete;

  // False: a signal came.
  bool operator()(double part) {
    const auto now = rt::monotonic_clock::now();
    if (shown_ && now >= next_) {
      next_ = now + 200ms;
      status_line::show(joined(printable(path_), ": ", std::lround(part * 100), " %"));
    }
    return !interrupt::seen();
  }

 private:
  const std::string& path_;
  bool shown_;
  rt::time_point next_ = rt::monotonic_clock::now() + 1s;
};

struct info_outcome {
  bool printed = false; // something
  bool failed = false;
};

// Nothing: go on with the next one.
std::optional<exit_code> print(const std::string& path, const info_options& o, const console& to,
                               info_outcome& so_far) {
  std::string why;
  std::optional<survey> found;
  {
    progress_of progress{path, o.quiet};
    found = survey_of(path, o.quick, why, [&](double part) { return progress(part); });
  }
  if (!found && interrupt::seen()) return exit_code::interrupted;
  if (!found) {
    so_far.failed = true;
    to.error(printable(why));
    if (!o.json) return std::nullopt;
  }
  const std::string text = !found ? json_of_unreadable(path, why)
                           : o.json
                               ? json_of(*found)
                               : joined(so_far.printed ? "\n" : "", text_of(*found, columns_of_stdout()));
  so_far.printed = true;
  return emit(text) ? std::nullopt : std::optional{output_failed() ? exit_code::failed : exit_code::done};
}

} // namespace

exit_code info(argument_list arguments) {
  info_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"info"};
  to.be_quiet(chosen.quiet);
  for (const std::string& word : chosen.files) {
    if (!is_meant_as_file(word))
      return usage_error("info", joined("there is no file ", quoted(word), "; a recording is called *.mcap"));
  }
  info_outcome so_far;
  for (const std::string& path : chosen.files) {
    if (const auto end = print(path, chosen, to, so_far)) return *end;
  }
  return so_far.failed ? exit_code::failed : exit_code::done;
}

} // namespace rowe::tools
