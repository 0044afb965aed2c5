// SPDX-License-Identifier: Apache-2.0
// The invocation of the paper, from the other side, with no schema: add_two_numbers URL A B
#include <cstdio>
#include <cstdlib>

#include <rowe/rowe.hpp>

using namespace std::chrono_literals;

int main(int count, char** arguments) {
  if (count != 4) return std::fputs("usage: add_two_numbers URL A B\n", stderr), 2;
  auto hop = rowe::endpoint::connect(arguments[1]).value();
  auto lane = hop.open_lane().value();
  const int a = std::atoi(arguments[2]), b = std::atoi(arguments[3]);
  const rowe::message question{"service", "add-two-numbers", "a", a, "b", b};
  const auto answer = lane.invoke(question, 2s);                    // waits, at most so long
  if (!answer) {
    return std::fprintf(stderr, "%s\n", answer.error().message().c_str()), 1;
  }
  const auto sum = answer->get<int>("result");                      // of {"result":42,"in_reply_to":"..."}
  if (!sum) {                                                       // where, what was wanted, what is there
    return std::fprintf(stderr, "%s\n", sum.error().message().c_str()), 1;
  }
  std::printf("%d + %d = %d\n", a, b, *sum);
}
