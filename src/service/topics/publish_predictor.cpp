// SPDX-License-Identifier: Apache-2.0
#include "service/topics/publish_predictor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rowe::service {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration lead_before_known = 50us;
constexpr rt::duration lead_max = 80us;    // a machine that wakes later than that is not waited for
constexpr rt::duration head = 2us;         // a value is to find the thread awake
constexpr rt::duration tail_min = 20us;    // a spin window ends with its value, so a long tail costs little
constexpr rt::duration exact_max = 20us;   // between two looks: the time a value came at is known
constexpr rt::duration stamp_age_max = 1s; // older stamps are no times of a loop
constexpr std::size_t enough_for_a_line = 32;
constexpr std::size_t enough_to_trim = 50; // so many values have a first and a last percentile

// The two smallest and the two largest of all values that it was given.
struct extremes {
  double low[2] = {INFINITY, INFINITY};
  double high[2] = {-INFINITY, -INFINITY};

  void show(double value) noexcept {
    if (value < low[1]) low[1] = value;
    if (low[1] < low[0]) std::swap(low[0], low[1]);
    if (value > high[1]) high[1] = value;
    if (high[1] > high[0]) std::swap(high[0], high[1]);
  }
};

// How much of the budget a topic leaves to topics of higher priority.
constexpr rt::duration reserve_of(priority of) noexcept {
  switch (of) {
  case priority::urgent: return 0us;
  case priority::normal: return publish_predictor::ahead_max / 4;
  case priority::bulk: break;
  }
  return publish_predictor::ahead_max / 2;
}

rt::duration rounded(double ns) noexcept { return rt::duration{std::llround(ns)}; }

} // namespace

std::size_t publish_predictor::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<row>(bounds.handles_max) + rt::arena::bytes_for<pair_index>(bounds.handles_max);
}

publish_predictor::publish_predictor(rt::arena& memory, const limits& bounds, counters& counts) noexcept
    : rows_{memory.carve<row>(bounds.handles_max)},
      used_{memory.carve<pair_index>(bounds.handles_max)},
      counts_{counts},
      lead_{lead_before_known} {
  wakings_.fill(static_cast<std::int32_t>(lead_before_known.count()));
}

// ---- publishers

void publish_predictor::begin(pair_index pair, rt::duration period, priority rank) noexcept {
  rows_[pair] = {.period = period, .rank = rank};
  used_[used_count_++] = pair;
}

void publish_predictor::listen(pair_index pair, bool somebody) noexcept {
  row& of = rows_[pair];
  if (of.period == rt::duration{0} || of.listened == somebody) return;
  somebody ? ++listened_ : --listened_;
  of = {.period = of.period, .rank = of.rank, .listened = somebody};
}

void publish_predictor::end(pair_index pair) noexcept {
  if (rows_[pair].period == rt::duration{0}) return;
  listen(pair, false);
  rows_[pair] = {};
  *std::find(used_.begin(), used_.begin() + used_count_, pair) = used_[used_count_ - 1];
  --used_count_;
}

// ---- values

void publish_predictor::saw(pair_index pair, rt::time_point published) noexcept {
  row& of = rows_[pair];
  if (!of.listened) return;
  const bool hit = spinning_ && of.state == window::open;
  counts_.add(hit ? counter::phase_hits : counter::phase_misses);
  published = std::clamp(published, looked_ - stamp_age_max, looked_);
  if (!of.planned) return learn(of, published, looked_ - published);

  const rt::time_point earliest = std::max(published, before_);
  if (hit && looked_ - earliest <= exact_max) {
    of.delay = looked_ - published;
    if (!std::exchange(of.timed, true)) of.grid += of.delay; // the values before it came as much later
  }
  take(of, of.timed ? std::clamp(published + of.delay, earliest, looked_) : published, hit);
}

// Only the stamps are known, and that a value had arrived when it was found. So a value takes at most the
// smallest delay that was found.
void publish_predictor::learn(row& of, rt::time_point published, rt::duration delay) noexcept {
  const rt::duration off = published - (of.grid + of.newest()) - of.period;
  if (of.streak == 0 || off < -of.period * 3 / 8 || off > of.period * 3 / 8) {
    of.at = of.count = of.streak = 0;
    of.grid = published - of.period;
    of.delay = delay;
  }
  of.delay = std::min(of.delay, delay);
  put(of, 1, published);
  if (++of.streak < hits_min) return;
  of.planned = true;
  of.timed = false;
  of.streak = 0;
}

void publish_predictor::take(row& of, rt::time_point came, bool hit) noexcept {
  const rt::duration since = came - (of.grid + of.newest());
  const std::int64_t periods = std::max<std::int64_t>((since + of.period / 2) / of.period, hit ? 1 : 0);
  if (periods < 1) return; // one more in the same period
  // Where in its spin window it came; the row may have a later window by now.
  rt::duration into = (came - of.opens) % of.period;
  if (into < rt::duration{0}) into += of.period;
  if (into <= of.closes - of.opens) {
    of.streak = 0;
  } else if (!of.missed) {
    count_miss(of);
    if (!of.planned) return;
  }
  put(of, periods, came);
}

void publish_predictor::put(row& of, std::int64_t periods, rt::time_point came) noexcept {
  of.grid += periods * of.period;
  of.offsets[of.at] = (came - of.grid).count();
  of.at = static_cast<std::uint8_t>((of.at + 1) % history);
  of.count = static_cast<std::uint8_t>(std::min<std::size_t>(of.count + 1U, history));
  of.fitted = of.overdue = of.missed = false;
  of.state = window::closed;
}

void publish_predictor::count_miss(row& of) noexcept {
  of.missed = true;
  if (++of.streak < misses_max) return;
  of.planned = false;
  of.streak = 0;
  of.state = window::closed;
}

// Fits a line to the last values, and measures how far from it they are.
void publish_predictor::fit(row& of) const noexcept {
  const std::size_t n = of.count;
  const auto offset = [&](std::size_t i) {
    return static_cast<double>(of.offsets[(of.at + history - n + i) % history]);
  };
  const double middle = static_cast<double>(n - 1) / 2;
  double slope = 0;
  if (n >= enough_for_a_line) {
    double both = 0, squares = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double x = static_cast<double>(i) - middle;
      both += x * offset(i);
      squares += x * x;
    }
    slope = both / squares;
  }
  extremes around;
  for (std::size_t i = 0; i < n; ++i) around.show(offset(i) - slope * (static_cast<double>(i) - 2 * middle));
  const std::size_t trimmed = n >= enough_to_trim ? 1 : 0;
  const rt::duration low = rounded(around.low[trimmed]);
  const rt::duration high = rounded(around.high[trimmed]) + (of.timed ? rt::duration{0} : of.delay);
  of.step = std::max(of.period + rounded(slope), of.period / 2);
  of.opens = of.grid + of.step + low - head - lead_;
  of.late = of.grid + of.step + high;
  of.closes = of.late + std::max(tail_min, (high - low) / 4);
  of.fitted = true;
}

// ---- answers

void publish_predictor::asked(rt::time_point now) noexcept {
  asked_ = now;
  answer_ = window::closed;
}

void publish_predictor::answered(rt::time_point given) noexcept {
  if (asked_ == rt::never) return;
  const bool soon = given - asked_ < answer_max;
  asked_ = rt::never;
  if (answers_soon_ || !soon) {
    answers_streak_ = 0;
  } else if (++answers_streak_ == hits_min) {
    answers_soon_ = true;
    answers_streak_ = 0;
  }
}

rt::time_point publish_predictor::look_for_answer(rt::time_point now) noexcept {
  if (asked_ == rt::never || !answers_soon_) return rt::never;
  if (now - asked_ >= answer_max) {
    asked_ = rt::never;
    if (answer_ != window::open || ++answers_streak_ < misses_max) return rt::never;
    answers_soon_ = false;
    answers_streak_ = 0;
    return rt::never;
  }
  const bool affordable = left_ >= (reserve_of(priority::normal) + answer_max) * 100;
  if (answer_ == window::closed) answer_ = affordable ? window::open : window::skipped;
  if (left_ <= rt::duration{0}) answer_ = window::skipped;
  return answer_ == window::open ? now : rt::never;
}

// ---- waits

rt::time_point publish_predictor::wait_until(rt::time_point now, rt::duration poll_period) noexcept {
  pay(now);
  rt::time_point next = listened_ == 0 ? rt::never : now + rest_max;
  next = std::min(next, look_for_answer(now));
  for (const pair_index pair : used_.first(used_count_)) {
    row& of = rows_[pair];
    if (of.listened) next = std::min(next, look_at(of, now, now + poll_period));
  }
  spinning_ = next <= now;
  return next;
}

rt::time_point publish_predictor::look_at(row& of, rt::time_point now, rt::time_point poll) noexcept {
  if (of.planned && !of.fitted) fit(of);
  if (of.planned && now > of.closes) pass(of, now);
  if (!of.planned) return poll;
  if (now < of.opens) return of.overdue ? std::min(poll, of.opens) : of.opens;
  if (of.state == window::closed) of.state = affords(of, now) ? window::open : window::skipped;
  if (left_ <= rt::duration{0}) of.state = window::skipped;
  return of.state == window::open ? now : poll;
}

// The spin window has passed without a value: moves on to the next window that has not passed.
void publish_predictor::pass(row& of, rt::time_point now) noexcept {
  if (of.state == window::open) count_miss(of);
  const rt::duration passed = of.step * ((now - of.closes) / of.step + 1);
  of.opens += passed;
  of.late += passed;
  of.closes += passed;
  of.overdue = true;
  of.state = window::closed;
}

bool publish_predictor::affords(const row& of, rt::time_point now) const noexcept {
  return left_ >= (reserve_of(of.rank) + (of.late - now)) * 100;
}

void publish_predictor::pay(rt::time_point now) noexcept {
  const rt::duration since = paid_ == rt::time_point{} ? rt::duration{0} : now - paid_;
  paid_ = now;
  left_ += std::min(since, 100 * ahead_max) * share_percent;
  if (spinning_) {
    counts_.add(counter::phase_watched_ns, static_cast<std::uint64_t>(since.count()));
    left_ -= since * 100;
  }
  left_ = std::clamp(left_, rt::duration{0}, ahead_max * 100);
}

void publish_predictor::woke(rt::time_point asked, rt::time_point now) noexcept {
  if (now < asked) return; // by a socket
  wakings_[wakings_at_] = static_cast<std::int32_t>(std::min(now - asked, rt::duration{lead_max}).count());
  wakings_at_ = static_cast<std::uint8_t>((wakings_at_ + 1) % history);
  if (wakings_at_ % 8 != 0) return;
  extremes seen;
  for (const std::int32_t one : wakings_) seen.show(one);
  lead_ = rounded(seen.high[1]);
}

} // namespace rowe::service
