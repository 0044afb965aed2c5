// SPDX-License-Identifier: Apache-2.0
#include "wire/plain/plain_codec.hpp"

#include "wire/codec/time_to_live.hpp"
#include "wire/plain/plain.hpp"

namespace rowe::wire {

message_head plain_codec::head_of(const delivery& to) const noexcept {
  message_head head{.size = 1, .from = 1};
  static_assert(sizeof head.bytes >= ttl_text_bytes_max + 2);
  head.bytes[0] = std::byte{'{'};
  if (to.ttl_ns == unlimited) return head;
  head.size += static_cast<std::uint8_t>(write_ttl(std::span{head.bytes}.subspan(1), to.ttl_ns));
  if (!to.empty) head.bytes[head.size++] = std::byte{','};
  return head;
}

message_kind plain_codec::write_call(json::writer& out, std::string_view service, std::string_view id,
                                     const call_args& args) const noexcept {
  if (args.is == call_args::form::object) {
    plain::write_invocation(out, args.text, id);
  } else {
    plain::write_call(out, service, id, args);
  }
  return message_kind::text;
}

message_kind plain_codec::write_reply(json::writer& out, const call_origin& call,
                                      const body& value) const noexcept {
  plain::write_reply(out, call.id_raw, value);
  return message_kind::text;
}

message_kind plain_codec::write_failure(json::writer& out, const call_origin& call,
                                        const diagnostic& why) const noexcept {
  plain::write_error(out, call.id_raw, why.code, why.text);
  return message_kind::text;
}

bool plain_codec::means_no_service(const request& failed, std::string_view, std::string_view) const noexcept {
  return failed.code == "no_service";
}

// A client answers only calls. Otherwise the two ends might refuse each other's refusals for ever.
message_kind plain_codec::write_error(json::writer& out, const error_context& to,
                                      const diagnostic& why) const noexcept {
  if (to.to_server && to.id_raw.empty()) return message_kind::none;
  plain::write_error(out, to.id_raw, why.code, why.text);
  return message_kind::text;
}

} // namespace rowe::wire
