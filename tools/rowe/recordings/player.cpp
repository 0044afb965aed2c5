// SPDX-License-Identifier: Apache-2.0
#include "player.hpp"

#include <algorithm>
#include <chrono>

#include <rowe/rt/periodic.hpp>

#include "../interrupt.hpp"
#include "../status_line.hpp"
#include "../text/times.hpp"
#include "../verbs/delivery.hpp"
#include "../verbs/sending.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration look_at_keys_period = 20ms; // while nothing has been read ahead
constexpr rt::duration status_period = 200ms;
constexpr rt::duration report_period = 100ms;
constexpr rt::duration seek_step = 5s;
// What is written around a body: its operation and its topic.
constexpr std::uint64_t envelope_bytes = 256;
// Waiting for a key ends so long before a message is due: the rest is slept to the point.
constexpr rt::duration precise_time = 3ms;

} // namespace

player::player(ordered_topics& to, const play_plan& plan, const std::vector<recorded_topic>& recorded,
               read_ahead& from, remote& hub, keys& keyboard, const player_options& chosen,
               const console& says)
    : to_{to},
      plan_{plan},
      recorded_{recorded},
      from_{from},
      hub_{hub},
      keys_{keyboard},
      chosen_{chosen},
      says_{says},
      clock_{chosen.rate},
      shows_status_{!says.quiet() && status_line::is_possible()} {}

std::optional<exit_code> player::play() {
  clock_.set(chosen_.from_ns, rt::monotonic_clock::now());
  while (!figures_.was_quit) {
    if (interrupt::seen()) return exit_code::interrupted;
    const auto item = from_.take(look_at_keys_period);
    if (!item) {
      const next_step step = look_at_keys(rt::monotonic_clock::now());
      if (step == next_step::quit) break;
      show_status(false);
      continue;
    }
    switch (item->is) {
    case read_item::kind::message:
      if (const auto end = play_one(*item)) return end;
      break;
    case read_item::kind::fault:
      ++figures_.faults;
      says_.error(item->text);
      break;
    case read_item::kind::lap:
      ++figures_.laps;
      clock_.begin_lap(chosen_.from_ns, chosen_.from_ns + chosen_.lap_ns);
      break;
    case read_item::kind::end:
      if (!clock_.paused()) return std::nullopt;
      if (const next_step step = stay_at_end(); step != next_step::drop) return std::nullopt;
    }
  }
  return std::nullopt;
}

// Until somebody goes on, seeks (drop) or quits.
player::next_step player::stay_at_end() {
  for (;;) {
    const next_step step = wait_until_due(chosen_.to_ns);
    if (step != next_step::publish_now) return step;
  }
}

std::optional<exit_code> player::play_one(const read_item& item) {
  const auto to = plan_.to[item.topic];
  if (!to) return std::nullopt;
  // Before it is due, since it takes time.
  const auto json = plan_.decoders[item.topic](item.text);
  const next_step step = wait_until_due(item.time_ns);
  if (interrupt::seen()) return exit_code::interrupted;
  if (step == next_step::quit) figures_.was_quit = true;
  if (step == next_step::quit || step == next_step::drop) return std::nullopt;
  if (!json) {
    skip(figures_.no_object, item.topic, "its message is no JSON object");
    return std::nullopt;
  }
  const bool stepped = step == next_step::publish_now;
  const auto end = publish(*to, *json, clock_.due(item.time_ns), stepped);
  if (stepped) clock_.set(item.time_ns, rt::monotonic_clock::now());
  if (!end) return end;
  if (*end != exit_code::lost) return end;
  skip(figures_.too_long, item.topic,
       joined("its message of ", json->size(), " bytes is longer than the ", to_.longest(),
              server_takes_less_ ? " that the server takes"
                                 : " that can be sent (ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX raises that)"));
  return std::nullopt;
}

// Nothing: it is published. `lost`: it is too long.
std::optional<exit_code> player::publish(std::size_t topic, std::string_view json, rt::time_point due,
                                         bool stepped) {
  for (;;) {
    const status done = to_.publish(topic, json);
    const auto now = rt::monotonic_clock::now();
    if (done) {
      if (!stepped) lateness_.record(now - due);
      break;
    }
    if (done.code() == errc::too_big) return exit_code::lost;
    if (done.code() == errc::full) {
      interrupt::sleep_until(now + room_period);
    } else if (done.code() == errc::no_peer) {
      if (const auto end = hub_.wait(chosen_.timeout)) return end;
      hear_of_server();
      const rt::duration pause = rt::monotonic_clock::now() - now;
      clock_.shift(pause);
      due += pause;
    } else {
      says_.error("cannot publish on ", quoted(plan_.topics[topic].name), ": ", done.error().message());
      return exit_code::failed;
    }
    if (interrupt::seen()) return exit_code::interrupted;
  }
  ++figures_.published;
  if (json.size() > figures_.longest_sent) {
    figures_.longest_sent = json.size();
    figures_.longest_on = plan_.topics[topic].name;
  }
  return std::nullopt;
}

// Waits until what was recorded then is due, and does what keys say meanwhile.
player::next_step player::wait_until_due(std::int64_t time_ns) {
  for (;;) {
    const auto now = rt::monotonic_clock::now();
    if (now >= report_due_) {
      hear_of_server();
      report_due_ = now + report_period;
    }
    show_status(false);
    const rt::time_point due = clock_.paused() ? rt::never : clock_.due(time_ns);
    const bool is_due = now >= due;
    const rt::time_point next_look = std::min(due, now + status_period);
    const next_step step = look_at_keys(is_due ? now : next_look - precise_time);
    if (step != next_step::go_on || interrupt::seen()) return step;
    if (clock_.paused()) continue;
    if (is_due) return next_step::go_on;
    if (!keys_.readable() || rt::monotonic_clock::now() + 2 * precise_time >= next_look)
      interrupt::sleep_until(std::min(clock_.due(time_ns), next_look));
  }
}

player::next_step player::look_at_keys(rt::time_point until) {
  if (!keys_.readable()) {
    if (clock_.paused()) interrupt::sleep_until(until); // in the background; it can come back
    return next_step::go_on;
  }
  char letter = '\0';
  const key pressed = keys_.read(until, letter);
  const auto now = rt::monotonic_clock::now();
  if (pressed == key::none) return next_step::go_on;
  const bool other = pressed == key::other;
  next_step step = next_step::go_on;
  if (other && (letter == 'q' || letter == 'Q')) return next_step::quit;
  if (pressed == key::space) {
    if (clock_.paused())
      clock_.resume(now);
    else
      clock_.pause(now);
  } else if (clock_.paused() && ((other && letter == 's') || pressed == key::right)) {
    step = next_step::publish_now;
  } else if (pressed == key::right || (other && letter == ']')) {
    seek(seek_step);
    step = next_step::drop;
  } else if (pressed == key::left || (other && letter == '[')) {
    seek(-seek_step);
    step = next_step::drop;
  }
  show_status(true);
  return step;
}

// A server that gets a message that is too long ends the connection: so it does that once.
void player::hear_of_server() {
  hub_.report();
  if (hub_.errors_reported() == 0) return;
  const auto taken = bytes_taken_by_server(hub_.error_reported());
  if (!taken || *taken >= to_.longest()) return;
  to_.take_at_most(static_cast<std::uint32_t>(*taken - std::min<std::uint64_t>(*taken, envelope_bytes)));
  server_takes_less_ = true;
}

void player::seek(rt::duration by) {
  const auto now = rt::monotonic_clock::now();
  const std::int64_t to = std::clamp(clock_.position(now) + by.count(), chosen_.from_ns,
                                     std::max(chosen_.from_ns, chosen_.to_ns));
  clock_.set(to, now);
  from_.seek(to);
}

// The first one of a topic is named; the rest is counted.
void player::skip(std::map<std::size_t, std::uint64_t>& count, std::size_t topic, const std::string& why) {
  if (++count[topic] == 1) says_.error("skipped: ", printable(name_of(topic)), ": ", why);
}

void player::show_status(bool at_once) {
  if (!shows_status_) return;
  const auto now = rt::monotonic_clock::now();
  if (!at_once && now < status_due_) return;
  status_due_ = now + status_period;
  const std::int64_t position =
      std::clamp(clock_.position(now), chosen_.from_ns, std::max(chosen_.from_ns, chosen_.to_ns));
  status_line::show(joined(clock_text(rt::duration{position - chosen_.from_ns}, 1), " / ",
                           clock_text(rt::duration{chosen_.to_ns - chosen_.from_ns}, 1), "  x",
                           decimal_text(clock_.rate(), clock_.rate() == 1.0 ? 0 : 2),
                           clock_.paused() ? "  paused" : "", "  ", counted(figures_.published, "message"),
                           keys_.readable() ? "  (space pauses, q ends)" : ""));
}

} // namespace rowe::tools
