// SPDX-License-Identifier: Apache-2.0
// The other side as a process:
//
//   processes_actor listen PORT ADDRESS
//   processes_actor connect URL
//
// prints "ready PORT" (0 as a client), then what part.hpp says, until it is killed or the reader of its
// output is gone.
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "part.hpp"

int main(int count, char** words) {
  const std::string_view role = count >= 3 ? words[1] : "";
  if (!(role == "listen" && count == 4) && !(role == "connect" && count == 3)) {
    std::fprintf(stderr, "usage: processes_actor listen PORT ADDRESS | connect URL\n");
    return 2;
  }
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  rowe::endpoint_options options = part::quick_options();
  if (role == "listen") options = part::quick_options(words[3]);
  auto opened = role == "listen"
                    ? rowe::endpoint::listen(static_cast<std::uint16_t>(std::atoi(words[2])), options)
                    : rowe::endpoint::connect(words[2], options);
  if (!opened) {
    std::fprintf(stderr, "processes_actor: %.*s\n", static_cast<int>(opened.error().name().size()),
                 opened.error().name().data());
    return 1;
  }
  part::actor acts{*opened, [](std::string_view what, std::string_view text) {
                     std::printf("%.*s %.*s\n", static_cast<int>(what.size()), what.data(),
                                 static_cast<int>(text.size()), text.data());
                   }};
  std::printf("ready %u\n", static_cast<unsigned>(opened->port()));
  rowe::rt::periodic loop{std::chrono::milliseconds{1}};
  while (const auto now = loop.wait()) acts.step(*now);
  return 0;
}
