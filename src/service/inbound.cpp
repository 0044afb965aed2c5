// SPDX-License-Identifier: Apache-2.0
// What peers say: frames to messages, messages to requests, requests to what is done. Everything that is
// refused is answered with a status that names the value and the limit, and counted.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <utility>

#include "service/core.hpp"
#include "service/publishing.hpp"

namespace rowe::service {
namespace {

namespace bare = wire::bare;
namespace rosbridge = wire::rosbridge;

std::string_view text_of(std::span<const std::byte> bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Topics that the endpoint itself publishes.
bool reserved(std::string_view topic) noexcept { return topic.starts_with("/rowe/"); }

rt::duration throttle_of(const rosbridge::request& asked) noexcept {
  return std::chrono::milliseconds{asked.throttle_ms};
}

std::uint32_t queue_length_of(const rosbridge::request& asked) noexcept {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(asked.queue_length, 0, UINT32_MAX));
}

} // namespace

void core::take(connection& c, const wire::frame_step& step) noexcept {
  switch (step.event) {
  case wire::frame_event::text: take_text(c, step.payload); break;
  case wire::frame_event::binary:
    add(counter::refused_requests);
    close(c, wire::close_code::unsupported_data, "binary messages have no meaning here");
    break;
  case wire::frame_event::ping: send_control(c, wire::opcode::pong, step.payload); break;
  case wire::frame_event::close:
    expire();
    offer(c); // what was answered already goes out before the goodbye
    close(c, step.close_code == wire::close_code::none_given ? wire::close_code::normal : step.close_code,
          "");
    break;
  case wire::frame_event::violation:
    add(counter::violations);
    close(c, step.close_code, step.reason);
    break;
  case wire::frame_event::pong: take_pong(c, step.payload); break;
  case wire::frame_event::need_more: break;
  }
}

// Message by message: an object with a string `op` is rosbridge's, everything else is bare.
void core::take_text(connection& c, std::span<const std::byte> payload) noexcept {
  add(counter::messages_in);
  ++c.messages_in;
  const std::string_view text = text_of(payload);
  if (const status valid = validator_.validate(text); !valid) {
    add(counter::malformed);
    std::array<char, 160> room;
    const std::string_view why = valid.error().text(room);
    if (c.spoke_last == dialect::rosbridge) return refuse(c, {}, why);
    report(event::kind::refused_request, c.peer(), why);
    return answer_bare_error(c, {}, valid.error().name(), why);
  }
  const json::document known = validator_.last(); // its members are noted until the next validation
  // Rosbridge's clients put it first, so that most of their members need not be looked at twice.
  json::object_walk members{known};
  json::member first;
  if (members.next(first) && json::name_is(first, "op") && first.what.type == json::kind::string)
    return take_rosbridge(c, known);
  bare::envelope said;
  const auto refusal = bare::decode(known, scratch_, {.service_bytes_max = bounds_.topic_bytes_max}, said);
  said.op_is_text ? take_rosbridge(c, known) : take_bare(c, known, said, refusal);
}

void core::take_rosbridge(connection& c, const json::document& text) noexcept {
  c.spoke_last = dialect::rosbridge;
  rosbridge::request asked;
  const rosbridge::name_limits names{.topic_bytes_max = bounds_.topic_bytes_max};
  if (const auto refusal = rosbridge::decode(text, scratch_, names, asked)) {
    if (asks_to_stop(text)) take_silent_stop(c, text.text);
    std::array<char, rosbridge::refusal_text_bytes_max> why;
    return refuse(c, asked.id_raw, refusal->text(why));
  }
  carry_out(c, asked);
}

void core::take_bare(connection& c, const json::document& text, const bare::envelope& said,
                     const std::optional<bare::refusal>& refusal) noexcept {
  c.spoke_last = dialect::bare;
  if (!json::is_object(text.text)) {
    add(counter::malformed);
    return answer_bare_error(c, {}, "not_an_object", "a message must be one JSON object");
  }
  if (!std::exchange(c.bare, true)) welcome(c);
  if (refusal || said.has_op) {
    if (asks_to_stop(text)) take_silent_stop(c, text.text);
    std::array<char, bare::refusal_text_bytes_max> room;
    const std::string_view why = refusal ? refusal->text(room) : "the member \"op\" must be a string";
    report(event::kind::refused_request, c.peer(), why);
    const bool asks = said.what == bare::kind::invocation;
    return answer_bare_error(c, asks ? said.id_raw : std::string_view{}, "bad_request", why);
  }
  switch (said.what) {
  case bare::kind::reply: return take_reply(c, said, text.text);
  case bare::kind::invocation:
    return take_call(c, dialect::bare, said.id_raw, said.service,
                     {.is = asking::form::object, .text = text.text}, said.ttl_ns);
  case bare::kind::message: break;
  }
  if (asks_to_stop(text)) return take_silent_stop(c, text.text);
  // What finds no room is counted there.
  (void)deliver_message({.stamped_ns = rt::nanoseconds_of(now_),
                         .expires_ns = rt::nanoseconds_of(inbound_expiry(said.ttl_ns)),
                         .what = detail::entry::message,
                         .peer = {c.id.index, c.id.generation}},
                        text.text);
}

void core::carry_out(connection& c, const rosbridge::request& asked) noexcept {
  using rosbridge::op;
  const bool for_servers = asked.what != op::publish && asked.what != op::status &&
                           asked.what != op::call_service && asked.what != op::service_response;
  if (c.ours == side::client && for_servers) {
    // A server asks nothing of its clients but this; whatever else it says is counted, and an answer could
    // only start a quarrel of two programs.
    return add(counter::refused_requests);
  }
  switch (asked.what) {
  case op::subscribe: return subscribe(c, asked);
  case op::unsubscribe: return unsubscribe(c, asked);
  case op::advertise: return advertise(c, asked);
  case op::unadvertise: return unadvertise(c, asked);
  case op::publish: return relay(c, asked);
  case op::call_service:
    return take_call(c, dialect::rosbridge, asked.id_raw, asked.service, {.text = asked.args_raw},
                     asked.timeout_ns);
  case op::service_response: return take_service_response(c, asked);
  case op::advertise_service: return advertise_service(c, asked);
  case op::unadvertise_service: return unadvertise_service(c, asked);
  case op::status: return report(event::kind::status_from_peer, c.peer(), asked.msg_raw);
  case op::set_level: c.status_level = asked.level; return;
  case op::unsupported:
  case op::unknown: break;
  }
  std::array<char, rosbridge::refusal_text_bytes_max> why;
  refuse(c, asked.id_raw, rosbridge::refuse_op(asked).text(why));
}

void core::subscribe(connection& c, const rosbridge::request& asked) noexcept {
  const std::uint32_t topic = router_.find_or_add(asked.topic);
  if (topic == no_index) return refuse_limit(c, asked.id_raw, "topics", bounds_.topics_max, "topics_max");
  std::uint32_t index = router_.find_subscription(topic, c.first_subscription);
  const bool fresh = index == no_index;
  if (fresh) {
    router_.hold(topic); // until the subscription does
    const bool too_many = c.subscriptions >= bounds_.subscriptions_per_connection_max;
    if (!too_many) index = router_.add_subscription(topic, c.id.index, c.first_subscription);
    let_go_topic(topic);
    if (too_many) {
      return refuse_limit(c, asked.id_raw, "subscriptions of one peer",
                          bounds_.subscriptions_per_connection_max, "subscriptions_per_connection_max");
    }
    if (index == no_index) {
      return refuse_limit(c, asked.id_raw, "subscriptions", bounds_.subscriptions_max, "subscriptions_max");
    }
    ++c.subscriptions;
  }
  subscription& s = router_.subscription_at(index);
  const std::uint64_t id = hash_of(asked.id_raw);
  std::uint8_t place = 0;
  while (place < s.request_count && s.requests[place].id_hash != id) ++place;
  if (place == s.requests.size()) {
    return refuse(c, asked.id_raw, "subscribe: one peer may hold 4 subscriptions to a topic, by their ids");
  }
  if (place == s.request_count) ++s.request_count;
  s.requests[place] = {.id_hash = id, .throttle = throttle_of(asked), .queue_length = queue_length_of(asked)};
  router_.merge(s, bounds_.queue_depth_max);
  update_wanted(topic);
  if (topic == statistics_topic_) begin_statistics();
  const slot_ref last = router_.at(topic).last;
  if (fresh && last.index != no_index && slots_.alive(last)) push(index, last.index);
}

void core::unsubscribe(connection& c, const rosbridge::request& asked) noexcept {
  const std::uint32_t topic = router_.find(asked.topic);
  const std::uint32_t index =
      topic == no_index ? no_index : router_.find_subscription(topic, c.first_subscription);
  if (index == no_index) return refuse(c, asked.id_raw, "unsubscribe: there is no such subscription");
  subscription& s = router_.subscription_at(index);
  if (!asked.id_raw.empty()) {
    const std::uint64_t id = hash_of(asked.id_raw);
    std::uint8_t place = 0;
    while (place < s.request_count && s.requests[place].id_hash != id) ++place;
    if (place == s.request_count)
      return refuse(c, asked.id_raw, "unsubscribe: there is no subscription with this id");
    s.requests[place] = s.requests[--s.request_count];
    if (s.request_count > 0) return router_.merge(s, bounds_.queue_depth_max);
  }
  remove_subscription(c, index);
}

void core::advertise(connection& c, const rosbridge::request& asked) noexcept {
  if (reserved(asked.topic))
    return refuse(c, asked.id_raw, "advertise: topics below /rowe/ are the endpoint's own");
  const std::uint32_t topic = router_.find_or_add(asked.topic);
  if (topic == no_index) return refuse_limit(c, asked.id_raw, "topics", bounds_.topics_max, "topics_max");
  const auto mine = c.advertised.first(c.advertisements);
  const bool known = std::find(mine.begin(), mine.end(), topic) != mine.end();
  router_.hold(topic); // the advertisement's
  if (!router_.set_type(topic, asked.type)) {
    std::array<char, 192> why;
    const std::string_view type = router_.type(topic);
    const int bytes = std::snprintf(why.data(), why.size(), "advertise: the topic exists with the type %.*s",
                                    static_cast<int>(std::min<std::size_t>(type.size(), 128)), type.data());
    let_go_topic(topic);
    return refuse(c, asked.id_raw, {why.data(), static_cast<std::size_t>(bytes)});
  }
  if (asked.latch) router_.at(topic).latched = true;
  if (known) return let_go_topic(topic);
  if (c.advertisements == c.advertised.size()) {
    let_go_topic(topic);
    return refuse_limit(c, asked.id_raw, "topics advertised by one peer", c.advertised.size(),
                        "advertisements_per_connection_max");
  }
  c.advertised[c.advertisements++] = topic;
}

void core::unadvertise(connection& c, const rosbridge::request& asked) noexcept {
  const std::uint32_t topic = router_.find(asked.topic);
  for (std::uint32_t i = 0; topic != no_index && i < c.advertisements; ++i) {
    if (c.advertised[i] != topic) continue;
    c.advertised[i] = c.advertised[--c.advertisements];
    return let_go_topic(topic);
  }
  refuse(c, asked.id_raw, "unadvertise: this peer does not advertise the topic");
}

void core::refuse(connection& c, std::string_view id_raw, std::string_view why) noexcept {
  report(event::kind::refused_request, c.peer(), why);
  answer_refusal(c, id_raw, why);
}

void core::refuse_limit(connection& c, std::string_view id_raw, std::string_view what, std::uint64_t limit,
                        std::string_view option) noexcept {
  std::array<char, 224> why;
  const int bytes = std::snprintf(why.data(), why.size(), "all %llu %.*s are taken (limit %.*s)",
                                  static_cast<unsigned long long>(limit), static_cast<int>(what.size()),
                                  what.data(), static_cast<int>(option.size()), option.data());
  const std::string_view sentence{why.data(), static_cast<std::size_t>(bytes)};
  std::array<char, 128> remedy;
  const int remedy_bytes = std::snprintf(remedy.data(), remedy.size(), "raise `limits::%.*s`",
                                         static_cast<int>(option.size()), option.data());
  report(event::kind::limit, c.peer(), sentence, {remedy.data(), static_cast<std::size_t>(remedy_bytes)});
  answer_refusal(c, id_raw, sentence);
}

void core::answer_refusal(connection& c, std::string_view id_raw, std::string_view why) noexcept {
  add(counter::refused_requests);
  if (c.ours == side::client || c.status_level == rosbridge::level::none) return;
  std::array<char, 6 * rosbridge::refusal_text_bytes_max + 512> text;
  send_direct(c, rosbridge::encode_status(text, rosbridge::level::error, id_raw, why));
}

// As a client nothing is answered but calls: an answer could only start a quarrel of two programs.
void core::answer_bare_error(connection& c, std::string_view id_raw, std::string_view code,
                             std::string_view why) noexcept {
  add(counter::refused_requests);
  if (c.ours == side::client && id_raw.empty()) return;
  (void)answer(c, [&](json::writer& into) { bare::write_error(into, id_raw, code, why); }); // lost: counted
}

} // namespace rowe::service
