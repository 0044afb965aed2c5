// SPDX-License-Identifier: Apache-2.0
// Pages that wait for a value, such as the next one of a topic. Each holds its place for
// service::page_wait_max at most; nothing of it is with libwebsockets meanwhile. One is answered a turn, and
// none in a turn in which another page was driven, so they take no more of a turn than other pages do. They
// take half of the places of pages at most, so whoever asks for something that is there finds a place, even
// if those who wait have left without a word.
#include <algorithm>

#include "net/handshakes/handshakes.hpp"
#include "net/http/handshake_answers.hpp"

namespace rowe::net {

void handshakes::await(handshake& one, const service::awaited_page& page, bool head,
                       service::transport_sink& sink) noexcept {
  const std::uint32_t most = std::max(pages_max() / 2, 1U);
  std::uint32_t waiting = 0;
  if (waiting_.oldest_of([&](const deadline_node&) { return ++waiting == most; }) != nullptr)
    return reject(one, answer::too_many_waiting(most), sink);
  one.awaited = page;
  one.to_head = head;
  enter(one, phase::waiting, waiting_, 0); // its end is reported unasked
}

// Answers the oldest for which there is something, or whose time is over. False: there is none now.
bool handshakes::answer_waiting(service::transport_sink& sink) noexcept {
  look_again_ = false;
  if (waiting_.oldest() == nullptr) return false;
  const std::uint64_t came = sink.awaited_came();
  if (page_was_driven_) {
    look_again_ = came != came_seen_;
    return false;
  }
  service::http_answer answer;
  deadline_node* node = waiting_.take_due(now_);
  if (node != nullptr) {
    answer = sink.on_http(
        {.path = {}, .if_none_match = {}, .awaited = &static_cast<handshake*>(node)->awaited, .last = true});
    if (answer.later) answer = {};
  } else if (came != came_seen_) {
    node = waiting_.oldest_of([&](deadline_node& each) {
      answer =
          sink.on_http({.path = {}, .if_none_match = {}, .awaited = &static_cast<handshake&>(each).awaited});
      return !answer.later;
    });
    if (node == nullptr) came_seen_ = came;
  }
  if (node == nullptr) return false;
  look_again_ = came != came_seen_;
  page_was_driven_ = true;
  auto& one = static_cast<handshake&>(*node);
  wire::http_judgement request;
  request.outcome = wire::http_outcome::page;
  request.head = one.to_head;
  request.host = "localhost";
  write_page(one, request, answer, sink);
  return true;
}

} // namespace rowe::net
