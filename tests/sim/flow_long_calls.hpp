// SPDX-License-Identifier: Apache-2.0
// Calls in the world of long messages (flow_long.hpp): one peer provides a service, others call it. Their
// arguments and its answers are short or long. The provider may answer late, slowly, twice, for somebody
// else, or not at all; callers may read slowly. Each call ends once, by the answer that was given or by a
// failure that has its reason.
#pragma once
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "flow_long_peers.hpp"

namespace flow {

class long_callers {
 public:
  long_callers(harness::core_harness& in, swarm::choices& random, swarm::coverage& seen)
      : on_{in}, random_{random}, seen_{seen}, provider_{in, tongue::slashed, "127.0.0.1:50000"} {
    provider_.says.add(opcode::text, R"({"op":"advertise_service","service":"/plan","type":"sim/Plan"})");
  }

  // Somebody calls.
  void call(bool may_be_slow) {
    if (callers_.size() < 2) add_caller(may_be_slow);
    caller& by = *callers_[random_.below(callers_.size())];
    if (by.link.says.left() != 0 || by.open >= 3) return;
    const auto n = static_cast<std::uint32_t>(calls_.size());
    constexpr std::int64_t timeouts_ms[] = {50, 300, 2000, 2000};
    const std::int64_t ms = random_.one_of(timeouts_ms);
    calls_.push_back({.by = by.number, .args = long_body(n, some_bytes(), random_), .timeout = ms * 1ms});
    ++by.open;
    by.last = n;
    std::string text = R"({"op":"call_service","id":)" + std::to_string(n) +
                       R"(,"service":"/plan","timeout":)" + std::to_string(ms) + "e-3";
    if (by.fragment_size != 0) text += R"(,"fragment_size":)" + std::to_string(by.fragment_size);
    text += R"(,"args":)" + calls_[n].args + "}";
    by.link.says.add_message(opcode::text, text, random_);
  }
  // A caller goes, whatever it waits for.
  void leave() {
    if (callers_.empty()) return;
    callers_.front()->link.peer.leave();
    forget(0);
  }
  void leave_all() {
    for (const auto& one : callers_) one->link.peer.leave();
    provider_.peer.leave();
  }

  void say() {
    for (const auto& one : callers_) {
      one->link.says.feed(on_, one->link.id(), 1 + random_.below(20'000));
      if (one->link.says.left() == 0 && one->last) calls_[*std::exchange(one->last, {})].said_at = on_.now;
    }
    if (provider_.all_read()) saying_.reset();
    if (provider_.all_read() && !answers_.empty()) answer_next();
    provider_.says.feed(on_, provider_.id(), 1 + random_.below(answer_pace_));
  }
  // Returns what is wrong.
  std::string hear() {
    for (const std::string& text : provider_.hear(SIZE_MAX, seen_)) {
      if (std::string wrong = take_request(text); !wrong.empty()) return wrong;
    }
    // An answer that found no room is no answer. Its provider is told behind its end.
    if (suspect_ && !saying_ && ++suspect_->turns > 5) {
      const given_up over = *std::exchange(suspect_, {});
      if (provider_.lost_own == over.lost_before)
        return "a call was given up though its answer had begun: " + over.text;
    }
    if (provider_.peer.cut()) return "a provider was disconnected: " + provider_.peer.close_reason;
    for (std::size_t i = 0; i < callers_.size();) {
      caller& one = *callers_[i];
      const std::size_t most = one.slow ? 1 + random_.below(3000) : SIZE_MAX;
      for (const std::string& text : one.link.hear(most, seen_)) {
        if (std::string wrong = take_end(one, text); !wrong.empty()) return wrong;
      }
      if (!one.link.peer.violated.empty()) return "a caller was sent " + one.link.peer.violated;
      if (!one.link.peer.cut()) {
        ++i;
      } else if (!one.slow) {
        return "a caller that reads was disconnected: " + one.link.peer.close_reason;
      } else {
        forget(i);
      }
    }
    return provider_.peer.violated.empty() ? std::string{} : "a provider was sent " + provider_.peer.violated;
  }

  // From now on everybody reads all and answers at once.
  void hurry() {
    answer_pace_ = 1 << 20;
    for (const auto& one : callers_) {
      one->slow = false;
      on_.net.link_of(one->link.id()) = {};
    }
  }
  bool is_quiet() const {
    for (const auto& one : callers_) {
      if (one->link.says.left() != 0 || !on_.net.sent(one->link.id()).empty()) return false;
    }
    return provider_.says.left() == 0 && answers_.empty();
  }
  // What has not ended; empty: all calls have.
  std::string open() const {
    for (const one_call& one : calls_) {
      if (!one.ended) return "call " + std::to_string(&one - calls_.data()) + " has not ended";
    }
    return {};
  }
  // How many messages were dropped because there was no room, as everybody here was told.
  std::uint64_t without_room() const { return without_room_ + provider_.lost_own; }

 private:
  struct caller {
    caller(harness::core_harness& in, std::uint32_t n)
        : link{in, tongue::slashed, "127.0.0.1:50000"}, number{n} {}
    long_link link;
    std::uint32_t number;
    bool slow = false;
    std::size_t fragment_size = 0;
    int open = 0;
    std::optional<std::uint32_t> last{}; // the call that it is about to say
  };
  struct one_call {
    std::uint32_t by = 0;
    std::string args{};
    duration timeout{};
    time_point said_at{};     // when the last of it was said: its time begins then, or later
    time_point asked_at{};    // when the provider had it
    std::string answer{};     // that it began to give
    time_point answer_from{}; // then
    bool fails = false;       // the answer is that it failed
    bool ended = false;
  };
  // A call that was given up while its answer came.
  struct given_up {
    std::string text;
    std::uint64_t lost_before = 0; // of the provider's messages
    int turns = 0;                 // behind the answer's end
  };
  struct pending {
    std::uint32_t n;
    std::string id; // the core's
  };

  std::size_t some_bytes() {
    const auto& bounds = on_.options.limits;
    return random_.one_in(3) ? 40 + random_.below(800)
                             : bounds.message_bytes_max - 200 + random_.below(60'000);
  }
  bool is_long(const std::string& body) const { return body.size() > on_.options.limits.message_bytes_max; }

  void add_caller(bool may_be_slow) {
    callers_.push_back(std::make_unique<caller>(on_, ++numbers_));
    caller& fresh = *callers_.back();
    fresh.slow = may_be_slow && random_.one_in(2);
    if (fresh.slow) on_.net.link_of(fresh.link.id()).capacity_bytes = 200 + random_.below(20'000);
    constexpr std::size_t sizes[] = {0, 0, 0, 1000, 8195};
    fresh.fragment_size = random_.one_of(sizes);
  }
  void forget(std::size_t which) {
    for (one_call& one : calls_) one.ended = one.ended || one.by == callers_[which]->number;
    callers_.erase(callers_.begin() + static_cast<std::ptrdiff_t>(which));
  }

  static std::string member(std::string_view text, std::string_view name) {
    const std::size_t at = text.find(name);
    if (at == std::string_view::npos) return {};
    const std::size_t from = at + name.size();
    return std::string{text.substr(from, text.find_first_of(",}", from) - from)};
  }

  std::string take_request(const std::string& text) {
    if (!text.starts_with(R"({"op":"call_service")")) return {};
    const std::int64_t n = swarm::integer_after(text, R"("args":{"n":)");
    if (n < 0 || n >= static_cast<std::int64_t>(calls_.size()))
      return "a provider was asked what nobody called: " + swarm::shortened(text);
    one_call& asked = calls_[static_cast<std::size_t>(n)];
    if (text.find(R"("args":)" + asked.args + "}") == std::string::npos &&
        text.find(R"("args":)" + asked.args + ",") == std::string::npos)
      return "a provider was asked with other arguments: " + swarm::shortened(text);
    if (asked.asked_at != time_point{}) return "a provider was asked twice: " + swarm::shortened(text);
    asked.asked_at = on_.now;
    if (is_long(asked.args)) seen_.add(flow_event::long_request);
    if (!random_.one_in(8)) answers_.push_back({static_cast<std::uint32_t>(n), member(text, R"("id":)")});
    return {};
  }

  // The next answer: late, wrong, or right.
  void answer_next() {
    if (random_.one_in(3) && answer_pace_ != 1 << 20) return;
    const pending next = answers_.front();
    answers_.pop_front();
    one_call& asked = calls_[next.n];
    asked.fails = random_.one_in(6);
    asked.answer = long_body(next.n, some_bytes(), random_);
    std::string text = R"({"op":"service_response","id":)" + next.id + R"(,"service":"/plan","result":)" +
                       (asked.fails ? "false" : "true") + R"(,"values":)" + asked.answer + "}";
    asked.answer_from = on_.now;
    saying_ = next.n;
    constexpr std::size_t paces[] = {1500, 8000, 40'000, 1 << 20};
    if (answer_pace_ != 1 << 20) answer_pace_ = random_.one_of(paces) - 1;
    if (random_.one_in(6)) { // first to somebody else's call
      std::string foreign = text;
      foreign[foreign.find(next.id) + 2] ^= 1;
      provider_.says.add(opcode::text, foreign);
      asked.answer_from = {}; // nobody knows when it begins
    }
    provider_.says.add(opcode::text, text);
    if (random_.one_in(6)) provider_.says.add(opcode::text, text); // the second one is late
  }

  // A caller hears how its call ended.
  std::string take_end(caller& by, const std::string& text) {
    if (!text.starts_with(R"({"op":"service_response")")) return "a caller is told " + swarm::shortened(text);
    const std::int64_t n = swarm::integer_after(text, R"("id":)");
    if (n < 0 || n >= static_cast<std::int64_t>(calls_.size()) ||
        calls_[static_cast<std::size_t>(n)].by != by.number)
      return "a caller hears of a call that is not its own: " + swarm::shortened(text);
    one_call& one = calls_[static_cast<std::size_t>(n)];
    if (one.ended) return "a call has ended twice: " + swarm::shortened(text);
    one.ended = true;
    --by.open;
    if (text.find(R"("result":true)") != std::string::npos) {
      if (one.fails || one.answer.empty() ||
          text.find(R"("values":)" + one.answer + "}") == std::string::npos)
        return "a caller got another answer than was given: " + swarm::shortened(text);
      if (is_long(one.answer)) seen_.add(flow_event::long_answer);
      return {};
    }
    if (text.find("in time") != std::string::npos) {
      seen_.add(flow_event::long_call_late);
      const bool began = is_long(one.answer) && one.answer_from != time_point{} &&
                         one.answer_from + 60ms < one.said_at + one.timeout &&
                         saying_ == static_cast<std::uint32_t>(n);
      if (began && !suspect_) suspect_ = given_up{swarm::shortened(text), provider_.lost_own};
      return {};
    }
    if (text.find("no room") != std::string::npos || text.find("others use the room") != std::string::npos) {
      seen_.add(flow_event::long_call_lost);
      ++without_room_;
      return {};
    }
    if (one.fails || text.find("too many calls") != std::string::npos) return {};
    return "a call failed without a reason: " + swarm::shortened(text);
  }

  harness::core_harness& on_;
  swarm::choices& random_;
  swarm::coverage& seen_;
  long_link provider_;
  std::vector<std::unique_ptr<caller>> callers_;
  std::vector<one_call> calls_;
  std::deque<pending> answers_;
  std::optional<std::uint32_t> saying_{}; // the call whose answer is not wholly said
  std::optional<given_up> suspect_{};
  std::size_t answer_pace_ = 8000;
  std::uint32_t numbers_ = 0;
  std::uint64_t without_room_ = 0;
};

} // namespace flow
