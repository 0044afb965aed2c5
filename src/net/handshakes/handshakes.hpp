// SPDX-License-Identifier: Apache-2.0
// Accepted sockets that are not connections yet, or never will be. Each waits for its request's header; then
// it is served a page, upgraded, logged in (wire/http/http_login.hpp), or rejected with a text. Service
// thread; never allocates itself (libwebsockets does, for a page or an upgrade).
//
// The header is peeked at in the kernel (MSG_PEEK) until it is complete. Then exactly the header is taken
// out: the bytes behind it belong to the connection, and libwebsockets must not see them. So no socket needs
// a buffer of its own. The epoll is edge triggered in this phase, because bytes that are left in the kernel
// would be reported again and again.
//
// A turn takes one step with libwebsockets. So a stop on an open connection waits behind one such step, not
// behind as many as strangers send. Headers that are ready wait in a queue.
//
// Sockets that send nothing, or only a part of their request, keep nobody out: if no place is left, one of
// them is evicted, of the source that has begun most handshakes lately (one that was let in, or got its page,
// does not count). A socket with bytes that were not looked at yet keeps its place until they were.
// While there are only such sockets, newcomers wait in the kernel's queue, for a few turns at most.
//
// A socket that was answered and must be closed is *closing*: our end is shut, and what arrives is discarded
// until the other end is shut, too. The reason: a socket that is closed with unread bytes sends a reset, and
// clients then drop the answer unread.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "net/base/deadline_list.hpp"
#include "net/base/listener.hpp"
#include "net/base/poll_set.hpp"
#include "net/base/reserved_descriptors.hpp"
#include "net/base/settings.hpp"
#include "net/base/source_tally.hpp"
#include "net/connections/established.hpp"
#include "net/handshakes/token_tries.hpp"
#include "net/lws/lws_host.hpp"
#include "service/base/transport.hpp"
#include "wire/http/http_request.hpp"

namespace rowe::net {

class handshakes {
 public:
  // `scratch` is shared with the reading of connections and holds header_bytes_max.
  handshakes(const socket_limits& limits, const wire::handshake_policy& policy, poll_set& polled,
             lws_host& host, established& connections, reserved_descriptors& kept, socket_counters& counters,
             std::span<std::byte> scratch);
  ~handshakes();
  handshakes(const handshakes&) = delete;
  handshakes& operator=(const handshakes&) = delete;

  void begin_turn(rt::time_point now) noexcept {
    now_ = now;
    page_was_driven_ = false;
    any_writable_ = false;
    ++turn_;
  }
  void begin(accepted_socket accepted, service::transport_sink& sink) noexcept;
  void on_event(const socket_event& event) noexcept;
  // Drives one of the pages that can be written to. Looks at one of the headers that are ready, or answers
  // one of the pages that wait. Called once a turn, when all events were reported.
  void step(service::transport_sink& sink) noexcept;
  bool has_ready() const noexcept { return !ready_.empty() || look_again_; }
  // True while there is no place for a newcomer, but will be.
  bool must_wait() const noexcept;
  void expire(service::transport_sink& sink) noexcept;
  rt::time_point next_deadline() const noexcept;

 private:
  enum class phase : std::uint8_t {
    free,
    header,
    waiting, // a page, for its value (waiting_pages.cpp)
    page,
    body, // a page whose body is long (long_pages.cpp)
    closing,
  };
  struct handshake : deadline_node {
    descriptor socket;
    socket_address peer;
    tls::place_id place; // under TLS
    tls::client_certificate shown;
    lws_watch watch;
    service::awaited_page awaited; // waiting
    bool to_head = false;          // likewise: it was asked for by HEAD
    std::size_t page_left = 0;     // of a page in pieces, when its time was last set
    service::long_body body;       // body
    std::size_t body_at = 0;       // likewise: so much is in the socket
    std::size_t body_taken = 0;    // and so much the reader had taken when its time was last set
    std::uint32_t generation = 0;
    std::uint32_t scanned = 0; // bytes of the header seen without its end
    std::uint32_t events = 0;  // that wait for step(); not 0 while it is in `ready_`
    phase now = phase::free;
    std::uint64_t turn = 0;        // in which it came: what it has sent is not known before the next turn
    std::uint64_t writable_in = 0; // page, body: the turn in which its socket was last writable
    bool looked_at = false;        // its header was looked at, and was not whole
    std::uint32_t before = 0;      // handshakes_begun() of its source, when it came
    bool welcome = false;          // its answer is not that of an error
    bool lent = false;             // its descriptor is reserved for the stop
    bool crowded = false;          // its source has all it may have, so it may only stop
  };

  static bool is_page(phase now) noexcept {
    return now == phase::waiting || now == phase::page || now == phase::body;
  }
  static service::credentials shown_by(const handshake& one, const wire::http_judgement& request,
                                       std::span<char> address) noexcept;
  handshake* free_or_closing() noexcept;
  bool may_be_evicted(const handshake& one) const noexcept;
  template <class Wanted>
  handshake* unfinished(bool by_claim, Wanted&& wanted) noexcept;
  handshake* place(const accepted_socket& came, bool crowded, std::uint32_t before) noexcept;
  void evict(handshake& one) noexcept;
  void enter(handshake& one, phase next, deadline_list& deadlines, std::uint32_t events) noexcept;
  void leave(handshake& one) noexcept;
  void unqueue(handshake& one) noexcept;
  void begin_close(handshake& one) noexcept;
  void read_header(handshake& one, std::uint32_t events, service::transport_sink& sink) noexcept;
  void serve(handshake& one, const wire::http_judgement& request, service::transport_sink& sink) noexcept;
  void answer_form(handshake& one, const wire::http_judgement& form, service::transport_sink& sink) noexcept;
  void upgrade(handshake& one, const wire::http_judgement& request, service::transport_sink& sink) noexcept;
  void write_page(handshake& one, const wire::http_judgement& request, const service::http_answer& answer,
                  service::transport_sink& sink) noexcept;
  void await(handshake& one, const service::awaited_page& page, bool head,
             service::transport_sink& sink) noexcept;
  void begin_body(handshake& one, const wire::http_judgement& request,
                  const service::http_answer& answer) noexcept;
  void drive_body(handshake& one) noexcept;
  void end_body(handshake& one) noexcept;
  void cut_body(handshake& one) noexcept;
  void expire_bodies() noexcept;
  std::uint32_t pages_max() const noexcept;
  bool answer_waiting(service::transport_sink& sink) noexcept;
  void hand_over(handshake& one, const wire::http_judgement& request,
                 const service::http_answer* answer) noexcept;
  void starve(handshake& one, service::transport_sink& sink) noexcept;
  void reject(handshake& one, const wire::http_rejection& rejection, service::transport_sink& sink) noexcept;
  void report(const socket_address& peer, const wire::http_rejection& rejection,
              service::transport_sink& sink) noexcept;
  void refuse(handshake& one, const service::admit_answer& why, const wire::http_judgement& request,
              service::transport_sink& sink) noexcept;
  void reject_tls(handshake& one, service::transport_sink& sink) noexcept;
  void drive_next() noexcept;
  void drive_page(handshake& one) noexcept;
  bool end_oldest_page() noexcept;
  bool too_many_from(const socket_address& peer) const noexcept;

  const socket_limits limits_;
  const wire::handshake_policy& policy_;
  poll_set& polled_;
  lws_host& host_;
  established& connections_;
  reserved_descriptors& kept_;
  socket_counters& counters_;
  std::span<std::byte> scratch_;
  std::vector<handshake> handshakes_;
  std::vector<std::uint32_t> ready_; // a queue of indices
  token_tries tries_;
  source_tally begun_ = handshakes_begun();
  std::uint32_t pages_ = 0;     // under way, or waiting
  std::uint64_t came_seen_ = 0; // transport_sink::awaited_came() when all that wait were asked about
  bool look_again_ = false;     // there may be an answer for another page that waits
  std::uint64_t turn_ = 0;
  bool page_was_driven_ = false;
  bool any_writable_ = false; // a page's socket, in this turn
  std::uint32_t driven_ = 0;  // the page that was driven last
  deadline_list header_;
  deadline_list waiting_;
  deadline_list page_;
  deadline_list body_;
  deadline_list closing_;
  rt::time_point now_{};
};

} // namespace rowe::net
