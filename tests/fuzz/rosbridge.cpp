// SPDX-License-Identifier: Apache-2.0
// The rosbridge codec under arbitrary texts. What is required: a text that is valid JSON is decoded or
// refused with a whole diagnostic, and the status that carries it is JSON again; what was decoded keeps its
// limits, points into the text or the scratch buffer, and what is encoded from it is decoded with the same
// meaning. A text that is not valid JSON is decoded, too, for the sanitizers: nobody does so, but nothing may
// be read that is not there.
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "fuzz/require.hpp"
#include "wire/rosbridge/rosbridge.hpp"
#include "wire/written.hpp"
#include "json/padded.hpp"
#include "json/reading/reader.hpp"
#include "json/writing/writer.hpp"

namespace {

using namespace rowe::wire;
using namespace rowe::wire::rosbridge;
using rowe::fuzz::lies_in;
using rowe::fuzz::require;
using rowe::json::reader;
using rowe::tests::padded;

constexpr name_limits limits{.name_bytes_max = 24, .id_bytes_max = 32};
constexpr std::size_t text_bytes_max = 4096;
using scratch_buffer = std::array<char, scratch_bytes(limits)>;

// Validates what was encoded and decodes it into `out`.
void read_back(reader& validator, std::string_view text, std::span<char> scratch, request& out) {
  require(!text.empty() && bool{validator.validate(padded{text}.text())}, "what is encoded is JSON");
  out = {};
  require(!decode(text, scratch, limits, out), "what is encoded is not refused");
}

void check_refusal(reader& validator, const refusal& why, const request& asked) {
  std::array<char, refusal::text_bytes_max> buffer;
  std::array<char, 2 * refusal::text_bytes_max> plenty;
  const std::string_view diagnostic = why.text(buffer);
  require(!diagnostic.empty() && diagnostic == why.text(plenty), "a diagnostic is whole");
  std::array<char, 6 * refusal::text_bytes_max + 512> status;
  request again;
  scratch_buffer scratch;
  read_back(validator, written(status, write_status, severity::error, asked.id_raw, diagnostic), scratch,
            again);
  require(again.what == verb::status && again.id_raw == asked.id_raw, "a status carries the id");
}

// Writes around a value with a head and a tail.
template <class Head>
std::string written_around(Head head, std::string_view value) {
  std::string buffer(text_bytes_max + 8 * limits.name_bytes_max + 8 * limits.id_bytes_max + 128, '\0');
  rowe::json::writer w{buffer};
  head(w);
  w.raw(value);
  w.end_object();
  require(!w.overflowed(), "a call fits its room");
  return std::string{w.text()};
}

// The calls and answers that can be made of it are read with the same meaning.
void check_service(reader& validator, const request& asked) {
  request again;
  scratch_buffer scratch;
  std::array<char, request_bytes_max(limits)> buffer;
  read_back(validator, written(buffer, write_advertise_service, asked.service, asked.type), scratch, again);
  require(again.what == verb::advertise_service && again.service == asked.service && again.type == asked.type,
          "an advertisement says the same");
  read_back(validator, written(buffer, write_unadvertise_service, asked.service), scratch, again);
  require(again.what == verb::unadvertise_service && again.service == asked.service, "so does its end");

  const bool calls = asked.what == verb::call && !asked.body_raw.empty();
  const std::string_view args = calls ? asked.body_raw : "{}";
  const auto call_head = [&](auto& w) { write_call_service_head(w, asked.service, "1.a"); };
  const std::string call = written_around(call_head, args);
  if (call.size() <= text_bytes_max && asked.service.find('#') == std::string_view::npos) {
    read_back(validator, call, scratch, again);
    require(again.what == verb::call && again.service == asked.service && again.id_raw == "\"1.a\"" &&
                again.body_raw == args,
            "a call says the same");
  }
  const auto goal_head = [&](auto& w) {
    write_goal_head(w, asked.service, asked.type, "1.a", asked.feedback);
  };
  const std::string goal = written_around(goal_head, args);
  if (goal.size() <= text_bytes_max) {
    read_back(validator, goal, scratch, again);
    require(again.what == verb::send_goal && again.service == asked.service && again.type == asked.type &&
                again.feedback == asked.feedback && again.body_raw == args,
            "a goal says the same");
  }
  const std::string_view values = asked.body_raw.empty() ? "null" : asked.body_raw;
  const auto head = [&](auto& w) {
    write_service_response_head(w, asked.service, asked.id_raw, !asked.failed);
  };
  const std::string response = written_around(head, values);
  if (response.size() > text_bytes_max) return;
  read_back(validator, response, scratch, again);
  require(again.what == verb::reply && again.service == asked.service && again.id_raw == asked.id_raw &&
              again.failed == asked.failed && again.body_raw == values,
          "an answer says the same");
}

void check_request(reader& validator, const request& asked, std::string_view text, std::string_view scratch) {
  const bool has_topic = asked.what >= verb::publish && asked.what <= verb::unadvertise;
  const bool has_service = asked.what >= verb::call && asked.what <= verb::goal_result;
  require(has_topic != asked.topic.empty(), "a topic is there where it is needed");
  require(has_service != asked.service.empty(), "and a service");
  for (const std::string_view name : {asked.topic, asked.service, asked.type}) {
    require(name.size() <= limits.name_bytes_max, "names keep their limit");
    require(name.empty() || lies_in(name, text) || lies_in(name, scratch), "names lie where they should");
  }
  require(asked.id_raw.size() <= limits.id_bytes_max, "ids keep their limit");
  require(asked.id_raw.empty() || lies_in(asked.id_raw, text) || lies_in(asked.id_raw, scratch),
          "ids lie where they should");
  require(asked.body_raw.empty() || lies_in(asked.body_raw, text), "messages lie in the text");
  require(asked.throttle_ms >= 0 && asked.throttle_ms <= milliseconds_max && asked.queue_length >= 0 &&
              asked.queue_size >= 0 && asked.lifespan_ns >= unlimited && asked.deadline_ns >= unlimited &&
              (asked.ttl_ns == unlimited || asked.ttl_ns > 0 ||
               (asked.ttl_ns == 0 && asked.what == verb::publish)),
          "numbers keep their limits");
  require(asked.tick == no_tick || (asked.tick >= 0 && asked.what == verb::publish), "ticks are of commands");
  require((asked.what != verb::fragment || asked.fragment_count >= 1) &&
              (asked.fragment_size == 0 || asked.fragment_size >= fragment_size_min),
          "fragments are at least one, and not too small");
  if (has_service) check_service(validator, asked);
  if (!has_topic) return;
  request again;
  scratch_buffer second_scratch;
  std::array<char, request_bytes_max(limits)> buffer;
  std::vector<char> head(publish_head_bytes_max(asked.topic.size()));
  std::string publish{written(head, write_publish_head, asked.topic)};
  publish.append(asked.body_raw.empty() ? "{}" : asked.body_raw).append(publish_tail);
  if (publish.size() <= text_bytes_max) {
    read_back(validator, publish, second_scratch, again);
    require(again.what == verb::publish && again.topic == asked.topic, "a publish says the same topic");
    require(asked.body_raw.empty() || again.body_raw == asked.body_raw, "a publish says the same message");
  }
  require(!written(buffer, write_subscribe, asked.topic, asked.type, asked.throttle_ms).empty() &&
              !written(buffer, write_advertise, asked.topic, asked.type, asked.latch).empty(),
          "requests fit their room");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static auto validator = reader::create(text_bytes_max);
  if (!validator || size > text_bytes_max) return 0;
  const padded block{{reinterpret_cast<const char*>(data), size}};
  const bool valid{validator->validate(block.text())};

  const std::vector<char> exact(data, data + size); // without tailroom: decoding needs none
  const std::string_view text{exact.data(), exact.size()};
  scratch_buffer scratch;
  request asked;
  const auto wrong = decode(text, scratch, limits, asked);
  if (!valid) return 0;
  if (wrong) {
    check_refusal(*validator, *wrong, asked);
  } else if (asked.what == verb::unsupported || asked.what == verb::unknown) {
    check_refusal(*validator, refuse_op(asked), asked);
  } else {
    check_request(*validator, asked, text, {scratch.data(), scratch.size()});
  }
  return 0;
}
