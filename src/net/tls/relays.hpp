// SPDX-License-Identifier: Apache-2.0
// TLS connections that are not upgraded yet, or never will be. Each goes through the handshake. Then it is a
// relay: between it and the service thread stands a pair of local sockets, over which that one reads the
// request and answers in plain, as if there were no TLS. If the answer is an upgrade, the service thread asks
// for the session, and the relay is gone. If it is a page or a rejection, the relay sends it, says that
// nothing more comes, and closes.
//
// Of what the peer sends, exactly the header goes to the service thread, with a form if there is one. The
// bytes behind it belong to the connection, and stay in the session.
//
// Sockets that do not end their handshake keep nobody out: if no place is left, one of them is evicted. A
// source that has begun few handshakes lately comes before one that has begun many, for places and for the
// work of a handshake. One that was let in, or got its page, does not count. One source has only so many
// places, and beyond them evicts its own. The place of an answer that is late on purpose is free for others.
//
// Terminator's thread; allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "net/base/arrival.hpp"
#include "net/base/deadline_list.hpp"
#include "net/base/descriptor.hpp"
#include "net/base/listener.hpp"
#include "net/base/poll_set.hpp"
#include "net/base/reserved_descriptors.hpp"
#include "net/base/socket_limits.hpp"
#include "net/base/source_tally.hpp"
#include "net/tls/certificates.hpp"
#include "net/tls/session.hpp"

namespace rowe::net::tls {

// Where a relay says what has happened.
class relay_outlet {
 public:
  // False: there is no room, and nothing was reported.
  virtual bool report(const arrival& news) noexcept = 0;
  // Somebody has lost, or not got, a place.
  virtual void note_eviction() noexcept = 0;
  // A counter of tls_counters.
  virtual void count(service::counter which) noexcept = 0;
  // Requests that have come in meanwhile.
  virtual void take_requests() noexcept = 0;

 protected:
  ~relay_outlet() = default;
};

class relays {
 public:
  // `remote`: the server that a client wants, by its certificate; empty: we are the server.
  relays(const socket_limits& limits, std::string remote, certificates& with, poll_set& polled,
         reserved_descriptors& kept, relay_outlet& outlet);
  ~relays();
  relays(const relays&) = delete;
  relays& operator=(const relays&) = delete;

  void begin_turn(rt::time_point now) noexcept { now_ = now; }
  // Server: somebody who connected.
  void accept(accepted_socket accepted);
  // Client: a connected socket. `attempt` is its place's generation from now on.
  void connect(descriptor socket, std::uint32_t attempt);
  // The service thread has answered with an upgrade, and has closed its end of the pair, or will.
  void hand_over(place_id place, service::connection_id connection);
  // The service thread will answer later, because the token was wrong.
  void answer_late(place_id place) noexcept;
  // Client: the attempt has taken too long.
  void drop(place_id place) noexcept;

  void on_event(const socket_event& event);
  // Server: takes one handshake a step further, which costs as much as many other things. False: none waits.
  bool shake_next();
  void expire();
  rt::time_point next_deadline() const noexcept;

 private:
  enum class phase : std::uint8_t {
    free,
    shaking,  // the handshake is under way
    reading,  // server: the request's header is not whole yet
    relaying, // the service thread has the other end of the pair
    draining, // the answer is written, but not sent whole
    closing,  // our end is shut, the peer's is awaited; what arrives is thrown away
    rejected, // client: it is reported that the server refuses us. The service thread drops the place
  };
  struct relay : deadline_node {
    std::unique_ptr<session> secure;
    descriptor pair; // our end
    socket_address peer;
    std::uint32_t generation = 0;
    phase now = phase::free;
    bool lent = false;           // on descriptors that are reserved for the stop
    bool looked_at = false;      // the first byte was
    bool waits = false;          // its handshake can go on: shake_next()
    std::uint32_t before = 0;    // handshakes_begun() of its source, when it came
    bool upgrades = false;       // the answer is one to an upgrade, which waits for hand_over()
    bool answered = false;       // some of the answer was seen
    bool welcome = false;        // and it is not that of an error
    bool header_passed = false;  // nothing more of what the peer sends is read here
    std::uint32_t of_socket = 0; // events that the poll_set looks for
    std::uint32_t of_pair = 0;
    std::size_t header_bytes = 0;
    std::vector<char> header;
  };

  relay* find(place_id place) noexcept;
  place_id id_of(const relay& one) const noexcept;
  relay* place_for(const accepted_socket& came, std::uint32_t before) noexcept;
  relay* oldest_closing(bool lent) noexcept;
  template <class Wanted>
  relay* to_evict(const socket_address& by, std::uint32_t before, Wanted&& wanted) noexcept;
  template <class Wanted>
  relay* oldest_unserved(Wanted&& wanted) noexcept;
  bool may_lend() const noexcept;
  void begin(relay& one, descriptor socket, const socket_address& peer);
  bool speaks_tls(relay& one);
  void shake(relay& one);
  void open_pair(relay& one);
  void read_header(relay& one);
  void pass_header(relay& one);
  void lose(relay& one);
  void pump(relay& one);
  bool sees_upgrade(relay& one) noexcept;
  void seal_answer(relay& one) noexcept;
  void answer(relay& one, const wire::http_rejection& rejection);
  bool report_rejected(const relay& one, const wire::http_rejection& rejection);
  void begin_draining(relay& one);
  void drain(relay& one);
  void begin_close(relay& one);
  void watch(relay& one) noexcept;
  void leave(relay& one) noexcept;
  void fail(const relay& one, service::counter why) noexcept;

  const socket_limits limits_;
  const std::string remote_;
  certificates& with_;
  poll_set& polled_;
  reserved_descriptors& kept_;
  relay_outlet& outlet_;
  std::vector<relay> relays_;
  deadline_list opening_; // shaking, reading
  deadline_list draining_;
  deadline_list closing_;
  deadline_list late_; // relaying, of those whose answer is late on purpose
  source_tally begun_ = handshakes_begun();
  rt::time_point now_{};
};

} // namespace rowe::net::tls
