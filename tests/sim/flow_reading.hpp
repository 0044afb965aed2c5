// SPDX-License-Identifier: Apache-2.0
// Clients that say as much as is read, in short messages, long ones, dense ones, refused ones or fragments,
// beside one that says little. The transport reads as sockets do: a connection that alone has something to
// read is read by much, others by a quantum each.
#pragma once
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <rowe/stop_latch.hpp>

#include "service/base/service_limits.hpp"

#include "flow.hpp"

namespace flow {

class reading final : public world {
 public:
  reading(std::uint64_t seed, swarm::coverage& seen, const std::set<std::string>& without, bool trace)
      : world{seed, options(seed), seen, without, trace},
        kind_{static_cast<kind>(random_.below(kinds))},
        long_{on_.offer(rowe::detail::pair_kind::subscribe_text, "/long",
                        on_.options.limits.message_bytes_max, {.depth = 2})} {
    on_.offer(rowe::detail::latch_request({.name = "loop", .loop_timeout = 10s})); // so there is a stop
    const std::size_t floods = random_.one_in(3) ? 1 : 1 + random_.below(6);
    for (std::size_t i = 0; i < floods; ++i) {
      floods_.push_back(
          {std::make_unique<swarm::far_end>(on_, rowe::service::side::server, "10.0.0.7:50000")});
      floods_.back().link->say(R"({"op":"advertise","topic":"/flood","type":"sim/Flood"})");
      floods_.back().link->say(R"({"op":"advertise","topic":"/long","type":"sim/Long"})");
    }
    fragments_ = 2 + random_.below(300);
    cycle(1ms);
    cycle(1ms);
    messages_before_ = messages_that_flood();
  }

 private:
  enum class kind : std::uint8_t {
    short_messages,
    long_messages,
    dense_messages,
    refused_messages,
    fragments,
    long_in_fragments
  };
  static constexpr std::uint64_t kinds = 6;
  static constexpr std::size_t numbers_of_dense = 1500;
  static constexpr std::size_t quantum = rowe::service::transport_sink::read_bytes_in_turn;
  static constexpr std::size_t parts_of_long = 900;
  static constexpr std::uint64_t budget = rowe::service::read_work_per_cycle;

  struct flood {
    std::unique_ptr<swarm::far_end> link;
    bool floods = false;
    bool left_some = false; // its last large read was more than one turn,
    bool small = false;     // and so was the one before it: that read was small
    std::size_t unread = 0; // before this cycle
    std::size_t wanted = 0; // likewise
  };

  static rowe::endpoint_options options(std::uint64_t seed) {
    auto chosen = harness::small_options();
    auto& l = chosen.limits;
    constexpr std::uint32_t longest[] = {8 * 1024, 60 * 1024, 256 * 1024, 256 * 1024};
    l.message_bytes_max = swarm::seeded_choices{seed ^ 0x1234567U}.one_of(longest);
    l.messages_per_second_max = 0;
    l.refusals_per_second_max = 0;
    l.handle_bytes = 4 * 1024 * 1024;
    return chosen;
  }
  std::size_t longest() const { return on_.options.limits.message_bytes_max; }

  void act() override {
    if (random_.one_in(8)) {
      flood& one = floods_[random_.below(floods_.size())];
      one.floods = !one.floods;
    }
    if (random_.one_in(30)) only(floods_[random_.below(floods_.size())]);
    for (flood& one : floods_) {
      if (one.floods) fill(one);
    }
    if (!asked_ && random_.one_in(3)) ask();
    if (kind_ == kind::short_messages && !leaver_ && random_.one_in(20)) call_and_leave();
    for (int i = 0; i < 4 && !broken(); ++i) {
      if (!stops_) say_stop();
      turn();
    }
  }
  // Whether what was read of it waits for its turn.
  bool has_backlog(const flood& one) const { return on_.core.wanted_bytes(one.link->id()) == 0; }

  void only(const flood& that) {
    for (flood& one : floods_) one.floods = &one == &that;
  }

  // ---- what they say

  static void append(std::vector<std::byte>& to, rowe::wire::opcode what, std::string_view payload,
                     bool last) {
    const std::vector<std::byte> frame = frame_of(what, payload, last);
    to.insert(to.end(), frame.begin(), frame.end());
  }
  // In up to so many frames, the first of which has `first` bytes.
  void append_parts(std::vector<std::byte>& to, std::string_view text, std::size_t parts,
                    std::size_t first) const {
    using rowe::wire::opcode;
    append(to, opcode::text, text.substr(0, first), false);
    text.remove_prefix(first);
    std::size_t between = 0;
    const std::size_t each = (text.size() + parts - 2) / (parts - 1);
    while (!text.empty()) {
      const std::size_t now = std::min(text.size(), each);
      append(to, opcode::continuation, text.substr(0, now), now == text.size());
      text.remove_prefix(now);
      // Else a turn does not end among them (wire/websocket/frame_parser.hpp).
      if (!text.empty() && ++between % 8 == 0) append(to, opcode::pong, "", true);
    }
  }

  static std::string dense_text() {
    std::string list = "1";
    for (std::size_t i = 1; i < numbers_of_dense; ++i) list += ",1";
    return R"({"op":"publish","topic":"/flood","msg":{"x":[)" + list + "]}}";
  }
  // Refused at its end. A control character keeps it from being counted in tokens.
  static std::string refused_text() {
    std::string text = dense_text();
    return text.insert(text.size() - 3, ",\"\n\"");
  }
  static std::string flood_text(std::size_t bytes) {
    return R"({"op":"publish","topic":"/flood","msg":{"x":")" + std::string(bytes, 'x') + "\"}}";
  }
  // Each place of it says where it is.
  std::string long_text() const {
    std::string body;
    while (body.size() + 200 < longest() * 9 / 10) body += std::to_string(body.size()) + ' ';
    return R"({"op":"publish","topic":"/long","msg":{"x":")" + body + "\"}}";
  }
  static bool is_whole(std::string_view text) {
    const std::size_t begin = text.find(R"({"x":")") + 6;
    for (std::size_t at = begin; at < text.size() && text[at] != '"';) {
      const auto number = std::to_string(at - begin) + ' ';
      if (text.substr(at, number.size()) != number) return false;
      at += number.size();
    }
    return text.ends_with("\"}");
  }

  // As much as the kernel keeps, and no more than the world's options make of it.
  void fill(flood& one) {
    const std::size_t unread = on_.net.unread(one.link->id());
    if (unread > 64 * 1024) return;
    std::vector<std::byte> bytes;
    while (bytes.size() < 128 * 1024) {
      switch (kind_) {
      case kind::short_messages: append(bytes, rowe::wire::opcode::text, flood_text(2), true); break;
      case kind::long_messages:
        append(bytes, rowe::wire::opcode::text, flood_text(std::min<std::size_t>(longest() / 2, 12'000)),
               true);
        break;
      case kind::dense_messages: append(bytes, rowe::wire::opcode::text, dense_text(), true); break;
      case kind::refused_messages: append(bytes, rowe::wire::opcode::text, refused_text(), true); break;
      case kind::fragments: append_parts(bytes, flood_text(fragments_), fragments_, 20); break;
      case kind::long_in_fragments: {
        const std::string text = long_text();
        append_parts(bytes, text, parts_of_long, text.size() * (5 + random_.below(5)) / 10);
        break;
      }
      }
    }
    one.link->send_raw(bytes);
  }
  // Of a message of theirs, at least.
  std::uint64_t units() const {
    switch (kind_) {
    case kind::short_messages: return 1;
    case kind::long_messages: return 1 + std::min<std::size_t>(longest() / 2, 12'000) / 1024;
    case kind::dense_messages:
      return 1 + (2 * numbers_of_dense * (1 + rowe::service::token_work_bytes) -
                  rowe::service::tokens_uncharged * rowe::service::token_work_bytes) /
                     1024;
    case kind::refused_messages: return refused_text().size() * rowe::service::token_work_bytes / 1024;
    case kind::fragments: return fragments_;
    case kind::long_in_fragments: return parts_of_long / 2;
    }
    return 1;
  }

  // The client beside them.
  void ask() {
    if (!caller_) {
      caller_ = std::make_unique<swarm::far_end>(on_);
      return;
    }
    asked_ = on_.now;
    waits_ = 0;
    // Many at once, as far as a queue holds the answers: those of whom one message took many turns sit out as
    // many rounds, which only shows then.
    unanswered_ = random_.one_in(2) ? 1 : 2 + random_.below(14);
    for (std::uint64_t i = 0; i < unanswered_; ++i)
      caller_->say(R"({"op":"call_service","id":")" + std::to_string(++calls_) + R"(","service":"/nobody"})");
  }
  // A client that calls, and does not wait for the answers: what was not read by then is not carried out.
  void call_and_leave() {
    leaver_ = std::make_unique<swarm::far_end>(on_);
    for (std::uint64_t i = 2 + random_.below(300); i > 0; --i)
      leaver_->say(R"({"op":"call_service","id":"1","service":"/nobody"})");
    left_behind_ = on_.count(counter::left_behind);
    leaver_->leave();
  }
  // One of those that flood, when all that it said was read, and waits for its turn.
  void say_stop() {
    for (const flood& one : floods_) {
      if (!one.small || !has_backlog(one) || on_.net.unread(one.link->id()) != 0) continue;
      one.link->say(R"({"op":"call_service","service":"/rowe/stop"})");
      stops_ = on_.count(counter::stops);
      stop_waits_ = 0;
      return;
    }
  }

  // ---- a cycle

  void turn() {
    std::size_t readable = caller_ && on_.net.unread(caller_->id()) != 0;
    for (flood& one : floods_) {
      one.unread = on_.net.unread(one.link->id());
      one.wanted = on_.core.wanted_bytes(one.link->id());
      readable += one.unread != 0;
    }
    constexpr std::size_t alone[] = {16 * 1024, 64 * 1024, 128 * 1024};
    const std::size_t most = readable > 1 ? quantum : random_.one_of(alone);
    for (const flood& one : floods_) limit(one.link->id(), std::min(most, one.wanted)); // one read
    if (caller_) limit(caller_->id(), quantum);
    if (leaver_) limit(leaver_->id(), quantum);
    cycle(100us);
    for (flood& one : floods_) {
      if (!broken()) look(one, readable);
    }
    if (broken()) return;
    check_leaver();
    check_work();
    check_call(readable);
    check_stop();
    take_long();
  }
  void limit(connection_id of, std::size_t bytes) {
    auto& conditions = on_.net.link_of(of);
    conditions.arrive_bytes_max = conditions.chunk_bytes_max = bytes;
  }

  void look(flood& one, std::size_t readable) {
    for (const std::string& text : one.link->hear()) {
      if (kind_ != kind::refused_messages && text.find("\"op\":\"status\"") != std::string::npos)
        return fail("whole", "a client is refused what it did not say: " + swarm::shortened(text));
    }
    if (one.link->cut())
      return fail("honest_cut", "a client that says much was disconnected: " + one.link->close_reason);
    const std::size_t got = one.unread - std::min(one.unread, on_.net.unread(one.link->id()));
    if (got == 0) return;
    if (readable > 1) seen_.add(flow_event::read_in_turn);
    if (got <= quantum) return;
    seen_.add(flow_event::read_beyond);
    one.small = std::exchange(one.left_some, has_backlog(one)) && one.left_some;
    if (!one.left_some) return;
    seen_.add(flow_event::read_in_parts);
    if (kind_ == kind::fragments || kind_ == kind::long_in_fragments)
      seen_.add(flow_event::fragments_in_parts);
    if (one.wanted < std::min(longest() / 2, rowe::service::transport_sink::read_bytes_alone_min))
      seen_.add(flow_event::assembly_behind);
  }

  void check_leaver() {
    if (!leaver_ || !leaver_->cut()) return;
    if (on_.count(counter::left_behind) != left_behind_) seen_.add(flow_event::calls_left_behind);
    leaver_.reset();
  }

  std::uint64_t messages_that_flood() const {
    return on_.count(counter::messages_in) - on_.count(counter::calls_in);
  }
  // One turn of reading alone and one of all others; each ends with the message that exceeds it.
  void check_work() {
    const std::uint64_t now = messages_that_flood();
    const std::uint64_t done = now - std::exchange(messages_before_, now);
    constexpr std::uint64_t others = 8; // stops
    if (done > others && (done - others) * units() > 2 * (budget + units()))
      fail("turn", std::to_string(done) + " messages of " + std::to_string(units()) +
                       " units of work were carried out in one cycle");
  }

  void check_call(std::size_t readable) {
    if (!caller_) return;
    const std::uint64_t answered = caller_->hear().size();
    if (!asked_) return;
    burst_ = std::max(burst_, unanswered_);
    if (unanswered_ <= answered) {
      if (readable > 2) seen_.add(flow_event::call_beside_flood);
      if (readable > 2 && burst_ > 1) seen_.add(flow_event::calls_beside_flood);
      burst_ = 0;
      return asked_.reset();
    }
    unanswered_ -= answered;
    // Its first call comes before the round, unless it has just said something. For each further one, every
    // other client has a turn, on average of as much as a turn may take; and once a message of each may be
    // carried out that is longer. The cycle's work is exceeded by one message, and one read alone.
    const std::uint64_t share = std::min<std::uint64_t>(units(), 2 * rowe::service::turn_work);
    const std::uint64_t work =
        (floods_.size() + 1) * (units() + (burst_ + 1) * share) + 2 * burst_; // and the leaver, and the calls
    const std::uint64_t turns = 3 + work / budget;
    if (++waits_ > turns)
      fail("floor_call",
           "a call beside clients that say much has no answer after " + std::to_string(waits_) + " cycles");
  }

  // It waits behind one small read, in turn with the others.
  void check_stop() {
    if (!stops_) return;
    if (on_.count(counter::stops) != *stops_) {
      if (stop_waits_ != 0) seen_.add(flow_event::stop_behind_read);
      return stops_.reset();
    }
    const std::uint64_t messages = rowe::service::transport_sink::read_bytes_alone_min /
                                   frame_of(rowe::wire::opcode::text, flood_text(2), true).size();
    if (++stop_waits_ > 3 + floods_.size() * messages / budget && kind_ == kind::short_messages)
      fail("floor_stop", "a client's stop behind what it said before was not carried out within " +
                             std::to_string(stop_waits_) + " cycles");
  }

  void take_long() {
    if (const auto slot = long_.user.in.ring->try_pop()) {
      const std::string_view text{reinterpret_cast<const char*>(long_.user.in.memory.value(*slot)),
                                  long_.user.in.memory.header(*slot)->bytes};
      if (!is_whole(text)) fail("whole", "a long message is not what was said: " + swarm::shortened(text));
      long_.user.in.free_ring->release(*slot);
    }
  }

  const kind kind_;
  rowe::detail::queue_pair& long_;
  std::vector<flood> floods_;
  std::size_t fragments_ = 2;
  std::unique_ptr<swarm::far_end> caller_;
  std::optional<time_point> asked_;
  std::unique_ptr<swarm::far_end> leaver_;
  std::uint64_t left_behind_ = 0; // before it
  std::uint64_t unanswered_ = 0, burst_ = 0;
  std::uint64_t waits_ = 0, calls_ = 0; // cycles
  std::uint64_t messages_before_ = 0;
  std::optional<std::uint64_t> stops_; // before the one that waits
  std::uint64_t stop_waits_ = 0;       // cycles
};

} // namespace flow
