// SPDX-License-Identifier: Apache-2.0
// Encodes rowe's messages in rosbridge's format.
#include "wire/codec/codec.hpp"
#include "wire/rosbridge/rosbridge.hpp"
#include "wire/text/text_out.hpp"
#include "json/writing/writer.hpp"

namespace rowe::wire::rosbridge {
namespace {

// `{"op":"subscribe"`, the object left open.
void begin_text(json::writer& into, std::string_view op_text) noexcept {
  into.begin_object();
  into.member("op", op_text);
}

// `{"op":"subscribe","id":"subscribe:/odom:1"`, the object left open. False when the id is too long to be
// made.
bool begin_request(json::writer& into, std::string_view op_text, std::string_view id_verb,
                   std::string_view topic) noexcept {
  text_of<1024> id;
  id.add(id_verb).add(":").add(topic).add(":1");
  if (id.cut()) return false;
  begin_text(into, op_text);
  into.member("id", id.text());
  return true;
}

// `{"op":"service_response","id":ID,"service":"/add"`, the object left open.
void begin_answer(json::writer& into, std::string_view op_text, std::string_view member,
                  std::string_view name, std::string_view id_raw) noexcept {
  begin_text(into, op_text);
  if (!id_raw.empty()) into.member_raw("id", id_raw);
  if (name.empty()) return; // the call that is refused had no good one
  into.member(member, name);
}

// A request that names a topic and no more.
void write_topic_request(json::writer& out, std::string_view op_text, std::string_view id_verb,
                         std::string_view topic) noexcept {
  if (!begin_request(out, op_text, id_verb, topic)) return;
  out.member("topic", topic);
  out.end_object();
}

} // namespace

std::string_view name_of(severity which) noexcept {
  switch (which) {
  case severity::none: return "none";
  case severity::error: return "error";
  case severity::warning: return "warning";
  case severity::info: return "info";
  }
  return "";
}

void write_publish_head(json::writer& out, std::string_view topic) noexcept {
  begin_text(out, "publish");
  out.member("topic", topic);
  out.key("msg");
}

void write_status(json::writer& out, severity how, std::string_view id_raw, std::string_view text) noexcept {
  begin_text(out, "status");
  out.member("level", name_of(how));
  if (!id_raw.empty()) out.member_raw("id", id_raw);
  out.member("msg", text);
  out.end_object();
}

void write_subscribe(json::writer& out, std::string_view topic, std::string_view type,
                     std::int64_t throttle_ms) noexcept {
  if (!begin_request(out, "subscribe", "subscribe", topic)) return;
  if (!type.empty()) out.member("type", type);
  out.member("topic", topic);
  out.member("compression", "none");
  out.member("throttle_rate", throttle_ms);
  out.member("queue_length", 0);
  out.end_object();
}

void write_unsubscribe(json::writer& out, std::string_view topic) noexcept {
  write_topic_request(out, "unsubscribe", "subscribe", topic);
}

void write_advertise(json::writer& out, std::string_view topic, std::string_view type, bool latch) noexcept {
  if (!begin_request(out, "advertise", "advertise", topic)) return;
  if (!type.empty()) out.member("type", type);
  out.member("topic", topic);
  out.member("latch", latch);
  out.member("queue_size", 100);
  out.end_object();
}

void write_unadvertise(json::writer& out, std::string_view topic) noexcept {
  write_topic_request(out, "unadvertise", "advertise", topic);
}

// Services.

void write_advertise_service(json::writer& out, std::string_view service, std::string_view type) noexcept {
  begin_text(out, "advertise_service");
  if (!type.empty()) out.member("type", type);
  out.member("service", service);
  out.end_object();
}

void write_unadvertise_service(json::writer& out, std::string_view service) noexcept {
  begin_text(out, "unadvertise_service");
  out.member("service", service);
  out.end_object();
}

void write_call_service_head(json::writer& out, std::string_view service, std::string_view id) noexcept {
  begin_text(out, "call_service");
  out.member("id", id);
  out.member("service", service);
  out.key("args");
}

void write_service_response_head(json::writer& out, std::string_view service, std::string_view id_raw,
                                 bool result) noexcept {
  begin_answer(out, "service_response", "service", service, id_raw);
  out.member("result", result);
  out.key("values");
}

// Actions.

void write_goal_head(json::writer& out, std::string_view action, std::string_view type, std::string_view id,
                     bool feedback) noexcept {
  begin_text(out, "send_action_goal");
  out.member("id", id);
  out.member("action", action);
  if (!type.empty()) out.member("action_type", type);
  out.member("feedback", feedback);
  out.key("args");
}

void write_cancel_goal(json::writer& out, std::string_view action, std::string_view id) noexcept {
  begin_text(out, "cancel_action_goal");
  out.member("id", id);
  out.member("action", action);
  out.end_object();
}

void write_feedback_head(json::writer& out, std::string_view action, std::string_view id_raw) noexcept {
  begin_answer(out, "action_feedback", "action", action, id_raw);
  out.key("values");
}

void write_action_result_head(json::writer& out, std::string_view action, std::string_view id_raw,
                              int goal_status, bool result) noexcept {
  begin_answer(out, "action_result", "action", action, id_raw);
  out.member("status", std::int64_t{goal_status});
  out.member("result", result);
  out.key("values");
}

void write_fragment(json::writer& out, const text_fragment& what) noexcept {
  out.begin_object();
  out.member("op", "fragment");
  out.member("id", what.id);
  out.member("data", what.data);
  out.member("num", std::int64_t{what.number});
  out.member("total", std::int64_t{what.count});
  out.end_object();
}

refusal refuse_op(const request& asked) noexcept {
  const bool known = asked.what == verb::unsupported;
  if (asked.verb_text == "png")
    return {.what = refusal::kind::unsupported_op,
            .value = asked.verb_text,
            .expected = R"("compression":"png" for what is subscribed to; send what the PNG holds as text)"};
  return {.what = known ? refusal::kind::unsupported_op : refusal::kind::unknown_op,
          .value = asked.verb_text,
          .expected =
              "subscribe, unsubscribe, advertise, unadvertise, publish, call_service, service_response, "
              "advertise_service, unadvertise_service, advertise_action, unadvertise_action, "
              "send_action_goal, cancel_action_goal, action_feedback, action_result, fragment and set_level"};
}

} // namespace rowe::wire::rosbridge
