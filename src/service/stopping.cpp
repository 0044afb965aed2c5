// SPDX-License-Identifier: Apache-2.0
// The stop's messages: what peers and this process ask of it, how they are answered, and who is shown its
// state. The rules are stop_rules.hpp's. A stop is carried out where it is read: no slot, queue or table is
// in its way, and the permit is withdrawn before the next message is looked at.
#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/core.hpp"
#include "service/publishing.hpp"
#include "wire/own_names.hpp"

namespace rowe::service {
namespace {

constexpr std::array<std::string_view, 4> service_names{wire::stop_name, wire::stop_reset_name,
                                                        wire::stop_lease_name, wire::stop_state_name};

constexpr std::size_t body_bytes_max = 2560; // of any answer, and of the state
constexpr std::size_t answer_bytes_max =
    body_bytes_max + call_table::id_bytes_max + 128; // with what is around it
static_assert(answer_bytes_max + wire::frame_header_bytes_max <= stop_frames::room_bytes);

// A member with escapes is read as far as this; a longer one counts as missing.
constexpr std::size_t member_bytes_max = 1024;

// How often the state is shown to whoever is no guard.
constexpr int ticks_for_others = 10;
constexpr std::uint64_t this_process = 1; // a peer's key is never so small
// Stops of one peer that wait for the loops; more of them are answered at once.
constexpr int waiting_per_peer_max = 2;

std::uint64_t key_of(connection_id id) noexcept { return std::uint64_t{id.generation} << 32 | id.index; }

// Nanoseconds as a string of digits: browsers round integers beyond 2^53.
void write_time(json::writer& into, std::string_view key, rt::time_point t) noexcept {
  into.key(key);
  if (t == rt::never) return into.null();
  std::array<char, 24> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), rt::nanoseconds_of(t)).ptr;
  into.string({digits.data(), static_cast<std::size_t>(end - digits.data())});
}

void write_text(json::writer& into, std::string_view key, std::string_view text) noexcept {
  into.key(key);
  text.empty() ? into.null() : into.string(text);
}

std::int64_t integer_of(std::string_view args, std::string_view member) noexcept {
  const auto found = json::find(args, member);
  return found ? json::to_integer(*found).value_or(-1) : -1;
}

} // namespace

core::stop_service core::stop_service_named(std::string_view name) noexcept {
  for (std::size_t i = 0; i < service_names.size(); ++i) {
    if (name == service_names[i] || name == service_names[i].substr(1))
      return static_cast<stop_service>(i + 1);
  }
  return stop_service::none;
}

std::string_view core::name_of(stop_service which) noexcept {
  return service_names[static_cast<std::size_t>(which) - 1];
}

// ---- loops

status core::attach_latch(std::uint32_t index) noexcept {
  detail::lane& lane = lanes_[index];
  const std::uint32_t loop = stop_.add_loop(lane.name(), lane.loop_timeout, lane.latch, now_);
  if (loop == stop_rules::no_loop)
    return error{errc::too_many_latches, stop_rules::loops_max, stop_rules::loops_max};
  views_[index].loop = loop;
  stop_.write_permit(shown_.permit);
  return {};
}

void core::detach_latch(std::uint32_t index) noexcept {
  stop_.remove_loop(views_[index].loop, now_);
  stop_.write_permit(shown_.permit);
}

// ---- what is asked

// A peer's call of one of the stop's services.
void core::take_stop_call(connection& c, const wire::request& asked, stop_service which) noexcept {
  const bool too_long = asked.id_raw.size() > call_table::id_bytes_max;
  carry_out_stop(
      which, {.who = party::of(c.id, asked.codec), .id_raw = too_long ? std::string_view{} : asked.id_raw},
      asked.body_raw);
}

// Whether a validated text names the stop, whatever else is wrong with it: then it is a stop. A service's
// name may end in "#" and an id.
bool core::asks_to_stop(const json::document& text) const noexcept {
  if (!stop_.in_use()) return false;
  for (const std::string_view member : {"service", "topic"}) {
    auto found = json::find(text, member);
    if (!found || found->type != json::kind::string) continue;
    const std::size_t mark = member == "service" ? found->raw.find('#') : std::string_view::npos;
    if (mark != std::string_view::npos) found->raw = found->raw.substr(0, mark + 1); // in place of the quote
    if (json::text_is(*found, wire::stop_name) || json::text_is(*found, wire::stop_name.substr(1)))
      return true;
  }
  return false;
}

// Whether hear() would carry out a stop: the same decisions, and nothing is done. Reads it as a request,
// so not while another one is carried out.
bool core::is_stop(peer_index from, std::string_view text) noexcept {
  if (!stop_.in_use() || !validator_.validate(text)) return false;
  const json::document known = validator_.last();
  const auto names = [](std::string_view what) { return stop_service_named(what) == stop_service::stop; };
  wire::request asked;
  wire::diagnostic why;
  sentence_room sentence;
  switch (peers_[from].protocol->reads.decode(known, decode_room(sentence), asked, why)) {
  case wire::decoded::malformed: return false;
  case wire::decoded::refused: return asks_to_stop(known);
  case wire::decoded::request: break;
  }
  switch (asked.what) {
  case wire::verb::message: return asks_to_stop(known);
  case wire::verb::publish: return names(asked.topic);
  case wire::verb::call: return names(asked.service);
  default: return false;
  }
}

// A connection is heard no more: what it guarded stops.
void core::leave_stop(const connection& c) noexcept {
  if (!stop_.in_use()) return;
  stop_.peer_gone(key_of(c.id), now_);
  stop_.write_permit(shown_.permit);
}

void core::stop_loops(rt::time_point now) noexcept {
  if (!stop_.in_use()) return;
  stop_.request("the endpoint is closing", 0, now);
  stop_.write_permit(shown_.permit);
}

// A stop that wants no answer: published, or a bare message without an id.
void core::take_silent_stop(connection& c, std::string_view args) noexcept {
  carry_out_stop(stop_service::stop, {.who = party::of(c.id, c.spoke_last), .silent = true}, args);
}

void core::carry_out_stop(stop_service which, const stop_asker& asker, std::string_view args) noexcept {
  connection* const c = asker.who.who == party::kind::peer ? find(asker.who.connection()) : nullptr;
  const std::uint64_t peer = c != nullptr ? key_of(c->id) : this_process;
  const bool role = asker.who.who != party::kind::peer || (c != nullptr && c->local);
  std::array<char, member_bytes_max> room; // of one at a time; scratch_ has the id that is answered
  const auto text_of = [&](std::string_view member) -> std::string_view {
    const auto found = json::find(args, member);
    const auto text = found ? json::to_string(*found, ROWE_MUTANT(stop_id) ? scratch_ : std::span<char>{room})
                            : std::nullopt;
    return text.value_or(std::string_view{});
  };
  if (!args.empty()) args = json::root(args).raw;
  // Who waits for the loops is told what they did until now, before this raises the number: those who stop
  // more often than a loop looks would leave everyone without an answer.
  stop_.turn(now_);
  answer_observed();
  auto refused = stop_rules::refusal::none;
  switch (which) {
  case stop_service::stop: {
    add(counter::stops);
    const std::string_view source = text_of("source");
    const std::string_view here = c != nullptr ? c->peer() : std::string_view{"this process"};
    if (c != nullptr && stop_.running()) c->stopped_at = now_;
    stop_.request(source.empty() ? here : source, peer, now_);
    break;
  }
  case stop_service::reset:
    refused = stop_.reset(integer_of(args, "number"), integer_of(args, "tick"), role, now_);
    break;
  case stop_service::lease: {
    const auto resigns = json::find(args, "resign");
    refused = stop_.lease(text_of("guard"), integer_of(args, "tick"),
                          resigns && json::to_boolean(*resigns).value_or(false), peer, role, now_);
    break;
  }
  case stop_service::state:
  case stop_service::none: break;
  }
  stop_.write_permit(shown_.permit); // before anything else
  if (stop_.running() != stop_reported_running_)
    report_stop(which == stop_service::stop ? text_of("reason") : "");
  if (refused != stop_rules::refusal::none) add(counter::stop_refusals);
  if (asker.silent) return;
  if (which == stop_service::stop) return await_observed(asker);
  answer_stop(which, asker, now_, refused);
}

void core::report_stop(std::string_view reason) noexcept {
  stop_reported_running_ = stop_.running();
  std::array<char, 224> text;
  auto put = [at = std::size_t{0}, &text](std::string_view piece) mutable {
    at += piece.copy(text.data() + at, std::min(piece.size(), text.size() - at));
    return std::string_view{text.data(), at};
  };
  (void)put(stop_.running() ? "reset: loops may move" : "stopped: ");
  if (!stop_.running()) (void)put(stop_.cause_name());
  if (!reason.empty()) (void)put(", ");
  report(event::kind::stop, stop_.source(), put(reason));
}

// ---- answers

// The answer to a stop waits until the loops have acknowledged, at most observe_timeout. Where all places for
// waiting are taken it does not wait.
void core::await_observed(const stop_asker& asker) noexcept {
  connection* const c = asker.who.who == party::kind::peer ? find(asker.who.connection()) : nullptr;
  const bool known = stop_.observed() != rt::never;
  if (known || stops_awaited_ == stop_waiters_.size() ||
      (c != nullptr && c->stops_awaited == waiting_per_peer_max)) {
    return answer_stop(stop_service::stop, asker, now_, stop_rules::refusal::none);
  }
  stop_waiter& last = stop_waiters_[(stop_first_waiter_ + stops_awaited_++) % stop_waiters_.size()];
  last = {.who = asker.who, .call = asker.call, .accepted = now_};
  last.until = now_ + options_.stop.observe_timeout;
  last.id_bytes = static_cast<std::uint16_t>(asker.id_raw.copy(last.id.data(), last.id.size()));
  if (c != nullptr) ++c->stops_awaited;
  stop_awaited_since_ = now_;
}

void core::answer_observed() noexcept {
  const bool observed = stop_.observed() != rt::never || stop_.running();
  while (stops_awaited_ != 0 && (observed || now_ >= stop_waiters_[stop_first_waiter_].until)) {
    const stop_waiter first = stop_waiters_[stop_first_waiter_];
    stop_first_waiter_ = static_cast<std::uint32_t>((stop_first_waiter_ + 1) % stop_waiters_.size());
    --stops_awaited_;
    connection* const c = first.who.who == party::kind::peer ? find(first.who.connection()) : nullptr;
    if (c != nullptr) --c->stops_awaited;
    answer_stop(stop_service::stop,
                {.who = first.who, .id_raw = {first.id.data(), first.id_bytes}, .call = first.call},
                first.accepted, stop_rules::refusal::none);
  }
}

void core::write_stop_answer(json::writer& into, stop_service which, rt::time_point accepted,
                             stop_rules::refusal refused) noexcept {
  if (which == stop_service::state) return stop_.write_state(into, now_);
  into.begin_object();
  into.key("state");
  into.string(stop_.running() ? "running" : "stopped");
  into.key("number");
  into.number(stop_.number());
  switch (which) {
  case stop_service::stop:
    write_text(into, "cause", stop_.cause_name());
    write_text(into, "source", stop_.source());
    write_time(into, "accepted_ns", accepted);
    write_time(into, "observed_ns", stop_.observed());
    break;
  case stop_service::lease:
    into.key("lease_ms");
    into.number(std::chrono::duration_cast<std::chrono::milliseconds>(options_.stop.lease).count());
    into.key("tick");
    into.number(stop_.tick(now_));
    [[fallthrough]];
  default: write_text(into, "refused", stop_rules::name_of(refused)); break;
  }
  into.end_object();
}

void core::answer_stop(stop_service which, const stop_asker& asker, rt::time_point accepted,
                       stop_rules::refusal refused) noexcept {
  std::array<char, answer_bytes_max> room;
  json::writer text{room};
  const auto body = [&](json::writer& into) { write_stop_answer(into, which, accepted, refused); };
  if (asker.who.who != party::kind::peer) {
    body(text);
    if (calls_.find(asker.call) == nullptr) return; // it did not wait so long
    return end_without_room(asker.call.index, finish_with(asker.call.index, {room.data(), text.bytes()}));
  }
  connection* const c = find(asker.who.connection());
  if (c == nullptr || !c->open()) return;
  protocols_.of(asker.who.speaks)
      .write_reply(text, {.service = name_of(which), .id_raw = asker.id_raw}, wire::body{body});
  sender_.add_stop_reply({c->id.index}, {room.data(), text.overflowed() ? 0 : text.bytes()});
}

// ---- the state

// In each cycle, after what was read: looks at loops, guards and the clock, and answers.
void core::turn_stop() noexcept {
  if (!stop_.in_use()) return;
  if (shown_.take_stop_asked()) carry_out_stop(stop_service::stop, {.silent = true}, {});
  stop_.turn(now_);
  stop_.write_permit(shown_.permit);
  if (stop_.running() != stop_reported_running_) report_stop({}); // a guard or a loop may have gone, too
  answer_observed();
}

// At the end of each cycle: shows the state to those who are due.
void core::show_stop_state() noexcept {
  if (!stop_.in_use()) return;
  const bool changed = std::exchange(stop_version_shown_, stop_.version()) != stop_.version();
  if (!changed && now_ < stop_state_due_) return;
  topic& on = router_.at(stop_topic_);
  std::array<char, answer_bytes_max> room;
  std::size_t bytes = 0;
  std::size_t body_at = 0;
  const auto text = [&] {
    if (bytes == 0) {
      json::writer into{room};
      into.append(router_.head(stop_topic_));
      body_at = into.bytes();
      stop_.write_state(into, now_);
      on.bytes = into.bytes() - body_at;
      into.append(router_.tail());
      bytes = into.overflowed() ? 0 : into.bytes();
      note(on, now_);
    }
    return std::span<const char>{room.data(), bytes};
  };
  std::array<char, answer_bytes_max> other;
  const auto unslashed_text = [&] { // the same, for who calls it by its name without the slash
    const std::span<const char> whole = text();
    if (whole.empty()) return whole;
    const wire::message_head head = router_.envelope().head_of({.unslashed = true});
    std::memcpy(other.data(), head.bytes.data(), head.size);
    const auto end = std::copy(whole.begin() + head.from, whole.end(), other.begin() + head.size);
    return std::span<const char>{other.begin(), end};
  };
  const rt::duration slow = ticks_for_others * options_.stop.tick;
  const rt::duration early = options_.stop.tick / 2; // those who are due soon go along with one who is
  stop_state_due_ = rt::never;
  for (std::uint32_t i = on.first_subscription; i != no_index; i = router_.subscription_at(i).next_on_topic) {
    connection& c = peers_[peer_index{router_.subscription_at(i).connection}];
    const bool unslashed = router_.subscription_at(i).unslashed;
    // There is room for one state: who subscribed by both names gets that with the slash.
    if (unslashed && router_.find_subscription(stop_topic_, c.first_subscription, false) != no_index)
      continue;
    const bool guards = stop_.guards_include(key_of(c.id));
    const rt::duration period = guards ? options_.stop.tick : slow;
    if (changed || now_ - c.stop_shown_at >= (guards ? period : period - early)) {
      c.stop_shown_at = now_;
      if (c.open()) sender_.add_stop_state({c.id.index}, unslashed ? unslashed_text() : text());
    }
    stop_state_due_ = std::min(stop_state_due_, c.stop_shown_at + period);
  }
  if (protocols_.any(&wire::capabilities::state_as_message)) show_stop_as_message(changed);
  // A client's handles that subscribe to it are told its server's state, never both by turns.
  const bool of_server = ours_ == side::client && protocols_.any(&wire::capabilities::topics);
  if (on.first_inbox == no_index || of_server) return;
  const rt::duration here = stop_.guards_include(this_process) ? options_.stop.tick : slow;
  if (changed || now_ - stop_delivered_at_ >= here) {
    stop_delivered_at_ = now_;
    const std::span<const char> whole = text();
    for (std::uint32_t i = on.first_inbox; i != no_index; i = views_[i].next_inbox)
      deliver_inbox(i, whole.subspan(body_at, on.bytes), {});
  }
  stop_state_due_ = std::min(stop_state_due_, stop_delivered_at_ + here);
}

// To those who know no topics the state goes as a message; to those who know no pings either, that also tells
// that the robot is there.
void core::show_stop_as_message(bool changed) noexcept {
  const rt::duration period = ticks_for_others * options_.stop.tick;
  for (connection& c : peers_) {
    if (!c.open() || !c.takes_messages || !c.protocol->can.state_as_message) continue;
    if (changed || now_ - c.stop_shown_at >= period) {
      c.stop_shown_at = now_;
      std::array<char, body_bytes_max> room;
      json::writer text{room};
      stop_.write_state(text, now_);
      sender_.add_stop_state({c.id.index}, {room.data(), text.overflowed() ? 0 : text.bytes()});
    }
    stop_state_due_ = std::min(stop_state_due_, c.stop_shown_at + period);
  }
}

// When turn_stop() is needed at the latest.
rt::time_point core::next_stop_turn() const noexcept {
  if (!stop_.in_use()) return rt::never;
  rt::time_point next = std::min(stop_.next_turn(now_), stop_state_due_);
  if (stops_awaited_ != 0) {
    next = std::min(next, now_ + std::clamp((now_ - stop_awaited_since_) / 8, acknowledgment_rest_min,
                                            acknowledgment_rest_max));
  }
  return next;
}

} // namespace rowe::service
