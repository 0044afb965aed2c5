// SPDX-License-Identifier: Apache-2.0
// What the service knows of message formats. A decoder reads the messages of one kind of connection. A codec
// writes the messages of one format. A protocol says which of them a connection uses, and what its peer can
// take. All of them are stateless constants in a protocol_set (protocols.hpp), which is passed to the
// service. Service thread only; nothing waits or allocates.
//
// A topic's message is written once, between the head and the tail of one codec's envelope. Peers that use
// this codec are sent exactly these bytes. A codec whose bodies are not JSON writes whole messages instead,
// once for all peers that use it.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "wire/codec/refusal.hpp"
#include "wire/codec/request.hpp"
#include "wire/websocket/websocket.hpp"
#include "json/writing/writer.hpp"

namespace rowe {
struct schema_description;
} // namespace rowe

namespace rowe::json {
struct other_encoders;
struct document;
} // namespace rowe::json

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
  list_place from{}; // where the request begins in its message: `next` of the one before
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
  // Where the body, which is JSON, begins in a binary message with this first byte, if such a message may be
  // longer than others; 0: it may not.
  virtual std::size_t body_begins(std::byte) const noexcept { return 0; }
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

// A value of a struct, and what encodes it.
struct typed_value {
  const std::byte* at = nullptr;
  const json::other_encoders* others = nullptr;
};

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
  std::string_view service;          // as its caller named it
  std::string_view id_raw;           // as it stood in the call
  std::int8_t goal_status = no_goal; // of an action's goal: a GoalStatus of ROS

  static constexpr std::int8_t no_goal = -1;
  bool is_goal() const noexcept { return goal_status != no_goal; }
};
// The origin of a refused call or goal.
inline call_origin origin_of(const request& asked) noexcept {
  return {.service = asked.service,
          .id_raw = asked.id_raw,
          .goal_status = asked.what == verb::send_goal ? std::int8_t{0} : call_origin::no_goal};
}

// What an action's provider is asked to do.
struct goal_order {
  std::string_view action;
  std::string_view type; // empty: none
  std::string_view id;   // ours
  const call_args& args;
  bool feedback = false; // is wanted
};

// The peer that is sent an error which is no answer to a call.
struct error_context {
  bool to_server = false;           // else to a client
  severity level = severity::error; // that its peer wants to hear of
  severity how = severity::error;   // of this one
  std::string_view id_raw{};        // of the request; empty: none
};

// What a client announces to a server.
struct announcement {
  std::string_view name;
  std::string_view type; // empty: none
  bool latch = false;
  bool begins = true;           // else it is taken back
  std::int64_t throttle_ms = 0; // of a subscription
};

// One delivery of a topic's message, or of a plain message.
struct delivery {
  std::uint32_t tag = no_number;   // of the subscription
  std::int64_t published_ns = 0;   // of the endpoint's clock
  std::int64_t wall_ns = 0;        // the same, since 1970
  bool unslashed = false;          // the peer calls the topic by its name without the slash
  bool empty = false;              // a plain message: the object has no members
  std::int64_t ttl_ns = unlimited; // what is left of its time to live; unlimited: nothing is said of it
};

// A part of a text that is too long for its peer, who asked for such parts.
struct text_fragment {
  std::string_view id;   // the same in all of them
  std::string_view data; // whole characters
  std::uint32_t number = 0;
  std::uint32_t count = 0;
};

// One message of a topic, for a codec that writes it whole: of a struct, or else its JSON.
struct topic_message {
  std::string_view topic;   // as its peers call it
  std::int64_t wall_ns = 0; // when it was published, since 1970
  std::string_view text{};  // empty where there is a value
  typed_value value{};
  const schema_description* schema = nullptr; // of the topic; null: nobody said
};

// How a message is sent to a peer that cannot get the shared text: first these bytes, then either the body
// alone, or the shared text from `from` on.
struct message_head {
  std::array<std::byte, 64> bytes{};
  std::uint8_t size = 0;
  std::uint8_t from = 0; // 0: the body alone
  message_kind as = message_kind::text;
};

// A topic or a service of this endpoint, for peers that get lists. Its number is never used again.
struct listed {
  std::uint32_t number = no_number;
  std::string_view name{};
  std::string_view type{}; // empty: none
  // Of the topic's messages, or of the service's answers; null: nobody said.
  const schema_description* schema = nullptr;
  const schema_description* request = nullptr; // of the service's requests; likewise
};

// Who a server is. Its epoch is another one each time that it is opened.
struct greeting {
  std::string_view name;
  std::uint64_t epoch = 0;
};

// A parameter with its value.
struct parameter_update {
  std::string_view name;
  std::string_view json; // empty: there is no such parameter, or not any more
  bool is_real = false;  // its type is a double or a float
};

// The lists of an update of the connection graph: who publishes on a topic, subscribes to it, or provides a
// service; and what is gone.
enum class graph_list : std::uint8_t {
  published_topics,
  subscribed_topics,
  advertised_services,
  removed_topics,
  removed_services,
};
inline constexpr std::size_t graph_lists = 5;

// Bytes of an announcement, and of an error; no codec needs more.
inline constexpr std::size_t announcement_bytes_max = 8192;
inline constexpr std::size_t error_bytes_max = 6 * refusal::text_bytes_max + 512;
// Bytes that suffice for the head of a topic with a name of so many bytes: names have no control characters
// and are valid UTF-8, so an escape has two bytes.
constexpr std::size_t topic_head_bytes_max(std::size_t name_bytes) noexcept { return 34 + 2 * name_bytes; }

inline constexpr std::size_t codecs_max = 8; // of an endpoint

class codec {
 public:
  struct traits {
    codec_id id;
    std::string_view name;
    // A failed call is answered by the same kind of message as a refused request, and counted as one.
    bool fails_as_refusal;
    // Bodies of topics' messages are not the shared JSON: write_message() writes them, and there is no
    // envelope.
    bool writes_whole = false;
    // Then: it writes bodies alone, behind a head for each peer.
    bool heads_whole = false;
    // Then: of a struct that has encoders of its own, no JSON is needed.
    bool writes_types = false;
    // The codec for messages of types that hold a time, if that is another one.
    codec_id of_times = same_codec;
  };
  constexpr codec_id id() const noexcept { return traits_.id; }
  constexpr std::string_view name() const noexcept { return traits_.name; }
  constexpr bool fails_as_refusal() const noexcept { return traits_.fails_as_refusal; }
  constexpr bool writes_whole() const noexcept { return traits_.writes_whole; }
  constexpr bool heads_whole() const noexcept { return traits_.heads_whole; }
  constexpr bool writes_types() const noexcept { return traits_.writes_types; }
  constexpr codec_id of_times() const noexcept { return traits_.of_times; }

  // The envelope around the messages of a topic, of a codec that has one for all who speak it.
  virtual void write_topic_head(json::writer&, std::string_view) const noexcept {}
  virtual std::string_view topic_tail() const noexcept { return {}; }
  // The head for a delivery that cannot use the shared text.
  virtual message_head head_of(const delivery&) const noexcept { return {}; }

  // Where it writes whole messages.
  virtual message_kind write_message(json::writer&, const topic_message&) const noexcept {
    return message_kind::none;
  }
  // Why a subscriber gets these messages in another form than it asked for, where no struct is published;
  // empty: it does not.
  virtual std::string_view lacks_without_type() const noexcept { return {}; }

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

  // Of actions: a goal for its provider, its cancellation, and an answer in between for who sent the goal.
  // The last answer is a reply or a failure.
  virtual message_kind write_goal(json::writer&, const goal_order&) const noexcept {
    return message_kind::none;
  }
  virtual message_kind write_cancel(json::writer&, std::string_view /*action*/,
                                    std::string_view /*id*/) const noexcept {
    return message_kind::none;
  }
  virtual message_kind write_feedback(json::writer&, const call_origin&, const body&) const noexcept {
    return message_kind::none;
  }

  // A fragment of a text.
  virtual void write_fragment(json::writer&, const text_fragment&) const noexcept {}

  // Writes an error, or nothing if this peer does not want one.
  virtual message_kind write_error(json::writer& out, const error_context& to,
                                   const diagnostic& why) const noexcept = 0;

  // As a client: what it announces to a server.
  virtual message_kind write_subscription(json::writer&, const announcement&) const noexcept {
    return message_kind::none;
  }
  virtual message_kind write_advertisement(json::writer&, const announcement&) const noexcept {
    return message_kind::none;
  }
  virtual message_kind write_provision(json::writer&, const announcement&) const noexcept {
    return message_kind::none;
  }

  // As a server: what it announces to a client without a request, if its protocol has listings. First, who we
  // are. Then, which topics and services were added, and the numbers of those that were removed. A topic that
  // gets a type is removed, and added under another number.
  virtual message_kind write_time(json::writer&, std::int64_t) const noexcept { // nanoseconds since 1970
    return message_kind::none;
  }
  virtual message_kind write_hello(json::writer&, const greeting&) const noexcept {
    return message_kind::none;
  }
  virtual message_kind write_topics(json::writer&, std::span<const listed>, bool) const noexcept {
    return message_kind::none;
  }
  virtual message_kind write_services(json::writer&, std::span<const listed>, bool) const noexcept {
    return message_kind::none;
  }
  // The values of parameters, where its protocol has requests for them: a head with the id of the request
  // that is answered (empty: none), then one after the other, and an end.
  virtual void begin_parameters(json::writer&, std::string_view) const noexcept {}
  virtual void add_parameter(json::writer&, const parameter_update&) const noexcept {}
  virtual message_kind end_parameters(json::writer&) const noexcept { return message_kind::none; }
  // What has changed of the connection graph, where its protocol has requests for that: all lists in their
  // order. Of what is there, `holders` is a list of names; of what is gone, only its name is written.
  virtual void begin_graph(json::writer&) const noexcept {}
  virtual void begin_graph_list(json::writer&, graph_list) const noexcept {}
  virtual void add_to_graph(json::writer&, graph_list, std::string_view /*name*/,
                            const body& /*holders*/) const noexcept {}
  virtual void end_graph_list(json::writer&) const noexcept {}
  virtual message_kind end_graph(json::writer&) const noexcept { return message_kind::none; }
  // How many bytes the schemas of one that was added take at most.
  virtual std::size_t schema_bytes(const listed&) const noexcept { return 0; }

 protected:
  constexpr explicit codec(const traits& its) noexcept : traits_{its} {}
  ~codec() = default;

 private:
  traits traits_;
};

} // namespace rowe::wire
