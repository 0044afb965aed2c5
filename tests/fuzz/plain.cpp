// SPDX-License-Identifier: Apache-2.0
// The plain codec under arbitrary texts. What is required: a text that is valid JSON is decoded, or refused
// with a whole diagnostic; what was decoded keeps its limits and points into the text or the scratch buffer.
// The text itself, as the body of an invocation, a call, a reply, an error or a delivered call, gives JSON
// that is decoded with the same meaning, in a buffer of any size, or does not fit. A text that is not valid
// JSON is decoded, too, for the sanitizers: nobody does so, but nothing may be read that is not there.
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fuzz/require.hpp"
#include "wire/codec/object_form.hpp"
#include "wire/plain/plain.hpp"
#include "json/padded.hpp"
#include "json/reading/reader.hpp"
#include "json/writing/writer.hpp"

namespace {

using namespace rowe::wire;
using namespace rowe::wire::plain;
namespace json = rowe::json;
using json::reader;
using rowe::fuzz::lies_in;
using rowe::fuzz::require;
using rowe::tests::padded;

constexpr name_limits limits{.name_bytes_max = 24, .id_bytes_max = 32};
constexpr std::size_t text_bytes_max = 2048;
constexpr std::size_t written_bytes_max = 8 * text_bytes_max;
using scratch_buffer = std::array<char, scratch_bytes(limits)>;

std::size_t members_of(std::string_view object) {
  std::size_t count = 0;
  json::object_walk walk{object};
  for (json::member m; walk.next(m);) ++count;
  return count;
}

// What `write` writes, validated. In a smaller buffer it must write the same, or say that it does not fit.
template <class Write>
std::string written(reader& validator, Write write, std::size_t less) {
  std::vector<char> block(written_bytes_max);
  json::writer w{std::span{block}.first(block.size() - reader::tailroom_bytes)};
  write(w);
  require(!w.overflowed() && validator.validate(w.text()).has_value(), "what is written is JSON");
  std::string text{w.text()};
  std::vector<char> small(less % (text.size() + 1));
  json::writer again{small};
  write(again);
  require(again.overflowed() || again.text() == text, "it is whole or it is not there");
  return text;
}

struct read_envelope {
  scratch_buffer scratch;
  request out;
  op_member op{};
};

// Users' own members may be reserved ones or stand there twice; then it is enough to have been JSON.
bool read_back(std::string_view text, read_envelope& into) {
  into.out = {};
  return !decode(text, into.scratch, limits, into.out, into.op) && into.op == op_member::none;
}

void check_request(const request& e, std::string_view text, std::string_view scratch) {
  require((e.what == verb::message) == e.id_raw.empty(),
          "a call has an id, and a reply that which it answers");
  require(e.id_raw.size() <= limits.id_bytes_max, "ids keep their limit");
  require(e.service.size() <= limits.name_bytes_max, "services keep their limit");
  require(e.service.empty() || e.what == verb::call, "only calls name a service");
  require(e.ttl_ns >= unlimited, "times to live keep their limit");
  require(e.failed == !e.code.empty() && e.code.size() <= code_bytes_max, "errors have a code");
  require(e.failed || e.body_raw == text, "what is no error is the whole text");
  for (const std::string_view raw : {e.id_raw, e.body_raw}) {
    require(lies_in(raw, text), "values lie in the text");
  }
  for (const std::string_view name : {e.service, e.code}) {
    require(lies_in(name, text) || lies_in(name, scratch), "names lie where they should");
  }
}

// The valid text as a body of every kind of message.
void write_around(reader& validator, std::string_view text, const request& from, std::size_t less) {
  const bool object = json::root(text).type == json::kind::object;
  const std::size_t members = members_of(text);
  const std::string_view id_raw = from.id_raw.empty() ? "\"7\"" : from.id_raw;
  const std::string_view service = from.service.empty() ? "/s\"\\" : from.service;
  read_envelope back;

  const std::string invocation = written(
      validator, [&](json::writer& w) { write_invocation(w, text, "i.1"); }, less);
  require(members_of(invocation) == (object ? members + 1 : 2), "an invocation has one member more");
  if (!find_reserved(text) && read_back(invocation, back)) {
    require(back.out.what == verb::call && back.out.id_raw == "\"i.1\"", "an invocation keeps its id");
  }

  const std::string call = written(
      validator, [&](json::writer& w) { write_call(w, service, "i.1", {.text = text}); }, less);
  const bool args_apart = !object || has_names_of_calls(json::root(text).raw);
  require(members_of(call) == (args_apart ? 3 : members + 2),
          "a call has two members more, or its arguments apart");
  if (read_back(call, back)) {
    require(back.out.service == service && back.out.id_raw == "\"i.1\"", "a call keeps its service");
  }

  const std::string reply = written(
      validator, [&](json::writer& w) { write_reply(w, id_raw, body{text}); }, less);
  require(members_of(reply) == (object && !find_reserved(text) ? members + 1 : 2),
          "a reply has one member more, or its value apart");
  if (read_back(reply, back)) {
    require(back.out.what == verb::reply && back.out.id_raw == id_raw, "a reply keeps its id");
  }

  const std::string error = written(
      validator, [&](json::writer& w) { write_error(w, id_raw, "code", text); }, less);
  require(read_back(error, back) && back.out.failed && back.out.code == "code" && back.out.id_raw == id_raw,
          "an error says the same");
  std::vector<char> buffer(text.size());
  const std::string_view quoted = back.out.body_raw;
  require(json::to_string({json::kind::string, quoted}, buffer) == text, "in the same words");

  if (json::root(text).type != json::kind::array && !object) return;
  const std::string delivered = written(
      validator, [&](json::writer& w) { write_delivered_call(w, service, text, "i.1"); }, less);
  const json::value args = json::find(delivered, "args").value_or(json::value{});
  const bool apart = members_of(delivered) == 3 && args.raw == json::root(text).raw;
  require(apart || members_of(delivered) == members + 2, "a delivered call has all arguments");
  if (read_back(delivered, back)) {
    require(back.out.what == verb::call && back.out.service == service && back.out.id_raw == "\"i.1\"" &&
                !json::find(delivered, "op"),
            "a delivered call is an invocation of the service, whatever its arguments");
  }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static auto validator = reader::create(written_bytes_max);
  if (!validator || size > text_bytes_max) return 0;
  const padded block{{reinterpret_cast<const char*>(data), size}};
  const bool valid{validator->validate(block.text())};

  const std::vector<char> exact(data, data + size); // without tailroom: decoding needs none
  const std::string_view text{exact.data(), exact.size()};
  scratch_buffer scratch;
  request out;
  op_member op{};
  const auto wrong = decode(text, scratch, limits, out, op);
  const auto reserved = find_reserved(text);
  require(!reserved || text[*reserved] == '"', "a reserved member is where it is said to be");
  if (!valid) return 0;
  if (wrong) {
    std::array<char, refusal::text_bytes_max> buffer;
    std::array<char, 2 * refusal::text_bytes_max> plenty;
    const std::string_view diagnostic = wrong->text(buffer);
    require(!diagnostic.empty() && diagnostic == wrong->text(plenty), "a diagnostic is whole");
    require(lies_in(out.id_raw, text), "an answer has a good id");
  } else if (op == op_member::none) {
    check_request(out, text, {scratch.data(), scratch.size()});
  }
  write_around(*validator, text, wrong ? request{} : out, size * 31 + (size > 1 ? data[size / 2] : 0));
  return 0;
}
