// SPDX-License-Identifier: Apache-2.0
// Encoding: what rowe says in rosbridge's words, and the sentences of its refusals.
#include <array>

#include "wire/rosbridge.hpp"
#include "wire/text_out.hpp"
#include "json/writer.hpp"

namespace rowe::wire::rosbridge {
namespace {

constexpr std::size_t value_bytes_max = 64; // of a value shown in a sentence

std::string_view text_of(const json::writer& done) noexcept {
  return done.overflowed() ? std::string_view{} : done.text();
}

// `{"op":"subscribe"`, the object left open.
void begin_text(json::writer& into, std::string_view op_text) noexcept {
  into.begin_object();
  into.key("op");
  into.string(op_text);
}

// `{"op":"subscribe","id":"subscribe:/odom:1"`, the object left open. False when the id is too long to be
// made.
bool begin_request(json::writer& into, std::string_view op_text, std::string_view id_verb,
                   std::string_view topic, std::uint64_t number) noexcept {
  std::array<char, 1024> room;
  text_out id{room};
  id.add(id_verb).add(":").add(topic).add(":").add(static_cast<std::int64_t>(number));
  if (id.cut()) return false;
  begin_text(into, op_text);
  into.key("id");
  into.string(id.text());
  return true;
}

// A request that names a topic and no more.
std::string_view encode_topic_request(std::span<char> out, std::string_view op_text, std::string_view id_verb,
                                      std::string_view topic, std::uint64_t number) noexcept {
  json::writer text{out};
  if (!begin_request(text, op_text, id_verb, topic, number)) return {};
  text.key("topic");
  text.string(topic);
  text.end_object();
  return text_of(text);
}

} // namespace

std::string_view name_of(level which) noexcept {
  switch (which) {
  case level::none: return "none";
  case level::error: return "error";
  case level::warning: return "warning";
  case level::info: return "info";
  }
  return "";
}

std::string_view encode_publish_head(std::span<char> out, std::string_view topic) noexcept {
  json::writer text{out};
  begin_text(text, "publish");
  text.key("topic");
  text.string(topic);
  text.key("msg");
  return text_of(text);
}

std::string_view encode_status(std::span<char> out, level how, std::string_view id_raw,
                               std::string_view text) noexcept {
  json::writer status{out};
  begin_text(status, "status");
  status.key("level");
  status.string(name_of(how));
  if (!id_raw.empty()) {
    status.key("id");
    status.raw(id_raw);
  }
  status.key("msg");
  status.string(text);
  status.end_object();
  return text_of(status);
}

std::string_view encode_subscribe(std::span<char> out, const subscription& what) noexcept {
  json::writer text{out};
  if (!begin_request(text, "subscribe", "subscribe", what.topic, what.number)) return {};
  if (!what.type.empty()) {
    text.key("type");
    text.string(what.type);
  }
  text.key("topic");
  text.string(what.topic);
  text.key("compression");
  text.string("none");
  text.key("throttle_rate");
  text.number(what.throttle_ms);
  text.key("queue_length");
  text.number(what.queue_length);
  text.end_object();
  return text_of(text);
}

std::string_view encode_unsubscribe(std::span<char> out, std::string_view topic,
                                    std::uint64_t number) noexcept {
  return encode_topic_request(out, "unsubscribe", "subscribe", topic, number);
}

std::string_view encode_advertise(std::span<char> out, const advertisement& what) noexcept {
  json::writer text{out};
  if (!begin_request(text, "advertise", "advertise", what.topic, what.number)) return {};
  if (!what.type.empty()) {
    text.key("type");
    text.string(what.type);
  }
  text.key("topic");
  text.string(what.topic);
  text.key("latch");
  text.boolean(what.latch);
  text.key("queue_size");
  text.number(what.queue_size);
  text.end_object();
  return text_of(text);
}

std::string_view encode_unadvertise(std::span<char> out, std::string_view topic,
                                    std::uint64_t number) noexcept {
  return encode_topic_request(out, "unadvertise", "advertise", topic, number);
}

// Services.

std::string_view encode_advertise_service(std::span<char> out, std::string_view service,
                                          std::string_view type) noexcept {
  json::writer text{out};
  begin_text(text, "advertise_service");
  if (!type.empty()) {
    text.key("type");
    text.string(type);
  }
  text.key("service");
  text.string(service);
  text.end_object();
  return text_of(text);
}

std::string_view encode_unadvertise_service(std::span<char> out, std::string_view service) noexcept {
  json::writer text{out};
  begin_text(text, "unadvertise_service");
  text.key("service");
  text.string(service);
  text.end_object();
  return text_of(text);
}

void write_call_service_head(json::writer& out, std::string_view service, std::string_view id,
                             std::int64_t timeout_ns) noexcept {
  begin_text(out, "call_service");
  out.key("id");
  out.string(id);
  out.key("service");
  out.string(service);
  if (timeout_ns > 0) {
    out.key("timeout");
    out.number(static_cast<double>(timeout_ns) / 1e9);
  }
  out.key("args");
}

void write_call_service_tail(json::writer& out) noexcept { out.end_object(); }

void write_service_response_head(json::writer& out, std::string_view service, std::string_view id_raw,
                                 bool result) noexcept {
  begin_text(out, "service_response");
  if (!id_raw.empty()) {
    out.key("id");
    out.raw(id_raw);
  }
  out.key("service");
  out.string(service);
  out.key("result");
  out.boolean(result);
  out.key("values");
}

void write_service_response_tail(json::writer& out) noexcept { out.end_object(); }

// The sentences.

refusal refuse_op(const request& asked) noexcept {
  const bool known = asked.what != op::unknown;
  return {.what = known ? refusal::kind::unsupported_op : refusal::kind::unknown_op, .value = asked.op_text};
}

std::string_view refusal::text(std::span<char> buffer) const noexcept {
  constexpr std::string_view offered =
      "subscribe, unsubscribe, advertise, unadvertise, publish, call_service, service_response, "
      "advertise_service, unadvertise_service and set_level";
  text_out out{buffer};
  if (!op_text.empty()) out.add_shortened(op_text, value_bytes_max).add(": ");
  const auto the_member = [&]() -> text_out& { return out.add("the member \"").add(member).add("\" "); };
  const auto it_is = [&] { out.add("; it is ").add_shortened(value, value_bytes_max); };
  switch (what) {
  case kind::not_an_object: out.add("a message must be a JSON object"); break;
  case kind::missing:
    the_member().add("is missing");
    if (member == "op") out.add(R"(; it says what to do, for example {"op":"subscribe","topic":"/odom"})");
    break;
  case kind::twice: the_member().add("stands there twice"); break;
  case kind::wrong_type:
    the_member().add("must be ").add(expected);
    it_is();
    break;
  case kind::negative:
    the_member().add("must not be negative");
    it_is();
    break;
  case kind::too_large:
    the_member().add("must be at most ").add(limit);
    it_is();
    break;
  case kind::too_long:
    the_member()
        .add("is ")
        .add(static_cast<std::int64_t>(bytes))
        .add(" bytes long; the limit is ")
        .add(limit);
    break;
  case kind::empty: the_member().add("must not be empty"); break;
  case kind::bad_characters:
    the_member().add("must have no control characters");
    it_is();
    break;
  case kind::not_offered:
    the_member().add("asks for ").add_shortened(value, value_bytes_max).add(", which is not offered; use ");
    out.add(expected).add(" or leave it out");
    break;
  case kind::unsupported_op:
    out.add("the operation \"")
        .add_shortened(value, value_bytes_max)
        .add("\" is not offered here; offered are ");
    out.add(offered);
    break;
  case kind::unknown_op:
    out.add("the operation \"")
        .add_shortened(value, value_bytes_max)
        .add("\" is unknown; offered are ")
        .add(offered);
    break;
  }
  return out.text();
}

} // namespace rowe::wire::rosbridge
