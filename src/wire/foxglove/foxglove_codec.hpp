// SPDX-License-Identifier: Apache-2.0
// The protocol of Foxglove and Lichtblick (ws-protocol), with JSON as the only encoding. The server speaks
// first; it numbers its topics and services, and the client its subscriptions and channels. Topics' messages,
// what clients publish, and calls are binary messages; all else is text. docs/wire.md has what is offered.
#pragma once
#include <string_view>

#include "wire/codec/codec.hpp"

namespace rowe::wire {

class foxglove_codec : public codec {
 public:
  message_head head_of(const delivery& to) const noexcept override;
  message_kind write_call(json::writer& out, std::string_view service, std::string_view id,
                          const call_args& args) const noexcept override;
  message_kind write_reply(json::writer& out, const call_origin& call,
                           const body& value) const noexcept override;
  message_kind write_failure(json::writer& out, const call_origin& call,
                             const diagnostic& why) const noexcept override;
  bool means_no_service(const request&, std::string_view, std::string_view) const noexcept override {
    return false;
  }
  message_kind write_error(json::writer& out, const error_context& to,
                           const diagnostic& why) const noexcept override;
  message_kind write_time(json::writer& out, std::int64_t wall_ns) const noexcept override;
  message_kind write_hello(json::writer& out, const greeting& who) const noexcept override;
  message_kind write_topics(json::writer& out, std::span<const listed> which,
                            bool added) const noexcept override;
  message_kind write_services(json::writer& out, std::span<const listed> which,
                              bool added) const noexcept override;
  void begin_parameters(json::writer& out, std::string_view id_raw) const noexcept override;
  void add_parameter(json::writer& out, const parameter_update& one) const noexcept override;
  message_kind end_parameters(json::writer& out) const noexcept override;
  void begin_graph(json::writer& out) const noexcept override;
  void begin_graph_list(json::writer& out, graph_list which) const noexcept override;
  void add_to_graph(json::writer& out, graph_list to, std::string_view name,
                    const body& holders) const noexcept override;
  void end_graph_list(json::writer& out) const noexcept override;
  message_kind end_graph(json::writer& out) const noexcept override;
  std::size_t schema_bytes(const listed& one) const noexcept override;

 protected:
  constexpr explicit foxglove_codec(const traits& its) noexcept : codec{its} {}
  ~foxglove_codec() = default;
};

// Messages have the body that others get.
class foxglove_json_codec final : public foxglove_codec {
 public:
  constexpr foxglove_json_codec(codec_id id, codec_id of_times) noexcept
      : foxglove_codec{{.id = id, .name = "foxglove", .fails_as_refusal = false, .of_times = of_times}} {}
};

// Messages have a body in which times are as Foxglove's programs read them. All its peers share it.
class foxglove_times_codec final : public foxglove_codec {
 public:
  constexpr explicit foxglove_times_codec(codec_id id) noexcept
      : foxglove_codec{{.id = id,
                        .name = "foxglove_times",
                        .fails_as_refusal = false,
                        .writes_whole = true,
                        .heads_whole = true,
                        .writes_types = true}} {}
  message_kind write_message(json::writer& out, const topic_message& what) const noexcept override;
};

// Reads what clients say (foxglove_decoder.cpp).
class foxglove_decoder final : public message_decoder {
 public:
  constexpr explicit foxglove_decoder(codec_id id) noexcept : id_{id} {}

  decoded decode(const json::document& text, const decode_buffers& buffers, request& into,
                 diagnostic& why) const noexcept override;
  decoded decode_binary(std::span<const std::byte> message, const decode_buffers& buffers, request& into,
                        diagnostic& why) const noexcept override;
  std::size_t body_begins(std::byte first) const noexcept override;
  codec_id guess(std::string_view, codec_id) const noexcept override { return id_; }
  bool may_be_stop(opcode what, std::string_view begins) const noexcept override;

 private:
  codec_id id_;
};

} // namespace rowe::wire
