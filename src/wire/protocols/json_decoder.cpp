// SPDX-License-Identifier: Apache-2.0
#include "wire/protocols/json_decoder.hpp"

#include <algorithm>
#include <iterator>

#include "wire/codec/own_names.hpp"
#include "wire/plain/plain.hpp"
#include "wire/rosbridge/rosbridge.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire {
namespace {

constexpr bool decoders_fit(const name_limits& limits) {
  return rosbridge::scratch_bytes(limits) <= decode_scratch_bytes(limits) &&
         plain::scratch_bytes(limits) <= decode_scratch_bytes(limits);
}
static_assert(decoders_fit({.name_bytes_max = 0, .id_bytes_max = 0}) && decoders_fit({}));

constexpr std::string_view stop_marks[] = {"rowe/stop", "rowe\\/stop"};

bool says_stop(std::string_view escaped) noexcept {
  return json::says(escaped, stop_name) || json::says(escaped, stop_name.substr(1));
}

diagnostic diagnose(const refusal& why, const decode_buffers& buffers) noexcept {
  return {.code = why.code(), .text = why.text(buffers.diagnostic)};
}

} // namespace

decoded json_decoder::decode(const json::document& text, const decode_buffers& buffers, request& into,
                             diagnostic& why) const noexcept {
  // Clients of rosbridge put `op` first. So most of their members are not looked at twice.
  const json::member* const first = text.noted.empty() ? nullptr : text.noted.data();
  if (first != nullptr && json::name_is(*first, "op") && first->what.type == json::kind::string)
    return decode_rosbridge(text, buffers, into, why);
  return decode_other(text, buffers, into, why);
}

inline decoded json_decoder::decode_other(const json::document& text, const decode_buffers& buffers,
                                          request& into, diagnostic& why) const noexcept {
  auto op = plain::op_member::none;
  const auto wrong = plain::decode(text, buffers.scratch, buffers.limits, into, op);
  if (op == plain::op_member::text) return decode_rosbridge(text, buffers, into, why);
  into.codec = plain_;
  if (wrong) {
    why = diagnose(*wrong, buffers);
    return decoded::refused;
  }
  if (text.noted.empty() && !json::is_object(text.text)) {
    why = diagnose({.what = refusal::kind::not_an_object}, buffers);
    return decoded::malformed;
  }
  return decoded::request;
}

inline decoded json_decoder::decode_rosbridge(const json::document& text, const decode_buffers& buffers,
                                              request& into, diagnostic& why) const noexcept {
  const auto wrong = rosbridge::decode(text, buffers.scratch, buffers.limits, into);
  into.codec = rosbridge_;
  into.messages_in = encodings_[into.encoding];
  if (wrong || into.what >= verb::unsupported)
    why = diagnose(wrong ? *wrong : rosbridge::refuse_op(into), buffers);
  if (wrong) return decoded::refused;
  return decoded::request;
}

codec_id json_decoder::guess(std::string_view text, codec_id spoke_last) const noexcept {
  if (rosbridge::names_operation(text)) return rosbridge_;
  return plain::names_id(text) ? plain_ : spoke_last;
}

// Whether a text that begins like this has a "service" or "topic" that is the stop, at its top level and not
// inside another value.
bool json_decoder::may_be_stop(opcode what, std::string_view begins) const noexcept {
  if (what != opcode::text) return false;
  const bool marked = std::any_of(std::begin(stop_marks), std::end(stop_marks), [&](std::string_view mark) {
    return begins.find(mark) != std::string_view::npos;
  });
  if (!marked) return false;
  int depth = 0;
  bool in_value = false;
  std::string_view name;
  for (std::size_t at = 0; at < begins.size(); ++at) {
    switch (begins[at]) {
    case '{':
    case '[': ++depth; break;
    case '}':
    case ']':
      if (--depth <= 0) return false;
      break;
    case ':': in_value = in_value || depth == 1; break;
    case ',': in_value = in_value && depth != 1; break;
    case '"': {
      const std::size_t begin = ++at;
      while (at < begins.size() && begins[at] != '"') at += begins[at] == '\\' ? 2U : 1U;
      if (at >= begins.size()) return false;
      const std::string_view said = begins.substr(begin, at - begin);
      if (depth != 1) break;
      if (!in_value) {
        name = said;
      } else if (name == "service" ? says_stop(said.substr(0, said.find('#')))
                                   : name == "topic" && says_stop(said)) {
        return true;
      }
      break;
    }
    default: break;
    }
  }
  return false;
}

} // namespace rowe::wire
