// SPDX-License-Identifier: Apache-2.0
// Makes wrong tokens slow for the source that tries them: after five, each further one is answered a second
// late. A token is looked at all the same, and a right one lets its peer in at once. So nobody can keep
// others out who come from the same address, through the same proxy, or to stop the robot.
//
// A source is forgiven one wrong token each ten seconds. The sources that tried last are remembered. Answers
// that wait hold a descriptor each and no place of a handshake; when there are too many, the oldest of them
// is sent at once. Service thread only. Never waits, never allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <rowe/rt/clock.hpp>

#include "net/base/address.hpp"
#include "net/base/descriptor.hpp"
#include "net/base/socket_options.hpp"
#include "net/base/source_tally.hpp"
#include "net/http/handshake_answers.hpp"
#include "net/http/send_answer.hpp"

namespace rowe::net {

class token_tries {
 public:
  static constexpr std::uint32_t wrong_max = 5; // that are answered at once
  static constexpr rt::duration forgiven_after = std::chrono::seconds{10};
  static constexpr rt::duration answered_after = std::chrono::seconds{1};
  static constexpr std::size_t waiting_max = 16;

  // A token of this source was wrong. True: there were so many that the answer is to be slow.
  bool note_wrong(const socket_address& from, rt::time_point now) noexcept {
    return wrong_.note(from, now) >= wrong_max;
  }

  // The answer to this socket, which is in no poll_set any more, is sent later.
  void answer_late(descriptor socket, rt::time_point now) noexcept {
    if (count_ == waiting_.size()) answer_first();
    waiting_[(first_ + count_++) % waiting_.size()] = {std::move(socket), now + answered_after};
  }
  // Sends the answers that are due.
  void expire(rt::time_point now) noexcept {
    while (next() <= now) answer_first();
  }
  // When expire() is needed at the latest.
  rt::time_point next() const noexcept { return count_ == 0 ? rt::never : waiting_[first_].due; }

 private:
  struct late_answer {
    descriptor socket;
    rt::time_point due{};
  };

  void answer_first() noexcept {
    late_answer& first = waiting_[first_];
    (void)discard_input(first.socket.get()); // what is unread would turn the close into a reset
    send_answer(first.socket.get(), answer::too_many_wrong_tokens());
    first.socket.reset();
    first_ = (first_ + 1) % waiting_.size();
    --count_;
  }

  // It counts no further, so ten seconds of quiet are enough for one prompt answer.
  source_tally wrong_{forgiven_after, wrong_max};
  std::array<late_answer, waiting_max> waiting_{}; // a ring: first come, first answered
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

} // namespace rowe::net
