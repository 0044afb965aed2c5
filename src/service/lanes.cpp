// SPDX-License-Identifier: Apache-2.0
// What this process publishes and takes: the service thread's side of the lanes, and relaying.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>

#include <rowe/detail/mutation_points.hpp>

#include "service/core.hpp"
#include "service/lane_home.hpp"
#include "service/publishing.hpp"
#include "wire/text_out.hpp"
#include "json/encoder.hpp"
#include "json/utf8.hpp"

namespace rowe::service {
namespace {

using detail::audience;
using detail::lane_kind;
using detail::pair_phase;

constexpr std::size_t lane_budget = 64;        // values taken from one lane in one cycle
constexpr std::size_t lane_budget_ample = 256; // the same where nothing would be lost by it

constexpr rt::duration misfit_period = std::chrono::seconds{1};
constexpr std::size_t event_text_bytes = 224; // of event::what

} // namespace

void core::take_from_lanes() noexcept {
  lanes_left_ = lanes_wait_ = false;
  phases_.looks(now_);
  const std::uint32_t used = shown_.lanes_used();
  for (std::uint32_t i = 0; i < used; ++i) {
    switch (lanes_[i].lifecycle.look()) {
    case pair_phase::free:
    case pair_phase::refused: continue;
    case pair_phase::offered: attach(i); break;
    case pair_phase::active: take_from(i); break;
    case pair_phase::closing:
      if (views_[i].attached) take_from(i);
      if (has_unsent(i)) {
        lanes_wait_ = true;
      } else {
        detach(i);
      }
      break;
    case pair_phase::held:
      if (all_home(lanes_[i])) lanes_[i].lifecycle.release(lanes_[i].news);
      break;
    }
    lanes_wait_ = lanes_wait_ || views_[i].held_first != no_index;
  }
}

bool core::has_answer() noexcept {
  return asked_lane_ != no_index && lanes_[asked_lane_].service.out.out->waiting_at_least() != 0;
}

bool core::lanes_quiet() const noexcept {
  const auto used = lanes_.first(shown_.lanes_used());
  return std::all_of(used.begin(), used.end(), [](const detail::lane& one) { return one.rope.quiet(); });
}

// Answers a lane that set-up offers. The topic's place may be gone to a peer since set-up looked, so the
// answer is given here, where topics are.
void core::attach(std::uint32_t index) noexcept {
  detail::lane& lane = lanes_[index];
  lane_view& view = views_[index];
  view = {.generation = view.generation + 1, .order = ++lanes_attached_};
  if (!detail::publishes(lane.kind) && !detail::subscribes(lane.kind)) return attach_talker(index);
  std::uint32_t topic_index = router_.find_or_add(lane.name());
  if (topic_index == no_index && take_back_topic()) topic_index = router_.find_or_add(lane.name());
  if (topic_index == no_index) {
    return lane.lifecycle.refuse({errc::too_many_topics, router_.topic_count(), bounds_.topics_max},
                                 lane.news);
  }
  router_.hold_as_own(topic_index);
  bool typed = !router_.type(topic_index).empty();
  if (!router_.set_type(topic_index, lane.type())) {
    if (router_.at(topic_index).own_holders > 1 || ROWE_MUTANT(pinned_type)) {
      report_conflict(topic_index, lane);
      let_go_own_topic(topic_index);
      return lane.lifecycle.refuse(errc::type_conflict, lane.news);
    }
    take_topic_from_peers(topic_index, lane.type());
    typed = false;
  }
  if (!typed) tell_other_types(topic_index);
  topic& on = router_.at(topic_index);
  const bool reads = detail::subscribes(lane.kind);
  if (!has_other_handle(topic_index, reads))
    (reads ? on.asked_unslashed : on.offered_unslashed) = !has_slash(lane.name());
  view.attached = true;
  view.topic = topic_index;
  if (reads) {
    view.next_inbox = on.first_inbox;
    on.first_inbox = index;
    if (topic_index == statistics_topic_) begin_statistics();
    if (const std::uint32_t last = outbox_.compose_latched(topic_index); last != no_index) {
      deliver_inbox(index, slots_.body(last), {});
      release(last);
    }
  } else {
    on.keep = lane.keep;
    on.priority = lane.priority;
    // Of a planned topic a value that comes early waits for its watch: not where it would not live as long.
    const bool outlives_rest =
        lane.ttl >= std::min(lane.period, phase_plan::rest_max) || lane.ttl == rt::duration{0};
    if (options_.phases && lane.period > rt::duration{0} && outlives_rest)
      phases_.begin(index, lane.period, lane.priority);
    for (std::uint32_t i = on.first_subscription; i != no_index;
         i = router_.subscription_at(i).next_on_topic) {
      outbox_.merge_requests(i);
    }
  }
  for (connection& c : peers_) {
    if (c.open() && c.ours == side::client) announce(c, index, true);
  }
  update_wanted(
      topic_index); // before the answer, so that a first value is not refused for want of a listener
  lane.lifecycle.accept(lane.news);
}

// A handle's type stands against the one that peers gave the topic before; they are told.
void core::take_topic_from_peers(std::uint32_t topic, std::string_view type) noexcept {
  std::array<char, 640> why;
  const std::string_view name = router_.name(topic);
  const std::string_view before = router_.type(topic);
  const int bytes =
      std::snprintf(why.data(), why.size(),
                    "advertise: the topic %.*s has the type %.*s here now; it was advertised as %.*s",
                    static_cast<int>(name.size()), name.data(), static_cast<int>(type.size()), type.data(),
                    static_cast<int>(before.size()), before.data());
  const std::string_view text{why.data(), std::min(static_cast<std::size_t>(bytes), why.size() - 1)};
  router_.replace_type(topic, type);
  for (connection& c : peers_) {
    // Never the last who holds the topic: the handle does.
    if (c.open() && withdraw_advertisement(c, topic)) refuse(c, {}, text);
  }
}

// Frees the place of a topic that only peers have, of whoever holds most of those, for one of this process;
// all who hold it are told. Peers come to have more than their part of the places where a handle leaves a
// topic to those who subscribed. False where there is none.
bool core::take_back_topic() noexcept {
  connection* most = nullptr;
  std::uint32_t held_by_most = 0;
  for (connection& c : peers_) {
    if (c.state == connection::phase::free) continue;
    const std::uint32_t held = peers_topics_held(c);
    if (held <= held_by_most) continue;
    most = &c;
    held_by_most = held;
  }
  if (most == nullptr || ROWE_MUTANT(made_up_topics)) return false;
  std::uint32_t taken = no_index;
  for (std::uint32_t i = 0; i < most->advertisements; ++i) {
    if (router_.of_peers(most->advertised[i].topic)) taken = most->advertised[i].topic;
  }
  for (std::uint32_t i = most->first_subscription; i != no_index;
       i = router_.subscription_at(i).next_on_connection) {
    if (router_.of_peers(router_.subscription_at(i).topic)) taken = router_.subscription_at(i).topic;
  }
  std::array<char, wire::refusal::text_bytes_max> room;
  wire::text_out why{room};
  why.add("the topic ").add_shortened(router_.name(taken), 96);
  why.add(" is given up: this process needs its place (limit topics_max)");
  router_.hold(taken); // until all know
  for (connection& c : peers_) {
    if (c.state == connection::phase::free) continue;
    bool had = withdraw_advertisement(c, taken);
    for (std::uint32_t s; (s = router_.find_subscription(taken, c.first_subscription)) != no_index;
         had = true)
      remove_subscription(c, s);
    if (had && c.open()) refuse(c, {}, why.text());
  }
  let_go_topic(taken);
  return true;
}

// Set-up is told by a number, which cannot name the types: an event does.
void core::report_conflict(std::uint32_t topic, const detail::lane& asked) noexcept {
  std::array<char, event_text_bytes> room;
  wire::text_out what{room};
  what.add(detail::subscribes(asked.kind) ? "subscribe " : "advertise ")
      .add_shortened(router_.name(topic), 64);
  what.add(": the topic has the type ").add_shortened(router_.type(topic), 56);
  what.add(", not ").add_shortened(asked.type(), 56);
  report(event::kind::warning, {}, what.text(), "use the same type, or leave the option `type` empty");
}

// Whether there is a handle that reads, or one that publishes, on the topic.
bool core::has_other_handle(std::uint32_t topic, bool that_reads) const noexcept {
  for (std::uint32_t i = 0; i < lanes_.size(); ++i) {
    if (views_[i].attached && views_[i].topic == topic && detail::subscribes(lanes_[i].kind) == that_reads)
      return true;
  }
  return false;
}

// The queue towards the server of what a lane publishes; null where there is none.
queue* core::queue_to_server(std::uint32_t index) noexcept {
  for (connection& c : peers_) {
    if (!c.open() || c.ours != side::client) continue;
    const std::uint32_t s = router_.find_subscription(views_[index].topic, c.first_subscription);
    if (s != no_index) return &router_.subscription_at(s).waiting;
  }
  return nullptr;
}

// Whether something that a closing handle published is still to be taken, or to be written to a server. What
// other handles publish on the same topic meanwhile does not count.
bool core::has_unsent(std::uint32_t index) noexcept {
  lane_view& view = views_[index];
  const detail::lane& lane = lanes_[index];
  if (!view.attached || detail::subscribes(lane.kind)) return false;
  if (view.held_first != no_index) return true;
  if (lane.service.out.out != nullptr && lane.service.out.out->waiting_at_least() != 0) return true;
  const queue* const towards = detail::publishes(lane.kind) ? queue_to_server(index) : nullptr;
  if (towards == nullptr) return false;
  if (view.last_queued == 0) view.last_queued = towards->popped + towards->count;
  return towards->popped < view.last_queued;
}

// What a user's thread counted goes on counting when its lane is gone.
void core::count_refusals(const detail::lane& lane) noexcept {
  add(counter::full, lane.refused_full.get());
  add(counter::no_peer, lane.no_peer.get());
  add(counter::too_big, lane.refused_too_big.get());
  add(counter::inbound_expired, lane.expired_here.get());
}

// A handle is gone, and what it published is taken. Nobody but the service thread knows the lane now.
void core::detach(std::uint32_t index) noexcept {
  detail::lane& lane = lanes_[index];
  lane_view& view = views_[index];
  if (asked_lane_ == index) asked_lane_ = no_index; // its rings are set-up's from here on
  if (view.attached && view.topic == no_index) {
    detach_talker(index);
    count_refusals(lane);
    view = {.generation = view.generation};
  } else if (view.attached) {
    if (detail::subscribes(lane.kind)) {
      std::uint32_t* link = &router_.at(view.topic).first_inbox;
      while (*link != index) link = &views_[*link].next_inbox;
      *link = view.next_inbox;
    }
    for (connection& c : peers_) {
      if (c.open() && c.ours == side::client) announce(c, index, false);
    }
    if (lane.audience.advice() == audience::somebody) --wanted_lanes_;
    count_refusals(lane);
    phases_.end(index);
    const std::uint32_t topic_index = view.topic;
    view = {.generation = view.generation};
    forget_latched(router_.at(topic_index), {latch_owner::kind::handle, index});
    update_wanted(topic_index);
    let_go_own_topic(topic_index);
  }
  lane.audience.set(audience::nobody);
  all_home(lane) ? lane.lifecycle.release(lane.news) : lane.lifecycle.hold(lane.news);
}

// ---- out

void core::take_from(std::uint32_t index) noexcept {
  detail::lane& lane = lanes_[index];
  if (detail::is_latch(lane.kind)) return;   // looked at by turn_stop()
  if (options_.lanes_tell) lane.rope.mark(); // before looking
  if (views_[index].topic == no_index) return take_entries(index);
  if (sender_.round_open()) return; // the sender comes first; who is scheduled keeps the cycles going
  const detail::emptying_end& path = lane.service.out;
  if (path.newest != nullptr) {
    const auto found = path.newest->begin_read();
    if (found.state != rt::freshness::fresh) return;
    lane_view& view = views_[index];
    const std::uint64_t passed_over = found.sequence - view.sequence - 1;
    view.sequence = found.sequence;
    router_.at(view.topic).messages += passed_over;
    add(counter::replaced, passed_over);
    take_value(index, found.slot);
  } else if (path.out != nullptr) {
    // A server gets every value: what finds no room in the queue towards it waits in the lane, and its
    // publisher is told `full`.
    std::size_t budget = lane_budget;
    if (const queue* const towards = ours_ == side::client ? queue_to_server(index) : nullptr) {
      budget = std::min<std::size_t>(budget, bounds_.queue_depth_max -
                                                 std::min(towards->count, bounds_.queue_depth_max));
    }
    const auto take = [&](std::uint32_t slot) {
      take_value(index, slot);
      path.home->give(slot);
    };
    const std::size_t taken = path.out->drain(take, budget);
    if (taken == lane_budget) {
      const std::size_t ample = ample_budget(router_.at(views_[index].topic));
      lanes_left_ = path.out->drain(take, ample) == ample || lanes_left_;
    }
    lanes_wait_ =
        lanes_wait_ || (taken == budget && budget < lane_budget && path.out->waiting_at_least() != 0);
  }
}

// How many values of a topic may be taken besides the usual ones. Messages that go out together cost one call
// of the kernel; but none may be lost because it was taken too early: everybody who wants them has room for
// them and reads, and all lanes together leave half of the slots and of the entries of queues. Large slots
// are few.
std::size_t core::ample_budget(const topic& on) const noexcept {
  if (on.first_inbox != no_index || on.bytes > slots_.small_bytes() / 2) return 0;
  const std::size_t halves = 2 * std::max<std::size_t>(wanted_lanes_, 1);
  std::size_t room = std::min<std::size_t>(lane_budget_ample, slots_.count() / halves);
  room = std::min<std::size_t>(room, (bounds_.queued_max - outbox_.entries().in_use()) /
                                         (halves * std::max<std::size_t>(on.subscriptions, 1)));
  room -= std::min(room, lane_budget);
  for (std::uint32_t i = on.first_subscription; i != no_index && room != 0;
       i = router_.subscription_at(i).next_on_topic) {
    const subscription& s = router_.subscription_at(i);
    if (outbox_.of({s.connection}).backpressured()) return 0;
    room = std::min<std::size_t>(room, s.depth - std::min(s.depth, s.waiting.count));
  }
  return room;
}

void core::take_value(std::uint32_t index, std::uint32_t slot) noexcept {
  const detail::lane& lane = lanes_[index];
  const detail::value_header& header = *lane.service.out.slots.header(slot);
  const std::byte* const value = lane.service.out.slots.value(slot);
  const rt::time_point published = time_of(header.stamped_ns);
  const rt::time_point expires = expiry_of(published, time_of(header.expires_ns));
  const std::uint32_t topic_index = views_[index].topic;
  const latch_owner latches = lane.latched ? latch_owner{latch_owner::kind::handle, index} : latch_owner{};
  phases_.saw(index, published);
  if (lane.kind == lane_kind::publish_value) {
    return publish(topic_index, published, expires, latches,
                   [&](json::writer& into) { lane.encoder->encode(value, into); });
  }
  const std::string_view text{reinterpret_cast<const char*>(value), header.bytes};
  if (!validator_.validate(text) || !json::is_object(text)) return add(counter::malformed);
  publish(topic_index, published, expires, latches, [&](json::writer& into) { into.raw(text); });
}

// For the statistics: how many, and how far apart.
void core::note(topic& on, rt::time_point published) noexcept {
  if (on.newest_at != rt::time_point{}) on.gap_max = std::max(on.gap_max, published - on.newest_at);
  on.newest_at = published;
  ++on.messages;
}

// Whether anybody takes a message of this topic at the moment; counts why not.
bool core::wanted_now(const topic& on) noexcept {
  if (on.first_inbox != no_index) return true;
  if (on.first_subscription == no_index) {
    add(counter::no_peer);
    return false;
  }
  for (std::uint32_t i = on.first_subscription; i != no_index; i = router_.subscription_at(i).next_on_topic) {
    const subscription& s = router_.subscription_at(i);
    if (!s.discards || now_ >= s.next_due) return true;
  }
  add(counter::throttled, on.subscriptions);
  return false;
}

// Tells the publishers of a topic whether anybody listens.
void core::update_wanted(std::uint32_t topic_index) noexcept {
  if (topic_index == stop_topic_) stop_state_due_ = now_; // whoever is new is shown it
  topic& on = router_.at(topic_index);
  const bool heard = on.first_subscription != no_index || on.first_inbox != no_index;
  if (!heard) on.newest_at = {}; // what is published from now on is not seen, so the pause is no gap
  for (std::uint32_t i = 0; i < lanes_.size(); ++i) {
    if (!views_[i].attached || views_[i].topic != topic_index || detail::subscribes(lanes_[i].kind)) continue;
    const bool wanted = heard || lanes_[i].latched;
    const audience now = wanted ? audience::somebody : audience::nobody;
    const audience before = lanes_[i].audience.advice();
    if (before == now) continue;
    wanted ? ++wanted_lanes_ : --wanted_lanes_;
    phases_.listen(i, wanted);
    lanes_[i].audience.set(now);
  }
}

// ---- in

// A peer published: to the handles of this process that subscribed and, in a hub, to the peers that did.
void core::relay(connection& c, const wire::request& asked) noexcept {
  if (stop_.in_use() && stop_service_named(asked.topic) == stop_service::stop)
    return take_silent_stop(c, asked.body_raw);
  if (drops_excess()) return;
  if (is_own_name(asked.topic) && c.ours == side::server) {
    return refuse(c, asked.id_raw, "publish: topics below /rowe/ are the endpoint's own");
  }
  const std::uint32_t topic_index = router_.find(asked.topic);
  if (topic_index == no_index) return add(counter::no_peer); // nobody has asked for it
  const auto write_body = [&](json::writer& into) { into.raw(asked.body_raw); };
  const published_by who{.peer = {c.id.index, c.id.generation}, .id_raw = asked.id_raw};
  if (options_.relay && c.ours == side::server) {
    const auto mine = c.advertised.first(c.advertisements);
    const bool latches = asked.latch || std::any_of(mine.begin(), mine.end(), [&](const advertisement& a) {
                           return a.topic == topic_index && a.latched;
                         });
    const bool kept = latches || ROWE_MUTANT(latch_of_others);
    const auto keeper = kept ? latch_owner{latch_owner::kind::peer, c.id.index} : latch_owner{};
    return publish(topic_index, now_, rt::never, keeper, write_body, who);
  }
  topic& on = router_.at(topic_index);
  note(on, now_);
  on.bytes = asked.body_raw.size();
  if (on.first_inbox == no_index) return add(counter::no_peer);
  for (std::uint32_t i = on.first_inbox; i != no_index; i = views_[i].next_inbox) {
    deliver_inbox(i, asked.body_raw, who);
  }
}

void core::deliver_inbox(std::uint32_t index, std::span<const char> body, const published_by& who) noexcept {
  json::decoder::diagnosis why;
  const status done = delivery_.deliver(index,
                                        {.stamped_ns = rt::nanoseconds_of(now_),
                                         .expires_ns = rt::nanoseconds_of(inbound_expiry(wire::unlimited)),
                                         .peer = who.peer},
                                        {body.data(), body.size()}, why);
  if (done) return;
  if (done.code() == errc::full) return add(counter::inbox_full);
  std::array<char, json::decoder::diagnosis::text_bytes_max> room;
  if (done.code() == errc::too_big) {
    add(counter::too_big);
    wire::text_out text{room};
    text.add("the message has ").add(done.error().value).add(" bytes, its subscriber takes ");
    text.add(done.error().limit).add(": raise the option `text_bytes_max`");
    return tell_misfit(index, who, text.text());
  }
  add(counter::undecodable);
  tell_misfit(index, who, why.text(room));
}

// A message does not fit a handle that subscribed: a difference of two programs, which would go on in
// silence. Whoever sent it is told, and an event tells this process; each once a second for a topic, at most,
// since what goes wrong once goes wrong with every message.
void core::tell_misfit(std::uint32_t index, const published_by& who, std::string_view why) noexcept {
  const std::uint32_t topic = views_[index].topic;
  rt::time_point& told_at =
      views_[router_.at(topic).first_inbox].misfit_at; // one of all handles on the topic
  connection* const c = find({who.peer.index, who.peer.generation});
  const bool first = told_at == rt::time_point{} || now_ - told_at >= misfit_period;
  const bool tells = c != nullptr && c->open() && c->ours == side::server && c->may_be_told(topic, now_);
  if (!first && !tells) return;
  std::array<char, wire::refusal::text_bytes_max> room;
  wire::text_out text{room};
  text.add("publish ").add_shortened(router_.name(topic), 64).add(": ").add_shortened(why, 320);
  if (tells) send_status(*c, who.id_raw, text.text());
  if (!first) return;
  told_at = now_;
  const bool by_peer = c != nullptr && c->ours == side::server;
  report(by_peer ? event::kind::refused_request : event::kind::warning,
         c != nullptr ? c->peer() : std::string_view{}, json::utf8_prefix(text.text(), event_text_bytes),
         "publish what the subscriber's type says, or set its option `fill_missing`");
}

// ---- as a client

// Tells a server what this process wants or offers, or no longer does. What it publishes goes to the server
// as if that had subscribed.
void core::announce(connection& c, std::uint32_t index, bool begins) noexcept {
  if (!c.protocol->can.topics) return;
  const detail::lane& lane = lanes_[index];
  const std::uint32_t topic_index = views_[index].topic;
  const topic& on = router_.at(topic_index);
  for (std::uint32_t i = 0; i < lanes_.size(); ++i) {
    // Nothing of a lane is looked at that is not attached: set-up may be building it.
    if (i == index || !views_[i].attached || views_[i].topic != topic_index) continue;
    if (detail::subscribes(lanes_[i].kind) != detail::subscribes(lane.kind)) continue;
    if (!begins || i < index) return; // another handle of the same kind said so, or goes on
  }
  std::array<char, wire::announcement_bytes_max> room;
  json::writer text{room};
  const bool reads = detail::subscribes(lane.kind);
  const bool unslashed = reads ? on.asked_unslashed : on.offered_unslashed;
  const std::string_view name = router_.name(topic_index).substr(unslashed ? 1 : 0);
  const wire::announcement what{.name = name, .type = lane.type(), .latch = lane.latched, .begins = begins};
  reads ? c.protocol->topics.write_subscription(text, what)
        : c.protocol->topics.write_advertisement(text, what);
  send_direct(c, text);
  if (reads) return;
  std::uint32_t subscribed = router_.find_subscription(topic_index, c.first_subscription);
  if (begins) {
    if (subscribed == no_index) {
      subscribed = router_.add_subscription(topic_index, c.id.index, c.first_subscription);
      if (subscribed == no_index) return add(counter::no_slot);
      subscription_claims_.take(c.subscriptions);
      router_.subscription_at(subscribed).unslashed = unslashed;
    }
    outbox_.merge_requests(subscribed);
  } else {
    if (subscribed != no_index) remove_subscription(c, subscribed);
  }
  update_wanted(topic_index);
}

void core::announce_all(connection& c) noexcept {
  for (std::uint32_t i = 0; i < lanes_.size(); ++i) {
    if (!views_[i].attached) continue;
    views_[i].topic == no_index ? announce_service(c, i, true) : announce(c, i, true);
  }
}

} // namespace rowe::service
