// SPDX-License-Identifier: Apache-2.0
// Pages that libwebsockets writes, some of it in a turn.
#include "net/base/socket_options.hpp"
#include "net/handshakes/handshakes.hpp"
#include "net/http/handshake_answers.hpp"

namespace rowe::net {

using service::transport_sink;

std::uint32_t handshakes::pages_max() const noexcept {
  return limits_.handshakes_max - reserved_for_stop(limits_.handshakes_max);
}

void handshakes::serve(handshake& one, const wire::http_judgement& request, transport_sink& sink) noexcept {
  if (pages_ >= pages_max()) return reject(one, answer::too_many_pages(pages_max()), sink);
  char address[address_text_bytes_max];
  const service::admit_answer allowed = sink.may_read(shown_by(one, request, address));
  if (allowed.status != 0) return refuse(one, allowed, request, sink);
  const service::http_answer answer = sink.on_http({.path = request.path,
                                                    .if_none_match = request.if_none_match,
                                                    .accepts_gzip = request.accepts_gzip,
                                                    .who = allowed.who});
  if (answer.later) return await(one, answer.awaited, request.head, sink);
  write_page(one, request, answer, sink);
}

void handshakes::write_page(handshake& one, const wire::http_judgement& request,
                            const service::http_answer& answer, transport_sink& sink) noexcept {
  constexpr std::uint16_t first_error = 400;
  one.welcome = answer.status < first_error;
  if (answer.in_pieces.from != nullptr) return begin_body(one, request, answer);
  do {
    hand_over(one, request, &answer);
  } while (one.watch.starved && one.watch.in_pieces && end_oldest_page()); // one read quickly is written
  one.page_left = one.watch.rest.size();
  if (one.watch.wsi) return enter(one, phase::page, page_, EPOLLOUT);
  if (one.watch.answered) return begin_close(one);
  if (one.watch.duplicate < 0) return reject(one, answer::no_descriptor(), sink);
  if (one.watch.starved) return starve(one, sink);
  if (has_gone(one.socket.get())) return leave(one);
  reject(one, answer::page_not_written(), sink);
}

// A page may be long: the time is for each 64 KiB of it.
void handshakes::drive_page(handshake& one) noexcept {
  constexpr std::size_t timed_bytes = std::size_t{64} << 10;
  host_.drive(one.watch);
  if (!one.watch.wsi) return begin_close(one);
  if (one.page_left < one.watch.rest.size() + timed_bytes) return;
  one.page_left = one.watch.rest.size();
  page_.arm(one, now_);
}

bool handshakes::end_oldest_page() noexcept {
  auto* const oldest = static_cast<handshake*>(page_.oldest());
  if (oldest == nullptr) return false;
  reset_on_close(oldest->socket.get());
  leave(*oldest);
  ++counters_.handshakes_evicted;
  return true;
}

} // namespace rowe::net
