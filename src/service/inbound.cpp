// SPDX-License-Identifier: Apache-2.0
// What peers say: frames to messages, messages to requests, requests to what is done. Everything that is
// refused is answered with a status that names the value and the limit, and counted.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/core.hpp"
#include "service/publishing.hpp"
#include "service/shares.hpp"
#include "wire/text_out.hpp"

namespace rowe::service {
namespace {

// To look at one topic that a peer holds takes as long as to compose so many bytes.
constexpr std::size_t held_topic_work_bytes = 4;

std::string_view text_of(std::span<const std::byte> bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Why a text is no JSON. NaN and infinities are what programs write that do not know that JSON has none.
std::string_view sentence_of(const error& why, std::string_view text, std::span<char> room) noexcept {
  const auto at = std::min(static_cast<std::size_t>(why.value), text.size());
  for (const std::string_view word : {std::string_view{"NaN"}, std::string_view{"Infinity"}}) {
    if (why.code != errc::malformed || !text.substr(at).starts_with(word)) continue;
    const int bytes = std::snprintf(
        room.data(), room.size(),
        "the text is no valid JSON, which has no %s (at byte %zu): send null, or leave the member out",
        word.data(), at);
    return {room.data(), static_cast<std::size_t>(bytes)};
  }
  return why.message(room);
}

rt::duration throttle_of(const wire::request& asked) noexcept {
  return std::chrono::milliseconds{asked.throttle_ms};
}

bool is_for_servers(wire::verb what) noexcept {
  using wire::verb;
  return what != verb::publish && what != verb::status && what != verb::call && what != verb::reply;
}

std::uint32_t queue_length_of(const wire::request& asked) noexcept {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(asked.queue_length, 0, UINT32_MAX));
}

} // namespace

void core::handle(peer_index from, const wire::frame_step& step) noexcept {
  connection& c = peers_[from];
  switch (step.event) {
  case wire::frame_event::text: {
    excess_ = !c.messages.take(now_);
    take_text(c, step.payload);
    if (std::exchange(excess_, false)) cut_if_flooding(c, c.messages, too_many_messages_);
    break;
  }
  case wire::frame_event::binary:
    add(counter::refused_requests);
    close(c, wire::close_code::unsupported_data, "binary messages have no meaning here");
    break;
  case wire::frame_event::ping:
    if (c.messages.take(now_)) {
      sender_.send_control({c.id.index}, wire::opcode::pong, step.payload);
    } else {
      add(counter::over_rate);
      cut_if_flooding(c, c.messages, too_many_messages_);
    }
    break;
  case wire::frame_event::close:
    expire();
    sender_.flush({c.id.index}); // what was answered already goes out before the goodbye
    close(c, step.close_code == wire::close_code::none_given ? wire::close_code::normal : step.close_code,
          "");
    break;
  case wire::frame_event::violation:
    add(counter::violations);
    close(c, step.close_code, step.reason);
    break;
  case wire::frame_event::pong: sender_.urgent().take_pong({c.id.index}, step.payload); break;
  case wire::frame_event::need_more: break;
  }
}

void core::handle_again(peer_index from, std::span<const std::byte> text) noexcept {
  heard_before_ = true;
  hear(peers_[from], text);
  heard_before_ = false;
}

inline void core::take_text(connection& c, std::span<const std::byte> payload) noexcept {
  add(counter::messages_in);
  ++c.messages_in;
  hear(c, payload);
}

// A text that was counted; once more where it found no room before.
inline void core::hear(connection& c, std::span<const std::byte> payload) noexcept {
  const std::string_view text = text_of(payload);
  if (const status valid = validator_.validate(text); !valid) {
    add(counter::malformed);
    if (drops_excess()) return;
    return refuse_malformed(c, text, valid.error());
  }
  const json::document known = validator_.last(); // its members are noted until the next validation
  wire::request asked;
  wire::diagnostic why;
  sentence_room sentence;
  const wire::decoded read = c.protocol->reads.decode(known, decode_room(sentence), asked, why);
  c.spoke_last = asked.codec;
  if (read == wire::decoded::malformed) add(counter::malformed);
  // Who speaks as users of this process do takes plain messages, too.
  const bool speaks_messages = asked.codec == protocols_.messages.id() && read != wire::decoded::malformed;
  if (speaks_messages && !c.stop_only && !std::exchange(c.takes_messages, true))
    messages_.deliver_pending({c.id.index});
  if (read == wire::decoded::request) return carry_out(c, asked, known, why);
  if (asks_to_stop(known)) take_silent_stop(c, known.text);
  if (drops_excess()) return;
  refuse(c, asked.codec, asked.id_raw, why);
}

void core::refuse_malformed(connection& c, std::string_view text, const error& why) noexcept {
  std::array<char, 192> room;
  refuse(c, c.protocol->reads.guess(text, c.spoke_last), {},
         {.code = why.name(), .text = sentence_of(why, text, room)});
}

// `unknown`: why, of a request that nobody here carries out.
inline void core::carry_out(connection& c, const wire::request& asked, const json::document& text,
                            const wire::diagnostic& unknown) noexcept {
  using wire::verb;
  // Who may only stop is asked nothing: an object that looks like an answer is a message as any other.
  const bool no_reply = c.stop_only && asked.form == wire::call_args::form::object;
  if (asked.what == verb::message || (asked.what == verb::reply && no_reply))
    return take_message(c, asked, text);
  if (c.ours == side::client && is_for_servers(asked.what)) {
    // A server asks nothing of its clients but this; whatever else it says is counted, and an answer could
    // only start a quarrel of two programs.
    return add(counter::refused_requests);
  }
  const bool may_stop = asked.what == verb::publish || asked.what == verb::call;
  if (!may_stop && drops_excess()) return;
  if (c.stop_only && !is_for_stop(asked)) {
    if (!drops_excess())
      refuse(c, asked.codec, asked.id_raw, {.code = "refused", .text = stop_only_sentence});
    return;
  }
  switch (asked.what) {
  case verb::subscribe: return subscribe(c, asked);
  case verb::unsubscribe: return unsubscribe(c, asked);
  case verb::advertise: return advertise(c, asked);
  case verb::unadvertise: return unadvertise(c, asked);
  case verb::publish: return relay(c, asked);
  case verb::call: return take_call(c, asked);
  case verb::reply: return take_reply(c, asked);
  case verb::advertise_service: return advertise_service(c, asked);
  case verb::unadvertise_service: return unadvertise_service(c, asked);
  case verb::status: {
    if (!c.reports.take(now_)) return add(counter::events_lost);
    const auto plain = json::to_string(json::root(asked.body_raw), scratch_);
    return report(event::kind::status_from_peer, c.peer(), plain.value_or(asked.body_raw));
  }
  case verb::set_level: c.status_level = asked.level; return;
  case verb::message:
  case verb::unsupported:
  case verb::unknown: break;
  }
  refuse(c, asked.codec, asked.id_raw, unknown);
}

// A plain one: to whoever receives.
inline void core::take_message(connection& c, const wire::request& asked,
                               const json::document& text) noexcept {
  if (asks_to_stop(text)) return take_silent_stop(c, text.text);
  if (drops_excess()) return;
  if (c.stop_only) return refuse(c, asked.codec, {}, {.code = "refused", .text = stop_only_sentence});
  switch (receiver_.admit({c.id.index})) {
  case admission::now: break;
  case admission::later: return ingress_.park({c.id.index});
  case admission::never: return add(counter::inbox_full);
  }
  // What is too long is counted there.
  (void)receiver_.deliver({.stamped_ns = rt::nanoseconds_of(now_),
                           .expires_ns = rt::nanoseconds_of(inbound_expiry(asked.ttl_ns)),
                           .what = detail::entry::message,
                           .peer = {c.id.index, c.id.generation}},
                          text.text);
}

// How many topics it holds that no handle of this process has. A topic counts once for each subscription and
// once for its advertisement.
std::uint32_t core::peers_topics_held(const connection& c) const noexcept {
  std::uint32_t held = 0;
  for (std::uint32_t i = c.first_subscription; i != no_index;
       i = router_.subscription_at(i).next_on_connection)
    held += router_.of_peers(router_.subscription_at(i).topic);
  for (std::uint32_t i = 0; i < c.advertisements; ++i) held += router_.of_peers(c.advertised[i].topic);
  return held;
}

bool core::holds_topic(const connection& c, std::uint32_t topic) const noexcept {
  if (router_.find_subscription(topic, c.first_subscription) != no_index) return true;
  const auto advertised = c.advertised.first(c.advertisements);
  return std::any_of(advertised.begin(), advertised.end(),
                     [topic](const advertisement& one) { return one.topic == topic; });
}

// The topic that a peer wants to hold; no_index, and the peer is told, where it may not have one more. One
// that this process holds costs nothing.
std::uint32_t core::topic_for(connection& c, const wire::request& asked) noexcept {
  const std::uint32_t known = router_.find(asked.topic);
  if (known != no_index && (!router_.of_peers(known) || holds_topic(c, known))) return known;
  const std::uint32_t share = share_of_peers(bounds_.topics_max, bounds_.lanes_max + own_topics);
  const std::uint32_t left = left_of(share, router_.topics_of_peers());
  const std::uint32_t held = peers_topics_held(c);
  const claims all = claims_to_topics(share);
  // One that there is takes no place; but who holds it may be the last to hold it one day.
  const bool may = all.may_take(held, left) || (known != no_index && held < all.claim());
  const std::uint32_t found =
      may || ROWE_MUTANT(made_up_topics) ? router_.find_or_add(asked.topic) : no_index;
  if (found == no_index) {
    refuse_share(c, asked,
                 {.what = "topics",
                  .held = held,
                  .left = left,
                  .for_peers = share,
                  .kept = all.kept(),
                  .option = "topics_max"});
  }
  return found;
}

// Made anew each time: what peers hold changes with what handles of this process hold, too. The place of a
// topic is charged to one of those who hold it.
claims core::claims_to_topics(std::uint32_t share) noexcept {
  claims all = claims_to(share);
  ++topics_charged_;
  for (const connection& c : peers_) {
    work_bytes_ += held_topic_work_bytes * (1 + c.subscriptions + c.advertisements);
    if (c.state == connection::phase::free) continue;
    std::uint32_t charged = 0;
    const auto charge = [&](std::uint32_t index) {
      topic& on = router_.at(index);
      if (router_.of_peers(index) && std::exchange(on.charged_in, topics_charged_) != topics_charged_)
        all.take(charged);
    };
    for (std::uint32_t i = c.first_subscription; i != no_index;
         i = router_.subscription_at(i).next_on_connection)
      charge(router_.subscription_at(i).topic);
    for (std::uint32_t i = 0; i < c.advertisements; ++i) charge(c.advertised[i].topic);
  }
  return all;
}

void core::subscribe(connection& c, const wire::request& asked) noexcept {
  const std::uint32_t topic = topic_for(c, asked);
  if (topic == no_index) return;
  const bool unslashed = !has_slash(asked.topic);
  std::uint32_t index = router_.find_subscription(topic, c.first_subscription, unslashed);
  const bool fresh = index == no_index;
  if (fresh) {
    router_.hold(topic); // until the subscription does
    const bool too_many = c.subscriptions >= bounds_.subscriptions_per_connection_max;
    const std::uint32_t left = bounds_.subscriptions_max - router_.subscription_count();
    const bool may = subscription_claims_.may_take(c.subscriptions, left);
    if (!too_many && may) index = router_.add_subscription(topic, c.id.index, c.first_subscription);
    let_go_topic(topic);
    if (too_many) {
      return refuse_limit(c, asked.id_raw, "subscriptions of one peer",
                          bounds_.subscriptions_per_connection_max, "subscriptions_per_connection_max");
    }
    if (index == no_index) {
      return refuse_share(c, asked,
                          {.what = "subscriptions",
                           .held = c.subscriptions,
                           .left = left,
                           .for_peers = bounds_.subscriptions_max,
                           .kept = subscription_claims_.kept(),
                           .option = "subscriptions_max"});
    }
    subscription_claims_.take(c.subscriptions);
    router_.subscription_at(index).unslashed = unslashed;
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
  outbox_.merge_requests(index);
  update_wanted(topic);
  if (topic == statistics_topic_) begin_statistics();
  s.type_hash = hash_of_type(asked.type);
  if (fresh && !router_.at(topic).last.empty()) outbox_.owe_latched(index);
  const std::string_view type = router_.type(topic);
  if (!type.empty() && !asked.type.empty() && !same_type(asked.type, type))
    tell_other_type(c, asked.id_raw, topic, asked.type);
}

void core::unsubscribe(connection& c, const wire::request& asked) noexcept {
  const std::uint32_t topic = router_.find(asked.topic);
  std::uint32_t index = no_index;
  if (topic != no_index) {
    index = router_.find_subscription(topic, c.first_subscription, !has_slash(asked.topic));
    if (index == no_index)
      index = router_.find_subscription(topic, c.first_subscription); // the other spelling
  }
  if (index == no_index) return refuse(c, asked.id_raw, "unsubscribe: there is no such subscription");
  subscription& s = router_.subscription_at(index);
  if (!asked.id_raw.empty()) {
    const std::uint64_t id = hash_of(asked.id_raw);
    std::uint8_t place = 0;
    while (place < s.request_count && s.requests[place].id_hash != id) ++place;
    if (place == s.request_count)
      return refuse(c, asked.id_raw, "unsubscribe: there is no subscription with this id");
    s.requests[place] = s.requests[--s.request_count];
    if (s.request_count > 0) return outbox_.merge_requests(index);
  }
  remove_subscription(c, index);
}

void core::advertise(connection& c, const wire::request& asked) noexcept {
  if (is_own_name(asked.topic))
    return refuse(c, asked.id_raw, "advertise: topics below /rowe/ are the endpoint's own");
  const std::uint32_t topic = topic_for(c, asked);
  if (topic == no_index) return;
  const bool typed = !router_.type(topic).empty();
  const auto mine = c.advertised.first(c.advertisements);
  const auto known =
      std::find_if(mine.begin(), mine.end(), [&](const advertisement& a) { return a.topic == topic; });
  router_.hold(topic); // the advertisement's
  if (!router_.set_type(topic, asked.type)) {
    std::array<char, 192> why;
    const std::string_view type = router_.type(topic);
    const int bytes = std::snprintf(why.data(), why.size(), "advertise: the topic exists with the type %.*s",
                                    static_cast<int>(std::min<std::size_t>(type.size(), 128)), type.data());
    let_go_topic(topic);
    return refuse(c, asked.id_raw, {why.data(), static_cast<std::size_t>(bytes)});
  }
  if (!typed) tell_other_types(topic);
  if (known != mine.end()) {
    known->latched = known->latched || asked.latch;
    return let_go_topic(topic);
  }
  if (c.advertisements == c.advertised.size()) {
    let_go_topic(topic);
    return refuse_limit(c, asked.id_raw, "topics advertised by one peer", c.advertised.size(),
                        "advertisements_per_connection_max");
  }
  c.advertised[c.advertisements++] = {topic, asked.latch};
}

bool core::withdraw_advertisement(connection& c, std::uint32_t topic) noexcept {
  for (std::uint32_t i = 0; topic != no_index && i < c.advertisements; ++i) {
    if (c.advertised[i].topic != topic) continue;
    c.advertised[i] = c.advertised[--c.advertisements];
    forget_latched(router_.at(topic), {latch_owner::kind::peer, c.id.index});
    let_go_topic(topic);
    return true;
  }
  return false;
}

void core::unadvertise(connection& c, const wire::request& asked) noexcept {
  if (!withdraw_advertisement(c, router_.find(asked.topic)))
    refuse(c, asked.id_raw, "unadvertise: this peer does not advertise the topic");
}

// Its messages come all the same: that they are not what the peer expects is for it to judge.
void core::tell_other_type(connection& c, std::string_view id_raw, std::uint32_t topic,
                           std::string_view asked) noexcept {
  sentence_room room;
  wire::text_out why{room};
  why.add("subscribe ").add_shortened(router_.name(topic), 96).add(": the topic has the type ");
  why.add_shortened(router_.type(topic), 96);
  if (!asked.empty()) {
    why.add(", not ").add_shortened(asked, 96);
  } else {
    why.add(", not the one that was asked for");
  }
  if (admits_refusal(c, event::kind::refused_request, why.text(), {})) send_status(c, id_raw, why.text());
}

// The topic has got its type: those who subscribed before and expect another one are told.
void core::tell_other_types(std::uint32_t topic) noexcept {
  const std::uint32_t type = hash_of_type(router_.type(topic));
  if (type == 0) return;
  for (std::uint32_t i = router_.at(topic).first_subscription; i != no_index;
       i = router_.subscription_at(i).next_on_topic) {
    const subscription& s = router_.subscription_at(i);
    if (s.type_hash != 0 && s.type_hash != type)
      tell_other_type(peers_[peer_index{s.connection}], {}, topic, {});
  }
}

void core::refuse(connection& c, wire::codec_id in, std::string_view id_raw,
                  const wire::diagnostic& why) noexcept {
  if (admits_refusal(c, event::kind::refused_request, why.text, {})) answer_refusal(c, in, id_raw, why);
}

// What it wants of topics and services.
void core::refuse(connection& c, std::string_view id_raw, std::string_view why) noexcept {
  refuse(c, c.protocol->topics.id(), id_raw, {.code = "refused", .text = why});
}

void core::refuse_limit(connection& c, std::string_view id_raw, std::string_view what, std::uint64_t limit,
                        std::string_view option) noexcept {
  std::array<char, 224> room;
  wire::text_out why{room};
  why.add("all ").add(static_cast<std::int64_t>(limit)).add(" ").add(what).add(" are taken");
  refuse_for(c, id_raw, why, option);
}

// One that has as much as it leaves, see shares.hpp.
void core::refuse_share(connection& c, const wire::request& asked, const taken_share& of) noexcept {
  std::array<char, 384> room;
  wire::text_out why{room};
  why.add_shortened(asked.verb_text, 24).add(" ");
  why.add_shortened(asked.topic.empty() ? asked.service : asked.topic, 96);
  why.add(": one peer may hold no more ").add(of.what).add(" than it leaves: it holds ").add(of.held);
  why.add(", ").add(of.left).add(" of ").add(of.for_peers).add(" are left");
  const std::uint32_t kept = std::min(of.kept, of.left);
  if (kept != 0) why.add(", ").add(kept).add(" of them kept for peers that hold fewer");
  refuse_for(c, asked.id_raw, why, of.option);
}

// The peer is told the limit's name in the sentence, the user what to do about it.
void core::refuse_for(connection& c, std::string_view id_raw, wire::text_out& why,
                      std::string_view option) noexcept {
  std::array<char, 128> room;
  wire::text_out remedy{room};
  remedy.add("raise `limits::").add(option).add("`");
  if (!admits_refusal(c, event::kind::limit, why.text(), remedy.text())) return;
  why.add(" (limit ").add(option).add(")");
  answer_refusal(c, c.protocol->topics.id(), id_raw, {.code = "refused", .text = why.text()});
}

// ---- rates

// Whether a refusal is to be said: a peer that is refused all the time is not answered all the time.
bool core::admits_refusal(connection& c, event::kind kind, std::string_view why,
                          std::string_view remedy) noexcept {
  report_refusal(c, kind, why, remedy);
  if (within_refusals(c)) return true;
  add(counter::refusals_unsaid);
  return false;
}

// One more; false where that is too many, for which the peer may have been closed.
bool core::within_refusals(connection& c) noexcept {
  if (c.ours == side::client || c.refusals.take(now_)) return true;
  cut_if_flooding(c, c.refusals, too_many_refusals_);
  return false;
}

// Nor may it fill logs and the ring of events.
void core::report_refusal(connection& c, event::kind kind, std::string_view why,
                          std::string_view remedy) noexcept {
  if (c.reports.take(now_)) {
    report(kind, c.peer(), why, remedy);
  } else {
    ++c.unreported;
  }
}

// With look_after(): what was not reported one by one.
void core::report_refusals(connection& c) noexcept {
  if (c.unreported == 0 || !c.reports.take(now_)) return;
  std::array<char, 64> text;
  const int bytes = std::snprintf(text.data(), text.size(), "%u more requests were refused",
                                  std::exchange(c.unreported, 0));
  report(event::kind::refused_request, c.peer(), {text.data(), static_cast<std::size_t>(bytes)});
}

// Of a message beyond its peer's rate, which is no stop: true, counted.
bool core::drops_excess() noexcept {
  if (excess_) add(counter::over_rate);
  return excess_;
}

void core::cut_if_flooding(connection& c, const rate_limit& rate, std::string_view why) noexcept {
  if (!c.open() || rate.over_for(now_) < flood_time_max) return;
  add(counter::flooding_peers);
  close(c, wire::close_code::policy, why);
}

void core::answer_refusal(connection& c, wire::codec_id in, std::string_view id_raw,
                          const wire::diagnostic& why) noexcept {
  add(counter::refused_requests);
  say_error(c, in, id_raw, why);
}

// About its topics; not counted.
void core::send_status(connection& c, std::string_view id_raw, std::string_view why) noexcept {
  say_error(c, c.protocol->topics.id(), id_raw, {.code = "refused", .text = why});
}

void core::say_error(connection& c, wire::codec_id in, std::string_view id_raw,
                     const wire::diagnostic& why) noexcept {
  std::array<char, wire::error_bytes_max> room;
  json::writer text{room};
  protocols_.of(in).write_error(
      text, {.to_server = c.ours == side::client, .level = c.status_level, .id_raw = id_raw}, why);
  send_direct(c, text);
}

// A call of a peer's has failed. What finds no room is counted.
void core::answer_failure(connection& c, wire::codec_id in, const wire::call_origin& call,
                          const wire::diagnostic& why) noexcept {
  const wire::codec& codec = protocols_.of(in);
  if (codec.fails_as_refusal()) add(counter::refused_requests);
  (void)answer(c, [&](json::writer& into) { codec.write_failure(into, call, why); }); // lost: counted
}

} // namespace rowe::service
