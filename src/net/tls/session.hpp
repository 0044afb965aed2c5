// SPDX-License-Identifier: Apache-2.0
// One TLS connection: a socket, and what OpenSSL knows about it. The terminator's thread makes it and takes
// it through the handshake; then one other thread at a time may have it, and reads and writes records. It
// goes back to the terminator to be destroyed.
//
// OpenSSL reads and writes through us. Behind the handshake, a write never has to be repeated: what the
// kernel does not take of a record waits in a tail, and nothing more is sealed until the tail is sent. So no
// more than one record is sealed too early, and what is written later but is urgent waits behind one record
// at most.
//
// What one read takes from the kernel is bounded by the room it is given, and the records it opens by
// records_at_once. Records of one byte each cost the same to open as long ones, so a bound on the plaintext
// alone would not bound the time.
//
// Reading and writing never wait. OpenSSL allocates some 40 bytes for each record, three times to seal one
// and once to open one, and frees them before it returns. It takes no lock.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include <sys/types.h>

#include <rowe/rt/clock.hpp>

#include "net/base/descriptor.hpp"
#include "service/base/transport.hpp"

struct bio_st;
struct ssl_st;

namespace rowe::net::tls {

class context;

class session {
 public:
  // The most plaintext that one record holds (RFC 8446, 5.1).
  static constexpr std::size_t record_bytes_max = 16384;
  // What a record adds to its plaintext, at most, with the ciphers that we allow: 5 bytes of header, 8 of
  // nonce in TLS 1.2, 16 of tag, 1 of type in TLS 1.3.
  static constexpr std::size_t record_overhead = 32;
  // What one read opens at most: some 150 us of work.
  static constexpr std::uint32_t records_at_once = 256;
  // New keys cost 8 us and 65 allocations, and take 27 bytes to ask for. So a peer may ask for so many at
  // once, and for one more in each `new_keys_period`. Nobody needs as many: one in 2^24 records is advised.
  static constexpr std::uint32_t new_keys_max = 8;
  static constexpr rt::duration new_keys_period = std::chrono::seconds{1};

  // Takes the socket, which must be non-blocking. `remote` is the name, or the numeric address, whose
  // certificate is wanted, if we are the client; a server has none. Null if there is no memory. Allocates.
  static std::unique_ptr<session> open(std::shared_ptr<const context> with, descriptor socket,
                                       const char* remote) noexcept;
  ~session();
  session(const session&) = delete;
  session& operator=(const session&) = delete;

  int descriptor_number() const noexcept { return socket_.get(); }
  // Nothing but the destructor may be called afterwards.
  void close_socket() noexcept { socket_.reset(); }

  // ---- the handshake

  enum class progress : std::uint8_t { done, wants_read, wants_write, failed };
  // A few hundred microseconds; allocates.
  progress shake() noexcept;
  // Server, once it is done: the common name of the client's certificate, written into `out`. Empty: it
  // presented none, or one whose subject has no common name, or several, or one that is not of so many bytes
  // of printable ASCII.
  std::string_view client_name(std::span<char> out) const noexcept;
  // Why it failed, or why reading did: words of OpenSSL's, or of ours. Static.
  const char* reason() const noexcept { return reason_; }
  // What to change about that, in words of ours. Static.
  const char* remedy() const noexcept { return remedy_; }
  // The counter of handshakes that failed for such a reason.
  service::counter failed_by() const noexcept { return failed_by_; }

  // ---- behind the handshake

  // As recv(): how many bytes were read; 0 when the peer has said that it sends no more; -1 with an errno,
  // which is EAGAIN if nothing is there yet, and ECONNRESET if the peer, or somebody between, ended the
  // stream without saying so. Takes no more from the kernel than `to` has room for.
  ssize_t read(std::span<std::byte> to, rt::time_point now) noexcept;
  // The same, but what is read will be read again; at most the rest of one record.
  ssize_t peek(std::span<std::byte> to, rt::time_point now) noexcept;
  // Whether read() has something without asking the kernel. Then no event may come.
  bool holds_input() const noexcept;
  // The counter of connections whose reading ended so; nothing if it has not ended, or in good order.
  std::optional<service::counter> cut_by() const noexcept { return cut_by_; }

  // Seals `bytes` and sends them, in records of at most `record_bytes`. Returns how many are taken. If these
  // are not all, or the last record is not sent whole (holds_output), flush() must be called when the socket
  // is writable.
  std::size_t write(std::span<const std::byte> bytes, std::size_t record_bytes = record_bytes_max) noexcept;
  // The same, but sends nothing: that is left for flush(). At most one record, and nothing may be held.
  void seal(std::span<const std::byte> bytes) noexcept;
  bool holds_output() const noexcept { return tail_begin_ != tail_end_; }
  // Sends what write() or finish() has left. True when nothing is left.
  bool flush() noexcept;
  // Says that we send no more (close_notify). What it needs to be sent may be left for flush().
  void finish() noexcept;
  // The errno for which nothing can be written any more; 0: it can.
  int broken() const noexcept { return broken_; }

 private:
  friend struct session_bio;

  session(std::shared_ptr<const context> with, descriptor socket) noexcept;
  ssize_t receive(std::span<std::byte> to, bool keep, rt::time_point now) noexcept;
  ssize_t cannot_read(int what) noexcept;
  bool fill_stage(std::size_t bytes_max) noexcept;
  int from_stage(char* to, int bytes) noexcept;
  int from_socket(char* to, int bytes) noexcept;
  int send_or_keep(const char* from, int bytes) noexcept;
  void allow_new_keys(rt::time_point now) noexcept;
  bool asks_too_often() const noexcept { return steps_ > steps_of_new_keys * new_keys_max; }

  // OpenSSL reports three steps when it takes new keys.
  static constexpr std::uint32_t steps_of_new_keys = 3;
  static constexpr std::size_t tail_bytes =
      record_bytes_max + 1024; // one record, and what OpenSSL says itself

  const std::shared_ptr<const context> with_;
  descriptor socket_;
  ssl_st* ssl_ = nullptr;
  const char* reason_ = "";
  const char* remedy_ = "";
  service::counter failed_by_ = service::counter::tls_failed_protocol;
  std::optional<service::counter> cut_by_;
  int broken_ = 0;
  int unreadable_ = 0; // an errno: reading will never succeed again
  bool established_ = false;
  bool end_seen_ = false;     // the kernel says that nothing more comes
  bool end_pending_ = false;  // the end of what can be read came behind the bytes that the last read() gave
  bool more_follows_ = false; // another record of the same write
  bool sends_ = true;         // what is sealed
  std::uint32_t steps_ = 0;   // that OpenSSL took for new keys
  rt::time_point keys_allowed_at_{};
  std::size_t stage_begin_ = 0;
  std::size_t stage_end_ = 0;
  std::size_t tail_begin_ = 0;
  std::size_t tail_end_ = 0;
  std::array<char, 16384> stage_{}; // what came from the kernel, not opened yet
  std::array<char, tail_bytes> tail_{};
};

} // namespace rowe::net::tls
