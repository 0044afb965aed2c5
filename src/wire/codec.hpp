// SPDX-License-Identifier: Apache-2.0
// What the service knows of message formats. A decoder reads the messages of one kind of connection. A codec
// writes the messages of one format. A protocol says which of them a connection uses, and what its peer can
// take. All of them are stateless constants in a protocol_set (protocols.hpp), which is passed to the
// service. Service thread only; nothing waits or allocates.
//
// A topic's message is written once, between the head and the tail of one codec's envelope. Peers that use
// this codec are sent exactly these bytes.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "wire/refusal.hpp"
#include "wire/request.hpp"
#include "wire/websocket.hpp"
#include "json/writer.hpp"

namespace rowe::json {
struct document;
}

namespace rowe::wire {

// ---- reading

// Why something failed: a code for programs, and a diagnostic for people.
struct diagnostic {
  std::string_view code;
  std::string_view text;
};

// What a decoder may use. It must live as long as the request and the diagnostic are used.
struct decode_buffers {
  std::span<char> scratch; // decode_scratch_bytes(limits)
  std::span<char, refusal::text_bytes_max> diagnostic;
  name_limits limits;
  std::uint32_t from = 0; // where the request begins in its message: 0, or `next` of the one before
};
// Bytes that suffice for every decoder.
constexpr std::size_t decode_scratch_bytes(const name_limits& limits) noexcept {
  return 2 * limits.name_bytes_max + limits.id_bytes_max + 128;
}

enum class decoded : std::uint8_t {
  request,
  refused,     // the request has its codec and what the answer needs, as far as these are valid
  malformed,   // likewise; it is no message of this protocol at all
  unsupported, // such messages have no meaning, and the connection ends
};

class message_decoder {
 public:
  // Reads a validated text into a new request. If it is refused, or its verb is unsupported or unknown, `why`
  // says so.
  virtual decoded decode(const json::document& text, const decode_buffers& buffers, request& into,
                         diagnostic& why) const noexcept = 0;
  // The same for a binary message. The request's body is not validated.
  virtual decoded decode_binary(std::span<const std::byte>, const decode_buffers&, request&,
                                diagnostic&) const noexcept {
    return decoded::unsupported;
  }
  // The codec in which to answer a text that is no JSON: the one whose members are visible in the text, or
  // else the one that the peer used last.
  virtual codec_id guess(std::string_view text, codec_id spoke_last) const noexcept = 0;
  // Whether a message that begins like this may be a stop. If so, it is decoded before its turn, and only
  // decoding decides.
  virtual bool may_be_stop(opcode what, std::string_view begins) const noexcept = 0;

 protected:
  ~message_decoder() = default;
};

// ---- writing

// The kind of what was written, which decides the kind of frame. None: nothing was written, because the codec
// has no such message.
enum class message_kind : std::uint8_t { none, text, binary };
constexpr opcode opcode_of(message_kind kind) noexcept {
  return kind == message_kind::binary ? opcode::binary : opcode::text;
}

// One JSON value: a text, or a function that writes it in place. Refers to either; owns nothing.
class body {
 public:
  explicit body(std::string_view text) noexcept : text_{text} {}
  template <class Write>
  requires(requires(const Write& write, json::writer& out) {
    write(out);
  }) explicit body(const Write& write) noexcept
      : writes_{&write}, write_{[](const void* with, json::writer& out) noexcept {
          (*static_cast<const Write*>(with))(out);
        }} {}

  bool is_text() const noexcept { return write_ == nullptr; }
  std::string_view text() const noexcept { return text_; }
  void write(json::writer& out) const noexcept { is_text() ? out.raw(text_) : write_(writes_, out); }

 private:
  std::string_view text_{};
  const void* writes_ = nullptr;
  void (*write_)(const void*, json::writer&) noexcept = nullptr;
};

// The call that a reply or a refusal answers.
struct call_origin {
  std::string_view service; // as its caller named it
  std::string_view id_raw;  // as it stood in the call
};

// The peer that is sent an error which is no answer to a call.
struct error_context {
  bool to_server = false;           // else to a client
  severity level = severity::error; // that its peer wants to hear of
  std::string_view id_raw{};        // of the request; empty: none
};

// What a client tells a server.
struct announcement {
  std::string_view name;
  std::string_view type; // empty: none
  bool latch = false;
  bool begins = true; // else it is taken back
};

// One delivery of a topic's message.
struct delivery {
  std::uint32_t tag = no_number; // of the subscription
  std::int64_t published_ns = 0; // of the endpoint's clock
  bool unslashed = false;        // the peer calls the topic by its name without the slash
};

// How a topic's message is sent to a peer that cannot get the shared text: first these bytes, then either the
// body alone, or the shared text from `from` on.
struct message_head {
  std::array<std::byte, 32> bytes{};
  std::uint8_t size = 0;
  std::uint8_t from = 0; // 0: the body alone
  message_kind as = message_kind::text;
};

// A topic or a service of this endpoint, for peers that get lists. Its number is never used again.
struct listed {
  std::uint32_t number = no_number;
  std::string_view name{};
  std::string_view type{}; // empty: none
};

// Bytes of an announcement, and of an error; no codec needs more.
inline constexpr std::size_t announcement_bytes_max = 8192;
inline constexpr std::size_t error_bytes_max = 6 * refusal::text_bytes_max + 512;
// Bytes that suffice for the head of a topic with a name of so many bytes.
constexpr std::size_t topic_head_bytes_max(std::size_t name_bytes) noexcept { return 34 + 6 * name_bytes; }

class codec {
 public:
  struct traits {
    codec_id id;
    std::string_view name;
    // A failed call is answered by the same kind of message as a refused request, and counted as one.
    bool fails_as_refusal;
  };
  constexpr codec_id id() const noexcept { return traits_.id; }
  constexpr std::string_view name() const noexcept { return traits_.name; }
  constexpr bool fails_as_refusal() const noexcept { return traits_.fails_as_refusal; }

  // The envelope around the messages of a topic, of a codec that has one for all who speak it.
  virtual void write_topic_head(json::writer&, std::string_view) const noexcept {}
  virtual std::string_view topic_tail() const noexcept { return {}; }
  // The head for a delivery that cannot use the shared text.
  virtual message_head head_of(const delivery&) const noexcept { return {}; }

  // Writes a call of a peer's service, with an id of ours.
  virtual message_kind write_call(json::writer& out, std::string_view service, std::string_view id,
                                  const call_args& args) const noexcept = 0;
  virtual message_kind write_reply(json::writer& out, const call_origin& call,
                                   const body& value) const noexcept = 0;
  virtual message_kind write_failure(json::writer& out, const call_origin& call,
                                     const diagnostic& why) const noexcept = 0;
  // Whether a reply that failed, with this diagnostic, says that nobody provides the service.
  virtual bool means_no_service(const request& failed, std::string_view diagnostic,
                                std::string_view service) const noexcept = 0;

  // Writes an error, or nothing if this peer does not want to be told.
  virtual message_kind write_error(json::writer& out, const error_context& to,
                                   const diagnostic& why) const noexcept = 0;

  // As a client: what a server must be told.
  virtual message_kind write_subscription(json::writer&, const announcement&) const noexcept {
    return message_kind::none;
  }
  virtual message_kind write_advertisement(json::writer&, const announcement&) const noexcept {
    return message_kind::none;
  }
  virtual message_kind write_provision(json::writer&, const announcement&) const noexcept {
    return message_kind::none;
  }

  // As a server: what a client is told without a request, if its protocol has listings. First it is told who
  // we are, then which topics and services were added, and the numbers of those that were removed. A topic
  // that gets a type is removed, and added under another number.
  virtual message_kind write_hello(json::writer&, std::string_view) const noexcept {
    return message_kind::none;
  }
  virtual message_kind write_topics(json::writer&, std::span<const listed>, bool) const noexcept {
    return message_kind::none;
  }
  virtual message_kind write_services(json::writer&, std::span<const listed>, bool) const noexcept {
    return message_kind::none;
  }

 protected:
  constexpr explicit codec(const traits& its) noexcept : traits_{its} {}
  ~codec() = default;

 private:
  traits traits_;
};

} // namespace rowe::wire
