// SPDX-License-Identifier: Apache-2.0
// What truly happens in a world with direct messages and calls. Every message, call and answer has a number
// that its text carries ("n", "a", "sum"), and the ledger records what became of it. Each outcome that the
// core reports is compared with that at once; what is left over is counted at the end.
#pragma once
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/timer_wheel.hpp>

namespace sim {

using rowe::errc;
using rowe::rt::duration;
using rowe::rt::time_point;

// The number behind a key; 0 when it is not there.
inline std::uint32_t number_after(std::string_view text, std::string_view key) {
  const auto at = text.find(key);
  if (at == std::string_view::npos) return 0;
  std::uint32_t number = 0;
  for (std::size_t i = at + key.size(); i < text.size() && text[i] >= '0' && text[i] <= '9'; ++i)
    number = number * 10 + static_cast<std::uint32_t>(text[i] - '0');
  return number;
}

// The string, with its quotes, or the number behind a key, as it stands there.
inline std::string_view raw_after(std::string_view text, std::string_view key) {
  const auto at = text.find(key);
  if (at == std::string_view::npos) return {};
  const auto from = at + key.size();
  const auto end =
      text[from] == '"' ? text.find('"', from + 1) + 1 : text.find_first_not_of("0123456789", from);
  return text.substr(from, end - from);
}

struct message_record {
  std::uint32_t sender = 0; // a handle or thread, by its number
  std::uint32_t to = 0;     // a peer's number; 0: everyone
  time_point accepted{};
  time_point expires = rowe::rt::never;
  bool only_now = false; // its time to live is nothing
  bool good = true;      // else not what a message must be
  bool waits = false;    // its sender wants to know
  bool told = false;
  std::uint32_t copies = 0; // given to the network in full
};

struct call_record {
  time_point deadline = rowe::rt::never;
  std::uint32_t asked_on = 0; // the peer that was sent its request
  std::uint32_t answer = 0;   // the first proper one that was given
  time_point ended_at = rowe::rt::never;
  bool ended = false;       // the caller was told
  bool wanted = true;       // and wants to be
  bool by_peer = false;     // so its time begins when it arrives
  bool own_service = false; // of the endpoint itself, whose answers have no number
};

class ledger {
 public:
  static constexpr std::uint32_t refused = UINT32_MAX;       // as an answer
  static constexpr std::uint32_t no_answer = UINT32_MAX - 1; // a reply that has no number

  std::uint32_t new_actor() { return ++actors_; }

  // ---- messages

  std::uint32_t new_message(const message_record& made) {
    messages_.push_back(made);
    return static_cast<std::uint32_t>(messages_.size() - 1);
  }
  message_record& message(std::uint32_t n) { return messages_[n < messages_.size() ? n : 0]; }
  void take_back_message() { messages_.pop_back(); } // it was not accepted

  // A peer's socket was given all of it.
  void wrote_message(std::uint32_t n, std::uint32_t peer, time_point begun) {
    message_record& m = message(n);
    const std::string name = "message " + std::to_string(n);
    if (!m.good || m.sender == 0) fail("was sent what is no message: " + name);
    if (m.to != 0 && m.to != peer) fail("was sent to somebody else: " + name);
    if (m.told && m.copies == 0) fail("was sent after its sender was told that it was not: " + name);
    if (begun > m.expires) fail("begun after its time: " + name);
    ++m.copies;
    // A message for everyone may be pending, until a peer speaks, while one for that peer is sent.
    std::uint32_t& newest = newest_[{2 * m.sender + (m.to != 0), peer}];
    if (n == newest) fail("sent twice: " + name);
    // A message that lost its peer may be given to another one later than messages sent after it.
    if (n < newest && m.accepted > last_departure) fail("out of order: " + name);
    newest = std::max(newest, n);
  }

  // The text says what was left of its time to live when it was begun.
  void told_ttl(std::uint32_t n, const std::string& text, time_point begun) {
    const double ns = std::strtod(text.c_str() + std::string_view{R"({"ttl_ms":)"}.size(), nullptr) * 1e6;
    const time_point expires = message(n).expires;
    if (expires == rowe::rt::never || ns <= 0 || std::llround(ns) > (expires - begun).count())
      fail("a peer is told a wrong time to live: " + text);
  }

  void announcement_of_message(std::uint32_t n, const rowe::status& outcome, time_point now) {
    message_record& m = message(n);
    const std::string name = "message " + std::to_string(n);
    if (m.sender == 0 || !m.waits) fail("told of a message that nobody asked for: " + name);
    if (std::exchange(m.told, true)) fail("told twice: " + name);
    if (outcome && m.copies == 0) fail("told that it was sent, which it was not: " + name);
    if (!outcome && m.copies != 0) fail("told that it was not sent, which it was: " + name);
    if (outcome.code() == errc::expired && !outcome && !m.only_now && now < m.expires)
      fail("expired too early: " + name);
    const bool bad =
        !outcome && (outcome.code() == errc::malformed || outcome.code() == errc::not_an_object ||
                     outcome.code() == errc::reserved_member);
    if (bad ? m.good : (outcome && !m.good)) fail("was taken for what it is not: " + name);
  }

  // ---- calls

  std::uint32_t new_call(time_point deadline) {
    calls_.push_back({.deadline = deadline});
    return static_cast<std::uint32_t>(calls_.size() - 1);
  }
  call_record& call(std::uint32_t k) { return calls_[k < calls_.size() ? k : 0]; }
  void take_back_call() { calls_.pop_back(); } // likewise

  // A peer's socket was given its request.
  void wrote_request(std::uint32_t k, std::uint32_t peer, time_point begun) {
    call_record& c = call(k);
    const std::string name = "call " + std::to_string(k);
    if (k == 0) return;
    if (c.asked_on != 0) fail("was asked twice: " + name);
    c.asked_on = peer;
    if (begun > c.ended_at) fail("asked after its end: " + name);
    // A call times out by the wheel, so up to a tick late.
    if (!c.by_peer && c.deadline != rowe::rt::never && begun > c.deadline + rowe::rt::timer_wheel::tick)
      fail("asked after its time: " + name + " by " + std::to_string((begun - c.deadline).count()) + " ns");
  }

  // An answer under this call's id, by the callee and on its connection. Returns its number.
  std::uint32_t new_answer(std::uint32_t k) {
    answers_.push_back(k);
    const auto r = static_cast<std::uint32_t>(answers_.size() - 1);
    if (call(k).answer == 0) call(k).answer = r;
    return r;
  }
  void take_back_answer(std::uint32_t k) { // it was not accepted
    if (call(k).answer == answers_.size() - 1) call(k).answer = 0;
    answers_.pop_back();
  }
  // One that must reach nobody.
  std::uint32_t new_false_answer() {
    answers_.push_back(0);
    return static_cast<std::uint32_t>(answers_.size() - 1);
  }
  void refuse(std::uint32_t k) {
    if (call(k).answer == 0) call(k).answer = refused;
  }

  std::uint32_t call_of_answer(std::uint32_t r) const { return r < answers_.size() ? answers_[r] : 0; }

  // The caller is told: the reply's number, or 0 and why.
  void ended(std::uint32_t k, std::uint32_t answer, errc why, time_point now) {
    call_record& c = call(k);
    const std::string name = "call " + std::to_string(k);
    if (k == 0) return fail("the end of no call");
    if (std::exchange(c.ended, true)) fail("ended twice: " + name);
    c.ended_at = now;
    if (!c.wanted) fail("told the end of a call that was cancelled: " + name);
    if (answer == no_answer) {
      if (!c.own_service) fail("answered without what was said: " + name);
    } else if (answer != 0) {
      if (answer >= answers_.size() || answers_[answer] != k)
        fail("answered with another's reply: " + name + ", which was given to " +
             std::to_string(answer < answers_.size() ? answers_[answer] : answer));
      if (answer != c.answer) fail("answered with a reply that is not the first: " + name);
    } else if (why == errc::timed_out && now < c.deadline) {
      fail("timed out too early: " + name + " by " + std::to_string((c.deadline - now).count()) + " ns");
    }
  }

  // ---- the end of a run

  // Messages that no peer was given; what the counters must explain.
  std::uint64_t messages_lost() const {
    std::uint64_t lost = 0;
    for (const message_record& m : messages_) lost += m.sender != 0 && m.copies == 0;
    return lost;
  }
  std::uint64_t messages_sent() const { return messages_.size() - 1 - messages_lost(); }
  std::uint64_t calls_answered() const {
    std::uint64_t count = 0;
    for (const call_record& c : calls_) count += c.ended && c.answer != 0 && c.answer != refused;
    return count;
  }

  void fail(const std::string& what) {
    if (wrong.empty()) wrong = what;
  }
  std::string wrong;
  time_point last_departure{}; // of a peer

 private:
  std::uint32_t actors_ = 0;
  std::vector<message_record> messages_{1};
  std::vector<call_record> calls_{1};
  std::vector<std::uint32_t> answers_{0}; // to which call
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t>
      newest_; // of each sender and kind, at each peer
};

} // namespace sim
