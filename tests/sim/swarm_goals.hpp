// SPDX-License-Identifier: Apache-2.0
// An action of two honest peers: one provides it, the other sends goals, one after the other, and each goal
// ends in one of the ways in which goals end. Whatever untrusted peers do, both are told in the cycles in
// which a call is answered; and what is said of a goal reaches who sent it, until its end, and nobody else.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "swarm_honest.hpp"

namespace swarm {

class honest_goals {
 public:
  honest_goals(context& in, codec_check& check, std::uint64_t comes)
      : in_{in}, check_{check}, comes_{comes} {}

  // Before each cycle.
  void act() {
    if (in_.step < comes_ || in_.result.broken()) return;
    if (goal_) return;
    if (!provider_) {
      provider_ = come("127.0.0.1:40003");
      if (!provider_) return;
      provider_->say(R"({"op":"advertise_action","action":"/of/honest/dock","type":"sim/Dock"})");
      advertised_ = now();
    }
    if (!asker_) asker_ = come("127.0.0.1:40004");
    if (asker_ && in_.on.now >= sends_next_ && is_over(advertised_)) send();
  }

  // After each cycle that was one.
  void look() {
    if (provider_) {
      for (const std::string& text : provider_->hear()) provider_hears(text);
    }
    if (asker_) {
      for (const std::string& text : asker_->hear()) asker_hears(text);
    }
    for (const far_end* one : {provider_.get(), asker_.get()}) {
      if (one == nullptr) continue;
      if (!one->violated.empty()) fail("frames", "one was sent " + one->violated);
      if (one->cut()) fail("honest_cut", "one was disconnected: " + one->close_reason);
    }
    if (!goal_) return;
    // It ends by its time, which may jump: only cycles behind that count.
    if (goal_->is == story::ignored && goal_->awaits == word::result &&
        in_.on.now <= goal_->taken_back_at + in_.on.options.call_timeout)
      goal_->awaits_since = now();
    if (!is_over(goal_->awaits_since)) return;
    constexpr std::string_view words[] = {"nobody was given", "nobody was told the end of a goal that",
                                          "nobody was told that somebody has taken back"};
    fail("floor_goal", std::string{words[static_cast<int>(goal_->awaits)]} + " " + name_of(goal_->is) +
                           ", after " + std::to_string(in_.cycles - goal_->awaits_since.cycle) + " cycles");
  }

  void leave() {
    for (auto* one : {&provider_, &asker_}) leave(*one);
    goal_.reset();
  }

 private:
  enum class story : std::uint8_t { succeeds, fails, taken_back, ignored, provider_leaves, asker_leaves };
  static constexpr std::uint64_t stories = 6;
  static std::string name_of(story of) {
    constexpr std::string_view names[] = {"succeeds",
                                          "fails",
                                          "its sender takes back",
                                          "its sender takes back and its provider goes on with",
                                          "its provider leaves",
                                          "its sender leaves"};
    return std::string{names[static_cast<std::size_t>(of)]};
  }
  enum class word : std::uint8_t { goal, result, cancel };
  struct moment_of_work {
    std::uint64_t cycle = 0;
    time_point worked_until{};
  };
  struct goal {
    std::string id{};
    std::int64_t number = 0;
    story is = story::succeeds;
    word awaits = word::goal;
    moment_of_work awaits_since{};
    std::string given{}; // the id by which its provider knows it
    time_point taken_back_at{};
  };

  moment_of_work now() const { return {in_.cycles, in_.worked_until()}; }
  bool is_over(const moment_of_work& since) const {
    return in_.cycles > since.cycle + honest::cycles_max &&
           in_.worked_until() > since.worked_until + honest::time_max;
  }
  void fail(std::string_view invariant, const std::string& what) {
    in_.fail(invariant, "of the honest peers with an action " + what);
  }
  void await(word what) {
    goal_->awaits = what;
    goal_->awaits_since = now();
  }
  // None while connections that are being closed have all places.
  std::unique_ptr<far_end> come(std::string_view address) {
    auto made = std::make_unique<far_end>(in_.on, in_.ours, address);
    if (made->cut()) made.reset();
    return made;
  }
  static void leave(std::unique_ptr<far_end>& one) {
    if (one) one->leave();
    one.reset();
  }

  void send() {
    goal_ = goal{.id = "\"g" + std::to_string(++number_) + "\"",
                 .number = number_,
                 .is = static_cast<story>(in_.random.below(stories))};
    if (goal_->is == story::ignored && in_.on.options.call_timeout > 1s) goal_->is = story::taken_back;
    in_.say("honest sends a goal that " + name_of(goal_->is));
    asker_->say(R"({"op":"send_action_goal","feedback":true,"action":"/of/honest/dock","id":)" + goal_->id +
                R"(,"args":{"n":)" + std::to_string(number_) + "}}");
    await(word::goal);
  }
  void take_back() {
    asker_->say(R"({"op":"cancel_action_goal","action":"/of/honest/dock","id":)" + goal_->id + "}");
    await(word::cancel);
  }
  void answer(std::string_view op, const std::string& id, std::int64_t number, std::string_view more = "") {
    provider_->say(R"({"op":")" + std::string{op} + R"(","action":"/of/honest/dock","id":)" + id +
                   std::string{more} + R"(,"values":{"n":)" + std::to_string(number) + "}}");
  }

  // ---- the provider

  void provider_hears(const std::string& text) {
    const auto h = check_.look(text);
    if (h.is == codec_check::kind::wrong)
      return fail("json", "the provider was sent " + shortened(text) + ": " + h.why);
    if (h.is == codec_check::kind::status) return fail("honest_refused", "the provider was refused: " + text);
    if (h.is == codec_check::kind::feedback || h.is == codec_check::kind::answer)
      return fail("goals", "the provider, which asks for nothing, was answered " + shortened(text));
    const bool cancel = text.starts_with(R"({"op":"cancel_action_goal")");
    if (!cancel && !text.starts_with(R"({"op":"send_action_goal")")) return; // a call of this process
    if (!provider_) return;                                                  // it has left meanwhile
    if (!goal_ || goal_->awaits != (cancel ? word::cancel : word::goal) ||
        (cancel ? h.id_raw != goal_->given : integer_after(text, R"("args":{"n":)") != goal_->number))
      return fail("goals",
                  "the provider was sent what it has heard, or what nobody said: " + shortened(text));
    if (cancel) return carry_cancel_out();
    goal_->given = h.id_raw;
    auto& others = in_.known.asked_of_others; // whom nobody believes
    others.push_back(h.id_raw);
    if (others.size() > 8) others.erase(others.begin());
    // What was said of the last goal comes late.
    if (!over_.empty()) answer("action_feedback", over_, over_number_);
    answer("action_feedback", goal_->given, goal_->number);
    carry_out();
  }
  void carry_out() {
    switch (goal_->is) {
    case story::succeeds:
      answer("action_result", goal_->given, goal_->number, R"(,"status":4,"result":true)");
      return await(word::result);
    case story::fails:
      answer("action_result", goal_->given, goal_->number, R"(,"status":6,"result":false)");
      return await(word::result);
    case story::taken_back:
    case story::ignored: return take_back();
    case story::provider_leaves: await(word::result); return leave(provider_);
    case story::asker_leaves: await(word::cancel); return leave(asker_);
    }
  }
  void carry_cancel_out() {
    if (goal_->is == story::asker_leaves) return end();
    goal_->taken_back_at = in_.on.now;
    if (goal_->is == story::taken_back)
      answer("action_result", goal_->given, goal_->number, R"(,"status":5,"result":true)");
    await(word::result);
  }

  // ---- who sends goals

  void asker_hears(const std::string& text) {
    using kind = codec_check::kind;
    const auto h = check_.look(text);
    if (h.is == kind::wrong) return fail("json", "the sender was sent " + shortened(text) + ": " + h.why);
    if (h.is == kind::status) return fail("honest_refused", "the sender was refused: " + text);
    if (h.is != kind::feedback && h.is != kind::answer) return;
    if (!goal_ || h.id_raw != goal_->id)
      return fail("goals", "the sender heard of a goal that is over: " + shortened(text));
    const bool of_this = integer_after(text, R"("values":{"n":)") == goal_->number;
    if (h.is == kind::feedback) {
      if (!of_this) fail("goals", "the sender heard of another goal: " + shortened(text));
      return;
    }
    const bool own_word =
        goal_->is == story::succeeds || goal_->is == story::fails || goal_->is == story::taken_back;
    const bool timed_out = goal_->taken_back_at != time_point{} && h.failed &&
                           in_.on.now >= goal_->taken_back_at + in_.on.options.call_timeout;
    const bool right = goal_->is == story::fails ? h.failed : own_word ? !h.failed && of_this : h.failed;
    if (goal_->awaits != word::result && !timed_out)
      return fail("goals", "the sender heard the end of a goal too early: " + shortened(text));
    if (!right && !timed_out)
      return fail("goals", "a goal that " + name_of(goal_->is) + " ends so: " + shortened(text));
    end();
  }
  void end() {
    over_ = goal_->is == story::provider_leaves ? std::string{} : goal_->given;
    over_number_ = goal_->number;
    goal_.reset();
    sends_next_ = in_.on.now + 20ms;
  }

  context& in_;
  codec_check& check_;
  std::uint64_t comes_;
  std::unique_ptr<far_end> provider_, asker_;
  moment_of_work advertised_{};
  std::optional<goal> goal_;
  std::int64_t number_ = 0;
  std::string over_; // by which id its provider knew the last goal
  std::int64_t over_number_ = 0;
  time_point sends_next_{};
};

} // namespace swarm
