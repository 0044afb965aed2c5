// SPDX-License-Identifier: Apache-2.0
// Reads the frames of one connection (RFC 6455), after the upgrade handshake. The service core calls this on
// its thread with the bytes that came. There is one parser for a connection. It has all that the protocol
// asks of a reader: masks, fragments with control frames between them, UTF-8 across fragments, close codes,
// limits. It is a state machine over bytes, without heap, clock or socket. So the same input gives the same
// events, however it was cut into reads; tests and a fuzzer check that.
//
// A payload may be in two places. A message that is one frame and came in one read, the usual case, is
// unmasked where it is and not copied. Everything else is gathered in the caller's assembly buffer. A message
// that is too long for it is not gathered: it is handed over in pieces, as they come.
//
// Every function here: one thread, never waits, never allocates; time is linear in the bytes given.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "wire/text/utf8.hpp"
#include "wire/websocket/mask.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::wire {
enum class frame_event : std::uint8_t {
  need_more, // all bytes are consumed and nothing is complete
  text,      // a whole message, valid UTF-8; or the last piece of a long one
  binary,    // a whole message, or the last piece of a long one
  piece,     // of a long message, not the last
  ping,
  pong,
  close,     // the peer closes; nothing follows
  violation, // the peer broke the protocol or a limit; nothing follows
};

struct frame_limits {
  std::size_t message_bytes_max = 0; // of a message that is handed over whole
  std::size_t long_bytes_max = 0;  // longer messages: violation 1009, before anything is copied; those up to
                                   // here are handed over in pieces
  std::uint32_t fragments_max = 0; // messages in more frames: violation 1008
  bool unmasked_accepted = false;  // as a server; RFC 6455 5.1 forbids it, the Hop of 2014 needs it
};

struct frame_step {
  frame_event event = frame_event::need_more;
  std::size_t consumed = 0;       // from the front of what was given
  std::size_t frames = 1;         // that were looked at for it; fragments are several
  bool in_pieces = false;         // piece, text, binary: the payload is a piece of a long message
  opcode message = opcode::text;  // piece: what the message is
  std::uint64_t known_bytes = 0;  // in_pieces: of the message, as far as its frames have said
  std::span<std::byte> payload{}; // unmasked; of a close: the body as it came, code included
  std::uint16_t close_code = 0;   // close: the peer's (1005 when it gave none); violation: the one to send
  std::string_view reason{};      // close: the peer's, valid UTF-8; violation: the diagnostic to send, which
                                  // stays until the parser is reset
};

class frame_parser {
 public:
  // A parser that was not reset swallows everything.
  frame_parser() noexcept = default;

  // Begins a connection. `assembly` must live until the next reset(), and has limits.message_bytes_max bytes
  // (a shorter one lowers the limit). 64 bytes behind it must be readable, because the JSON parser reads
  // ahead.
  void reset(role ours, frame_limits limits, std::span<std::byte> assembly) noexcept;

  // A step looks at no more fragments. So one peer's message in many pieces delays nobody for long.
  static constexpr std::size_t frames_in_step_max = 32;
  // No piece of a long message is longer.
  static constexpr std::size_t piece_bytes_max = 4096;
  // So much of its beginning is stored until it ends, or message_bytes_max where that is less.
  static constexpr std::size_t front_bytes_max = 4096;

  // Consumes bytes from the front of `bytes`, which may be written to, until one event, until all are
  // consumed, or until it has looked at frames_in_step_max fragments. The caller calls again with the rest.
  // The payload of a text or binary message is in `bytes` if the message is one frame and complete there,
  // else in the assembly buffer. The payload of a control frame is in `bytes` or in the parser. It is valid
  // until the next call, and while `bytes` is. After a close or a violation every byte is consumed, and
  // nothing more is reported.
  //
  // A violation is reported at the first byte that proves it: a bad header before its frame has come, bad
  // UTF-8 before its fragment is complete.
  frame_step next(std::span<std::byte> bytes) noexcept;

  // True while a frame or a fragmented message has begun and is not complete. For the deadline of a message.
  bool mid_message() const noexcept;
  // How many bytes of it are in the assembly buffer.
  std::size_t assembled_bytes() const noexcept {
    if (!in_frame_ && !in_message_) return 0;
    if (in_pieces_) return std::max(handed_ != gathered_ ? gathered_ : 0, front().size());
    return static_cast<std::size_t>(message_bytes_);
  }

  // How the long message begins of which a piece was the last step: what came of its first front_bytes_max.
  // It lies in the assembly buffer, and is valid until the next call.
  std::span<const std::byte> front() const noexcept {
    return assembly_.first(static_cast<std::size_t>(std::min<std::uint64_t>(message_bytes_, front_max())));
  }

  // Says where the frame that has begun ends in `bytes`, which come next (0: none has begun), and whether a
  // fragmented message is open after it. Nothing if its header does not end in `bytes`, or nothing is read
  // any more.
  struct outlook {
    std::size_t rest = 0; // may be more than bytes.size()
    bool in_message = false;
  };
  std::optional<outlook> look_ahead(std::span<const std::byte> bytes) const noexcept;

  // Another parser of the same role and limits, between two messages. Only for complete frames, because both
  // use the same assembly buffer.
  frame_parser anew() const noexcept;

  // True if bytes can lead to this state. For tests and fuzzers.
  bool check() const noexcept;

 private:
  struct header {
    opcode what = opcode::continuation;
    bool final = false;
    std::uint64_t payload_bytes = 0;
    mask_key key{}; // zeros where the frame is not masked
  };
  struct protocol_error {
    std::uint16_t code;
    std::string_view diagnostic;
  };

  static constexpr protocol_error not_utf8{close_code::invalid_text, "the text is not UTF-8"};

  std::optional<protocol_error> check_first_byte(std::byte first) const noexcept;
  std::optional<protocol_error> check_second_byte(std::byte first, std::byte second) const noexcept;
  std::optional<protocol_error> read_length(const std::byte* bytes) noexcept;
  std::optional<protocol_error> take_header(std::span<const std::byte> bytes, std::size_t& consumed) noexcept;
  std::optional<protocol_error> begin_frame() noexcept;
  bool take_whole_message(std::span<std::byte> bytes, frame_step& step) noexcept;
  frame_step take_pieces(std::span<std::byte> bytes) noexcept;
  frame_step take_control(std::span<std::byte> rest) noexcept;
  frame_step take_data(std::span<std::byte> rest) noexcept;
  frame_step take_piece(std::span<std::byte> rest) noexcept;
  void count_piece(std::span<const std::byte> piece) noexcept {
    const std::size_t have = front().size();
    const std::size_t kept = std::min(piece.size(), front_max() - have);
    std::copy_n(piece.begin(), kept, assembly_.begin() + static_cast<std::ptrdiff_t>(have));
    message_bytes_ += piece.size();
  }
  std::uint32_t fragments_max() const noexcept;
  std::size_t front_max() const noexcept { return std::min(front_bytes_max, limits_.message_bytes_max); }
  frame_step end_message(std::span<std::byte> message, std::size_t consumed) noexcept;
  frame_step read_close(std::span<std::byte> body) noexcept;
  frame_step violate(protocol_error what) noexcept;
  protocol_error too_big() noexcept;
  protocol_error too_many_frames() noexcept;

  frame_limits limits_;
  std::span<std::byte> assembly_;
  role ours_ = role::server;
  bool ended_ = true;       // a close or a violation was reported
  bool in_frame_ = false;   // the header in frame_ is complete, its payload is not
  bool in_message_ = false; // a fragmented message is open
  opcode message_ = opcode::text;
  std::uint32_t fragments_ = 0;     // frames of the open message so far
  std::uint64_t message_bytes_ = 0; // of the message so far: in the assembly buffer, unless
  bool in_pieces_ = false;          // it is long, and its pieces are handed over:
  std::size_t gathered_ = 0;        // first what was in the assembly buffer when it proved to be long,
  std::size_t handed_ = 0;          // of which so much was handed over
  std::uint64_t payload_done_ = 0;  // bytes of the frame's payload taken so far
  header frame_;
  utf8_check text_;
  std::uint8_t header_have_ = 0; // bytes in header_
  std::array<std::byte, frame_header_bytes_max> header_{};
  std::array<std::byte, control_bytes_max> control_{}; // after a violation: its diagnostic, if it has numbers
};

} // namespace rowe::wire
