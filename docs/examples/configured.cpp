// SPDX-License-Identifier: Apache-2.0
// A robot whose user configures it: configured [FILE]. What the environment says comes before the file.
#include <cstdio>
#include <string>

#include <rowe/rowe.hpp>

int main(int count, char** arguments) {
  rowe::configuration defaults;
  defaults.endpoint.name = "ang-01"; // where nobody says otherwise
  rowe::settings chosen{defaults};
  std::string why;
  rowe::status right;
  if (count > 1) right = chosen.read_file(arguments[1], &why);
  if (right) right = chosen.read_environment(&why);
  if (right) right = chosen.check(&why);
  if (!right) return std::fprintf(stderr, "%s\n", why.c_str()), 2;

  auto robot = rowe::endpoint::listen(chosen.values().endpoint).value();
  std::printf("ws://127.0.0.1:%d\n", robot.port());
  std::fflush(stdout);
  auto battery = robot.advertise<rowe::json_text>("/battery", {.latched = true}).value();
  battery.publish(R"({"percent":83})").value();
  (void)std::getchar(); // until Enter, or the end of stdin
}
