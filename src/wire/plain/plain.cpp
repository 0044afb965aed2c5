// SPDX-License-Identifier: Apache-2.0
#include "wire/plain/plain.hpp"

#include <algorithm>
#include <array>

#include "wire/codec/members.hpp"
#include "wire/codec/object_form.hpp"
#include "wire/codec/time_to_live.hpp"
#include "json/writing/splice.hpp"

namespace rowe::wire::plain {
namespace {

enum reserved : std::size_t { message_id, in_reply_to, ttl_ms, service, error, op };
constexpr word_table names{"message_id", "in_reply_to", "ttl_ms", "service", "error", "op"};
using found_members = members<names.size()>;

std::optional<refusal> read_id(reserved which, const found_members& found, std::size_t bytes_max,
                               std::string_view& into) noexcept {
  if (!found.given(which)) return std::nullopt;
  const json::value& v = found.values[which];
  if (v.type != json::kind::string && !json::to_integer(v) && !json::to_unsigned(v))
    return wrong_type(names[which], v, "a string or an integer");
  if (v.raw.size() > bytes_max) {
    return too_long(names[which], v.raw.size(), bytes_max);
  }
  into = v.raw;
  return std::nullopt;
}

std::optional<refusal> read_service(const found_members& found, std::size_t bytes_max,
                                    std::span<char> scratch, std::string_view& into) noexcept {
  const json::value& v = found.values[service];
  if (!found.given(service) || v.type != json::kind::string) return std::nullopt;
  const auto text = json::to_string(v, scratch.first(std::min(bytes_max, scratch.size())));
  if (!text || text->size() > bytes_max) return too_long(names[service], v.raw.size() - 2, bytes_max);
  if (text->empty()) return refusal{.what = refusal::kind::empty, .member = names[service]};
  if (has_control_characters(*text)) return bad_characters(names[service], v);
  into = *text;
  return std::nullopt;
}

void read_error(const found_members& found, std::span<char> scratch, request& out) noexcept {
  if (!found.given(error)) return;
  const std::string_view object = found.values[error].raw; // anything else has no members
  const auto code = json::find(object, "code");
  if (!code) return;
  const auto word = json::to_string(*code, scratch.first(std::min(code_bytes_max, scratch.size())));
  if (!word || word->empty() || word->size() > code_bytes_max) return;
  out.failed = true;
  out.code = *word;
  const auto text = json::find(object, "text");
  out.body_raw = text && text->type == json::kind::string ? text->raw : std::string_view{};
}

std::optional<refusal> refuse_twice(const found_members& found, std::span<const reserved> which) noexcept {
  for (const reserved r : which) {
    if (found.repeats(r)) return refusal{.what = refusal::kind::twice, .member = names[r]};
  }
  return std::nullopt;
}

// Ends a body. Its members stand among those of the envelope, unless one `is_taken` there.
template <class IsTaken>
void end(const json::writer& out, json::splice& body, std::string_view name, IsTaken is_taken) noexcept {
  const std::string_view value = out.overflowed() ? std::string_view{} : body.value();
  const bool apart = value == long_object || (!value.empty() && is_taken(json::root(value).raw));
  apart ? body.end_apart(name) : body.end(name);
}

} // namespace

std::optional<refusal> decode(const json::document& validated_text, std::span<char> scratch,
                              const name_limits& limits, request& out, op_member& of_rosbridge) noexcept {
  const auto found = collect(validated_text, names);
  of_rosbridge = op_member::none;
  if (found.given(op)) {
    const json::value first = found.repeats(op) ? *json::find(validated_text, names[op]) : found.values[op];
    of_rosbridge = first.type == json::kind::string ? op_member::text : op_member::other;
    if (of_rosbridge == op_member::text) return std::nullopt;
  }
  out.form = call_args::form::object;
  out.what = found.given(in_reply_to) ? verb::reply : found.given(message_id) ? verb::call : verb::message;
  // Both ids are read, whatever is wrong. But if both are there, nobody knows which was meant.
  std::optional<refusal> wrong;
  std::string_view asked;
  std::string_view answered;
  for (const auto& [which, into] : {std::pair{message_id, &asked}, {in_reply_to, &answered}}) {
    if (found.repeats(which)) continue;
    if (const auto bad = read_id(which, found, limits.id_bytes_max, *into); bad && !wrong) wrong = bad;
  }
  if (out.what == verb::call) out.id_raw = asked; // for the answer
  if (const auto twice = refuse_twice(found, std::array{message_id, in_reply_to, ttl_ms})) return twice;
  if (wrong) return wrong;
  if (found.given(ttl_ms)) {
    if (const auto bad = read_ttl(found.values[ttl_ms], out.ttl_ns)) return bad;
  }
  if (out.what == verb::call) {
    if (const auto twice = refuse_twice(found, std::array{service})) return twice;
    if (const auto bad = read_service(found, limits.name_bytes_max, scratch, out.service)) return bad;
  }
  if (out.what == verb::reply) {
    if (const auto twice = refuse_twice(found, std::array{error})) return twice;
  }
  if (of_rosbridge == op_member::other)
    return refusal{.what = refusal::kind::wrong_type, .member = names[op], .expected = "a string"};
  out.body_raw = validated_text.text;
  if (out.what == verb::reply) {
    out.id_raw = answered;
    read_error(found, scratch, out);
  }
  return std::nullopt;
}

bool names_id(std::string_view text) noexcept {
  for (const std::string_view name : {R"("message_id")", R"("in_reply_to")"}) {
    std::size_t from = 0;
    if (behind_name(text, name, from)) return true;
  }
  return false;
}

// Writing.

void write_invocation(json::writer& out, std::string_view object_text, std::string_view id) noexcept {
  out.begin_object();
  write_members(out, object_text, "args");
  write_id_member(out, id);
  out.end_object();
}

void write_call(json::writer& out, std::string_view service, std::string_view id,
                const call_args& args) noexcept {
  out.begin_object();
  write_service_member(out, service);
  json::splice into{out};
  write_args(out, args);
  end(out, into, "args", has_names_of_calls);
  write_id_member(out, id);
  out.end_object();
}

void write_reply(json::writer& out, std::string_view in_reply_to_raw, const body& value) noexcept {
  out.begin_object();
  json::splice into{out};
  value.write(out);
  end(out, into, "result", [](std::string_view object) { return find_reserved(object).has_value(); });
  out.member_raw("in_reply_to", in_reply_to_raw);
  out.end_object();
}

void write_error(json::writer& out, std::string_view in_reply_to_raw, std::string_view code,
                 std::string_view text) noexcept {
  out.begin_object();
  out.begin_object("error");
  out.member("code", code);
  out.member("text", text);
  out.end_object();
  if (!in_reply_to_raw.empty()) out.member_raw("in_reply_to", in_reply_to_raw);
  out.end_object();
}

} // namespace rowe::wire::plain
