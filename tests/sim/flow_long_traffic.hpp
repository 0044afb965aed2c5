// SPDX-License-Identifier: Apache-2.0
// Who publishes and reads in the world of long messages (flow_long.hpp): peers in three tongues, a handle
// that publishes and one that takes. Each message is known by its number, so it is seen whether it came as it
// was said, in its publisher's order, and what has not come.
#pragma once
#include <array>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "flow_long_peers.hpp"

namespace flow {

class long_traffic : public world {
 protected:
  static constexpr std::string_view topics[] = {"/map", "/grid", "/own"}; // the second is latched
  static constexpr std::size_t own = 2;                                   // the handle's
  static constexpr std::string_view local = "127.0.0.1:50000";

  struct publication {
    std::size_t topic = 0;
    std::uint32_t by = 0; // 0: the handle
    std::string body{};
  };
  struct sender {
    std::unique_ptr<long_link> link;
    std::uint32_t number = 0;
    std::size_t pace = 0;
  };
  struct subscription {
    bool asked = false;
    bool holds = false;
    bool repeated = false;                          // the first of a latched topic may come twice
    std::set<std::uint32_t> awaited{};              // was published and not heard
    std::map<std::uint32_t, std::uint32_t> heard{}; // the last of each publisher
  };
  struct reader {
    std::unique_ptr<long_link> link;
    std::array<bool, std::size(topics)> wants{};
    std::array<subscription, std::size(topics)> has{};
    bool quick = false;
    std::size_t pace = 0;
    std::size_t fragment_size = 0; // that it asks for
  };

  long_traffic(std::uint64_t seed, swarm::coverage& seen, const std::set<std::string>& without, bool trace)
      : world{seed, options(seed), seen, without, trace, &numbers::protocols()}, strict_{random_.one_in(2)} {
    handle_takes_ = &on_.offer(rowe::detail::pair_kind::subscribe_text, topics[0], longest(), {.depth = 2});
    if (!strict_) handle_says_ = &publisher(topics[own], longest(), random_.one_in(2));
  }

  static rowe::endpoint_options options(std::uint64_t seed) {
    auto chosen = harness::small_options();
    chosen.relay = true;
    auto& l = chosen.limits;
    l.connections_max = 32;
    l.messages_per_second_max = 0;
    l.refusals_per_second_max = 0;
    l.handle_bytes = 4 * 1024 * 1024;
    l.long_message_bytes_max = 96 * 1024;
    l.long_slots = static_cast<std::uint32_t>(4 + swarm::seeded_choices{seed ^ 0x1234567U}.below(3));
    return chosen;
  }
  std::size_t longest() const { return on_.options.limits.long_message_bytes_max; }

  // ---- what they do in a turn, before the cycle and behind it

  void say_some() {
    for (sender& one : senders_) one.link->says.feed(on_, one.link->id(), 1 + random_.below(one.pace));
    for (reader& one : readers_) one.link->says.feed(on_, one.link->id(), SIZE_MAX);
  }
  void hear_some() {
    for (sender& one : senders_) hear(one);
    for (std::size_t i = 0; i < readers_.size() && !broken();) {
      hear(readers_[i], readers_[i].quick ? SIZE_MAX : 1 + random_.below(readers_[i].pace));
      if (!readers_[i].link->peer.cut()) {
        ++i;
      } else if (readers_[i].quick) {
        fail("honest_cut", "who reads was disconnected: " + readers_[i].link->peer.close_reason);
      } else {
        readers_.erase(readers_.begin() + static_cast<std::ptrdiff_t>(i));
      }
    }
    take_by_handle();
  }
  void leave_all() {
    for (sender& one : senders_) one.link->peer.leave();
    for (reader& one : readers_) one.link->peer.leave();
    if (handle_says_ != nullptr) handle_says_->lifecycle.close();
    handle_takes_->lifecycle.close();
  }

  // ---- who publishes

  void add_sender() {
    sender fresh;
    fresh.number = static_cast<std::uint32_t>(senders_.size() + 1);
    const tongue how = random_.one_of(tongues);
    fresh.link = std::make_unique<long_link>(on_, how, local);
    constexpr std::size_t paces[] = {1500, 8000, 40'000, 1 << 20};
    fresh.pace = random_.one_of(paces);
    if (how == tongue::numbers) {
      fresh.link->says.add(opcode::text, R"({"offer":[[0,"/map"],[1,"/grid"]]})");
    } else {
      for (std::size_t i = 0; i < own; ++i)
        fresh.link->says.add(opcode::text, R"({"op":"advertise","topic":")" + named(how, topics[i]) +
                                               R"(","type":"sim/Long","latch":)" +
                                               (i == 1 ? "true}" : "false}"));
    }
    senders_.push_back(std::move(fresh));
  }

  std::size_t some_bytes() {
    switch (random_.below(4)) {
    case 0: return 40 + random_.below(800);
    case 1: return 7000 + random_.below(3000); // about message_bytes_max
    default: return 9000 + random_.below(longest() - 9200);
    }
  }
  // A new publication; whoever is subscribed to it waits for it.
  std::string new_body(std::size_t topic, std::uint32_t by, std::size_t bytes) {
    const auto n = static_cast<std::uint32_t>(published_.size());
    published_.push_back({topic, by, long_body(n, bytes, random_)});
    for (reader& one : readers_) {
      if (one.has[topic].holds) one.has[topic].awaited.insert(n);
    }
    return published_.back().body;
  }

  void say_message(sender& by, std::size_t topic, std::size_t bytes) {
    const std::string body = new_body(topic, by.number, bytes);
    say("sender " + std::to_string(by.number) + " publishes " + std::to_string(published_.size() - 1) +
        " on " + std::string{topics[topic]} + ", " + std::to_string(body.size()) + " bytes");
    if (by.link->speaks == tongue::numbers)
      by.link->says.add_message(opcode::binary, "p" + numbers::four(static_cast<std::uint32_t>(topic)) + body,
                                random_);
    else if (const std::string text = publish_text(named(by.link->speaks, topics[topic]), body);
             random_.one_in(3))
      by.link->says.add_in_fragments(text, random_);
    else
      by.link->says.add_message(opcode::text, text, random_);
  }
  void hear(sender& by) {
    for (const std::string& text : by.link->hear(SIZE_MAX, seen_)) {
      const bool not_kept = text.find("is not retained for late subscribers") != std::string::npos;
      if (not_kept && on_.count(counter::not_latched) != 0) {
        seen_.add(flow_event::not_kept_told);
        continue;
      }
      fail("honest_refused", "a sender of long messages is told " + swarm::shortened(text));
    }
    check_link(*by.link, "a sender of long messages");
    if (by.link->peer.cut())
      fail("honest_cut", "a sender of long messages was disconnected: " + by.link->peer.close_reason);
  }
  void check_link(const long_link& link, const std::string& who) {
    if (!link.peer.violated.empty()) fail("frames", who + " was sent " + link.peer.violated);
    if (!link.whole.wrong.empty())
      fail("fragments", who + " was sent: " + swarm::shortened(link.whole.wrong));
  }

  void say_by_handle() {
    const std::string body = new_body(own, 0, some_bytes());
    if (publish(*handle_says_, body)) {
      say("the handle publishes " + std::to_string(published_.size() - 1) + ", " +
          std::to_string(body.size()) + " bytes");
      return;
    }
    for (reader& one : readers_) // its queue is full
      one.has[own].awaited.erase(static_cast<std::uint32_t>(published_.size() - 1));
  }

  // ---- who reads

  void add_reader(bool quick) {
    reader fresh;
    fresh.quick = quick;
    fresh.link = std::make_unique<long_link>(on_, random_.one_of(tongues), local);
    for (bool& one : fresh.wants) one = readers_.empty() || random_.one_in(2);
    set_pace(fresh);
    constexpr std::size_t sizes[] = {0, 0, 0, 256, 1000, 8195, 30'000, 2'147'483'647};
    fresh.fragment_size = random_.one_of(sizes);
    readers_.push_back(std::move(fresh));
  }
  void set_pace(reader& of) {
    constexpr std::size_t paces[] = {50, 1000, 10'000, 100'000};
    constexpr std::size_t rooms[] = {200, 5000, 50'000, 256 * 1024};
    of.pace = random_.one_of(paces);
    if (!of.quick) on_.net.link_of(of.link->id()).capacity_bytes = random_.one_of(rooms);
  }
  void let_all_read() {
    for (reader& one : readers_) {
      on_.net.link_of(one.link->id()) = {};
      one.pace = 1 << 20;
    }
  }
  void change_reader() {
    const std::size_t which = random_.below(readers_.size());
    if (random_.one_in(2)) return set_pace(readers_[which]);
    if (which != 0 && random_.one_in(2)) {
      readers_[which].link->peer.leave(random_.one_in(2) ? rowe::service::close_cause::reset
                                                         : rowe::service::close_cause::peer);
      readers_.erase(readers_.begin() + static_cast<std::ptrdiff_t>(which));
    } else if (readers_.size() < 6) {
      add_reader(strict_ || random_.one_in(3));
    }
  }

  void subscribe(reader& of) {
    for (std::size_t i = 0; i < std::size(topics); ++i) {
      subscription& one = of.has[i];
      if (!of.wants[i] || one.holds) continue;
      if (one.asked) {
        one.holds = of.link->all_read();
        continue;
      }
      if (of.link->speaks != tongue::numbers) {
        std::string text = R"({"op":"subscribe","topic":")" + named(of.link->speaks, topics[i]) + '"';
        if (of.fragment_size != 0) text += R"(,"fragment_size":)" + std::to_string(of.fragment_size);
        of.link->says.add(opcode::text, text + "}");
      } else {
        const std::uint32_t number = of.link->knows.topics.number_of(topics[i]);
        if (number == rowe::wire::no_number) continue;
        of.link->says.add(opcode::text,
                          "{\"want\":[[" + std::to_string(i) + "," + std::to_string(number) + "]]}");
      }
      one.asked = true;
    }
  }
  void hear(reader& of, std::size_t most) {
    for (const std::string& text : of.link->hear(most, seen_)) {
      if (!long_link::is_message(text))
        fail("honest_refused", "a reader is told " + swarm::shortened(text));
      else
        hear_message(of, text);
    }
    check_link(*of.link, "a reader of long messages");
    subscribe(of);
  }
  void hear_message(reader& of, std::string_view text) {
    const publication* const what = find(text);
    if (what == nullptr) return;
    const auto n = static_cast<std::uint32_t>(what - published_.data());
    const std::string_view topic = topics[what->topic];
    const bool is_right = of.link->speaks == tongue::numbers
                              ? text.size() == what->body.size() + 13 && text.ends_with(what->body) &&
                                    numbers::number_at(text.substr(1)) == what->topic
                              : text == publish_text(named(of.link->speaks, topic), what->body);
    if (!is_right) return fail("whole", "a reader was sent " + swarm::shortened(text));
    subscription& has = of.has[what->topic];
    std::uint32_t& last = has.heard[what->by];
    // A value that comes before the latched one was written is that one, too.
    const bool again = n == last && what->topic != 0 && !std::exchange(has.repeated, true);
    if (n <= last && !again)
      return fail("order", "a reader was sent message " + std::to_string(n) + " of " + std::string{topic} +
                               " behind " + std::to_string(last));
    last = n;
    if (has.awaited.erase(n) == 0 && what->topic == 1 && is_long(*what))
      seen_.add(flow_event::long_latched_read);
  }
  bool is_long(const publication& one) const {
    return one.body.size() > on_.options.limits.message_bytes_max;
  }
  // None: nobody published such a text.
  const publication* find(std::string_view text) {
    const std::int64_t n = swarm::integer_after(text, R"({"n":)");
    if (n >= 1 && n < static_cast<std::int64_t>(published_.size()))
      return &published_[static_cast<std::size_t>(n)];
    fail("whole", "was sent what nobody published: " + swarm::shortened(text));
    return nullptr;
  }

  void take_by_handle() {
    const auto slot = random_.one_in(2) ? handle_takes_->user.in.ring->try_pop() : std::nullopt;
    if (!slot) return;
    const std::string_view text{reinterpret_cast<const char*>(handle_takes_->user.in.memory.value(*slot)),
                                handle_takes_->user.in.memory.header(*slot)->bytes};
    if (const publication* const what = find(text)) {
      const auto n = static_cast<std::uint32_t>(what - published_.data());
      if (text != what->body) fail("whole", "a handle was given " + swarm::shortened(text));
      if (n <= handle_heard_[what->by])
        fail("order", "a handle was given " + std::to_string(n) + " too late");
      handle_heard_[what->by] = n;
      if (is_long(*what)) seen_.add(flow_event::long_to_handle);
    }
    handle_takes_->user.in.free_ring->release(*slot);
  }

  // ---- what was lost

  std::uint64_t lost() const {
    std::uint64_t sum = 0;
    for (const counter one : {counter::evicted, counter::expired, counter::no_slot, counter::outbox_full})
      sum += on_.count(one);
    return sum;
  }
  bool is_quiet() {
    for (const sender& one : senders_) {
      if (!one.link->all_read()) return false;
    }
    for (const reader& one : readers_) {
      if (!on_.net.sent(one.link->id()).empty() || one.link->whole.under_way()) return false;
    }
    return true;
  }

  void check_missing(const reader& of, std::uint64_t most) {
    std::uint64_t missing = 0;
    std::string which;
    for (const subscription& one : of.has) {
      missing += one.awaited.size();
      for (const std::uint32_t n : one.awaited) which += " " + std::to_string(n);
    }
    if (missing > most)
      fail("reached", "a reader has not got" + which + ", and only " + std::to_string(most) + " are counted");
  }

  const bool strict_; // all readers are quick: nothing is dropped on its way out
  rowe::detail::queue_pair* handle_takes_ = nullptr;
  rowe::detail::queue_pair* handle_says_ = nullptr;
  std::map<std::uint32_t, std::uint32_t> handle_heard_;
  std::vector<publication> published_{1};
  std::vector<sender> senders_;
  std::vector<reader> readers_;
};

} // namespace flow
