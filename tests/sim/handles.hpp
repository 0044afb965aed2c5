// SPDX-License-Identifier: Apache-2.0
// The loops of this process in a simulated world, as actors whose calls are single steps: a queue pair,
// responders and callers. Each checks what it is told against the ledger, and at the end that its handle has
// all its slots back.
#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <rowe/caller.hpp>
#include <rowe/lane.hpp>
#include <rowe/responder.hpp>

#include "ledger.hpp"
#include "messaging_peer.hpp"

namespace sim {

struct addends {
  std::int64_t a, b;
};
struct sum {
  std::int64_t sum;
};

} // namespace sim

template <>
inline constexpr auto rowe::schema<sim::addends> = rowe::fields<&sim::addends::a, &sim::addends::b>{};
template <>
inline constexpr auto rowe::schema<sim::sum> = rowe::fields<&sim::sum::sum>{};

namespace sim {

using rowe::detail::pair_kind;
using rowe::detail::pair_phase;
using rowe::detail::pair_request;

inline duration some_time(random_source& random) {
  constexpr duration times[] = {0ns, 1ms, 20ms, 500ms, -1ns, -1ns};
  return times[random.below(std::size(times))];
}

inline std::string reply_text(std::uint32_t answer) { return R"({"sum":)" + std::to_string(answer) + "}"; }

// A message's text; now and then a bad one.
inline std::string message_text(random_source& random, std::uint32_t n, bool good) {
  constexpr const char* bad[] = {"{", "[]", R"({"op":1})", R"({"message_id":"1"})"};
  if (!good) return bad[random.below(std::size(bad))];
  std::string text = R"({"n":)" + std::to_string(n);
  if (random.one_in(4))
    text += R"(,"x":")" + std::string(random.below(random.one_in(8) ? 1500 : 300), 'x') + '"';
  return text + "}";
}

// What every actor has: a queue pair, and its open calls.
class actor {
 public:
  explicit actor(world_context& in, const pair_request& asked)
      : in_{in}, pair_{in.on.offer(asked)}, number_{in.book.new_actor()} {}
  virtual ~actor() = default;
  actor(const actor&) = delete;
  actor& operator=(const actor&) = delete;

  virtual void act(const std::vector<std::unique_ptr<messaging_peer>>& peers) = 0;
  // Takes what has come, and answers or forgets what is held.
  virtual void finish_up() = 0;
  // Closes the handle; nobody may be told anything of it afterwards.
  void close() {
    let_go();
    for (const auto& [call, number] : open_) give_up(number);
    pair_.lifecycle.close();
  }
  bool active() const { return pair_.lifecycle.look() == pair_phase::active; }
  bool refused() const { return pair_.lifecycle.look() == pair_phase::refused; }
  std::size_t open_calls() const { return open_.size(); }

  // Whether all slots of its queues are free again, when everything is completed. The service thread keeps a
  // spare one of an inbox.
  bool all_slots_free() {
    auto& user = pair_.user;
    auto& service = pair_.service;
    const auto all_free = [](auto& path, std::uint32_t parked) {
      return path.free_ring == nullptr || path.free_ring->free_at_least() + parked >= path.count;
    };
    return user.calls_open == 0 && all_free(user.out, user.spare_replies.count) && all_free(service.in, 1) &&
           all_free(service.completions, 0);
  }

 protected:
  // A number in the ledger: of a message, or of a call.
  struct subject {
    bool message = false;
    std::uint32_t number = 0;
  };
  virtual void let_go() = 0; // of what is held

  void opened(rowe::call_id call, subject of) { open_.emplace_back(call, of); }
  void give_up(subject of) {
    if (of.message) {
      in_.book.message(of.number).waits = false;
    } else {
      in_.book.call(of.number).wanted = false;
    }
  }
  void cancel_one(auto& handle) {
    if (open_.empty()) return;
    const auto which = open_.begin() + static_cast<std::ptrdiff_t>(in_.random.below(open_.size()));
    handle.cancel(which->first);
    give_up(which->second);
    open_.erase(which);
  }
  // A completion that the handle handed out.
  void ended(rowe::call_id call, std::uint32_t answer, const rowe::status& outcome) {
    const auto which =
        std::find_if(open_.begin(), open_.end(), [&](const auto& one) { return one.first == call; });
    if (which == open_.end()) return in_.book.fail("a handle was given the completion of no call of its own");
    const subject of = which->second;
    open_.erase(which);
    if (of.message) return in_.book.announcement_of_message(of.number, outcome, in_.on.now);
    if (outcome && answer == 0) in_.book.fail("a reply without what it must hold");
    in_.book.ended(of.number, answer, outcome ? errc::misuse : outcome.code(), in_.on.now);
  }

  world_context& in_;
  rowe::detail::queue_pair& pair_;
  std::uint32_t number_;

 private:
  std::vector<std::pair<rowe::call_id, subject>> open_;
};

// rowe::lane.
class lane_user final : public actor {
 public:
  lane_user(world_context& in, bool receives, rowe::priority priority)
      : actor{in, request(receives, priority)}, handle_{harness::core_harness::handle_of(pair_)} {}

  void act(const std::vector<std::unique_ptr<messaging_peer>>& peers) override {
    const messaging_peer* const to =
        !peers.empty() && in_.random.one_in(4) ? peers[in_.random.below(peers.size())].get() : nullptr;
    switch (in_.random.below(8)) {
    case 0:
    case 1: return send(to, false);
    case 2: return send(to, true);
    case 3: return start(to);
    case 4: return receive();
    case 5: return answer();
    case 6: return in_.random.one_in(4) ? cancel_one(handle_) : finish();
    default: return finish();
    }
  }
  void finish_up() override {
    while (auto got = handle_.try_receive(in_.on.now)) {
      if (got->wants_reply()) reply(*got);
    }
    while (!held_.empty()) answer();
    finish();
  }

 private:
  static pair_request request(bool receives, rowe::priority priority) {
    return {.kind = pair_kind::talk,
            .priority = priority,
            .receives = receives,
            .out_depth = 8,
            .in_depth = 4,
            .completions_depth = 4,
            .out_bytes = 2000,
            .in_bytes = 512,
            .completions_bytes = 512};
  }

  // With `waits` as lane::send() does it, but without waiting.
  void send(const messaging_peer* to, bool waits) {
    const duration ttl = some_time(in_.random);
    const time_point expires = rowe::detail::expiry_after(in_.on.now, ttl);
    const bool good = !in_.random.one_in(16);
    const std::uint32_t n = in_.book.new_message({.sender = number_,
                                                  .to = to != nullptr ? to->number() : 0,
                                                  .accepted = in_.on.now,
                                                  .expires = ttl == 0ns ? rowe::rt::never : expires,
                                                  .only_now = ttl == 0ns,
                                                  .good = good,
                                                  .waits = waits});
    const std::string text = message_text(in_.random, n, good);
    const rowe::connection whom = to != nullptr ? to->named() : rowe::everyone;
    bool accepted = false;
    if (waits) {
      const auto call = rowe::detail::start_call_to(pair_, whom, text,
                                                    rowe::detail::message_header(rowe::detail::entry::message,
                                                                                 rowe::detail::ref_of(whom),
                                                                                 in_.on.now, expires));
      accepted = call.has_value();
      if (accepted) opened({call->index, call->generation}, {true, n});
    } else {
      accepted = handle_.try_send(text, ttl, in_.on.now, whom).has_value();
    }
    if (!accepted) in_.book.take_back_message();
  }

  void start(const messaging_peer* to) {
    const duration timeout = some_time(in_.random);
    const std::uint32_t k = in_.book.new_call(rowe::rt::deadline_after(in_.on.now, timeout));
    constexpr const char* services[] = {"/add", "/echo", "/peer0", "/peer1", "/rowe/stats", "nobody's"};
    std::string text = R"({"service":")" + std::string{services[in_.random.below(std::size(services))]} +
                       R"(","a":)" + std::to_string(k) + R"(,"b":0})";
    if (in_.random.one_in(16)) text = R"({"a":)" + std::to_string(k) + "}";
    const auto call = handle_.start(text, timeout, in_.on.now, to != nullptr ? to->named() : rowe::everyone);
    if (!call) return in_.book.take_back_call();
    in_.book.call(k).own_service = text.find("/rowe/") != std::string::npos;
    opened(*call, {false, k});
  }

  void finish() {
    while (const auto end = handle_.try_finish()) {
      const std::uint32_t sum = end->reply ? number_after(end->reply->value(), R"("sum":)") : 0;
      ended(end->id, end->reply && sum == 0 ? no_answer : sum,
            end->reply ? rowe::status{} : rowe::status{end->reply.error()});
    }
  }

  void receive() {
    auto got = handle_.try_receive(in_.on.now);
    if (got && got->wants_reply()) held_.push_back(std::move(*got));
  }
  void answer() {
    if (held_.empty()) return;
    const auto which = held_.begin() + static_cast<std::ptrdiff_t>(in_.random.below(held_.size()));
    reply(*which);
    if (in_.random.one_in(8)) reply(*which); // one too many
    held_.erase(which);
  }
  void reply(const rowe::message_view& to) {
    const std::uint32_t k = number_after(to.value(), R"("a":)");
    switch (in_.random.below(6)) {
    case 0: return; // forgotten: the call times out
    case 1:
      if (handle_.try_refuse(to, "no", in_.on.now)) in_.book.refuse(k);
      return;
    case 2:
      if (handle_.try_reply(to, "{", in_.on.now)) in_.book.refuse(k);
      return;
    default: break;
    }
    const std::uint32_t r = in_.book.new_answer(k);
    if (!handle_.try_reply(to, reply_text(r), in_.on.now)) in_.book.take_back_answer(k);
  }
  void let_go() override { held_.clear(); }

  static constexpr std::uint32_t no_answer = ledger::no_answer;
  rowe::lane handle_;
  std::vector<rowe::message_view> held_;
};

// responder<addends, sum>, or of text.
template <class Q, class A>
class server final : public actor {
 public:
  server(world_context& in, std::string_view name)
      : actor{in, rowe::detail::serve_request<Q, A>(name,
                                                    {.depth = 3, .type = "sim/Add", .text_bytes_max = 300})},
        handle_{harness::core_harness::handle_of(pair_)} {}

  void act(const std::vector<std::unique_ptr<messaging_peer>>&) override {
    if (held_.empty() || in_.random.one_in(2)) {
      if (auto asked = handle_.try_next(in_.on.now)) held_.push_back(std::move(*asked));
    } else {
      answer(in_.random.below(held_.size()));
    }
  }
  void finish_up() override {
    while (!held_.empty()) answer(0);
    while (auto asked = handle_.try_next(in_.on.now)) {
      held_.push_back(std::move(*asked));
      answer(0);
    }
  }

 private:
  static constexpr bool of_text = std::is_same_v<Q, rowe::json_text>;

  static std::uint32_t call_of(const rowe::request<Q>& asked) {
    if constexpr (of_text) {
      return number_after(asked.value(), R"("a":)");
    } else {
      return static_cast<std::uint32_t>(asked.value().a);
    }
  }
  void answer(std::size_t which) {
    rowe::request<Q> asked = std::move(held_[which]);
    held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(which));
    const std::uint32_t k = call_of(asked);
    if (in_.random.one_in(8)) return in_.book.refuse(k); // forgets it
    if (in_.random.one_in(8)) {
      (void)handle_.refuse(asked, "no", in_.on.now); // a caller that is gone needs no refusal
      return in_.book.refuse(k);
    }
    if constexpr (of_text) {
      if (in_.random.one_in(8)) {
        (void)handle_.reply(asked, "[", in_.on.now);
        return in_.book.refuse(k);
      }
      (void)handle_.reply(asked, reply_text(in_.book.new_answer(k)), in_.on.now);
    } else {
      (void)handle_.reply(asked, {in_.book.new_answer(k)}, in_.on.now);
    }
  }
  void let_go() override {
    for (const auto& one : held_) in_.book.refuse(call_of(one));
    held_.clear();
  }

  rowe::responder<Q, A> handle_;
  std::vector<rowe::request<Q>> held_;
};

// caller<addends, sum>, or of text.
template <class Q, class A>
class client final : public actor {
 public:
  client(world_context& in, std::string_view name)
      : actor{in, rowe::detail::client_request<Q, A>(name, {.depth = 3, .text_bytes_max = 300})},
        handle_{harness::core_harness::handle_of(pair_)} {}

  void act(const std::vector<std::unique_ptr<messaging_peer>>&) override {
    switch (in_.random.below(5)) {
    case 0:
    case 1: return start();
    case 2: return in_.random.one_in(4) ? cancel_one(handle_) : finish_up();
    default: return finish_up();
    }
  }
  void finish_up() override {
    while (const auto end = handle_.try_finish()) {
      ended(end->id, end->reply ? answer_of(*end->reply) : 0,
            end->reply ? rowe::status{} : rowe::status{end->reply.error()});
    }
  }

 private:
  static std::uint32_t answer_of(const sum& value) { return static_cast<std::uint32_t>(value.sum); }
  static std::uint32_t answer_of(const rowe::message_view& value) {
    return number_after(value.value(), R"("sum":)");
  }

  void start() {
    const duration timeout = some_time(in_.random);
    const std::uint32_t k = in_.book.new_call(rowe::rt::deadline_after(in_.on.now, timeout));
    const auto call = [&] {
      if constexpr (std::is_same_v<Q, rowe::json_text>) {
        return handle_.start(R"({"a":)" + std::to_string(k) + R"(,"b":0})", timeout, in_.on.now);
      } else {
        return handle_.start({k, 0}, timeout, in_.on.now);
      }
    }();
    if (!call) return in_.book.take_back_call();
    opened(*call, {false, k});
  }
  void let_go() override {}

  rowe::caller<Q, A> handle_;
};

} // namespace sim
