// SPDX-License-Identifier: Apache-2.0
// A robot's types, for those who read its messages: a step of the build runs this and keeps what it prints.
//
//   types typescript > robot.d.ts     types json-schema > state.json     types ros > State.msg
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string_view>

#include <rowe/ros.hpp>
#include <rowe/types.hpp>

enum class mode : std::uint8_t { off, manual, automatic };

struct state {
  rowe::ros::header header;
  ::mode mode = mode::off;
  std::chrono::milliseconds uptime{};
  double battery = 0; // volts
};

template <> inline constexpr auto rowe::names<mode> =
    rowe::enumerators<mode::off, mode::manual, mode::automatic>{};

template <> inline constexpr auto rowe::schema<state> =
    rowe::fields<&state::header, rowe::field<&state::mode>.by_name(), &state::uptime,
                 &state::battery>{}.type("my_robot/State");

int main(int count, char** arguments) {
  const std::string_view form = count == 2 ? arguments[1] : "";
  if (form == "typescript") return std::fputs(rowe::typescript<state>().c_str(), stdout) < 0;
  if (form == "json-schema") return std::puts(rowe::json_schema<state>().c_str()) < 0;
  if (form == "ros") {
    const rowe::ros_text message = rowe::ros_message<state>();
    if (!message) return std::fprintf(stderr, "%s\n", message.reason.c_str()), 1;
    return std::fputs(message.text.c_str(), stdout) < 0;
  }
  return std::fputs("usage: types typescript|json-schema|ros\n", stderr), 2;
}
