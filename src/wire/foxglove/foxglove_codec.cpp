// SPDX-License-Identifier: Apache-2.0
#include "wire/foxglove/foxglove_codec.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "wire/foxglove/foxglove.hpp"
#include "wire/foxglove/foxglove_schema.hpp"
#include "json/structs/encoder.hpp"
#include "json/structs/times.hpp"

namespace rowe::wire {
namespace {

using namespace foxglove_words;

void append_number(json::writer& out, std::uint64_t number, std::size_t bytes) noexcept {
  std::array<char, 8> all{};
  for (std::size_t i = 0; i < bytes; ++i) all[i] = static_cast<char>(number >> (8 * i));
  out.append({all.data(), bytes});
}

void begin(json::writer& out, std::string_view op) noexcept {
  out.begin_object();
  out.member("op", op);
}

// Whether the id of a request is a text of JSON. That of a call is binary: it may pass only if it is one,
// too.
bool is_text(std::string_view id_raw) noexcept {
  if (id_raw.size() != call_id_bytes) return !id_raw.empty();
  return id_raw.front() == '"' && id_raw.back() == '"' &&
         std::all_of(id_raw.begin() + 1, id_raw.end() - 1,
                     [](char c) { return c >= ' ' && c <= '~' && c != '"' && c != '\\'; });
}

message_kind write_numbers(json::writer& out, std::string_view op, std::string_view key,
                           std::span<const listed> which) noexcept {
  begin(out, op);
  out.begin_array(key);
  for (const listed& one : which) out.number(one.number);
  out.end_array();
  out.end_object();
  return message_kind::text;
}

void write_form(json::writer& out, const schema_description* schema, std::string_view name,
                foxglove_times times) noexcept {
  out.member("encoding", json_encoding);
  out.member("schemaName", name);
  out.member("schemaEncoding", "jsonschema");
  out.key("schema");
  write_foxglove_schema(out, schema, times);
}

std::string_view name_of(const schema_description* schema, std::string_view type) noexcept {
  return schema != nullptr && !schema->type_name.empty() ? schema->type_name : type;
}

// What a list of the connection graph is called, and who holds one of its elements; empty: nobody does.
struct graph_words {
  std::string_view list;
  std::string_view holders;
};
graph_words words_of(graph_list which) noexcept {
  switch (which) {
  case graph_list::published_topics: return {"publishedTopics", "publisherIds"};
  case graph_list::subscribed_topics: return {"subscribedTopics", "subscriberIds"};
  case graph_list::advertised_services: return {"advertisedServices", "providerIds"};
  case graph_list::removed_topics: return {"removedTopics", {}};
  case graph_list::removed_services: break;
  }
  return {"removedServices", {}};
}

} // namespace

message_head foxglove_codec::head_of(const delivery& to) const noexcept {
  message_head head{.size = 13, .as = message_kind::binary};
  head.bytes[0] = std::byte{message_data};
  for (std::size_t i = 0; i < 4; ++i) head.bytes[1 + i] = std::byte(to.tag >> (8 * i));
  const auto time = static_cast<std::uint64_t>(to.wall_ns);
  for (std::size_t i = 0; i < 8; ++i) head.bytes[5 + i] = static_cast<std::byte>(time >> (8 * i));
  return head;
}

message_kind foxglove_times_codec::write_message(json::writer& out,
                                                 const topic_message& what) const noexcept {
  if (what.value.others != nullptr) {
    const json::other_encoders& by = *what.value.others;
    (by.sec_nsec ? *by.sec_nsec : *by.json).encode(what.value.at, out);
  } else if (what.schema != nullptr) {
    json::write_sec_nsec(out, what.text, *what.schema);
  } else {
    out.raw(what.text);
  }
  return message_kind::text;
}

message_kind foxglove_codec::write_call(json::writer&, std::string_view, std::string_view,
                                        const call_args&) const noexcept {
  return message_kind::none; // its clients provide nothing
}

message_kind foxglove_codec::write_reply(json::writer& out, const call_origin& call,
                                         const body& value) const noexcept {
  // A stop that ended before the call's own number. Its sender gets a status for that.
  if (call.id_raw.size() != call_id_bytes) return message_kind::none;
  append_number(out, service_response, 1);
  out.append(call.id_raw);
  append_number(out, json_encoding.size(), 4);
  out.append(json_encoding);
  value.write(out);
  return message_kind::binary;
}

message_kind foxglove_codec::write_failure(json::writer& out, const call_origin& call,
                                           const diagnostic& why) const noexcept {
  if (call.id_raw.size() != call_id_bytes) return write_error(out, {}, why);
  begin(out, "serviceCallFailure");
  out.member("serviceId", number_at(call.id_raw));
  out.member("callId", number_at(call.id_raw.substr(4)));
  out.member("message", why.text);
  out.end_object();
  return message_kind::text;
}

message_kind foxglove_codec::write_error(json::writer& out, const error_context& to,
                                         const diagnostic& why) const noexcept {
  if (to.to_server) return message_kind::none;
  begin(out, "status");
  out.member("level", to.how == severity::error ? 2 : to.how == severity::warning ? 1 : 0);
  out.member("message", why.text);
  if (is_text(to.id_raw)) out.member_raw("id", to.id_raw);
  out.end_object();
  return message_kind::text;
}

message_kind foxglove_codec::write_time(json::writer& out, std::int64_t wall_ns) const noexcept {
  append_number(out, server_time, 1);
  append_number(out, static_cast<std::uint64_t>(wall_ns), 8);
  return message_kind::binary;
}

message_kind foxglove_codec::write_hello(json::writer& out, const greeting& who) const noexcept {
  begin(out, "serverInfo");
  out.member("name", who.name);
  out.member_raw(
      "capabilities",
      R"(["clientPublish","services","parameters","parametersSubscribe","connectionGraph","time"])");
  out.member_raw("supportedEncodings", R"(["json"])");
  out.member_raw("metadata", "{}");
  out.key("sessionId");
  std::array<char, 20> digits; // a text, because a browser rounds numbers beyond 2^53
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), who.epoch).ptr;
  out.string({digits.data(), static_cast<std::size_t>(end - digits.data())});
  out.end_object();
  return message_kind::text;
}

message_kind foxglove_codec::write_topics(json::writer& out, std::span<const listed> which,
                                          bool added) const noexcept {
  if (!added) return write_numbers(out, "unadvertise", "channelIds", which);
  begin(out, "advertise");
  out.begin_array("channels");
  for (const listed& one : which) {
    out.begin_object();
    out.member("id", one.number);
    out.member("topic", one.name);
    write_form(out, one.schema, name_of(one.schema, one.type), foxglove_times::sec_nsec);
    out.end_object();
  }
  out.end_array();
  out.end_object();
  return message_kind::text;
}

message_kind foxglove_codec::write_services(json::writer& out, std::span<const listed> which,
                                            bool added) const noexcept {
  if (!added) return write_numbers(out, "unadvertiseServices", "serviceIds", which);
  begin(out, "advertiseServices");
  out.begin_array("services");
  const auto write_side = [&out](std::string_view key, const schema_description* schema,
                                 std::string_view type) {
    out.begin_object(key);
    write_form(out, schema, name_of(schema, type), foxglove_times::as_described);
    out.end_object();
  };
  for (const listed& one : which) {
    out.begin_object();
    out.member("id", one.number);
    out.member("name", one.name);
    out.member("type", one.type);
    write_side("request", one.request, {});
    write_side("response", one.schema, {});
    out.end_object();
  }
  out.end_array();
  out.end_object();
  return message_kind::text;
}

void foxglove_codec::begin_parameters(json::writer& out, std::string_view id_raw) const noexcept {
  begin(out, "parameterValues");
  if (!id_raw.empty()) out.member_raw("id", id_raw);
  out.begin_array("parameters");
}

void foxglove_codec::add_parameter(json::writer& out, const parameter_update& one) const noexcept {
  out.begin_object();
  out.member("name", one.name);
  if (!one.json.empty()) out.member_raw("value", one.json);
  // A real number that is whole looks like any whole number.
  if (one.is_real) out.member("type", "float64");
  out.end_object();
}

message_kind foxglove_codec::end_parameters(json::writer& out) const noexcept {
  out.end_array();
  out.end_object();
  return message_kind::text;
}

void foxglove_codec::begin_graph(json::writer& out) const noexcept { begin(out, "connectionGraphUpdate"); }

void foxglove_codec::begin_graph_list(json::writer& out, graph_list which) const noexcept {
  out.begin_array(words_of(which).list);
}

void foxglove_codec::add_to_graph(json::writer& out, graph_list to, std::string_view name,
                                  const body& holders) const noexcept {
  const std::string_view key = words_of(to).holders;
  if (key.empty()) return out.string(name);
  out.begin_object();
  out.member("name", name);
  out.key(key);
  holders.write(out);
  out.end_object();
}

void foxglove_codec::end_graph_list(json::writer& out) const noexcept { out.end_array(); }

message_kind foxglove_codec::end_graph(json::writer& out) const noexcept {
  out.end_object();
  return message_kind::text;
}

// With the words around it, beyond those that each listed topic or service is counted to take.
std::size_t foxglove_codec::schema_bytes(const listed& one) const noexcept {
  constexpr std::size_t words = 128;
  const auto bytes = [](const schema_description* of) {
    const std::size_t name = of != nullptr ? 2 * of->type_name.size() : 0;
    const std::size_t described = foxglove_schema_bytes(of, foxglove_times::as_described);
    if (of == nullptr || !json::holds_time(*of)) return words + name + described;
    return words + name + std::max(described, foxglove_schema_bytes(of, foxglove_times::sec_nsec));
  };
  return bytes(one.schema) + bytes(one.request);
}

} // namespace rowe::wire
