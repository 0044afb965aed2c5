// SPDX-License-Identifier: Apache-2.0
#include "service/topics/topic_pages.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "service/topics/listed_topics.hpp"
#include "wire/codec/own_names.hpp"
#include "wire/text/percent.hpp"
#include "wire/text/text_out.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {
namespace {

http_answer no_value() noexcept {
  static_assert(page_wait_max == std::chrono::seconds{2});
  return fresh_answer(404, "no value of the topic came within 2 s\n"
                           "ask again, or read in /api/v1/stats how often it has one\n");
}

http_answer rights_changed() noexcept {
  return fresh_answer(503, "the rights have just changed\nask again\n");
}

} // namespace

topic_pages::topic_pages(rt::arena& memory, const topic_pages_needs& parts) noexcept
    : topic_pages_needs{parts}, name_{memory.carve<char>(name_bytes(state_.bounds()))} {}

std::string_view topic_pages::topic_in(std::string_view path) const noexcept {
  const auto name = wire::undo_percent(name_, path.substr(wire::topics_prefix.size()));
  return name && name->size() < name_.size() ? *name : std::string_view{};
}

http_answer topic_pages::answer(const http_request& request, std::span<char> out) noexcept {
  const std::string_view name = topic_in(request.path);
  const topic_id topic = name.empty() ? topic_id{} : state_.topics.find(name);
  if (!topic || !listed_topics{state_.topics, stop_rules_}(topic)) {
    wire::text_out words{out};
    words.add("there is no topic ").add_shortened(request.path.substr(wire::topics_prefix.size() - 1), 200);
    return fresh_answer(404, words.add("\n/api/v1/stats has those that there are\n").text());
  }
  if (state_.topics.name(topic) == wire::stop_state_name) { // it is not published to queues
    json::writer into{out};
    stop_rules_.write_state(into, state_.cycle.now);
    into.append("\n");
    http_answer answer = fresh_answer(200, {out.data(), into.bytes()});
    answer.content_type = "application/json";
    answer.age_ms = 0;
    return answer;
  }
  return answer(
      awaited_page{.topic = topic.value, .channel = state_.topics.at(topic).channel, .who = request.who},
      false, out);
}

http_answer topic_pages::answer(const awaited_page& page, bool last, std::span<char> out) noexcept {
  if (state_.cycle.closing) return fresh_answer(503, "the endpoint is closing\n");
  if (state_.rights.outdated(page.who)) return rights_changed();
  const topic_id index{page.topic};
  topic& on = state_.topics.at(index);
  if (on.holders == 0 || on.channel != page.channel)
    return fresh_answer(404, "the topic is gone, or has another type now\nask again\n");
  state_.latches.drop_expired(on.latched, state_.cycle.now);
  if (!on.latched.empty()) return value_of(state_.latches.at(on.latched.tail).value, page.who, out, true);
  if (!on.asked && !last) begin(index);
  if (on.asked) {
    const latched_value& newest = state_.last_values.ask(on.asked, state_.cycle.now, !last);
    if (!newest.empty()) return value_of(newest, page.who, out, false);
    if (const std::size_t bytes = state_.last_values.long_bytes(on.asked); bytes != 0)
      return too_long(index, bytes, out);
  }
  if (last) return no_value();
  http_answer answer;
  answer.later = true;
  answer.awaited = page;
  return answer;
}

http_answer topic_pages::too_long(topic_id topic, std::size_t bytes, std::span<char> out) const noexcept {
  wire::text_out words{out};
  words.add("the last value has ").add(bytes);
  words.add(" bytes, and there was no room to keep it\nraise long_slots (").add(state_.bounds().long_slots);
  words.add("), or subscribe to the topic, as `rowe echo URL ");
  words.add_shortened(state_.topics.name(topic), 200).add(" --json --once` does\n");
  return fresh_answer(404, words.text());
}

http_answer topic_pages::in_pieces(const latched_value& value, const access::subject& who,
                                   std::span<char> out) noexcept {
  page_texts& texts = state_.long_pages;
  if (texts.full() || !texts.has_room_for(value.chunks)) (void)texts.displace_slow(state_.cycle.now);
  const bool full = texts.full();
  if (full || !texts.has_room_for(value.chunks)) {
    wire::text_out words{out};
    if (full)
      words.add(long_pages_max).add(" long values are being sent over HTTP, which is the limit\n");
    else
      words.add(
          "another long value is being sent over HTTP, and both have more than a quarter of the room for "
          "long ones\n");
    words.add("ask again in a second, or subscribe to the topic\n");
    http_answer answer = fresh_answer(503, words.text());
    answer.retry_after_s = 1;
    return answer;
  }
  http_answer answer = fresh_answer(200, {});
  const std::uint32_t which = texts.begin(value.chunks, state_.cycle.now);
  readers_[which] = who;
  answer.in_pieces = {.from = this, .which = which, .bytes = value.bytes};
  return answer;
}

std::span<const std::byte> topic_pages::read_body(std::uint32_t which, std::size_t at) noexcept {
  if (state_.cycle.closing || state_.rights.outdated(readers_[which])) return {};
  return state_.long_pages.read(which, at);
}

http_answer topic_pages::value_of(const latched_value& value, const access::subject& who, std::span<char> out,
                                  bool latched) noexcept {
  http_answer answer = value.bytes > state_.bounds().message_bytes_max ? in_pieces(value, who, out)
                                                                       : page_of(value, out, latched);
  if (answer.status != 200) return answer;
  answer.content_type = "application/json";
  const auto age = std::chrono::duration_cast<std::chrono::milliseconds>(state_.cycle.now - value.published);
  answer.age_ms = std::max<std::int64_t>(age.count(), 0);
  return answer;
}

http_answer topic_pages::page_of(const latched_value& value, std::span<char> out, bool latched) noexcept {
  json::writer into{out};
  latched ? state_.latches.write(value, into) : state_.last_values.write(value, into);
  into.append("\n"); // for who reads it in a terminal
  state_.cycle.work_bytes += value.bytes;
  return fresh_answer(200, {out.data(), into.bytes()});
}

void topic_pages::begin(topic_id topic) noexcept {
  last_value_store& values = state_.last_values;
  if (values.in_use() == asked_topics_max) end(values.replaceable(state_.cycle.now));
  state_.topics.at(topic).set_asked(values.add(topic, state_.cycle.now));
  audiences_.update(topic);
  topic_rates_.begin_for(topic);
}

void topic_pages::end(topic_id topic) noexcept {
  state_.last_values.remove(state_.topics.at(topic).set_asked({}));
  audiences_.update(topic);
}

void topic_pages::end_unasked() noexcept {
  while (const topic_id topic = state_.last_values.unasked(state_.cycle.now)) end(topic);
}

} // namespace rowe::service
