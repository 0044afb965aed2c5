// SPDX-License-Identifier: Apache-2.0
// Foxglove's protocol under arbitrary messages: texts, and binary ones if the first byte is below 0x20. What
// is required: a message is decoded, request by request, or refused with a diagnostic, and then the error or
// the failure that tells its sender is JSON. What was decoded keeps its limits and points into the message or
// the scratch buffer; a call that has its numbers has them as its id. What may be a stop by its first bytes
// is seen at any length.
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "fuzz/require.hpp"
#include "wire/foxglove/foxglove_codec.hpp"
#include "json/padded.hpp"
#include "json/reading/reader.hpp"

namespace {

using namespace rowe::wire;
using rowe::fuzz::lies_in;
using rowe::fuzz::require;
using rowe::json::reader;

constexpr name_limits limits{.name_bytes_max = 24, .id_bytes_max = 32};
constexpr std::size_t message_bytes_max = 4096;
constexpr codec_id id{5};
constexpr foxglove_decoder reads{id};
constexpr foxglove_json_codec writes{id, id};

void check_names(const request& asked, std::string_view message, std::string_view scratch) {
  for (const std::string_view name : {asked.topic, asked.service, asked.type}) {
    require(name.size() <= limits.name_bytes_max, "names keep their limit");
    require(lies_in(name, message) || lies_in(name, scratch), "names lie where they should");
  }
  require(lies_in(asked.id_raw, message) && lies_in(asked.body_raw, message), "so do ids and bodies");
}

void check_refusal(reader& validator, const request& asked, const diagnostic& why) {
  require(!why.text.empty() && !why.code.empty(), "a refusal says why");
  std::array<char, error_bytes_max + reader::tailroom_bytes> buffer{};
  rowe::json::writer out{std::span{buffer}.first<error_bytes_max>()};
  const bool of_call = asked.what == verb::call;
  const message_kind kind = of_call ? writes.write_failure(out, {.service = {}, .id_raw = asked.id_raw}, why)
                                    : writes.write_error(out, {}, why);
  require(kind == message_kind::text && !out.overflowed(), "its sender is told");
  require(bool{validator.validate(out.text())}, "in JSON");
}

bool is_of_parameters(verb what) {
  return what == verb::get_parameters || what == verb::set_parameters || what == verb::subscribe_parameters ||
         what == verb::unsubscribe_parameters;
}

// The lists are as whoever carries them out reads them, and the id can be echoed.
void check_parameters(reader& validator, const request& asked) {
  require(!asked.by_number && !asked.next, "all in one request");
  rowe::json::array_walk elements{asked.body_raw};
  for (rowe::json::value one; elements.next(one);) {
    const auto name = asked.what == verb::set_parameters ? rowe::json::find(one.raw, "name") : one;
    require(name && name->type == rowe::json::kind::string, "each has a name");
  }
  std::array<char, 256 + reader::tailroom_bytes> buffer{};
  rowe::json::writer out{std::span{buffer}.first<256>()};
  writes.begin_parameters(out, asked.id_raw);
  writes.add_parameter(out, {.name = "/a", .json = "1", .is_real = true});
  require(writes.end_parameters(out) == message_kind::text && !out.overflowed(), "it is answered");
  require(bool{validator.validate(out.text())}, "in JSON");
}

void check_one(reader& validator, decoded is, const request& asked, const diagnostic& why) {
  require(is != decoded::unsupported, "every message has a meaning or a refusal");
  require(asked.codec == id, "the answer has this codec");
  if (is != decoded::request) return check_refusal(validator, asked, why);
  require((asked.what == verb::advertise) == !asked.topic.empty(), "a channel has a topic");
  if (is_of_parameters(asked.what)) return check_parameters(validator, asked);
  if (asked.what == verb::subscribe_graph || asked.what == verb::unsubscribe_graph)
    return require(!asked.by_number && !asked.next && asked.id_raw.empty(), "it has nothing else");
  require(asked.by_number == (asked.what != verb::advertise), "all else has numbers");
  require(asked.what != verb::call || asked.id_raw.size() == 8, "a call has an id");
}

void check_text(reader& validator, std::string_view text) {
  const rowe::tests::padded block{text};
  const std::string_view padded = block.text();
  const bool valid = bool{validator.validate(padded)};
  std::array<char, decode_scratch_bytes(limits)> scratch;
  std::array<char, refusal::text_bytes_max> buffer;
  list_place from;
  for (int count = 0; count < 64; ++count) {
    request asked;
    diagnostic why;
    const decoded is = reads.decode(
        padded, {.scratch = scratch, .diagnostic = buffer, .limits = limits, .from = from}, asked, why);
    if (!valid) return;
    check_names(asked, padded, {scratch.data(), scratch.size()});
    reader other = reader::create(message_bytes_max).value();
    check_one(other, is, asked, why);
    if (!asked.next) return;
    require(asked.next.index == from.index + 1 && asked.next.at > from.at, "requests follow one another");
    from = asked.next;
  }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > message_bytes_max) return 0;
  static reader validator = reader::create(message_bytes_max).value();
  const std::string_view message{reinterpret_cast<const char*>(data), size};
  for (std::size_t bytes = 0; bytes <= std::min<std::size_t>(size, 16); ++bytes) {
    (void)reads.may_be_stop(opcode::text, message.substr(0, bytes));
    const bool stop = reads.may_be_stop(opcode::binary, message.substr(0, bytes));
    require(!stop || bytes >= 2, "no stop is seen in nothing");
  }
  if (message.empty() || static_cast<unsigned char>(message[0]) >= 0x20) {
    check_text(validator, message);
    return 0;
  }
  std::array<char, refusal::text_bytes_max> buffer;
  request asked;
  diagnostic why;
  const decoded is = reads.decode_binary(std::as_bytes(std::span{message}),
                                         {.scratch = {}, .diagnostic = buffer, .limits = limits}, asked, why);
  check_names(asked, message, {});
  check_one(validator, is, asked, why);
  return 0;
}
