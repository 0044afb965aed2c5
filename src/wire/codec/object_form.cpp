// SPDX-License-Identifier: Apache-2.0
#include "wire/codec/object_form.hpp"

#include <algorithm>
#include <iterator>

#include "wire/codec/members.hpp"
#include "wire/codec/time_to_live.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/encoder.hpp"
#include "json/writing/splice.hpp"
#include "json/writing/writer.hpp"

namespace rowe::wire {

bool has_names_of_calls(std::string_view validated_object) noexcept {
  static constexpr word_table names{"service", "op", "message_id", "in_reply_to"};
  return collect(validated_object, names).seen != 0;
}

std::optional<std::size_t> find_reserved(std::string_view validated_text, bool with_ttl) noexcept {
  json::object_walk walk{validated_text};
  for (json::member m; walk.next(m);) {
    if (json::name_is(m, "op") || json::name_is(m, "message_id") || json::name_is(m, "in_reply_to") ||
        (with_ttl && json::name_is(m, ttl_member))) {
      return static_cast<std::size_t>(m.name_raw.data() - validated_text.data()) - 1;
    }
  }
  return std::nullopt;
}

void write_args(json::writer& out, const call_args& what) noexcept {
  switch (what.is) {
  case call_args::form::value: return what.encoder->encode(what.value, out);
  case call_args::form::args: return out.raw(what.text.empty() ? std::string_view{"{}"} : what.text);
  case call_args::form::object: break;
  }
  out.begin_object();
  json::object_walk members{json::root(what.text).raw};
  for (json::member m; members.next(m);) {
    constexpr std::string_view own[] = {"service", "message_id", "in_reply_to", "ttl_ms"};
    if (std::any_of(std::begin(own), std::end(own), [&](std::string_view n) { return json::name_is(m, n); }))
      continue;
    out.raw({m.name_raw.data() - 1, m.name_raw.size() + 2}); // with its quotes
    out.append(":");
    out.append(m.what.raw);
  }
  out.end_object();
}

void write_delivered_call(json::writer& out, std::string_view service, std::string_view args_raw,
                          std::string_view id) noexcept {
  out.begin_object();
  write_service_member(out, service);
  if (json::is_object(args_raw) && !has_names_of_calls(args_raw)) {
    write_members(out, args_raw, "args");
  } else if (!args_raw.empty()) {
    out.member_raw("args", args_raw);
  }
  write_id_member(out, id);
  out.end_object();
}

void write_result(json::writer& out, std::string_view value_raw) noexcept {
  out.begin_object();
  out.member_raw("result", value_raw);
  out.end_object();
}

void write_service_member(json::writer& out, std::string_view service) noexcept {
  out.member("service", service);
}

void write_id_member(json::writer& out, std::string_view id) noexcept { out.member("message_id", id); }

void write_members(json::writer& out, std::string_view text, std::string_view name_otherwise) noexcept {
  json::splice members{out};
  out.raw(text);
  members.end(name_otherwise);
}

} // namespace rowe::wire
