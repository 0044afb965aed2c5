// SPDX-License-Identifier: Apache-2.0
// A peer with numbers that reads, and keeps to the rules. It knows each topic and service that there is, and
// has the same floor of service as the honest peer with names (swarm_honest.hpp), on the handles of that one.
// Now and then it comes anew, and what it is told then must be what it knew.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "swarm_honest.hpp"

namespace swarm {

class honest_by_number {
 public:
  honest_by_number(context& in, codec_check& check, std::uint64_t comes)
      : in_{in}, check_{check}, comes_{comes} {}

  // Before each cycle. `handles_are_there`: those that it calls and hears.
  void act(bool handles_are_there) {
    if (in_.step < comes_ || in_.result.broken()) return;
    if (!link_) {
      link_ = open();
      link_->say(R"({"offer":[[1,"/of/numbers"]]})");
    }
    if (!knows_.greeted) return;
    subscribe();
    if (handles_are_there) ask();
    look_anew();
  }

  // After each cycle that was one.
  void look() {
    if (!link_) return;
    for (const std::string& text : link_->hear()) hear(text);
    if (second_) hear_anew();
    if (!link_->violated.empty()) fail("frames", "was sent " + link_->violated);
    if (link_->cut()) fail("honest_cut", "was disconnected: " + link_->close_reason);
    if (asked_ && in_.cycles > asked_->cycle + honest::cycles_max &&
        in_.worked_until() > asked_->worked_until + honest::time_max)
      fail("floor_call",
           "has no answer to a call after " + std::to_string(in_.cycles - asked_->cycle) + " cycles");
  }

  void leave() {
    if (link_) link_->leave();
    if (second_) second_->leave();
    link_.reset();
    second_.reset();
    asked_.reset();
  }

 private:
  static constexpr std::uint32_t tag = 7;
  static constexpr auto catches_up = 1s;
  static constexpr std::string_view steady = "/honest/steady";
  struct call {
    std::uint32_t service = 0;
    std::string id{};
    std::uint64_t cycle = 0;
    time_point worked_until{};
    time_point at{};
  };

  std::unique_ptr<far_end> open() {
    return std::make_unique<far_end>(in_.on, in_.ours, "127.0.0.1:40002", "/", numbers::subprotocol);
  }
  void fail(std::string_view invariant, const std::string& what) {
    in_.fail(invariant, "the honest peer with numbers " + what);
  }

  // A topic that gets another number is the same topic: the subscription stays.
  void subscribe() {
    const std::uint32_t number = knows_.topics.number_of(steady);
    if (subscribed_ || number == rowe::wire::no_number) return;
    subscribed_ = true;
    link_->say("{\"want\":[[" + std::to_string(tag) + "," + std::to_string(number) + "]]}");
  }

  void ask() {
    const std::uint32_t number = knows_.services.number_of(honest_service);
    if (asked_ || in_.on.now < asks_next_ || number == rowe::wire::no_number) return;
    asks_next_ = in_.on.now + 60ms;
    ++calls_;
    asked_ = {.service = number,
              .id = numbers::four(calls_),
              .cycle = in_.cycles,
              .worked_until = in_.worked_until(),
              .at = in_.on.now};
    link_->send(rowe::wire::opcode::binary,
                "c" + numbers::four(number) + asked_->id + "{\"a\":" + std::to_string(calls_) + "}");
  }

  void hear(const std::string& text) {
    if (number_lists::is_list(text)) {
      if (const std::string why = knows_.take(text); !why.empty())
        fail("listing", "was sent " + shortened(text) + ": " + why);
      give_up_what_is_gone();
      return;
    }
    const std::string_view all = text;
    if (text.starts_with('{') && in_.on.options.bare_unasked) return; // a plain message, to everyone
    switch (text.empty() ? ' ' : text.front()) {
    case 'e': {
      // The number may have gone while this was under way.
      if (all.find("has this number") == std::string_view::npos)
        return fail("honest_refused", "hears " + text);
      subscribed_ = false;
      return;
    }
    case 'm':
      if (numbers::number_at(all.substr(1)) != tag) return fail("ids", "is sent a number that it never gave");
      if (const std::string why = check_.look_at_object(all.substr(13)); !why.empty())
        return fail("json", "was sent " + shortened(text) + ": " + why);
      ++heard_;
      return;
    case 'r':
    case 'f': return hear_answer(all);
    default: return fail("json", "was sent " + shortened(text));
    }
  }
  // Its call may have come when the number was gone. So many of such are refused in a second, and no more.
  void give_up_what_is_gone() {
    if (!asked_ || knows_.services.names().contains(asked_->service)) return;
    given_up_.insert(asked_->id);
    asked_.reset();
  }
  void hear_answer(std::string_view text) {
    if (given_up_.contains(text.substr(1, 4))) return;
    if (!asked_ || text.substr(1, 4) != asked_->id) return fail("ids", "is answered what it never asked");
    const std::string_view body = text.substr(5);
    // Where time jumps, or nobody does anything for long, its time may truly be over; and where its number
    // has gone, it knows by now.
    const bool late = in_.on.now > asked_->at + 150ms;
    if (text.front() == 'f' && !late && body.find("has this number") == std::string_view::npos)
      return fail("floor_call", "is refused: " + std::string{body});
    if (text.front() == 'r' && integer_after(body, "{\"a\":") != static_cast<std::int64_t>(calls_))
      return fail("answers", "was answered with another's answer: " + shortened(body));
    if (text.front() == 'r') ++served;
    asked_.reset();
  }

  // ---- comes anew

  void look_anew() {
    if (second_ || in_.on.now < anew_next_) return;
    anew_next_ = in_.on.now + 400ms;
    second_ = open();
    anew_ = {};
    anew_in_ = in_.cycles;
    anew_at_ = in_.on.now;
  }
  // What one is told at once the other was told by and by. Both have read all that there is. Where there are
  // many changes both are told with pauses, and know the same some time after the second one came.
  void hear_anew() {
    for (const std::string& text : second_->hear()) {
      if (text.starts_with('{') && in_.on.options.bare_unasked) continue; // likewise
      if (!number_lists::is_list(text)) return fail("listing", "who comes anew was sent " + shortened(text));
      if (const std::string why = anew_.take(text); !why.empty())
        return fail("listing", "who comes anew was sent " + shortened(text) + ": " + why);
    }
    if (second_->cut())
      return fail("honest_cut", "who comes anew was disconnected: " + second_->close_reason);
    if (in_.cycles > anew_in_ + honest::cycles_max && !anew_.greeted)
      return fail("listing", "who comes anew is not greeted");
    if (!anew_.greeted || in_.cycles < anew_in_ + 3 || !all_was_read()) return;
    for (const bool of_topics : {true, false}) {
      const auto& old = (of_topics ? knows_.topics : knows_.services).names();
      const auto& now = (of_topics ? anew_.topics : anew_.services).names();
      if (old == now) continue;
      if (in_.on.now < anew_at_ + catches_up || in_.cycles < anew_in_ + honest::cycles_max) return;
      std::string text = of_topics ? "knows of other topics:" : "knows of other services:";
      for (const auto& [number, name] : old) text += now.contains(number) ? "" : " -" + name;
      for (const auto& [number, name] : now) text += old.contains(number) ? "" : " +" + name;
      return fail("listing_changes", text);
    }
    second_->leave();
    second_.reset();
  }
  bool all_was_read() const {
    return in_.on.net.sent(link_->id()).empty() && in_.on.net.sent(second_->id()).empty();
  }

 public:
  std::uint64_t served = 0; // calls

 private:
  context& in_;
  codec_check& check_;
  std::uint64_t comes_;
  std::unique_ptr<far_end> link_, second_;
  number_lists knows_{}, anew_{};
  bool subscribed_ = false;
  std::uint64_t heard_ = 0; // messages of the steady topic
  std::optional<call> asked_{};
  std::set<std::string, std::less<>> given_up_{};
  std::uint32_t calls_ = 0;
  time_point asks_next_{}, anew_next_{};
  std::uint64_t anew_in_ = 0;
  time_point anew_at_{};
};

} // namespace swarm
