// SPDX-License-Identifier: Apache-2.0
#include "wire/rosbridge/rosbridge_codec.hpp"

#include <cstring>

#include "wire/codec/object_form.hpp"
#include "wire/codec/time_to_live.hpp"
#include "wire/rosbridge/rosbridge.hpp"

namespace rowe::wire {
namespace {

static_assert(rosbridge::publish_head_bytes_max(0) <= topic_head_bytes_max(0) &&
              rosbridge::publish_head_bytes_max(255) <= topic_head_bytes_max(255));
static_assert(rosbridge::request_bytes_max({.name_bytes_max = 255}) <= announcement_bytes_max);

void write_answer_head(json::writer& out, const call_origin& call, bool result) noexcept {
  call.is_goal()
      ? rosbridge::write_action_result_head(out, call.service, call.id_raw, call.goal_status, result)
      : rosbridge::write_service_response_head(out, call.service, call.id_raw, result);
}

} // namespace

void rosbridge_codec::write_topic_head(json::writer& out, std::string_view topic) const noexcept {
  rosbridge::write_publish_head(out, topic);
}

std::string_view rosbridge_codec::topic_tail() const noexcept { return rosbridge::publish_tail; }

// The name may be sent without its slash, which is one byte. The time to live goes behind the operation.
message_head rosbridge_codec::head_of(const delivery& to) const noexcept {
  constexpr std::string_view begins = rosbridge::publish_begins;
  constexpr std::string_view topic = R"("topic":")";
  static_assert(begins.ends_with(topic));
  message_head head;
  static_assert(begins.size() + ttl_text_bytes_max + 1 <= sizeof head.bytes);
  const auto add = [&](std::string_view text) {
    std::memcpy(head.bytes.data() + head.size, text.data(), text.size());
    head.size += static_cast<std::uint8_t>(text.size());
  };
  add(begins.substr(0, begins.size() - topic.size()));
  if (to.ttl_ns != unlimited) {
    const auto room = std::span{head.bytes}.subspan(head.size);
    head.size += static_cast<std::uint8_t>(write_ttl(room, to.ttl_ns));
    add(",");
  }
  add(topic);
  head.from = static_cast<std::uint8_t>(begins.size() + (to.unslashed ? 1 : 0));
  return head;
}

void rosbridge_codec::write_fragment(json::writer& out, const text_fragment& what) const noexcept {
  rosbridge::write_fragment(out, what);
}

message_kind rosbridge_codec::write_call(json::writer& out, std::string_view service, std::string_view id,
                                         const call_args& args) const noexcept {
  rosbridge::write_call_service_head(out, service, id);
  write_args(out, args);
  out.end_object();
  return message_kind::text;
}

message_kind rosbridge_codec::write_reply(json::writer& out, const call_origin& call,
                                          const body& value) const noexcept {
  write_answer_head(out, call, true);
  value.write(out);
  out.end_object();
  return message_kind::text;
}

message_kind rosbridge_codec::write_failure(json::writer& out, const call_origin& call,
                                            const diagnostic& why) const noexcept {
  write_answer_head(out, call, false);
  out.string(why.text);
  out.end_object();
  return message_kind::text;
}

bool rosbridge_codec::means_no_service(const request&, std::string_view diagnostic,
                                       std::string_view service) const noexcept {
  return says_no_service(diagnostic, service);
}

message_kind rosbridge_codec::write_goal(json::writer& out, const goal_order& what) const noexcept {
  rosbridge::write_goal_head(out, what.action, what.type, what.id, what.feedback);
  write_args(out, what.args);
  out.end_object();
  return message_kind::text;
}

message_kind rosbridge_codec::write_cancel(json::writer& out, std::string_view action,
                                           std::string_view id) const noexcept {
  rosbridge::write_cancel_goal(out, action, id);
  return message_kind::text;
}

message_kind rosbridge_codec::write_feedback(json::writer& out, const call_origin& call,
                                             const body& value) const noexcept {
  rosbridge::write_feedback_head(out, call.service, call.id_raw);
  value.write(out);
  out.end_object();
  return message_kind::text;
}

message_kind rosbridge_codec::write_error(json::writer& out, const error_context& to,
                                          const diagnostic& why) const noexcept {
  if (to.to_server || to.how > to.level) return message_kind::none;
  rosbridge::write_status(out, to.how, to.id_raw, why.text);
  return message_kind::text;
}

message_kind rosbridge_codec::write_subscription(json::writer& out, const announcement& what) const noexcept {
  what.begins ? rosbridge::write_subscribe(out, what.name, what.type, what.throttle_ms)
              : rosbridge::write_unsubscribe(out, what.name);
  return message_kind::text;
}

message_kind rosbridge_codec::write_advertisement(json::writer& out,
                                                  const announcement& what) const noexcept {
  what.begins ? rosbridge::write_advertise(out, what.name, what.type, what.latch)
              : rosbridge::write_unadvertise(out, what.name);
  return message_kind::text;
}

message_kind rosbridge_codec::write_provision(json::writer& out, const announcement& what) const noexcept {
  what.begins ? rosbridge::write_advertise_service(out, what.name, what.type)
              : rosbridge::write_unadvertise_service(out, what.name);
  return message_kind::text;
}

} // namespace rowe::wire
