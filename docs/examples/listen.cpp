// SPDX-License-Identifier: Apache-2.0
// Prints what a robot publishes, knowing nothing of its type: listen ws://127.0.0.1:8080 /odom
#include <cstdio>

#include <rowe/rowe.hpp>

using namespace std::chrono_literals;

int main(int count, char** arguments) {
  if (count != 3) return std::fputs("usage: listen URL TOPIC\n", stderr), 2;
  auto robot = rowe::endpoint::connect(arguments[1]).value();     // connects, and again if it is lost
  auto messages = robot.subscribe<rowe::json_text>(arguments[2]).value();
  for (;;) {
    const auto message = messages.take(10s);                      // waits: this thread is not a real-time one
    if (!message) {
      return std::fprintf(stderr, "%s\n", message.error().message().c_str()), 1;
    }
    const auto text = message->value();                           // valid JSON, in place until `message` goes
    std::printf("%.*s\n", static_cast<int>(text.size()), text.data());
    std::fflush(stdout);
  }
}
