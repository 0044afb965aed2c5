// SPDX-License-Identifier: Apache-2.0
// Messages that are longer than message_bytes_max, in a small pool of chunks. Honest peers and a handle
// publish short ones and long ones, in one frame or in many, and others read them, fast or slowly. Hostile
// peers send long messages that are wrong or never end. Beside them two peers have a stream of short messages
// at 100 Hz, and somebody stops the loop now and then. What an honest subscriber gets is what was published;
// what it does not get is counted, and told where its sender can be told.
#pragma once
#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <rowe/stop_latch.hpp>

#include "flow_long_calls.hpp"
#include "flow_long_hostile.hpp"
#include "flow_long_traffic.hpp"

namespace flow {

class long_messages final : public long_traffic {
 public:
  long_messages(std::uint64_t seed, swarm::coverage& seen, const std::set<std::string>& without, bool trace)
      : long_traffic{seed, seen, without, trace},
        pose_to_{on_, tongue::slashed, local},
        pose_from_{on_, tongue::slashed, local},
        calls_{on_, random_, seen} {
    on_.offer(rowe::detail::latch_request({.name = "loop", .loop_timeout = 10s})); // so there is a stop
    pose_to_.says.add(opcode::text, R"({"op":"subscribe","topic":"/pose"})");
    for (std::uint64_t i = 1 + random_.below(3); i != 0; --i) add_sender();
    for (int i = 0; i < 5; ++i) turn(1ms); // a topic whose type is said later gets another number
    add_reader(true);                      // who reads all at once
    const std::uint64_t others = 1 + random_.below(4);
    for (std::uint64_t i = 0; i < others; ++i) add_reader(strict_ || random_.one_in(3));
    settle();
  }

  void finish(std::uint64_t number) override {
    world::finish(number);
    settle();
    for (int i = 0; i < 160 && !broken() && !calls_.open().empty(); ++i) turn(50ms);
    if (broken()) return;
    if (const std::string open = calls_.open(); !open.empty()) return fail("answered", open);
    leave_all();
    calls_.leave_all();
    for (const auto& one : hostile_) one->link.peer.leave();
    pose_from_.peer.leave();
    pose_to_.peer.leave();
    for (int i = 0; i < 20; ++i) cycle(20ms);
    if (on_.core.slots_in_use() != 0 || on_.core.chunks_in_use() != 0)
      fail("end", std::to_string(on_.core.slots_in_use()) + " slots and " +
                      std::to_string(on_.core.chunks_in_use()) + " chunks are not free");
  }

 private:
  static constexpr std::size_t hostile_max = 4;
  static constexpr std::uint64_t pose_cycles_max = 40;
  static constexpr std::uint64_t stop_cycles_max = 8;
  static constexpr duration starved_max = 1200ms;

  // ---- a step

  void act() override {
    switch (random_.below(28)) {
    case 0:
    case 1:
    case 2:
      if (hostile_.size() < hostile_max) add_hostile();
      break;
    case 3:
      for (std::uint64_t i = random_.below(hostile_max); i != 0 && hostile_.size() < hostile_max; --i)
        add_hostile(mischief::endless);
      break;
    case 4:
      if (!hostile_.empty()) leave(random_.below(hostile_.size()));
      break;
    case 5: change_reader(); break;
    case 6:
      if (!stopper_) say_stop();
      break;
    case 7:
      if (random_.one_in(4)) settle();
      break;
    case 8:
      if (random_.one_in(10)) besiege();
      if (random_.one_in(10)) starve();
      break;
    case 9:
      if (handle_says_ != nullptr) say_by_handle();
      break;
    case 10:
    case 11:
    case 12: calls_.call(!strict_); break;
    case 13:
      if (random_.one_in(6)) calls_.leave();
      break;
    default:
      if (sender* const one = any_sender(); one->link->says.left() == 0)
        say_message(*one, random_.below(own), some_bytes());
    }
    constexpr duration waits[] = {100us, 1ms, 1ms, 3ms, 20ms};
    const duration each = random_.one_of(waits);
    for (std::uint64_t i = 1 + random_.below(6); i != 0 && !broken(); --i) turn(each);
  }
  sender* any_sender() { return &senders_[random_.below(senders_.size())]; }

  void turn(duration later) {
    say_some();
    for (const auto& one : hostile_) one->link.says.feed(on_, one->link.id(), one->pace);
    calls_.say();
    say_pose();
    for (long_link* one : {&pose_from_, &pose_to_}) one->says.feed(on_, one->id(), SIZE_MAX);
    const std::uint64_t evicted = on_.count(counter::evicted);
    cycle(later);
    if (on_.count(counter::evicted) != evicted) seen_.add(flow_event::long_evicted);
    hear_pose();
    hear_some();
    if (const std::string wrong = calls_.hear(); !wrong.empty()) fail("answered", wrong);
    for (std::size_t i = 0; i < hostile_.size() && !broken();) hear_hostile(i) ? (void)++i : forget(i);
    check_stop();
  }

  // ---- who means harm

  void add_hostile(std::optional<mischief> what = {}, bool mute = false) {
    const auto kind = what.value_or(static_cast<mischief>(random_.below(mischiefs)));
    hostile_.push_back(
        std::make_unique<long_hostile>(on_, kind, mute || (!strict_ && random_.one_in(2)), random_));
    say("hostile " + std::to_string(static_cast<int>(kind)) + " comes");
    seen_.add(static_cast<flow_event>(static_cast<std::uint64_t>(flow_event::long_endless) +
                                      static_cast<std::uint64_t>(kind)));
  }
  void leave(std::size_t which) {
    hostile_[which]->link.peer.leave(random_.one_in(2) ? rowe::service::close_cause::reset
                                                       : rowe::service::close_cause::peer);
    forget(which);
  }
  // What it may have been told is not known.
  void forget(std::size_t which) {
    ++untold_;
    gone_announced_ += hostile_[which]->link.lost_own;
    hostile_.erase(hostile_.begin() + static_cast<std::ptrdiff_t>(which));
  }
  // False: it is gone.
  bool hear_hostile(std::size_t which) {
    long_hostile& one = *hostile_[which];
    const std::uint64_t full = one.link.lost_own;
    for (const std::string& text :
         one.link.hear(one.is_mute && !one.link.peer.cut() ? one.reads : SIZE_MAX, seen_)) {
      if (!long_link::is_message(text)) one.told = text;
    }
    check_link(one.link, "a hostile peer");
    if (one.link.lost_own != full) one.told = "full";
    if (one.kind == mischief::leaves && one.link.says.left() == 0 && random_.one_in(20)) {
      one.link.peer.leave();
      return false;
    }
    const bool cut = one.link.peer.cut();
    if (!one.judged && !one.is_mute && one.ends() && (cut || (one.link.all_read() && --one.judged_in == 0)))
      judge(one, cut);
    return !cut || !on_.net.sent(one.link.id()).empty();
  }
  void judge(long_hostile& one, bool cut) {
    one.judged = true;
    const std::string kind = "hostile " + std::to_string(static_cast<int>(one.kind));
    if (one.closed_with() != 0 || cut) {
      if (one.link.peer.close_code != one.closed_with() && !(one.told == "full" && cut))
        fail("judged", kind + " was closed with " + std::to_string(one.link.peer.close_code) + ": " +
                           one.link.peer.close_reason);
      return;
    }
    if (one.kind == mischief::stop && on_.count(counter::stops) == one.stops_before)
      return fail("stop", "a long stop was not carried out");
    if (one.told == "full") return;
    if (one.told.find(one.answer()) == std::string::npos ||
        (one.answer().empty() && !one.told.empty() && one.kind == mischief::envelope))
      fail("judged", kind + " was told " + swarm::shortened(one.told));
  }

  // Endless messages take the room for what is received. Somebody who has used none has it nevertheless, when
  // they had theirs for a while. Once: later, who comes may get the place of one of them, and its use.
  void besiege() {
    if (std::exchange(besieged_, true)) return;
    settle();
    while (!hostile_.empty()) leave(hostile_.size() - 1);
    for (int i = 0; i < 3 && !broken(); ++i) turn(1ms);
    if (broken() || senders_.size() > 5) return;
    const std::uint32_t before = on_.core.chunks_in_use();
    for (std::size_t i = 0; i < 2 * hostile_max; ++i) {
      add_hostile(mischief::endless);
      hostile_.back()->pace = 1 << 20;
      turn(1ms);
    }
    for (int i = 0; i < 30 && !broken(); ++i) turn(25ms);
    if (broken() || on_.core.chunks_in_use() == before) return;
    say("the siege is on");
    add_sender();
    sender& fresh = senders_.back();
    fresh.pace = 1 << 20;
    // Its place may have been that of one who has used much, which is forgotten and outgrown in seconds.
    bool taken = false;
    for (int attempt = 0; attempt < 8 && !taken && !broken(); ++attempt) {
      const auto lost = fresh.link->lost_own;
      say_message(fresh, random_.below(own), some_bytes());
      for (int i = 0; i < 200 && !broken() && !fresh.link->all_read(); ++i) turn(1ms);
      for (int i = 0; i < 3 && !broken(); ++i) turn(1ms);
      taken = fresh.link->lost_own == lost;
      for (int i = 0; i < 20 && !taken && !broken(); ++i) turn(25ms);
    }
    if (!broken() && !taken)
      fail("floor_long", "endless messages have kept out those of a peer that has sent none before");
    if (is_long(published_.back())) seen_.add(flow_event::long_displaced);
    while (!hostile_.empty()) leave(hostile_.size() - 1);
  }

  // Somebody gets a long message, and reads nothing of it. Others want the place that it takes.
  void starve() {
    settle();
    while (!hostile_.empty()) leave(hostile_.size() - 1);
    let_all_read();
    for (int i = 0; i < 3 && !broken(); ++i) turn(1ms);
    if (broken()) return;
    add_hostile(mischief::endless, true);
    hostile_.back()->reads = 0;
    on_.net.link_of(hostile_.back()->link.id()).capacity_bytes = 1000;
    for (int i = 0; i < 5 && !broken(); ++i) turn(1ms);
    sender& by = *any_sender();
    by.pace = 1 << 20;
    const std::uint64_t stalled = on_.count(counter::stalled_peers);
    say_message(by, 0, 80'000);
    for (int i = 0; i < 100 && !broken() && !by.link->all_read(); ++i) turn(1ms);
    const time_point since = on_.now;
    say_message(by, 0, 20'000);
    const auto last = static_cast<std::uint32_t>(published_.size() - 1);
    for (int i = 0; i < 200 && !broken() && readers_[0].has[0].awaited.contains(last); ++i) turn(10ms);
    if (broken() || by.link->lost_own != 0) return;
    if (on_.now - since > starved_max)
      fail("floor_reading", "a long message has waited for one that is not read for " +
                                std::to_string((on_.now - since) / 1ms) + " ms");
    if (on_.count(counter::stalled_peers) != stalled) seen_.add(flow_event::long_stalled);
  }

  // ---- beside them

  void say_pose() {
    if (on_.now < pose_next_) return;
    pose_next_ = on_.now + 10ms;
    pose_from_.says.add(opcode::text, R"({"op":"publish","topic":"/pose","msg":{"n":)" +
                                          std::to_string(++pose_said_) + "}}");
    pose_said_in_.push_back(on_.count(counter::cycles));
  }
  void hear_pose() {
    (void)pose_from_.hear(SIZE_MAX, seen_);
    for (const std::string& text : pose_to_.hear(SIZE_MAX, seen_)) {
      if (swarm::integer_after(text, R"("msg":{"n":)") != static_cast<std::int64_t>(++pose_heard_))
        return fail("stream", "behind pose " + std::to_string(pose_heard_ - 1) + " came " + text);
    }
    if (pose_from_.peer.cut() || pose_to_.peer.cut()) fail("honest_cut", "who sends poses was disconnected");
    if (pose_heard_ < pose_said_ && on_.count(counter::cycles) - pose_said_in_[pose_heard_] > pose_cycles_max)
      fail("stream", "pose " + std::to_string(pose_heard_ + 1) + " has not come for " +
                         std::to_string(pose_cycles_max) + " cycles");
  }

  void say_stop() {
    stopper_ = std::make_unique<swarm::far_end>(on_, rowe::service::side::server, local,
                                                random_.one_in(2) ? "/stop" : "/");
    stopper_->say(R"({"op":"call_service","service":"/rowe/stop"})");
    stops_ = on_.count(counter::stops);
    stop_waits_ = 0;
  }
  void check_stop() {
    if (!stopper_) return;
    if (on_.count(counter::stops) != stops_) {
      stopper_->leave();
      return stopper_.reset();
    }
    if (++stop_waits_ > stop_cycles_max)
      fail("floor_stop", "a stop beside long messages was not carried out within " +
                             std::to_string(stop_waits_) + " cycles");
  }

  // ---- what was lost

  // Everybody says and reads all; then what is missing was counted.
  void settle() {
    for (sender& one : senders_) one.pace = 1 << 20;
    for (std::size_t i = 0; i < hostile_.size();) hostile_[i]->is_mute ? leave(i) : (void)++i; // others wait
    int quiet = 0;
    for (int i = 0; i < 1500 && quiet < 20 && !broken(); ++i) { // a handle's text is taken in 12 cycles
      let_all_read();
      calls_.hurry();
      turn(2ms);
      quiet = is_quiet() && calls_.is_quiet() ? quiet + 1 : 0;
    }
    if (broken()) return;
    std::uint64_t told = gone_announced_;
    std::uint64_t told_senders = 0;
    for (const sender& one : senders_) told_senders += one.link->lost_own;
    for (const auto& one : hostile_) told += one->link.lost_own;
    told += told_senders;
    untold_ += calls_.without_room() - calls_without_room_;
    const std::uint64_t dropped = on_.count(counter::no_chunks) - dropped_before_;
    if (told > dropped)
      fail("told", std::to_string(told) + " were told that a message was dropped, and " +
                       std::to_string(dropped) + " are counted");
    if (strict_ && told + untold_ < dropped)
      fail("told", std::to_string(dropped) + " messages were dropped, and only " + std::to_string(told) +
                       " were told");
    const std::uint64_t most = dropped - std::min(dropped, told) + lost() - lost_before_ + told_senders;
    for (const reader& one : readers_) check_missing(one, most);
    begin_account();
  }
  void begin_account() {
    dropped_before_ = on_.count(counter::no_chunks);
    lost_before_ = lost();
    calls_without_room_ = calls_.without_room();
    gone_announced_ = untold_ = 0;
    for (sender& one : senders_) one.link->lost_own = 0;
    for (const auto& one : hostile_) one->link.lost_own = 0;
    for (reader& one : readers_) {
      for (subscription& two : one.has) two.awaited.clear();
    }
    constexpr std::size_t paces[] = {1500, 8000, 40'000, 1 << 20};
    for (sender& one : senders_) one.pace = random_.one_of(paces);
    for (reader& one : readers_) set_pace(one);
  }

  std::vector<std::unique_ptr<long_hostile>> hostile_;
  bool besieged_ = false;
  long_link pose_to_, pose_from_;
  time_point pose_next_{};
  std::uint64_t pose_said_ = 0, pose_heard_ = 0;
  std::vector<std::uint64_t> pose_said_in_; // cycles
  long_callers calls_;
  std::uint64_t calls_without_room_ = 0; // before the last settlement
  std::unique_ptr<swarm::far_end> stopper_;
  std::uint64_t stops_ = 0;
  std::uint64_t stop_waits_ = 0; // cycles
  // Since the last settlement.
  std::uint64_t dropped_before_ = 0, lost_before_ = 0;
  std::uint64_t gone_announced_ = 0; // by those that are gone
  std::uint64_t untold_ = 0;         // at most so many more were told
};

} // namespace flow
