// SPDX-License-Identifier: Apache-2.0
// Takes TLS connections through their handshake, on a thread of its own. A handshake costs 0.3 ms, and any
// stranger can begin one, so the service thread, behind which a stop waits, does none. It gets a local socket
// that speaks plain HTTP (relays.hpp), and after the upgrade the session.
//
// The thread has ordinary scheduling, and less of a core than other programs (nice 10). It has an epoll of
// its own. The two threads pass news and requests to each other through a ring in each direction, and ring
// each other's eventfd. Sessions end here, too, because to free one costs 10 us and takes the allocator's
// lock.
//
// The thread ends, and is joined, before the destructor returns. It must not run while the process exits:
// OpenSSL's own clean-up then frees what it uses.
#pragma once
#include <pthread.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <rowe/result.hpp>
#include <rowe/rt/spsc_ring.hpp>
#include <rowe/tls.hpp>

#include "net/base/arrival.hpp"
#include "net/base/descriptor.hpp"
#include "net/base/listener.hpp"
#include "net/base/poll_set.hpp"
#include "net/base/reserved_descriptors.hpp"
#include "net/base/socket_limits.hpp"
#include "net/tls/certificates.hpp"
#include "net/tls/relays.hpp"
#include "net/tls/session.hpp"

namespace rowe::net::tls {

struct terminator_options {
  socket_limits limits{};
  tls_options files{};
  std::string remote{}; // client: whose certificate is wanted; empty: we are the server
  int waker = -1;       // an eventfd that is written to when news is there; a duplicate is kept
};

class terminator final : relay_outlet {
 public:
  // Set-up. A server gives its listener away. Errors: bad_certificate, no_memory, no_thread (value: errno).
  static result<std::unique_ptr<terminator>> open(const terminator_options& options,
                                                  std::optional<listener> from, reserved_descriptors& kept);
  ~terminator();
  terminator(const terminator&) = delete;
  terminator& operator=(const terminator&) = delete;

  // ---- the service thread; never waits

  // What has happened, oldest first.
  std::optional<arrival> next() noexcept { return news_out_->try_pop(); }
  // How many have news, at least.
  bool has_news() noexcept { return news_out_->pending_at_least() != 0; }
  // How many have lost their place to others, or got none, so far. Any thread.
  std::uint64_t evictions() const noexcept {
    return evictions_.load(std::memory_order_relaxed); // a count: nothing is handed over with it
  }
  const service::tls_counters& counters() const noexcept { return counters_; }
  // Asks for the session of a place whose upgrade is answered. It comes as an arrival, or null does. The
  // caller closes its socket afterwards. False: the terminator is stuck, and no session will come.
  bool ask_session(place_id place, service::connection_id connection) noexcept {
    return ask({.what = request::kind::hand_over, .place = place, .connection = connection});
  }
  // A place is answered later, so it may be given to others.
  void answer_late(place_id place) noexcept { (void)ask({.what = request::kind::late, .place = place}); }
  // Client: takes a connected socket. False as above.
  bool connect(descriptor socket, std::uint32_t attempt) noexcept;
  void drop(place_id place) noexcept { (void)ask({.what = request::kind::drop, .place = place}); }
  // Ends a session, and closes its socket.
  void destroy(std::unique_ptr<session> ended) noexcept;

 private:
  using news_ring = rt::spsc_ring<arrival>;
  using request_ring = rt::spsc_ring<request>;

  terminator(const terminator_options& options, std::optional<listener> from, reserved_descriptors& kept,
             poll_set polled, std::shared_ptr<const context> first);
  bool ask(const request& what) noexcept;

  // ---- its own thread
  static void* run(void* self);
  void serve();
  void accept_some();
  void look_after_certificates();
  void notice(std::string_view what, std::string_view value, std::string_view remedy,
              std::string_view remedy_value);
  bool report(const arrival& news) noexcept override;
  void note_eviction() noexcept override;
  void count(service::counter which) noexcept override { counters_.add(which); }
  void note_certificate() noexcept;
  void take_requests() noexcept override;
  void carry_out(const request& one);

  const terminator_options options_;
  descriptor service_waker_;
  descriptor waker_; // ours
  std::vector<news_ring::entry> news_places_;
  std::vector<request_ring::entry> request_places_;
  news_ring news_;
  request_ring requests_;
  news_ring::producer* news_in_;
  news_ring::consumer* news_out_;
  request_ring::producer* requests_in_;
  request_ring::consumer* requests_out_;
  std::atomic<bool> ending_{false};
  std::atomic<std::uint64_t> evictions_{0};
  service::tls_counters counters_; // its own thread writes them
  pthread_t thread_{};
  bool started_ = false;

  // The rest is used by its own thread alone, between open() and the destructor.
  std::optional<listener> listener_;
  poll_set polled_;
  reserved_descriptors& kept_;
  certificates certificates_;
  relays relays_;
  rt::time_point now_{};
  rt::time_point look_at_{};
  bool pause_reported_ = false;
};

} // namespace rowe::net::tls
