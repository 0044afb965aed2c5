// SPDX-License-Identifier: Apache-2.0
// The seam between the core and what carries bytes. The core calls a transport from one thread only, the
// service thread; a transport calls its sink only from inside poll(). One transport serves one endpoint.
//
// A connection is an index below `connections_max` and a generation. The transport chooses the index, and
// raises its generation each time the index is used again. It reports every connection with exactly one
// on_open and later exactly one on_close, unless the transport itself is destroyed first. Calls that name a
// connection that is gone do nothing.
//
// It carries the byte stream *after* the upgrade handshake: WebSocket frames, which the core reads and writes
// itself. The transport does the handshake, HTTP and TLS.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/rt/clock.hpp>
#include <rowe/rt/counter.hpp>

#include "access/policy.hpp"
#include "service/base/counters.hpp"

namespace rowe::service {

struct connection_id {
  std::uint32_t index = 0;
  std::uint32_t generation = 0; // never 0 for a connection that was reported
  friend bool operator==(const connection_id&, const connection_id&) = default;
};

// The path for peers that only want to stop, and to see the stop's state. Places are reserved for them
// (docs/stop.md).
inline constexpr std::string_view stop_path = "/rowe/stop";
// Such a peer holds its place for so long, which is enough for a stop and its answer. The transport counts
// from when its source came, the core from the stop of a robot that could move.
inline constexpr rt::duration stop_place_protected_for = std::chrono::seconds{1};

// Within this time a transport ends a connection that it is to close, even if the peer does not read.
inline constexpr rt::duration close_time_max = std::chrono::seconds{1};

// What we are on a connection. It decides who masks.
enum class side : std::uint8_t { server, client };

struct peer_info {
  side ours = side::server;
  std::string_view address;     // numeric, with port; valid during the call
  std::string_view path;        // of the request, query removed; valid during the call
  std::string_view subprotocol; // the one that was chosen, or empty
  access::subject who{};        // as transport_sink::admit() said
};

// What a peer presents before it is connected. The texts are valid during the call.
struct credentials {
  std::string_view address;       // numeric, with port
  std::string_view path;          // of the request, query removed
  std::string_view token;         // empty: none
  bool in_url = false;            // the token
  std::string_view certificate{}; // the common name of its certificate, which is verified; empty: none
  // The token was typed into the form of the log-in: may_read() says whether it is somebody's.
  bool typed_in = false;
};

struct admit_answer {
  access::subject who{};
  std::uint16_t status = 0; // of HTTP, if the peer is rejected; 0: it is admitted
  std::string_view what{};  // for the rejection; static texts, as is the next
  std::string_view remedy{};
  std::string_view value{}; // stands for the % in them; valid until the next call
};

// Why a connection ended, as far as the transport knows.
enum class close_cause : std::uint8_t {
  asked,     // the core called close()
  peer,      // orderly end of the stream
  reset,     // reset, or another socket error
  timed_out, // the write deadline passed
};
constexpr std::string_view words_of(close_cause why) noexcept {
  constexpr std::string_view words[] = {"closed", "the peer closed the stream", "the connection was reset",
                                        "the peer does not read"};
  return words[static_cast<std::size_t>(why)];
}

// A handshake, or an attempt, that did not become a connection. `what` says what was wrong, with the value;
// `remedy` says what to change.
struct rejection {
  // A wrong token after many of the same source: it is answered late.
  static constexpr std::uint16_t slowed = 429;
  std::uint16_t http_status = 0; // what was answered; 0: nothing, or nothing in HTTP
  std::string_view peer;         // numeric address with port; empty where unknown
  std::string_view what;
  std::string_view remedy;
  bool lasting = false; // client: another attempt will end the same way until somebody changes something
};

// A page that waits for its value. What the numbers mean is the core's; `who` is as in the request.
struct awaited_page {
  std::uint32_t topic = 0;
  std::uint32_t channel = 0;
  access::subject who{};
};
// So long at most.
inline constexpr rt::duration page_wait_max = std::chrono::seconds{2};

struct http_request {
  std::string_view path;          // query removed
  std::string_view if_none_match; // empty when absent
  bool accepts_gzip = false;
  access::subject who{}; // as transport_sink::may_read() said
  // The answer to this page was to come later: everything else here is empty. `last`: it has waited for
  // page_wait_max, and is answered now.
  const awaited_page* awaited = nullptr;
  bool last = false;
};

// What a page may do in a browser depends on whose it is.
enum class page_kind : std::uint8_t {
  own,
  form,  // an own one with a form, which it sends to its own server
  users, // of the folder that the option `web` names
};

// Where the body of an answer lies that is sent piece by piece. The transport reads it from its beginning to
// its end, with calls of poll() between.
class body_source {
 public:
  // The bytes from `at` on that lie together, valid until poll() returns. None: nothing more will come, and
  // whoever reads is to see that the body was cut.
  virtual std::span<const std::byte> read_body(std::uint32_t which, std::size_t at) noexcept = 0;
  // The transport will not read that one any more. Once for each answer that has one, unless the transport is
  // destroyed first.
  virtual void end_body(std::uint32_t which) noexcept = 0;

 protected:
  ~body_source() = default;
};

struct long_body {
  body_source* from = nullptr; // none: the answer has none
  std::uint32_t which = 0;
  std::size_t bytes = 0;
};
// Whoever takes fewer of its bytes in such a time is not waited for.
inline constexpr std::size_t long_body_step_bytes = std::size_t{32} << 10;
inline constexpr rt::duration long_body_step_max = std::chrono::seconds{5};

// The texts of an answer must stay valid until it is written: they are static assets, or memory of the core
// that does not change before the next poll().
struct http_answer {
  std::uint16_t status = 404;
  std::string_view content_type = "text/plain; charset=utf-8";
  std::string_view content_encoding; // empty or "gzip"
  std::string_view etag;             // quoted, or empty
  std::string_view cache_control = "no-cache";
  page_kind kind = page_kind::own;
  bool lasts = false; // the body is valid as long as the transport is open, so it may be written in pieces
  bool later = false; // there is no answer yet: on_http() is to be asked again, about `awaited`
  awaited_page awaited{};          // later
  std::int64_t age_ms = -1;        // of the value in the body; -1: it has none
  std::uint16_t retry_after_s = 0; // 0: that is not said
  std::span<const std::byte> body;
  long_body in_pieces{}; // in place of that
};

// One that changes with each request, so nobody may store it.
inline http_answer fresh_answer(std::uint16_t status, std::string_view text) noexcept {
  http_answer answer;
  answer.status = status;
  answer.cache_control = "no-store";
  answer.body = std::as_bytes(std::span{text});
  return answer;
}

// What is served over HTTP besides the endpoint's own pages.
class page_source {
 public:
  // The answer to a GET of `request.path`. Service thread; never waits, never allocates.
  virtual http_answer answer(const http_request& request) const noexcept = 0;

 protected:
  ~page_source() = default;
};

// What may be read behind the bytes that a transport hands over.
inline constexpr std::size_t tailroom_bytes = 64;

// What a transport reports. Implemented by the core; called only inside transport::poll().
class transport_sink {
 public:
  // Whether a peer that presents this may become a connection. Asked before anything is done for it.
  virtual admit_answer admit(const credentials& shown) const noexcept = 0;
  // The same for the page of a path. Asked before on_http().
  virtual admit_answer may_read(const credentials&) noexcept { return {}; }
  virtual void on_open(connection_id connection, const peer_info& peer) noexcept = 0;
  // Bytes as they came; the span may be written to, and `tailroom_bytes` behind it may be read.
  // The core may call transport::write() and close() from here, for this connection and for others.
  virtual void on_bytes(connection_id connection, std::span<std::byte> bytes) noexcept = 0;
  // How many bytes of this connection are wanted now, at most. The rest stays with the transport; poll() asks
  // again, and wait() may return at once.
  virtual std::size_t wanted_bytes(connection_id) const noexcept { return SIZE_MAX; }
  // Nobody is there any more who could read what is written. What arrived before is still read, then comes
  // on_close(). Called at most once, and only where there may be something to read.
  virtual void on_gone(connection_id) noexcept {}
  // An earlier write() took less than it was given. Now there is room again.
  virtual void on_writable(connection_id connection) noexcept = 0;
  virtual void on_close(connection_id connection, close_cause cause) noexcept = 0;
  // A handshake was rejected (as server), or an attempt to connect failed (as client).
  virtual void on_rejected(const rejection& reason) noexcept = 0;
  // Something that nobody connecting is to blame for: a certificate that ends soon, say.
  virtual void on_warning(std::string_view what, std::string_view remedy) noexcept {
    (void)what, (void)remedy;
  }
  virtual http_answer on_http(const http_request& request) noexcept = 0;
  // How often something has come that a page waited for. After a change on_http() may have an answer for one
  // that waits.
  virtual std::uint64_t awaited_came() const noexcept { return 0; }
  // A new peer on stop_path finds no place. Whether this connection, which is on stop_path too, may be closed
  // for it.
  virtual bool may_displace(connection_id) const noexcept { return false; }
  // The connection is closed for the new peer. This is the last chance to write to it: on_close follows
  // before anything else is reported of it.
  virtual void displace(connection_id) noexcept {}

  // on_bytes() gets at most so many bytes while other connections are readable as well.
  static constexpr std::size_t read_bytes_in_turn = 4096;
  // The same for a connection that is alone: so many to begin with, and at most.
  static constexpr std::size_t read_bytes_alone_min = 16 * 1024;
  static constexpr std::size_t read_bytes_alone_max = 128 * 1024;

 protected:
  ~transport_sink() = default;
};

enum class close_how : std::uint8_t {
  flushed, // send what write() has taken, then close in an orderly way; a peer that does not read is cut
  aborted, // at once
};

// What a transport uses for handshakes and pages: memory, and places.
struct transport_memory {
  std::uint64_t bytes_used = 0;
  std::uint64_t bytes_peak = 0;            // the most it has used
  std::uint64_t allocations = 0;           // none while peers are only connected
  std::uint64_t refusals = 0;              // handshakes or pages for which there was none
  std::uint64_t evictions = 0;             // handshakes that did not end and lost their place to a newer one
  std::uint64_t pages_cut = 0;             // bodies in pieces that were not sent to their end
  const class tls_counters* tls = nullptr; // null: no TLS
};

// What a transport counts of TLS: tls_handshakes, and the counters behind it. One thread of the transport's
// writes them; any thread reads them.
class tls_counters {
 public:
  static constexpr counter first = counter::tls_handshakes;
  static constexpr counter last = counter::tls_certificate_end;

  void add(counter which) noexcept { counts_[place_of(which)].add(); }
  void set(counter which, std::uint64_t value) noexcept { counts_[place_of(which)].set(value); }
  std::uint64_t read(counter which) const noexcept { return counts_[place_of(which)].get(); }

 private:
  static constexpr std::size_t place_of(counter which) noexcept {
    return static_cast<std::size_t>(which) - static_cast<std::size_t>(first);
  }
  std::array<rt::counter, static_cast<std::size_t>(last) - static_cast<std::size_t>(first) + 1> counts_{};
};

// Counts what the transport has used. Service thread; once a cycle.
inline void show(const transport_memory& now, counters& in) noexcept {
  in.set(counter::handshake_bytes_used, now.bytes_used);
  in.set(counter::handshake_bytes_peak, now.bytes_peak);
  in.set(counter::handshake_allocations, now.allocations);
  in.set(counter::handshakes_starved, now.refusals);
  in.set(counter::handshakes_evicted, now.evictions);
  in.set(counter::pages_cut, now.pages_cut);
  if (now.tls == nullptr) return;
  for (auto i = static_cast<std::size_t>(tls_counters::first);
       i <= static_cast<std::size_t>(tls_counters::last); ++i)
    in.set(static_cast<counter>(i), now.tls->read(static_cast<counter>(i)));
}

class transport {
 public:
  virtual ~transport() = default;

  // Reports everything that has happened since the last call. Never waits.
  virtual void poll(rt::time_point now, transport_sink& sink) noexcept = 0;

  // Waits until a descriptor is ready, wake() was called or `until` has come. Reports nothing.
  virtual void wait(rt::time_point now, rt::time_point until) noexcept = 0;

  // Ends a wait() early. The only call that any thread may make; it enters the kernel.
  virtual void wake() noexcept = 0;
  // The eventfd that wake() writes to; writing to it does the same. -1 if there is none.
  virtual int wake_descriptor() const noexcept = 0;

  // Hands `bytes` to the connection, in as few system calls as possible. Returns how many were taken: all, or
  // fewer if there is no more room (then on_writable() follows), or 0. Has no buffer of its own, never waits.
  virtual std::size_t write(connection_id connection, std::span<const std::byte> bytes) noexcept = 0;

  // write() took part of a frame. This hands over the rest, even beyond the transport's usual limit: nothing
  // else can be sent before it. Returns the bytes taken; 0 if the transport cannot do that. on_writable()
  // follows as after write().
  virtual std::size_t write_rest(connection_id connection, std::span<const std::byte> rest) noexcept {
    (void)connection, (void)rest;
    return 0;
  }

  // on_close follows in a later poll().
  virtual void close(connection_id connection, close_how how) noexcept = 0;

  // Limits the transport's own send buffer, in bytes; 0, as until this is called: as the transport finds
  // right. The core calls it where the round trip is short, to bound what is in flight.
  virtual void limit_send_buffer(connection_id connection, std::size_t bytes) noexcept = 0;

  // Stops (false) or resumes reading from a connection.
  virtual void read_enabled(connection_id connection, bool enabled) noexcept = 0;

  // Client only: begins one attempt to reach the configured remote. Ends in on_open() or on_rejected().
  virtual void connect() noexcept = 0;

  virtual transport_memory memory() const noexcept { return {}; }
};

} // namespace rowe::service
