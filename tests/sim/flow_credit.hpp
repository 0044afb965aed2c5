// SPDX-License-Identifier: Apache-2.0
// One client that reads at some rate, behind some round trip, of a publisher that always has more. The rate
// and the round trip change, and the client's machine is busy with other things now and then, so that answers
// to single pings are late. What is in flight follows the rate, and so does the kernel's send buffer.
#pragma once
#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "service/outgoing/credit.hpp"

#include "flow.hpp"
#include "simulated_link.hpp"

namespace flow {

class credits final : public world {
 public:
  credits(std::uint64_t seed, swarm::coverage& seen, const std::set<std::string>& without, bool trace)
      : world{seed, options(), seen, without, trace},
        publisher_{publisher("/telemetry", text_bytes)},
        link_{on_, {.round_trip = 450us, .bytes_per_second = 4e6}} {
    constexpr std::uint64_t late_of_four[] = {0, 2, 4};
    late_of_four_ = random_.one_of(late_of_four);
    on_.net.written = [this](connection_id, std::span<const std::byte> bytes, std::size_t) {
      wrote_ping_ = !std::exchange(wrote_, true) && is_one_ping(bytes);
    };
    link_.peer().say(R"({"op":"subscribe","topic":"/telemetry"})");
    cycle(tick);
    change_link();
  }

 private:
  using credit = rowe::service::credit;
  using round_trip = rowe::service::round_trip;
  static constexpr duration tick = 100us;
  static constexpr std::int64_t ticks_min = 60; // of a step
  static constexpr std::size_t text_bytes = 3500;
  static constexpr std::size_t frame_bytes = text_bytes + 100;
  static constexpr std::uint64_t queued_min = 100; // messages
  static constexpr duration jitter_max = 300us;
  static constexpr duration late_min = 2500us;
  static constexpr duration late_max = 12ms;
  // Answers to pings after a change, until the bound has followed it, and until it has grown.
  static constexpr std::uint64_t pings_until_calm = 6;
  static constexpr std::uint64_t pings_until_fast = 24;

  static rowe::endpoint_options options() {
    auto chosen = harness::small_options();
    chosen.limits.small_slots = 256;
    chosen.limits.small_slot_bytes = 4096;
    chosen.limits.queue_depth_max = 128;
    return chosen;
  }
  static double seconds(duration time) { return std::chrono::duration<double>(time).count(); }

  void act() override {
    const std::uint64_t what = random_.below(12);
    if (what == 0 || (what == 1 && !stays_near_)) change_link();
    if (what == 2) be_idle();
    if (broken()) return;
    const std::uint64_t read = link_.bytes_read();
    most_ = 0;
    ++steps_with_buffer_;
    bool measured = measuring();
    const auto ticks = std::max(ticks_min, 4 * (way() / tick));
    for (auto left = ticks; left > 0 && !broken(); --left) {
      turn(true);
      measured = measured || measuring();
    }
    check_structures(); // in each cycle it would take most of the time
    if (broken() || measured || !calm()) return;
    check_bound();
    const double possible = std::min(link_.is().bytes_per_second, 0.4 * most_of_bound() / seconds(way()));
    const double got =
        static_cast<double>(link_.bytes_read() - read) / (static_cast<double>(ticks) * seconds(tick));
    const std::uint64_t grew_from = std::max(pings_at_change_, pings_at_measurement_);
    if (link_.pings() - grew_from < pings_until_fast || !way_known_) return;
    usual_ = most_;
    if (got < 0.5 * possible)
      fail("busy", "a client that could read " + std::to_string(possible) + " bytes a second got " +
                       std::to_string(got));
  }

  bool low() const { return buffer_ != 0; }
  // A round trip as it is seen here.
  duration way() { return link_.is().round_trip + 3 * tick + jitter_max; }
  double most_of_bound() const {
    return static_cast<double>(low() ? credit::bytes_max_low_rtt : credit::bytes_max);
  }
  std::uint64_t pings_since_change() const { return link_.pings() - pings_at_change_; }
  bool calm() const {
    return pings_since_change() >= pings_until_calm && link_.bytes_read() >= out_at_change_;
  }
  // The peer is sent pings alone.
  bool measuring() const { return pings_alone_ > 1; }

  void change_link() {
    auto& is = link_.is();
    if (!stays_near_ && random_.one_in(4)) is_far_ = !is_far_;
    const duration before = is.round_trip;
    is.round_trip = is_far_ ? 4ms + some_of(12ms) : 50us + 100 * some_of(11us);
    way_known_ = way_known_ && is.round_trip <= before;
    longest_way_ = std::max(longest_way_, way());
    const double slowest = is_far_ ? 100e3 : stays_near_ ? 10e6 : 500e3;
    is.bytes_per_second =
        slowest * std::pow(stays_near_ ? 4 : 80, static_cast<double>(random_.below(1000)) / 1000);
    say("a round trip of " + std::to_string(is.round_trip / 1us) + " us, " +
        std::to_string(is.bytes_per_second) + " bytes a second");
    pings_at_change_ = link_.pings();
    out_at_change_ = on_.count(counter::bytes_out);
    jitters_from_ = on_.now + 30ms;
    usual_ = 0;
  }

  // Nothing is published for so long that the shortest round trip is to be measured anew, where messages were
  // held back before and each round trip was a little longer.
  void be_idle() {
    bool idle = false;
    for (int left = 40'000; left > 0 && !idle && !broken(); --left) {
      turn(false);
      idle = on_.core.drained() && link_.bytes_read() == on_.count(counter::bytes_out);
    }
    if (!idle) return;
    wait_for_answers();
    const int hops = random_.one_in(3) ? 1 : 5;
    say("idle for " + std::to_string(hops * 2500) + " ms");
    for (int hop = 0; hop < hops; ++hop) {
      on_.now += 2500ms;
      wait_for_answers();
    }
    pings_at_change_ = link_.pings();
  }
  void wait_for_answers() {
    for (auto left = (way() + late_max) / tick; left > 0 && !broken(); --left) {
      turn(false);
      if (wrote_) left = (way() + late_max) / tick;
    }
  }

  void turn(bool publishes) {
    // More waits than may be in flight.
    for (; publishes && published_ < on_.count(counter::messages_out) + queued_min; ++published_) {
      if (!publish(publisher_, text_)) break;
    }
    const duration jitter = on_.now < jitters_from_ ? duration{0} : jitter_max / 2;
    link_.is().late = measuring() ? lone_late_ : jitter + some_of(100us);
    const std::size_t unread = on_.net.unread(link_.peer().id());
    const bool all_read = link_.bytes_read() == on_.count(counter::bytes_out);
    wrote_ = wrote_ping_ = false;
    on_.cycle(tick);
    const std::uint64_t in_flight = on_.count(counter::bytes_out) - link_.bytes_read();
    most_ = std::max(most_, in_flight);
    note_buffer();
    note_pings(on_.net.unread(link_.peer().id()) < unread, all_read);
    if (measuring()) link_.is().late = lone_late_; // of the one that was just written
    if (publishes && looks_for_ != 0) look_behind_measurement(in_flight);
    link_.advance();
    if (link_.broken()) fail("frames", "the client was sent what is no frame");
  }

  // ---- the kernel's send buffer

  void note_buffer() {
    const std::size_t now = on_.net.send_buffer(link_.peer().id());
    if (now == buffer_) return;
    say("send buffer of " + std::to_string(now) + " bytes");
    if (buffer_ != 0 && now > buffer_) seen_.add(flow_event::buffer_grown);
    if (now != 0 && now < buffer_) seen_.add(flow_event::buffer_shrunk);
    if (now == 0) seen_.add(flow_event::buffer_given_back);
    if (now != 0 && (now < credit::send_buffer_min || !std::has_single_bit(now)))
      fail("send_buffer", "a send buffer of " + std::to_string(now) + " bytes");
    buffer_ = now;
    steps_with_buffer_ = 0;
  }

  void check_bound() {
    const duration waits = low() ? credit::queue_time_low_rtt : credit::queue_time_high_rtt;
    const duration trip = low() ? longest_way_ : std::max(longest_way_, late_max + way());
    const double least = static_cast<double>(low() ? credit::bytes_min_low_rtt : credit::bytes_min);
    // It may have grown once more than the client can use.
    const double bound =
        std::min(1.6 * std::max(1.3 * link_.is().bytes_per_second * seconds(2 * trip + waits), least),
                 most_of_bound());
    if (static_cast<double>(most_) > bound + frame_bytes)
      fail("in_flight", std::to_string(most_) + " bytes are in flight to a client that reads " +
                            std::to_string(link_.is().bytes_per_second) + " a second, behind " +
                            std::to_string(trip / 1us) + " us");
    if (!low() || steps_with_buffer_ < 3) return;
    if (most_ > buffer_ + frame_bytes)
      fail("send_buffer", std::to_string(most_) + " bytes are in flight, and the send buffer has " +
                              std::to_string(buffer_));
    if (buffer_ > credit::send_buffer_min && buffer_ > 8 * most_)
      fail("send_buffer", "only " + std::to_string(most_) + " bytes are in flight, and the send buffer has " +
                              std::to_string(buffer_));
  }

  // ---- the round trip

  // A ping that is written alone when an answer comes lies behind all that is in flight. Those after it,
  // again when the answer comes, and with nothing in between, measure the round trip.
  void note_pings(bool answered, bool all_read) {
    if (!answered && !wrote_) return;
    if (answered && measuring()) took_.push_back(on_.now - asked_at_);
    if (!answered || !wrote_ping_ || (pings_alone_ != 0 && !all_read)) {
      pings_alone_ = 0;
      if (!took_.empty()) check_measurement();
      return;
    }
    if (++pings_alone_ == 1) return;
    if (pings_alone_ == 2) was_low_ = low();
    asked_at_ = on_.now;
    seen_.add(flow_event::lone_ping);
    lone_late_ = random_.below(4) < late_of_four_ ? late_min + some_of(9ms) : duration{0};
  }

  void check_measurement() {
    const duration shortest = *std::ranges::min_element(took_);
    const bool late = shortest >= round_trip::low_below;
    say(std::to_string(took_.size()) + " lone pings, the shortest took " + std::to_string(shortest / 1us) +
        " us");
    const bool asked_again = late && (was_low_ || shortest < round_trip::little_late_below);
    if (low() == late || (asked_again && took_.size() != round_trip::lone_pings_max))
      fail("round_trip",
           "after " + std::to_string(took_.size()) + " lone pings, of which the shortest was answered in " +
               std::to_string(shortest / 1us) + " us, the client counts as " + (low() ? "near" : "far"));
    if (was_low_ && !late && took_.size() > 1) seen_.add(flow_event::second_lone_ping);
    if (!was_low_ && took_.size() > 1) seen_.add(flow_event::lone_pings_not_low);
    if (was_low_ && late && !is_far_) seen_.add(flow_event::late_lone_pings);
    took_.clear();
    looks_for_ = usual_ != 0 && way_known_ ? way() / tick : 0;
    most_behind_ = 0;
    way_known_ = true;
    pings_at_measurement_ = link_.pings();
    longest_way_ = way();
  }
  // A lone ping says nothing about the client's rate.
  void look_behind_measurement(std::uint64_t in_flight) {
    most_behind_ = std::max(most_behind_, in_flight);
    if (--looks_for_ != 0) return;
    if (most_behind_ + frame_bytes < usual_ / 3)
      fail("in_flight", "behind a lone ping only " + std::to_string(most_behind_) +
                            " bytes are in flight, and before it " + std::to_string(usual_));
  }

  const std::string text_ = R"({"x":")" + std::string(text_bytes - 8, 'x') + "\"}";
  rowe::detail::queue_pair& publisher_;
  sim::simulated_link link_;
  std::uint64_t late_of_four_ = 0; // so many lone pings are answered late
  std::uint64_t published_ = 0;
  const bool stays_near_ = random_.one_in(2); // and reads fast
  bool is_far_ = false;
  std::uint64_t pings_at_change_ = 0, pings_at_measurement_ = 0;
  std::uint64_t out_at_change_ = 0;
  time_point jitters_from_{};
  std::size_t buffer_ = 0;
  unsigned steps_with_buffer_ = 0;
  std::uint64_t most_ = 0;     // in flight, of this step
  std::uint64_t usual_ = 0;    // of the last calm one
  duration longest_way_{};     // since the round trip was measured
  bool way_known_ = true;      // it has not become longer since then
  bool wrote_ = false;         // in this cycle,
  bool wrote_ping_ = false;    // and that was a ping alone
  unsigned pings_alone_ = 0;   // one after the other
  std::vector<duration> took_; // the lone ones among them
  bool was_low_ = false;       // before these
  time_point asked_at_{};      // the last of them
  duration lone_late_{};       // how late that is answered
  std::int64_t looks_for_ = 0; // so many cycles after that, in which something is published
  std::uint64_t most_behind_ = 0;
};

} // namespace flow
