// SPDX-License-Identifier: Apache-2.0
#include "record_modes.hpp"

#include <cstdint>

#include <rowe/recording.hpp>

#include "../arguments/command_line.hpp"
#include "../network/asked_robot.hpp"
#include "../text/json_values.hpp"

namespace rowe::tools {

exit_code repair_recordings(const std::vector<std::string>& files, const console& to) {
  exit_code end = exit_code::done;
  if (files.empty()) return usage_error("record", "--repair needs a FILE");
  for (const std::string& path : files) {
    std::string why;
    const auto done = repair_recording(path, &why);
    if (!done) {
      to.error(printable(why));
      end = exit_code::failed;
      continue;
    }
    for (const recording_damage& part : done->damaged)
      to.note(printable(path), ": ", counted(part.bytes, "byte"), " at ", part.offset,
              " cannot be read: ", printable(part.why));
    if (done->was_whole) {
      to.note(printable(path), " is whole: ", counted(done->messages, "message"));
    } else {
      to.note(printable(done->path), done->in_place ? " got its end: " : " has what could be read: ",
              counted(done->messages, "message"));
    }
  }
  return end;
}

exit_code ask_for_snapshot(const remote_place& at, const std::string& cause, rt::duration timeout,
                           const console& to) {
  asked_robot robot{"record", timeout, to};
  if (const auto end = robot.connect(at)) return *end;
  const auto answer =
      robot.ask("/rowe/record", cause.empty() ? "{}" : joined("{\"cause\":", json_string_of(cause), "}"));
  if (!answer) return robot.give_up("whether its black boxes write");
  const auto asked = read_json(*answer).get<std::uint64_t>("black_boxes");
  if (!asked || *asked == 0) {
    const auto counted_only = robot.ask("/rowe/record", R"({"write":false})");
    const auto there = read_json(counted_only.value_or("{}")).get<std::uint64_t>("black_boxes");
    if (there && *there > 0)
      to.error(robot.url(), " has a black box, which has no room for that now: try again");
    else
      to.error(robot.url(), " has no black box (`rowe serve --black-box DIR`, or endpoint::record())");
    return exit_code::failed;
  }
  to.note(*asked == 1 ? "its black box writes" : joined("its ", *asked, " black boxes write"));
  return exit_code::done;
}

} // namespace rowe::tools
