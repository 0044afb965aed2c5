// SPDX-License-Identifier: Apache-2.0
// A peer with numbers that reads, and keeps to the rules. It knows each topic and service that there is, and
// has the same floor of service as the honest peer with names (swarm_honest.hpp), on the handles of that one.
// Now and then it comes anew, and what it is told then must be what it knew.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "swarm_honest.hpp"
#include "swarm_honest_parameters.hpp"

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
      link_->say(speaks == tongue::numbers ? R"({"offer":[[1,"/of/numbers"]]})" : offer_in_foxglove);
    }
    if (!knows_.greeted) return;
    subscribe();
    if (handles_are_there) ask();
    look_anew();
    if (speaks == tongue::foxglove) parameters_.act(*link_);
    if (speaks == tongue::foxglove && !std::exchange(sees_graph_, true)) link_->say(graph);
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
    parameters_.look();
  }

  void leave() {
    parameters_.leave();
    sees_graph_ = false;
    graph_ = {};
    if (link_) link_->leave();
    if (second_) second_->leave();
    link_.reset();
    second_.reset();
    asked_.reset();
  }

 private:
  static constexpr std::uint32_t tag = 7;
  static constexpr auto catches_up = 2s;
  static constexpr std::string_view offer_in_foxglove =
      R"({"op":"advertise","channels":[{"id":1,"topic":"/of/numbers","encoding":"json","schemaName":""}]})";
  static constexpr std::string_view steady = "/honest/steady";
  static constexpr std::string_view graph = R"({"op":"subscribeConnectionGraph"})";
  struct call {
    std::uint32_t service = 0;
    std::string id{};
    std::uint64_t cycle = 0;
    time_point worked_until{};
    time_point at{};
  };

  std::unique_ptr<far_end> open() {
    const auto by = speaks == tongue::numbers ? numbers::subprotocol : foxglove::subprotocol;
    return std::make_unique<far_end>(in_.on, in_.ours, "127.0.0.1:40002", "/", by);
  }
  void fail(std::string_view invariant, const std::string& what) {
    in_.fail(invariant, "the honest peer with numbers " + what);
  }

  // A topic that gets another number is the same topic: the subscription stays.
  void subscribe() {
    const std::uint32_t number = knows_.topics.number_of(steady);
    if (subscribed_ || number == rowe::wire::no_number) return;
    subscribed_ = true;
    const std::string its = std::to_string(tag), channel = std::to_string(number);
    link_->say(speaks == tongue::numbers ? "{\"want\":[[" + its + "," + channel + "]]}"
                                         : R"({"op":"subscribe","subscriptions":[{"id":)" + its +
                                               R"(,"channelId":)" + channel + "}]}");
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
    const std::string args = "{\"a\":" + std::to_string(calls_) + "}";
    link_->send(rowe::wire::opcode::binary, speaks == tongue::numbers
                                                ? "c" + numbers::four(number) + asked_->id + args
                                                : foxglove::call(number, asked_->id, args));
  }

  // As it is by the codec with numbers; nothing where it has no such words.
  std::optional<std::string> understood(const std::string& text, graph_view& graph_of_it) {
    const bool plain = text.starts_with('{') && !text.starts_with(R"({"op":)");
    if (speaks == tongue::numbers || plain) return text;
    auto heard = foxglove::as_numbers(
        text, [&](const std::string& json) { return check_.look_at_object(json).empty(); });
    if (!heard.wrong.empty()) fail("json", "was sent " + shortened(text, 700) + ": " + heard.wrong);
    if (heard.of_others) graph_view::is_update(text) ? (void)graph_of_it.take(text) : parameters_.hear(text);
    return heard.wrong.empty() && !heard.of_others ? std::optional{std::move(heard.text)} : std::nullopt;
  }
  void hear(const std::string& message) {
    const auto words = understood(message, graph_);
    if (!words) return;
    const std::string& text = *words;
    if (number_lists::is_list(text)) {
      if (const std::string why = knows_.take(text); !why.empty())
        fail("listing", "was sent " + shortened(text) + ": " + why);
      return;
    }
    const std::string_view all = text;
    if (text.starts_with('{') && in_.on.options.plain_unasked) return; // a plain message, to everyone
    switch (text.empty() ? ' ' : text.front()) {
    case 'e': {
      if (all.find("messages for this client were dropped") != std::string_view::npos) return;
      // The number may have gone while this was under way.
      if (all.find("has the number") == std::string_view::npos)
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
  void hear_answer(std::string_view text) {
    if (!asked_ || text.substr(1, 4) != asked_->id) return fail("ids", "is answered what it never asked");
    const std::string_view body = text.substr(5);
    // Where time jumps, or nobody does anything for long, its time may truly be over; and where its number
    // has gone, it knows by now.
    const bool late = in_.on.now > asked_->at + 150ms;
    if (text.front() == 'f' && !late && body.find("has the number") == std::string_view::npos)
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
    anew_graph_ = {};
    same_lists_ = false;
    if (speaks == tongue::foxglove) second_->say(graph);
    anew_in_ = in_.cycles;
    anew_at_ = in_.worked_until();
  }
  // What one is told at once the other was told by and by. Both have read all that there is. Where there are
  // many changes both are told with pauses, and know the same some time after the second one came.
  void hear_anew() {
    for (const std::string& message : second_->hear()) {
      const auto words = understood(message, anew_graph_);
      if (!words) continue;
      const std::string& text = *words;
      if (text.starts_with('{') && in_.on.options.plain_unasked) continue; // likewise
      if (!number_lists::is_list(text)) return fail("listing", "who comes anew was sent " + shortened(text));
      if (const std::string why = anew_.take(text); !why.empty())
        return fail("listing", "who comes anew was sent " + shortened(text) + ": " + why);
    }
    if (second_->cut())
      return fail("honest_cut", "who comes anew was disconnected: " + second_->close_reason);
    if (in_.cycles > anew_in_ + honest::cycles_max && !anew_.greeted)
      return fail("listing", "who comes anew is not greeted");
    if (!anew_.greeted || in_.cycles < anew_in_ + 3 || !all_was_read()) return;
    if (!same_lists_ && !know_the_same_lists()) return;
    same_lists_ = true;
    if (speaks == tongue::foxglove && !know_the_same_graph()) return;
    second_->leave();
    second_.reset();
  }
  bool know_the_same_lists() {
    for (const bool of_topics : {true, false}) {
      const auto& old = (of_topics ? knows_.topics : knows_.services).names();
      const auto& now = (of_topics ? anew_.topics : anew_.services).names();
      if (old == now) continue;
      if (in_.worked_until() < anew_at_ + catches_up || in_.cycles < anew_in_ + honest::cycles_max)
        return false;
      std::string text = of_topics ? "knows of other topics:" : "knows of other services:";
      for (const auto& [number, name] : old) text += now.contains(number) ? "" : " -" + name;
      for (const auto& [number, name] : now) text += old.contains(number) ? "" : " +" + name;
      fail("listing_changes", text);
      return false;
    }
    return true;
  }
  // Both are told after the same comparison, four times a second. What is told of holders may be from a later
  // cycle, so they need not know the same after each.
  bool know_the_same_graph() {
    const auto differs = [](const graph_view::holders& old, const graph_view::holders& now) {
      return graph_view::held(old) != graph_view::held(now);
    };
    const bool publishers = differs(graph_.publishers, anew_graph_.publishers);
    const bool subscribers = differs(graph_.subscribers, anew_graph_.subscribers);
    const bool providers = differs(graph_.providers, anew_graph_.providers);
    if (!publishers && !subscribers && !providers) return true;
    if (in_.worked_until() < anew_at_ + 5 * catches_up || in_.cycles < anew_in_ + 5 * honest::cycles_max)
      return false;
    std::string text = "knows of other ";
    text += publishers ? "publishers" : subscribers ? "subscribers" : "providers";
    const auto list = [&](char sign, const graph_view& of) {
      const auto& its = publishers ? of.publishers : subscribers ? of.subscribers : of.providers;
      for (const auto& [name, who] : graph_view::held(its)) {
        text += std::string{" "} + sign + name;
        for (const std::string& one : who) text += "," + one;
      }
    };
    list('-', graph_);
    list('+', anew_graph_);
    fail("graph_changes", text);
    return false;
  }
  bool all_was_read() const {
    return in_.on.net.sent(link_->id()).empty() && in_.on.net.sent(second_->id()).empty();
  }

 public:
  std::uint64_t served = 0; // calls
  tongue speaks = tongue::numbers;

 private:
  context& in_;
  codec_check& check_;
  std::uint64_t comes_;
  std::unique_ptr<far_end> link_, second_;
  honest_parameters parameters_{in_};
  number_lists knows_{}, anew_{};
  graph_view graph_{}, anew_graph_{};
  bool sees_graph_ = false;
  bool same_lists_ = false; // since the second one came
  bool subscribed_ = false;
  std::uint64_t heard_ = 0; // messages of the steady topic
  std::optional<call> asked_{};
  std::uint32_t calls_ = 0;
  time_point asks_next_{}, anew_next_{};
  std::uint64_t anew_in_ = 0;
  time_point anew_at_{};
};

} // namespace swarm
