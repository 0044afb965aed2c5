// SPDX-License-Identifier: Apache-2.0
#include "service/threads/stop_rules.hpp"

#include <algorithm>
#include <cassert>

#include <rowe/detail/mutation_points.hpp>

#include "json/text/utf8.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {
namespace {

constexpr std::array<std::string_view, 5> cause_names{"start", "request", "guard", "loop", "service"};
constexpr std::array<std::string_view, 7> refusal_names{"",       "number", "tick", "role",
                                                        "guards", "loops",  "name"};

// Ticks stay below 2^53, which browsers can count to, for longer than robots run.
constexpr std::uint64_t tick_seed_mask = (std::uint64_t{1} << 44) - 1;

double milliseconds(rt::duration d) noexcept {
  const auto us = std::max<std::int64_t>(std::chrono::duration_cast<std::chrono::microseconds>(d).count(), 0);
  return static_cast<double>(us / 100) / 10;
}

// FNV-1a. It distinguishes the sources of one peer.
std::uint64_t hash_of(std::string_view text, std::uint64_t seed) noexcept {
  std::uint64_t h = 0xcbf29ce484222325U ^ seed;
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return h;
}

template <std::size_t Bytes>
std::size_t copy_cut(std::string_view from, std::array<char, Bytes>& to) noexcept {
  from = json::utf8_prefix(from, Bytes);
  std::copy_n(from.data(), from.size(), to.data());
  return from.size();
}

} // namespace

stop_rules::stop_rules(const stop_options& options, rt::time_point start, std::uint64_t seed) noexcept
    : options_{options},
      start_{start},
      first_tick_{seed & tick_seed_mask},
      number_{1 + (seed >> 48) % detail::latch_number_max}, // short enough to be typed
      latch_{static_cast<latch_number>(number_)},
      latch_number_{number_},
      latch_tick_{first_tick_ - 1}, // none: it may be raised in the first millisecond, too
      reset_tick_least_{first_tick_},
      since_{start} {}

bool stop_rules::good_name(std::string_view name) noexcept {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == ':' || c == '/' || c == '-';
  };
  return !name.empty() && name.size() <= name_bytes_max && std::all_of(name.begin(), name.end(), good);
}

std::string_view stop_rules::name_of(refusal why) noexcept {
  return refusal_names[static_cast<std::size_t>(why)];
}
std::string_view stop_rules::cause_name() const noexcept {
  return running_ ? std::string_view{} : cause_names[static_cast<std::size_t>(cause_)];
}

// ---- ticks

std::uint64_t stop_rules::tick(rt::time_point now) const noexcept {
  return first_tick_ +
         static_cast<std::uint64_t>(std::chrono::floor<std::chrono::milliseconds>(now - start_).count());
}

rt::time_point stop_rules::issued(std::int64_t of, rt::time_point now) const noexcept {
  if (of < 0) return rt::never;
  const auto given = static_cast<std::uint64_t>(of);
  if (given < first_tick_ || given > tick(now)) return rt::never;
  return start_ + std::chrono::milliseconds{given - first_tick_};
}

// ---- loops

std::uint32_t stop_rules::add_loop(std::string_view name, rt::duration timeout,
                                   const detail::latch_words<>& words, rt::time_point now) noexcept {
  for (std::uint32_t i = 0; i < loops_.size(); ++i) {
    loop& l = loops_[i];
    if (l.words != nullptr) continue;
    // A loop that comes while others move has seen no stop; it begins as they did.
    if (running_) stop(stop_cause::start, name, now);
    l = {.words = &words, .timeout = timeout, .since = now};
    l.name_bytes = static_cast<std::uint8_t>(copy_cut(name, l.name_buffer));
    in_use_ = true;
    permit_changed_ = true;
    ++version_;
    return i;
  }
  return no_loop;
}

void stop_rules::remove_loop(std::uint32_t index, rt::time_point now) noexcept {
  update(now);
  loop& gone = loops_[index];
  if (running_) stop(stop_cause::loop, gone.name(), now);
  gone.words = nullptr;
  ++version_;
}

rt::time_point stop_rules::last_look(const loop& l) const noexcept {
  return std::max(l.since, l.words->checked_in());
}

bool stop_rules::loops_ready(rt::time_point now) const noexcept {
  bool any = false;
  for (const loop& l : loops_) {
    if (l.words == nullptr) continue;
    any = true;
    if (l.words->acknowledged(now).number != latch_ || now - last_look(l) > l.timeout) return false;
  }
  return any;
}

rt::time_point stop_rules::observed() const noexcept {
  rt::time_point last{};
  for (const loop& l : loops_) {
    if (l.words == nullptr) continue;
    if (l.answered.number != latch_) return rt::never;
    last = std::max(last, l.answered.at);
  }
  return running_ || last == rt::time_point{} ? rt::never : last;
}

// ---- guards

stop_rules::guard* stop_rules::find_guard(std::string_view name) noexcept {
  const auto found = std::find_if(guards_.begin(), guards_.end(),
                                  [&](const guard& g) { return g.name_bytes != 0 && g.name() == name; });
  return found == guards_.end() ? nullptr : &*found;
}

bool stop_rules::guards_include(std::uint64_t peer) const noexcept {
  return std::any_of(guards_.begin(), guards_.end(),
                     [&](const guard& g) { return g.name_bytes != 0 && g.peer == peer; });
}

bool stop_rules::guarded(rt::time_point now) const noexcept {
  bool any = options_.unguarded;
  for (const guard& g : guards_) {
    if (g.name_bytes == 0) continue;
    any = true;
    if (g.until <= now) return false;
  }
  return any;
}

stop_rules::refusal stop_rules::heartbeat(std::string_view name, std::int64_t tick, bool resigns,
                                          std::uint64_t peer, bool role, rt::time_point now) noexcept {
  update(now);
  guard* known = find_guard(name);
  const bool own = known != nullptr && known->peer == peer;
  if (!own && !role) return refusal::role;
  if (!good_name(name)) return refusal::name;
  if (resigns) {
    if (known == nullptr) return refusal::none;
    if (running_) stop(stop_cause::guard, name, now);
    *known = {};
    ++version_;
    return refusal::none;
  }
  if (known != nullptr && !own && known->peer != 0) return refusal::name; // somebody else has it
  const rt::time_point when = issued(tick, now);
  if (when == rt::never || when + options_.guard_timeout <= now) return refusal::tick;
  if (known == nullptr) {
    const auto free =
        std::find_if(guards_.begin(), guards_.end(), [](const guard& g) { return g.name_bytes == 0; });
    if (free == guards_.end()) return refusal::guards;
    known = &*free;
    known->name_bytes = static_cast<std::uint8_t>(copy_cut(name, known->name_buffer));
  }
  if (!own || known->until <= now) ++version_;
  known->peer = peer;
  known->issued = std::max(known->issued, when);
  known->until = std::max(known->until, when + options_.guard_timeout);
  return refusal::none;
}

void stop_rules::peer_gone(std::uint64_t peer, rt::time_point now) noexcept {
  update(now);
  for (guard& g : guards_) {
    if (g.name_bytes == 0 || g.peer != peer) continue;
    g.peer = 0;
    g.until = std::min(g.until, now);
    if (running_) stop(stop_cause::guard, g.name(), now);
    ++version_;
  }
}

// ---- stop and reset

void stop_rules::set_source(std::string_view source) noexcept { source_bytes_ = copy_cut(source, source_); }

void stop_rules::stop(stop_cause cause, std::string_view source, rt::time_point now) noexcept {
  running_ = false;
  cause_ = cause;
  set_source(source);
  asker_count_ = 0;
  until_ = {};
  outdate_ticks(now);
  raise_number(now); // the number while running names no stop
}

// Whether a loop's words still have this latch number from an earlier use. Such words would be taken for the
// answer to a newer stop, or for its trip.
bool stop_rules::is_held(latch_number one) const noexcept {
  return std::any_of(loops_.begin(), loops_.end(), [&](const loop& l) {
    return l.words != nullptr && (l.words->tripped() == one || l.answered.number == one);
  });
}

void stop_rules::raise_number(rt::time_point now) noexcept {
  since_ = now;
  ++number_;
  if (ROWE_MUTANT(stop_number)) number_ = 1 + number_ % detail::latch_number_max;
  if (latch_tick_ != tick(now) || ROWE_MUTANT(stop_latch)) {
    do latch_ = detail::next_latch_number(latch_);
    while (is_held(latch_)); // of 65 535 the loops have sixteen at most
    latch_number_ = number_;
    latch_tick_ = tick(now);
  }
  permit_changed_ = true;
  ++version_;
}

// The peers that got ticks until now do not know of the stop that is requested now.
void stop_rules::outdate_ticks(rt::time_point now) noexcept { reset_tick_least_ = tick(now) + 1; }

bool stop_rules::is_new(std::uint64_t asker) noexcept {
  const auto end = askers_.begin() + static_cast<std::ptrdiff_t>(asker_count_);
  if (std::find(askers_.begin(), end, asker) != end) return false;
  if (asker_count_ < askers_.size()) askers_[asker_count_++] = asker;
  return true;
}

void stop_rules::request(std::string_view source, std::uint64_t peer, rt::time_point now) noexcept {
  update(now);
  outdate_ticks(now); // also for a repeated request: it asks for a stop now
  const bool was_running = running_;
  if (was_running) stop(stop_cause::request, source, now);
  if (!is_new(hash_of(source, peer)) || was_running) return;
  cause_ = stop_cause::request;
  set_source(source);
  raise_number(now);
}

stop_rules::refusal stop_rules::reset(std::int64_t number, std::int64_t tick, bool role,
                                      rt::time_point now) noexcept {
  update(now);
  if (!role) return refusal::role;
  if (running_ || number < 0 || static_cast<std::uint64_t>(number) != number_) return refusal::number;
  const rt::time_point when = issued(tick, now);
  if (when == rt::never || now - when > reset_tick_age_max) return refusal::tick;
  if (static_cast<std::uint64_t>(tick) < reset_tick_least_ && !ROWE_MUTANT(stop_tick)) return refusal::tick;
  if (!loops_ready(now)) return refusal::loops;
  if (!guarded(now)) return refusal::guards;
  assert(latch_tick_ != this->tick(now)); // it was raised by a stop, and the tick is newer than any
  raise_number(now);
  running_ = true;
  source_bytes_ = 0;
  until_ = run_until(now);
  return refusal::none;
}

// ---- time

rt::time_point stop_rules::run_until(rt::time_point now) const noexcept {
  rt::time_point until = now + options_.service_timeout;
  for (const guard& g : guards_) {
    if (g.name_bytes != 0) until = std::min(until, g.until);
  }
  return until;
}

bool stop_rules::find_trouble(rt::time_point now) noexcept {
  const auto lapsed = [&](rt::time_point at) {
    return std::find_if(guards_.begin(), guards_.end(),
                        [&](const guard& g) { return g.name_bytes != 0 && g.until <= at; });
  };
  if (const auto g = lapsed(now); g != guards_.end()) {
    stop(stop_cause::guard, g->name(), now);
    return true;
  }
  for (const loop& l : loops_) {
    if (l.words == nullptr) continue;
    if (l.words->tripped() == latch_) {
      // It found the permit over, a moment ago: a guard was silent, or this thread was late.
      const auto g = lapsed(last_look(l) + rt::duration{std::int64_t{1} << detail::permit::unit_shift});
      const bool by_guard = g != guards_.end();
      stop(by_guard ? stop_cause::guard : stop_cause::service, by_guard ? g->name() : l.name(), now);
      return true;
    }
    if (now - last_look(l) > l.timeout) {
      stop(stop_cause::loop, l.name(), now);
      return true;
    }
  }
  return false;
}

void stop_rules::update(rt::time_point now) noexcept {
  for (loop& l : loops_) {
    if (l.words == nullptr) continue;
    const auto answered = l.words->acknowledged(now);
    if (answered.number == l.answered.number) continue; // its time was complete when it was new
    l.answered = answered;
    l.answered_number = answered.number == latch_ ? number_ : latch_number_ - 1; // late: to one before
    ++version_;
  }
  if (!running_ || find_trouble(now)) return;
  // The permit is renewed in steps, so the word stays in the loops' caches for a while.
  const rt::time_point until = run_until(now);
  const bool soon = until_ - now < options_.service_timeout / 2;
  if (until == until_ || (until > until_ && !soon && until - until_ < options_.service_timeout / 8)) return;
  until_ = until;
  permit_changed_ = true;
}

rt::time_point stop_rules::next_update(rt::time_point now) const noexcept {
  if (!running_) return rt::never;
  rt::time_point next = now + options_.service_timeout / 4;
  for (const guard& g : guards_) {
    if (g.name_bytes != 0) next = std::min(next, g.until);
  }
  for (const loop& l : loops_) {
    if (l.words != nullptr) next = std::min(next, last_look(l) + l.timeout + rt::duration{1});
  }
  return next;
}

void stop_rules::write_permit(detail::permit_word<>& into) noexcept {
  if (!permit_changed_) return;
  permit_changed_ = false;
  running_ ? into.grant(latch_, until_) : into.withdraw(latch_);
}

// ---- state for peers

void stop_rules::write_state(json::writer& into, rt::time_point now) const noexcept {
  const auto text_or_null = [&](std::string_view key, std::string_view text) {
    into.key(key);
    text.empty() ? into.null() : into.string(text);
  };
  into.begin_object();
  into.member("state", running_ ? "running" : "stopped");
  into.member("number", number_);
  text_or_null("cause", cause_name());
  text_or_null("source", source());
  into.member("since_ms", milliseconds(now - since_));
  into.member("tick", tick(now));
  into.member("unguarded", options_.unguarded);
  into.begin_array("guards");
  for (const guard& g : guards_) {
    if (g.name_bytes == 0) continue;
    into.begin_object();
    into.member("name", g.name());
    into.member("age_ms", milliseconds(now - g.issued));
    into.member("fresh", g.until > now);
    into.end_object();
  }
  into.end_array();
  into.begin_array("loops");
  for (const loop& l : loops_) {
    if (l.words == nullptr) continue;
    into.begin_object();
    into.member("name", l.name());
    into.member("age_ms", milliseconds(now - last_look(l)));
    into.member("acknowledged", l.answered.number == latch_ ? number_ : l.answered_number);
    into.end_object();
  }
  into.end_array();
  into.end_object();
}

} // namespace rowe::service
