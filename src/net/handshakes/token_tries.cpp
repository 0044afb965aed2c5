// SPDX-License-Identifier: Apache-2.0
#include "net/handshakes/token_tries.hpp"

#include <sys/socket.h>

#include <utility>

#include "net/base/socket_options.hpp"
#include "net/http/handshake_answers.hpp"
#include "net/http/send_answer.hpp"

namespace rowe::net {

void token_tries::answer_late(descriptor socket, rt::time_point now) noexcept {
  if (count_ == waiting_.size()) answer_first();
  waiting_[(first_ + count_++) % waiting_.size()] = {std::move(socket), now + answered_after};
}

void token_tries::expire(rt::time_point now) noexcept {
  while (next() <= now) answer_first();
}

void token_tries::answer_first() noexcept {
  late_answer& first = waiting_[first_];
  (void)discard_input(first.socket.get()); // what is unread would turn the close into a reset
  send_answer(first.socket.get(), answer::too_many_wrong_tokens());
  first.socket.reset();
  first_ = (first_ + 1) % waiting_.size();
  --count_;
}

} // namespace rowe::net
