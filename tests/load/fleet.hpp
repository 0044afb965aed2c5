// SPDX-License-Identifier: Apache-2.0
// The clients of a robot under load, in a process of their own, so that what they take is not the robot's:
// healthy ones, which look whether they get everything in order; hostile ones; and visitors.
#pragma once
#include <sys/types.h>

#include "board.hpp"

namespace rowe::load {

// The token of those who may connect.
inline constexpr const char* fleet_token = "a-token-of-the-whole-fleet";
// What all healthy clients take, and what the fast ones take besides. Each value is {"n":NUMBER}.
inline constexpr const char* topic_for_all = "/for/all";
inline constexpr const char* topic_of_loop = "/of/loop";

// How many visitors there are at a time, at most.
inline constexpr std::uint32_t visitors_max = 64;

// As many open files as this process may have.
void raise_descriptor_limit();

class fleet {
 public:
  // Parts the process: only where there is no other thread.
  fleet(const plan& of, board& shown);
  ~fleet(); // ends it, and waits for that
  fleet(const fleet&) = delete;
  fleet& operator=(const fleet&) = delete;

 private:
  board& board_;
  pid_t child_ = -1;
};

} // namespace rowe::load
