// SPDX-License-Identifier: Apache-2.0
// A hub that gives each message to many clients, whose frames the sender gathers. Most clients read; some
// stall, leave or never read at all. A group is seen from outside: no byte counts as written before all its
// members were written to.
#pragma once
#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "service/base/service_limits.hpp"
#include "service/outgoing/credit.hpp"

#include "flow.hpp"

namespace flow {

class groups final : public world {
 public:
  groups(std::uint64_t seed, swarm::coverage& seen, const std::set<std::string>& without, bool trace)
      : world{seed, options(seed), seen, without, trace} {
    for (std::size_t i = 0; i < topics_; ++i)
      publishers_.push_back({&publisher(name_of(i), text_bytes_max, i == 3)});
    on_.net.written = [this](connection_id to, std::span<const std::byte> bytes, std::size_t taken) {
      note_write(to, bytes, taken);
    };
    stalls_ = random_.one_in(2);
    gone_in_ = random_.one_in(2) ? 30 : 0;
    cycle(1ms);
  }

  void finish(std::uint64_t number) override {
    world::finish(number);
    on_.net.written = nullptr;
    for (int i = 0; i < 3 && !broken(); ++i) settle();
    for (client& one : clients_) one.link->leave();
    clients_.clear();
    for (int i = 0; i < 5; ++i) cycle(20ms);
    if (!broken() && on_.core.slots_in_use() != 0)
      fail("end", std::to_string(on_.core.slots_in_use()) + " slots are not free");
  }

 private:
  static constexpr std::size_t clients_max = 40;
  static constexpr std::size_t text_bytes_max = 3000;
  static constexpr std::size_t topics_max = 4;

  struct source {
    rowe::detail::queue_pair* pair;
    std::int64_t newest = 0;
  };
  struct client {
    std::unique_ptr<swarm::far_end> link;
    std::array<bool, topics_max> subscribes{};
    std::array<std::int64_t, topics_max> heard{};
    bool reads = true;
    bool deaf = false; // never reads
  };

  static rowe::endpoint_options options(std::uint64_t seed) {
    auto chosen = harness::small_options();
    auto& l = chosen.limits;
    l.connections_max = clients_max;
    l.subscriptions_max = 128;
    l.queued_max = 2048;
    swarm::seeded_choices chooses{seed ^ 0x1234567U};
    constexpr std::uint32_t slots[] = {256, 16, 8}; // few: others' partly written frames are waited for
    l.small_slots = chooses.one_of(slots);
    l.large_slots = chooses.one_in(2) ? 8 : 4;
    return chosen;
  }
  static std::string name_of(std::size_t topic) { return std::string{"/"} + static_cast<char>('a' + topic); }

  void act() override {
    switch (random_.below(10)) {
    case 0:
    case 1: connect(1 + random_.below(8)); break;
    case 2:
      if (client* const one = any(); one != nullptr && !one->deaf) leave(*one);
      break;
    case 3: change_conditions(); break;
    case 4:
      if (client* const one = any()) one->link->send(rowe::wire::opcode::ping, "?");
      break;
    case 5:
      if (random_.one_in(6)) settle();
      break;
    default:
      if (random_.one_in(4)) {
        for (std::size_t topic = 0; topic < topics_; ++topic) give(topic);
      } else {
        give(random_.below(topics_));
      }
    }
    constexpr duration waits[] = {10us, 100us, 1ms, 5ms};
    turn(random_.one_of(waits));
  }

  client* any() { return clients_.empty() ? nullptr : &clients_[random_.below(clients_.size())]; }
  client* find(connection_id id) {
    const auto at = std::ranges::find_if(clients_, [&](const client& one) { return one.link->id() == id; });
    return at == clients_.end() ? nullptr : &*at;
  }
  auto& conditions(client& of) { return on_.net.link_of(of.link->id()); }

  void connect(std::uint64_t count) {
    for (; count > 0 && clients_.size() + leaving_.size() < clients_max - 2; --count) {
      client fresh;
      fresh.link = std::make_unique<swarm::far_end>(on_);
      fresh.deaf = random_.one_in(12);
      fresh.reads = !fresh.deaf;
      if (fresh.deaf) conditions(fresh).capacity_bytes = 1 << 20;
      if (stalls_ && !fresh.deaf && random_.one_in(narrow_in_))
        conditions(fresh).capacity_bytes = 100 << random_.below(5);
      for (std::size_t i = 0; i < topics_; ++i) {
        if (!random_.one_in(topics_)) continue;
        fresh.subscribes[i] = true;
        fresh.link->say(R"({"op":"subscribe","topic":")" + name_of(i) + "\"}");
      }
      clients_.push_back(std::move(fresh));
    }
  }
  void leave(client& one) {
    one.link->leave(random_.one_in(2) ? rowe::service::close_cause::reset : rowe::service::close_cause::peer);
    leaving_.push_back(std::move(one.link));
    clients_.erase(clients_.begin() + (&one - clients_.data()));
  }

  void change_conditions() {
    client* const one = any();
    if (!stalls_ || one == nullptr || one->deaf) return;
    constexpr std::size_t rooms[] = {0, 1, 100, 1000, 5000, 1'000'000};
    auto& c = conditions(*one);
    c.capacity_bytes = random_.one_of(rooms);
    c.rest_bytes_max = random_.one_in(2) ? SIZE_MAX : 0;
    one->reads = random_.one_in(2);
  }

  // The text says how long it is, so that a part of another is seen.
  void give(std::size_t topic) {
    source& of = publishers_[topic];
    const std::size_t bytes = random_.one_in(large_in_) ? 1100 + random_.below(1500) : random_.below(700);
    const std::string text = "{\"n\":" + std::to_string(of.newest + 1) +
                             ",\"bytes\":" + std::to_string(bytes) + ",\"x\":\"" + std::string(bytes, 'x') +
                             "\"}";
    if (publish(*of.pair, text)) ++of.newest;
  }

  void turn(duration later) {
    run_ = 0;
    cycle(later);
    for (std::size_t i = 0; i < clients_.size() && !broken();) {
      client& one = clients_[i];
      if (one.reads) hear(one);
      look(one);
      if (one.link->cut()) {
        clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i));
      } else {
        ++i;
      }
    }
    std::erase_if(leaving_, [](const auto& one) { return one->cut(); });
  }

  void hear(client& one) {
    for (const std::string& text : one.link->hear()) {
      const auto topic = static_cast<std::size_t>(text.at(text.find("topic\":\"/") + 9) - 'a');
      const std::int64_t n = swarm::integer_after(text, "\"msg\":{\"n\":");
      const std::int64_t bytes = swarm::integer_after(text, "\"bytes\":");
      const std::size_t from = text.find('x', text.find("\"x\":\"") + 4);
      const auto all = from == std::string::npos ? 0 : text.find('"', from) - from;
      if (n < 1 || n > publishers_[topic].newest || static_cast<std::int64_t>(all) != bytes)
        return fail("whole", "a client was sent what nobody published: " + swarm::shortened(text));
      if (n <= one.heard[topic])
        return fail("order", "a client was sent message " + std::to_string(n) + " of " + name_of(topic) +
                                 " behind " + std::to_string(one.heard[topic]));
      one.heard[topic] = n;
    }
    if (!one.link->violated.empty()) fail("frames", "a client was sent " + one.link->violated);
  }
  void look(client& one) {
    using rowe::service::credit;
    const std::size_t waits = on_.net.sent(one.link->id()).size();
    // One that never read, and one frame is begun with one byte of credit.
    if (one.deaf && waits > credit::bytes_min + text_bytes_max + 200)
      fail("in_flight", "a client that never reads was sent " + std::to_string(waits) + " bytes");
  }

  // Everybody reads; then each gets the next message of what it subscribed to.
  void settle() {
    for (int i = 0; i < 40 && !broken(); ++i) {
      for (client& one : clients_) {
        if (one.deaf) continue;
        conditions(one) = {};
        one.reads = true;
      }
      turn(20ms);
    }
    for (std::size_t topic = 0; topic < topics_; ++topic) give(topic);
    const std::uint64_t lost = on_.count(counter::evicted) + on_.count(counter::no_slot);
    for (int i = 0; i < 6 && !broken(); ++i) turn(1ms);
    if (broken() || on_.count(counter::evicted) + on_.count(counter::no_slot) != lost) return;
    for (const client& one : clients_) {
      for (std::size_t topic = 0; topic < topics_; ++topic) {
        if (one.deaf || !one.subscribes[topic] || one.heard[topic] == publishers_[topic].newest) continue;
        return fail("reached", "a client that reads has message " + std::to_string(one.heard[topic]) +
                                   " of " + name_of(topic) + ", and " +
                                   std::to_string(publishers_[topic].newest) + " were published");
      }
    }
  }

  // After each write of a frame: is it another member of the same group? If the first one counts as written,
  // it is not.
  void note_write(connection_id to, std::span<const std::byte> bytes, std::size_t taken) {
    const std::uint64_t out = on_.count(counter::bytes_out);
    if (!is_one_text(bytes)) {
      run_ = 0;
      return;
    }
    if (run_ == 0 || out != out_at_first_) {
      run_ = taken != 0 ? 1 : 0;
      out_at_first_ = out;
      gone_ = {};
      if (gone_in_ != 0 && random_.one_in(gone_in_)) break_another(to);
      return;
    }
    ++run_;
    if (run_ == 2) seen_.add(flow_event::group_of_two);
    if (run_ == rowe::service::group_max) seen_.add(flow_event::group_full);
    if (taken == 0) seen_.add(flow_event::member_refused);
    if (taken != 0 && taken < bytes.size()) seen_.add(flow_event::member_partly);
    if (gone_ == to) seen_.add(flow_event::member_gone);
  }
  void break_another(connection_id than) {
    client* const one = any();
    if (one == nullptr || one->deaf || one->link->id() == than) return;
    gone_ = one->link->id();
    conditions(*one).capacity_bytes = random_.one_in(2) ? 0 : SIZE_MAX;
    one->link->leave(rowe::service::close_cause::reset);
    one->reads = false;
  }

  const std::uint64_t narrow_in_ = 1 + random_.below(3);     // one client in so many
  const std::uint64_t large_in_ = random_.one_in(2) ? 8 : 2; // one message in so many
  const std::size_t topics_ = 1 + random_.below(topics_max);
  std::vector<source> publishers_;
  std::vector<client> clients_;
  std::vector<std::unique_ptr<swarm::far_end>> leaving_;
  bool stalls_ = false;
  std::uint64_t gone_in_ = 0; // one in so many groups; 0: none
  // In this cycle.
  std::uint32_t run_ = 0; // writes of one group so far
  std::uint64_t out_at_first_ = 0;
  connection_id gone_{};
};

} // namespace flow
