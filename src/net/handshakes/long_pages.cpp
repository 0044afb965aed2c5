// SPDX-License-Identifier: Apache-2.0
// Pages whose body is long, such as the last value of a topic with maps. Nothing of them is with
// libwebsockets. The body stays where it is, and goes from there to the socket, some of it in a turn and none
// in a turn in which another page was driven. So such a page takes no more of a turn than others do.
//
// Who does not take service::long_body_step_bytes in service::long_body_step_max is cut, because few such
// bodies can be sent at a time. What counts is what has left the socket's buffer.
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

#include "net/base/socket_options.hpp"
#include "net/handshakes/handshakes.hpp"
#include "net/http/http_page.hpp"
#include "net/http/send_answer.hpp"

namespace rowe::net {

namespace {

// What the kernel may hold of it unsent: enough for a turn or two, and little enough that the kernel says
// soon that there is room.
constexpr std::uint32_t unsent_bytes = 128 * 1024;

} // namespace

// One in a turn, and each in its turn: the kernel always names those that are writable in the same order.
void handshakes::drive_next() noexcept {
  if (!any_writable_) return;
  const auto count = static_cast<std::uint32_t>(handshakes_.size());
  for (std::uint32_t i = 1; i <= count; ++i) {
    const std::uint32_t index = (driven_ + i) % count;
    handshake& one = handshakes_[index];
    if (one.writable_in != turn_ || (one.now != phase::page && one.now != phase::body)) continue;
    driven_ = index;
    page_was_driven_ = true;
    return one.now == phase::page ? drive_page(one) : drive_body(one);
  }
}

void handshakes::begin_body(handshake& one, const wire::http_judgement& request,
                            const service::http_answer& answer) noexcept {
  char head[long_page_head_bytes_max];
  const bool sent = send_whole(one.socket.get(), write_long_page_head(head, answer));
  if (!sent || request.head) answer.in_pieces.from->end_body(answer.in_pieces.which);
  if (!sent) return leave(one);
  if (request.head) return begin_close(one);
  one.body = answer.in_pieces;
  one.body_at = one.body_taken = 0;
  limit_unsent(one.socket.get(), unsent_bytes);
  enter(one, phase::body, body_, EPOLLOUT);
}

void handshakes::drive_body(handshake& one) noexcept {
  for (std::size_t left = service::long_body_step_bytes; left != 0;) {
    std::span<const std::byte> here = one.body.from->read_body(one.body.which, one.body_at);
    if (here.empty()) return cut_body(one);
    here = here.first(std::min(left, here.size()));
    const ssize_t sent = ::send(one.socket.get(), here.data(), here.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0) {
      if (!has_no_room(errno)) leave(one);
      return;
    }
    one.body_at += static_cast<std::size_t>(sent);
    left -= static_cast<std::size_t>(sent);
    if (one.body_at == one.body.bytes) return begin_close(one);
    if (static_cast<std::size_t>(sent) < here.size()) return;
  }
}

void handshakes::end_body(handshake& one) noexcept {
  if (one.body.from == nullptr) return;
  one.body.from->end_body(one.body.which);
  one.body = {};
}

// From the reset the reader learns that the body is not whole.
void handshakes::cut_body(handshake& one) noexcept {
  ++counters_.pages_cut;
  reset_on_close(one.socket.get());
  leave(one);
}

// Bodies whose readers were given time enough.
void handshakes::expire_bodies() noexcept {
  while (deadline_node* node = body_.take_due(now_)) {
    auto& one = static_cast<handshake&>(*node);
    const auto kept = static_cast<std::size_t>(std::max(unacknowledged_bytes(one.socket.get()), 0));
    const std::size_t taken = one.body_at - std::min(kept, one.body_at);
    if (taken < one.body_taken + service::long_body_step_bytes) {
      cut_body(one);
      continue;
    }
    one.body_taken = taken;
    body_.arm(one, now_);
  }
}

} // namespace rowe::net
