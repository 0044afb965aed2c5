// SPDX-License-Identifier: Apache-2.0
// A world of direct messages and calls: queue pairs, responders, callers and ordinary threads on one side,
// peers of both codecs on the other, and between them a network that stalls, splits and disconnects. The core
// is a server, with or without relaying, or a client whose server goes away and comes back. After every step
// it checks, besides the core's own structures:
//
//   - a message is begun within its time to live and given to a peer once, in its sender's order; a sender
//     that waits for the outcome is told the true one, once
//   - a call is sent to one callee, once; its caller gets one completion: the first answer that the callee
//     gave under the call's id, and nobody else's; never a time-out before its time
//   - a peer is never answered what it did not ask, nor twice
//
// At the end of a run, when everyone has had time: everyone was told, the counters explain what was lost, and
// every slot is free.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "handles.hpp"
#include "ledger.hpp"
#include "messaging_peer.hpp"
#include "ordinary_threads.hpp"
#include "sim_base.hpp"

namespace sim {

using rowe::service::side;

class messaging_world : public sim_base {
 public:
  explicit messaging_world(std::uint64_t seed)
      : sim_base{seed, options(seed), role(seed)},
        context_{on_, random_, book_},
        role_{role(seed)},
        threads_{context_} {
    opens_all_ = one_in(2);
  }

  void step() {
    ++steps_;
    switch (below(20)) {
    case 0: connect(); break;
    case 1: disconnect(); break;
    case 2:
      if (!peers_.empty() && one_in(2)) sim_base::change_conditions(some_peer().link().id());
      break;
    case 3:
    case 4:
    case 5:
    case 6: say_something(); break;
    case 7:
    case 8:
    case 9: read(); break;
    case 10: open_or_close(); break;
    case 11:
    case 12: threads_.act(peers_); break;
    case 13:
    case 14:
    case 15:
    case 16:
    case 17:
    case 18:
      if (!actors_.empty()) actors_[below(actors_.size())]->act(peers_);
      break;
    default: wait(true); break;
    }
    cycle();
  }

  // Good link conditions; everyone reads, takes what has come and answers. Then the peers that have not
  // answered leave, one stays to which every message may be sent, and the handles close.
  void finish() {
    for (int i = 0; i < 30; ++i) quiesce(20ms);
    using rowe::service::counter;
    const std::uint64_t answers_lost =
        on_.count(counter::no_slot) + on_.count(counter::outbox_full) + on_.count(counter::too_big);
    for (const auto& one : peers_) {
      if (one->well_behaved && !one->link().cut() && one->overdue() > answers_lost)
        fail("a peer was not answered");
    }
    for (int round = 0; round < 2; ++round) { // a call that a peer does not answer ends with it
      while (!peers_.empty()) leave(0);
      open_peer();
      peers_.back()->link().say("{}");
      for (int i = 0; i < 10; ++i) quiesce(20ms);
    }
    while (!peers_.empty()) leave(0);
    for (int i = 0; i < 5; ++i) quiesce(20ms);
    for (const auto& one : actors_) {
      if (one->open_calls() != 0) fail("a handle was not told what became of something");
      if (!one->all_slots_free()) fail("a handle has not all its slots back");
      one->close();
    }
    actors_.clear();
    threads_.collect();
    while (!peers_.empty()) leave(0);
    for (int i = 0; i < 5; ++i) quiesce(20ms);
    if (on_.core.slots_in_use() != 0) fail("a slot is lost");
    if (!on_.core.drained()) fail("something waits for nobody");
    if (!on_.all_slots_free()) fail("a slot of the submission queue is lost");
    std::uint64_t explained = 0;
    for (const counter c : {counter::expired, counter::outbox_full, counter::no_slot, counter::lost_with_peer,
                            counter::malformed, counter::too_big})
      explained += on_.count(c);
    if (book_.messages_lost() > explained) fail("a message is lost and not counted");
    note_book();
  }

  const ledger& book() const { return book_; }

 private:
  static side role(std::uint64_t seed) { return seed % 3 == 0 ? side::client : side::server; }
  static rowe::endpoint_options options(std::uint64_t seed) {
    auto chosen = harness::small_options();
    random_source random{seed + 77};
    chosen.relay = random.one_in(2);
    chosen.answers_any = random.one_in(2);
    chosen.plain_unasked = random.one_in(4);
    if (random.one_in(3)) chosen.inbound_ttl = 200ms;
    auto& bounds = chosen.limits;
    if (random.one_in(3)) bounds.small_slots = 8;
    if (random.one_in(3)) bounds.large_slots = 1;
    if (random.one_in(3)) bounds.queue_depth_max = 4;
    if (random.one_in(4)) bounds.queued_max = 12;
    if (random.one_in(3)) bounds.calls_max = 6;
    if (random.one_in(4)) bounds.door_slots = 2;
    return chosen;
  }

  messaging_peer& some_peer() { return *peers_[below(peers_.size())]; }

  void cycle() {
    on_.core.cycle(on_.now);
    const std::uint64_t gone = on_.count(rowe::service::counter::peers_joined) - on_.shared.peers();
    if (std::exchange(gone_, gone) != gone) book_.last_departure = on_.now;
    for (const auto& one : peers_) one->note_writes();
    for (const auto& one : leaving_) one->note_writes(); // up to the end
    std::erase_if(leaving_, [this](const auto& one) { return on_.net.closed_by_us(one->link().id()); });
    note_book();
    mix(on_.core.slots_in_use());
  }
  void note_book() {
    if (!book_.wrong.empty()) fail(book_.wrong);
  }

  // ---- peers

  void open_peer() { peers_.push_back(std::make_unique<messaging_peer>(context_, role_)); }

  void connect() {
    if (peers_.size() + leaving_.size() >= (role_ == side::client ? 1 : 5)) return wait(true);
    open_peer();
    if (one_in(3)) sim_base::change_conditions(peers_.back()->link().id());
  }
  void leave(std::size_t which) {
    messaging_peer& gone = *peers_[which];
    on_.net.link_of(gone.link().id()) = {}; // else its last bytes might never arrive
    gone.link().leave(one_in(2) || role_ == side::client ? rowe::service::close_cause::reset
                                                         : rowe::service::close_cause::peer);
    leaving_.push_back(std::move(peers_[which]));
    peers_.erase(peers_.begin() + static_cast<std::ptrdiff_t>(which));
    cycle();
  }
  void disconnect() {
    if (peers_.empty() || !one_in(3)) return wait(true);
    leave(below(peers_.size()));
  }

  void read() {
    if (peers_.empty()) return wait(true);
    some_peer().read(one_in(2) ? SIZE_MAX : below(500));
  }

  void say_something() {
    if (peers_.empty()) return wait(true);
    messaging_peer& p = some_peer();
    constexpr const char* services[] = {"/add",   "/echo",       "add",     "/peer0",
                                        "/peer1", "/rowe/stats", "nobody's"};
    const std::string provided = "/peer" + std::to_string(below(3));
    switch (below(14)) {
    case 0:
    case 1: return p.link().say(R"({"u":)" + std::to_string(below(100)) + R"(,"ttl_ms":50})");
    case 2:
    case 3:
    case 4:
      return p.ask(services[below(std::size(services))], one_in(2),
                   one_in(2) ? duration{-1ms} : below(100) * 1ms);
    case 5: return p.link().say(R"({"op":"advertise_service","service":")" + provided + "\"}");
    case 6:
      if (!one_in(4)) return;
      return p.link().say(R"({"op":"unadvertise_service","service":")" + provided + "\"}");
    case 7:
    case 8:
    case 9:
    case 10: return answer(p);
    case 11: return p.link().send(rowe::wire::opcode::ping, "are you there");
    case 12: return p.link().say(one_in(2) ? R"({"in_reply_to":"1"})" : R"({"op":"nothing"})");
    default: return misbehave(p);
    }
  }
  void answer(messaging_peer& p) {
    if (p.asked().empty()) return p.read(SIZE_MAX);
    const std::size_t which = below(p.asked().size());
    using manner = messaging_peer::manner;
    switch (below(10)) {
    case 0: return p.answer(which, manner::refusing);
    case 1: return p.answer(which, manner::twice);
    case 2: return p.answer(which, manner::under_another_id);
    case 3: { // somebody else answers for it
      messaging_peer& other = some_peer();
      if (&other != &p) other.answer_for(p.asked()[which]);
      return;
    }
    case 4: p.asked().erase(p.asked().begin() + static_cast<std::ptrdiff_t>(which)); return; // never
    default: return p.answer(which, manner::well);
    }
  }
  void misbehave(messaging_peer& p) {
    if (!one_in(4)) return p.link().say("{\"op\":");
    p.well_behaved = false;
    switch (below(3)) {
    case 0: return p.link().send(rowe::wire::opcode::binary, "?");
    case 1: return p.link().send(rowe::wire::opcode::close, "");
    default: p.answers_pings = false; return;
    }
  }

  // ---- handles

  void open_or_close() {
    if (!actors_.empty() && one_in(4)) {
      const std::size_t which = below(actors_.size());
      actors_[which]->close();
      actors_.erase(actors_.begin() + static_cast<std::ptrdiff_t>(which));
      return;
    }
    if (actors_.size() >= 4 || !a_lane_is_free()) return wait(true);
    using rowe::json_text;
    std::unique_ptr<actor> made;
    switch (below(6)) {
    case 0:
    case 1:
      made = std::make_unique<lane_user>(context_, opens_all_ || one_in(2),
                                         static_cast<rowe::priority>(below(3)));
      break;
    case 2: made = std::make_unique<server<addends, sum>>(context_, "/add"); break;
    case 3: made = std::make_unique<server<json_text, json_text>>(context_, "/echo"); break;
    case 4: made = std::make_unique<client<addends, sum>>(context_, one_in(2) ? "/add" : "/peer0"); break;
    default:
      made = std::make_unique<client<json_text, json_text>>(context_, one_in(2) ? "/echo" : "/peer1");
      break;
    }
    cycle();
    if (made->active()) {
      actors_.push_back(std::move(made));
    } else {
      made->close(); // the service is provided already
    }
  }
  bool a_lane_is_free() {
    for (const auto& one : on_.pairs) {
      if (one.lifecycle.is_free()) return true;
    }
    return false;
  }

  // ---- the end

  void quiesce(duration later) {
    for (const auto& one : peers_) {
      on_.net.link_of(one->link().id()) = {};
      one->read(SIZE_MAX);
    }
    for (const auto& one : actors_) one->finish_up();
    threads_.finish_up();
    on_.now += later;
    cycle();
  }

  ledger book_;
  world_context context_;
  side role_;
  bool opens_all_ = false;
  std::vector<std::unique_ptr<messaging_peer>> peers_;
  std::vector<std::unique_ptr<messaging_peer>> leaving_; // some of what they said is still to be read
  std::vector<std::unique_ptr<actor>> actors_;
  ordinary_threads threads_;
  std::uint64_t gone_ = 0; // peers that were there
};

} // namespace sim
