// SPDX-License-Identifier: Apache-2.0
// rowe info: what is in recordings, or what topics, services and actions of a robot are (robot_info.hpp).
// Words that are files, or look like one, are recordings.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "../arguments/command_line.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/remote.hpp"
#include "../output.hpp"
#include "../recordings/reading_progress.hpp"
#include "../recordings/survey_text.hpp"
#include "../status_line.hpp"
#include "robot_info.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

struct info_options {
  std::vector<std::string> files; // or a URL and names
  remote_place at;
  std::optional<rt::duration> timeout;
  bool quick = false;
  bool json = false;
  bool quiet = false;
};

command table_of(info_options& o) {
  return {
      .verb = "info",
      .examples = {{{"rowe info run.mcap", "its topics, rates, gaps, losses and stops"},
                    {"rowe info 127.0.0.1:8080 /odom", "its type, who publishes it and who subscribes"}}},
      .description =
          "Prints what is in recordings (MCAP), also in those that others wrote; or, behind a URL or with\n"
          "$ROWE_URL, what topics, services and actions of a robot are: type, publishers, subscribers, "
          "rate,\n"
          "and the members of their messages.\n"
          "\n"
          "Of a recording RATE is the number of messages a second between the first and the last one of the\n"
          "topic. OUT OF ORDER are messages that were published before the one in front of them, or have a\n"
          "lower number. Every message is looked at. With --quick only the summary at the end of the file "
          "is\n"
          "read: this takes no time, however large the file is, and says nothing of rates, gaps, sizes, "
          "losses\n"
          "and stops. A file without a summary is looked through all the same.\n"
          "\n"
          "It exits with 1 if a file cannot be read, or a name is not there. Damaged parts are listed, and "
          "are\n"
          "no failure.\n",
      .operands = {{.name = "FILE|URL TOPIC|SERVICE|ACTION",
                    .meaning = "recordings, such as run.mcap; or a robot, and names there",
                    .into = &o.files}},
      .options = with_remote(
          o.at, {{"--quick", "", "", "of a file: read the summary only", &o.quick},
                 {"--json", "", "", "one JSON object for each file or name, on one line", &o.json},
                 {"--timeout", "", "TIME", "of a robot: for the connection and for each answer (default 2s)",
                  time_span{&o.timeout}},
                 {"--quiet", "-q", "", "print errors only on stderr", &o.quiet}})};
}

// Whether a word is meant as a file.
bool is_meant_as_file(const std::string& word) {
  struct stat found {};
  if (::stat(word.c_str(), &found) == 0) return true;
  if (reads_like_url(word) && !word.ends_with(".mcap")) return false;
  const std::size_t name = word.rfind('/') == word.npos ? 0 : word.rfind('/') + 1;
  const std::size_t point = word.rfind('.');
  return point != word.npos && point > name && point + 1 < word.size();
}

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
    reading_progress progress{path, o.quiet};
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

exit_code of_robot(const info_options& o, const console& to) {
  robot_info_options asked{.at = o.at, .names = o.files, .timeout = o.timeout, .json = o.json};
  const char* const usual = std::getenv("ROWE_URL");
  const std::string& first = o.files.front();
  const bool is_host = first.find_first_of("/.") != 0 && o.files.size() > 1 && o.files[1].starts_with('/');
  if ((reads_like_url(first) && !first.starts_with('.')) || is_host) {
    asked.at.url = o.files.front();
    asked.names.erase(asked.names.begin());
  } else if (usual != nullptr && *usual != '\0') {
    asked.at.url = usual;
  } else {
    const auto other = std::ranges::find_if_not(o.files, is_meant_as_file);
    return usage_error("info", joined("there is no file ", quoted(*other),
                                      "; a recording is called *.mcap, and in front of a robot's topics and "
                                      "services stands its URL"));
  }
  if (asked.names.empty())
    return usage_error("info", "a TOPIC or SERVICE is missing; `rowe list URL` has them");
  if (o.quick) return usage_error("info", "--quick is for recordings");
  return info_of_robot(asked, to);
}

} // namespace

exit_code info(argument_list arguments) {
  info_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"info"};
  to.be_quiet(chosen.quiet);
  if (!std::ranges::all_of(chosen.files, is_meant_as_file)) return of_robot(chosen, to);
  info_outcome so_far;
  for (const std::string& path : chosen.files) {
    if (const auto end = print(path, chosen, to, so_far)) return *end;
  }
  return so_far.failed ? exit_code::failed : exit_code::done;
}

} // namespace rowe::tools
