// SPDX-License-Identifier: Apache-2.0
// This process in a swarm world: handles of every kind that open, are used in every way, and close; and
// ordinary threads. Checked: a set-up that fits beside this process's own other handles succeeds, whatever
// untrusted peers hold; and a caller whose calls have all ended or been given up can call again.
#pragma once
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <rowe/caller.hpp>
#include <rowe/lane.hpp>
#include <rowe/publisher.hpp>
#include <rowe/responder.hpp>
#include <rowe/stop_latch.hpp>
#include <rowe/subscriber.hpp>

#include "swarm_context.hpp"
#include "swarm_parameters.hpp"
#include "swarm_recorder.hpp"
#include "swarm_threads.hpp"

namespace swarm {

struct reading {
  std::int64_t n;
  double x;
};

} // namespace swarm

template <>
inline constexpr auto
    rowe::schema<swarm::reading> = rowe::fields<&swarm::reading::n, &swarm::reading::x>{}.type("sim/Usual");

namespace swarm {

using rowe::json_text;
using rowe::detail::pair_kind;
using rowe::detail::pair_phase;

class handle {
 public:
  handle(context& in, handle_kind kind, const rowe::detail::pair_request& asked)
      : in_{in}, kind_{kind}, name_{asked.name}, type_{asked.type}, pair_{&in.on.offer(asked)} {
    latched_ = asked.latched && (kind == handle_kind::publish_text || kind == handle_kind::publish_value);
    switch (kind) {
    case handle_kind::publish_text: user_ = rowe::publisher<json_text>{held()}; break;
    case handle_kind::publish_value: user_ = rowe::publisher<reading>{held()}; break;
    case handle_kind::subscribe_text: user_ = rowe::subscriber<json_text>{held()}; break;
    case handle_kind::subscribe_value: user_ = rowe::subscriber<reading>{held()}; break;
    case handle_kind::respond: user_ = rowe::responder<json_text, json_text>{held()}; break;
    case handle_kind::call:
    case handle_kind::call_wait: user_ = rowe::caller<json_text, json_text>{held()}; break;
    case handle_kind::talk: user_ = rowe::lane{held()}; break;
    case handle_kind::latch: user_ = rowe::stop_latch{held()}; break;
    case handle_kind::record: break; // hears by its sink
    }
    text_max_ = asked.out_bytes;
    depth_ = asked.completions_depth;
  }

  handle_kind kind() const { return kind_; }
  const std::string& name() const { return name_; }
  const std::string& type() const { return type_; }
  bool latched() const { return latched_; }
  rowe::detail::queue_pair& pair() { return *pair_; }
  pair_phase phase() const { return pair_->lifecycle.look(); }
  bool is_detached() const { return phase() == pair_phase::held; } // only its memory is left
  bool honest = false;                                             // its owner alone uses it
  bool told = false;                                               // that it was refused
  // Of a recorder: nobody calls its sink once the handle is gone.
  void hears_by(recorder& sink) { sink_ = &sink; }
  ~handle() {
    if (sink_ != nullptr) sink_->gone = true;
  }
  handle(const handle&) = delete;
  handle& operator=(const handle&) = delete;
  bool of_topic() const { return kind_ <= handle_kind::subscribe_value; }

  // Of a latch: whether the loop moves. Anybody may look.
  bool moves = false;
  bool looks = true;

  void act() {
    begin_use();
    switch (kind_) {
    case handle_kind::publish_text:
    case handle_kind::publish_value: return publish(1 + in_.random.below(in_.random.one_in(8) ? 40 : 3));
    case handle_kind::subscribe_text: return take(std::get<rowe::subscriber<json_text>>(user_));
    case handle_kind::subscribe_value: return take_value();
    case handle_kind::respond: return respond();
    case handle_kind::call: return call();
    case handle_kind::call_wait: return; // in each step: wait()
    case handle_kind::talk: return say_something();
    case handle_kind::latch: return;
    case handle_kind::record: sink_->is_full = in_.random.one_in(2); return;
    }
  }

  // Of a subscriber with a lease: what is in force now.
  std::optional<reading> in_force() {
    begin_use();
    const auto found = std::get<rowe::subscriber<reading>>(user_).latest_within(in_.on.now);
    return found ? std::optional{found->value()} : std::nullopt;
  }

  // In each step: the part of a thread that waits, and of a loop.
  void wait() {
    if (kind_ == handle_kind::call_wait || kind_ == handle_kind::latch) begin_use();
    if (kind_ == handle_kind::call_wait) wait_for_call();
  }
  // A loop that obeys its latch.
  bool look() {
    auto& latch = std::get<rowe::stop_latch>(user_);
    const bool engaged = latch.engaged(in_.on.now);
    if (engaged && acknowledges) latch.acknowledge(in_.on.now);
    moves = !engaged;
    return moves;
  }
  bool acknowledges = true;

  // Closes the handle. Views and requests that it gave out end before it, or after it.
  void close() {
    const bool holds = !calls_.empty() || waits_ || outlived();
    if (in_.random.one_in(4)) let_go();
    in_.seen.add(kind_, outlived() ? moment::outlived
                        : holds    ? moment::closed_holding
                        : used_    ? moment::closed
                                   : moment::closed_unused);
    pair_->lifecycle.close();
  }
  void let_go() {
    requests_.clear();
    views_.clear();
  }
  bool outlived() const { return !requests_.empty() || !views_.empty(); }
  void finish_up() {
    let_go();
    if (kind_ == handle_kind::talk) {
      auto& lane_user = std::get<rowe::lane>(user_);
      while (lane_user.try_receive(in_.on.now)) continue;
      while (lane_user.try_finish()) continue;
    }
    if (kind_ == handle_kind::respond) {
      auto& responder = std::get<rowe::responder<json_text, json_text>>(user_);
      while (auto asked = responder.try_next(in_.on.now)) continue;
    }
    if (kind_ == handle_kind::call) finish_calls();
  }

 private:
  void begin_use() {
    if (!std::exchange(used_, true)) in_.seen.add(kind_, moment::used);
  }
  rowe::detail::pair_handle held() { return core_harness::handle_of(*pair_); }
  rowe::duration some_time() {
    constexpr rowe::duration times[] = {0ns, 1ms, 20ms, 100ms, 500ms, -1ns, -1ns};
    return in_.random.one_of(times);
  }
  std::string filling() {
    const std::size_t small = in_.known.bounds.small_slot_bytes;
    std::size_t bytes = in_.random.below(40);
    if (in_.random.one_in(6)) bytes = small - 100 + in_.random.below(100);
    if (in_.random.one_in(6)) bytes = small + in_.random.below(small);
    return std::string(std::min(bytes, text_max_ > 60 ? text_max_ - 60 : 0), 'y');
  }

  void publish(std::uint64_t times) {
    for (; times > 0; --times) {
      const std::uint32_t n = in_.note_publication(++in_.message_number, 0, latched_);
      if (kind_ == handle_kind::publish_text) {
        std::string text = "{\"n\":" + std::to_string(n) + ",\"x\":\"" + filling() + "\"}";
        if (in_.random.one_in(32)) text = in_.random.one_in(2) ? "[" : "7";
        (void)std::get<rowe::publisher<json_text>>(user_).publish(text, in_.on.now); // the outcome is counted
      } else {
        (void)std::get<rowe::publisher<reading>>(user_).publish({n, 0.5}, in_.on.now); // likewise
      }
    }
  }

  void take(rowe::subscriber<json_text>& from) {
    if (in_.random.one_in(3) && !views_.empty()) return views_.clear();
    auto got = in_.random.one_in(4) ? from.latest(in_.on.now) : from.try_take(in_.on.now);
    if (got && views_.size() < 4) views_.push_back(std::move(*got));
  }
  void take_value() {
    auto& from = std::get<rowe::subscriber<reading>>(user_);
    // looked at, and given back at once
    (void)(in_.random.one_in(4) ? from.latest(in_.on.now) : from.try_take(in_.on.now));
  }

  void respond() {
    auto& responder = std::get<rowe::responder<json_text, json_text>>(user_);
    if (requests_.empty() || in_.random.one_in(2)) {
      if (auto asked = responder.try_next(in_.on.now); asked && requests_.size() < 6)
        requests_.push_back(std::move(*asked));
      return;
    }
    const std::size_t which = in_.random.below(requests_.size());
    rowe::request<json_text> one = std::move(requests_[which]);
    requests_.erase(requests_.begin() + static_cast<std::ptrdiff_t>(which));
    switch (in_.random.below(8)) {
    case 0: return;                                                // forgotten
    case 1: (void)responder.refuse(one, "no", in_.on.now); return; // a caller that is gone needs none
    case 2: (void)responder.reply(one, "[", in_.on.now); return;   // likewise
    default: (void)responder.reply(one, "{\"x\":\"" + filling() + "\"}", in_.on.now); return; // likewise
    }
  }

  // ---- calls

  std::string request_text() {
    return in_.random.one_in(16) ? "{" : "{\"a\":1,\"b\":2,\"x\":\"" + filling() + "\"}";
  }
  void finish_calls() {
    auto& caller = std::get<rowe::caller<json_text, json_text>>(user_);
    while (const auto end = caller.try_finish()) {
      const auto at = std::find(calls_.begin(), calls_.end(), end->id);
      if (at == calls_.end())
        return in_.fail("calls", "a caller is given the completion of no call that it wants");
      calls_.erase(at);
    }
  }
  void call() {
    auto& caller = std::get<rowe::caller<json_text, json_text>>(user_);
    if (!calls_.empty() && in_.random.one_in(4)) {
      const std::size_t which = in_.random.below(calls_.size());
      caller.cancel(calls_[which]);
      calls_.erase(calls_.begin() + static_cast<std::ptrdiff_t>(which));
      return;
    }
    if (in_.random.one_in(2)) return finish_calls();
    const auto started = caller.start(request_text(), some_time(), in_.on.now);
    if (started) calls_.push_back(*started);
  }

  // caller::call(), a step at a time: starts, looks for the end, gives up a little after the time-out. As
  // long as none is started without waiting, all places are free again a while after the last one.
  void wait_for_call() {
    auto& caller = std::get<rowe::caller<json_text, json_text>>(user_);
    namespace d = rowe::detail;
    // Time may jump: only cycles after the last end can free places.
    if (in_.on.now <= last_ends_ + 300ms) served_at_ = in_.cycles;
    if (waits_) {
      const d::call_ref call{waits_->index, waits_->generation};
      if (const auto slot = d::take_completion_of(*pair_, call)) {
        d::release_completion(*pair_, *slot);
        waits_.reset();
        served_at_ = in_.cycles;
      } else if (in_.on.now >= gives_up_) {
        d::give_up(*pair_, call);
        waits_.reset();
        served_at_ = in_.cycles;
      }
      return;
    }
    if (!in_.random.one_in(6)) return;
    constexpr rowe::duration times[] = {1ms, 5ms, 20ms, 50ms};
    const rowe::duration timeout = in_.random.one_of(times);
    d::reclaim_rows(*pair_);
    const auto started = caller.start("{\"a\":1}", timeout, in_.on.now);
    if (started) {
      gives_up_ = in_.on.now + timeout + d::word_late_max;
      if (in_.random.one_in(6)) {
        caller.cancel(*started); // started without waiting, and not wanted any more
        last_ends_ = std::max(last_ends_, gives_up_);
        served_at_ = in_.cycles; // its place comes free in the cycles from here on
        return;
      }
      waits_ = *started;
      last_ends_ = std::max(last_ends_, gives_up_);
      return;
    }
    if (started.code() == rowe::errc::too_many_calls && in_.on.now > last_ends_ + 300ms &&
        in_.cycles > served_at_ + 40) {
      in_.fail("rows_of_calls", "a caller whose " + std::to_string(depth_) +
                                    " calls have all ended or been given up is told that there are too many");
    }
  }

  void say_something() {
    auto& lane_user = std::get<rowe::lane>(user_);
    switch (in_.random.below(8)) {
    case 0:
    case 1: // a message that finds no room is counted
      (void)lane_user.try_send(in_.random.one_in(16) ? "[]" : "{\"x\":\"" + filling() + "\"}", some_time(),
                               in_.on.now);
      return;
    case 2: {
      constexpr std::string_view names[] = {"/s0",         "/s1",        "/nobody",
                                            "/rowe/stats", "/rowe/stop", "/honest/echo"};
      const auto started = lane_user.start(
          R"({"service":")" + std::string{in_.random.one_of(names)} + R"(","a":1})", some_time(), in_.on.now);
      if (started) calls_.push_back(*started);
      return;
    }
    case 3:
      if (!calls_.empty()) {
        lane_user.cancel(calls_.back());
        calls_.pop_back();
      }
      return;
    case 4:
      while (lane_user.try_finish()) continue;
      calls_.clear();
      return;
    case 5:
      if (auto got = lane_user.try_receive(in_.on.now); got && views_.size() < 4)
        views_.push_back(std::move(*got));
      return;
    case 6:
      if (!views_.empty())
        (void)lane_user.try_reply(views_.back(), "{\"x\":\"" + filling() + "\"}", in_.on.now);
      return;
    default:
      if (!views_.empty()) views_.pop_back();
      return;
    }
  }

  context& in_;
  handle_kind kind_;
  std::string name_;
  std::string type_;
  rowe::detail::queue_pair* pair_;
  recorder* sink_ = nullptr; // which lives as long as the process
  bool latched_ = false;
  bool used_ = false;
  std::size_t text_max_ = 0;
  std::uint32_t depth_ = 0;
  std::variant<std::monostate, rowe::publisher<json_text>, rowe::publisher<reading>,
               rowe::subscriber<json_text>, rowe::subscriber<reading>, rowe::responder<json_text, json_text>,
               rowe::caller<json_text, json_text>, rowe::lane, rowe::stop_latch>
      user_;
  std::vector<rowe::request<json_text>> requests_;
  std::vector<rowe::message_view> views_;
  std::vector<rowe::call_id> calls_;
  std::optional<rowe::call_id> waits_;
  time_point gives_up_{};
  time_point last_ends_{};
  std::uint64_t served_at_ = 0;
};

// All handles of this process, and its ordinary threads.
class process {
 public:
  explicit process(context& in) : in_{in}, uses_(handle_kinds), threads_{in.on} {
    uses_.randomise(in.random);
  }

  std::vector<std::unique_ptr<handle>>& handles() { return handles_; }
  bool receives = true; // else nothing here takes what comes for nobody: the honest peer's thread receives

  // Opens a handle; those of the honest peer have names.
  handle* open(handle_kind kind, const rowe::detail::pair_request& asked) {
    if (!has_free_pair()) return nullptr;
    std::unique_ptr<handle> made;
    try {
      made = std::make_unique<handle>(in_, kind, asked);
    } catch (const std::runtime_error&) {
      return nullptr; // the memory of queue pairs is used up
    }
    in_.say("process opens " + std::string{name_of(kind)} + " " + made->name() + " type '" + made->type() +
            (made->latched() ? "', latched" : "'"));
    note(*made, 1);
    in_.seen.add(kind, moment::opened);
    if (made->latched()) in_.seen.add(kind, moment::opened_latched);
    if (!pairs_used_.insert(&made->pair()).second) in_.seen.add(kind, moment::opened_again);
    if (kind == handle_kind::latch) in_.stop_in_use = true;
    handles_.push_back(std::move(made));
    return handles_.back().get();
  }
  void open_any() {
    const std::size_t which = uses_.choose(in_.random, 0, handle_kinds, 0, [](std::size_t) { return true; });
    const auto kind = static_cast<handle_kind>(which);
    constexpr std::string_view types[] = {"", "sim/Usual", "sim/Usual", "sim/Usual", "sim/Other"};
    constexpr std::string_view services[] = {"/s0",          "/s1",        "/s2",        "/nobody",
                                             "/honest/echo", "/rowe/stop", "/rowe/stats"};
    constexpr std::uint32_t depths[] = {1, 2, 8, 16};
    constexpr rowe::duration lives[] = {0ns, 1ms, 20ms, 100ms, 500ms, rowe::rt::for_ever};
    rowe::topic_options topic{.ttl = in_.random.one_of(lives),
                              .keep = in_.random.one_in(3) ? rowe::keep::newest : rowe::keep::all,
                              .depth = in_.random.one_of(depths),
                              .priority = static_cast<rowe::priority>(in_.random.below(3)),
                              .latched = in_.random.one_in(2),
                              .shared = in_.random.one_in(2),
                              .type = in_.random.one_of(types),
                              .text_bytes_max = in_.random.one_in(2) ? 200U : 3000U};
    if (in_.random.one_in(3)) topic.period = 20ms;
    // So few that the latched values of this process always fit in its half.
    if (topic.latched && in_.known.bounds.latched_bytes <= 16 * 1024)
      topic.text_bytes_max = std::min(topic.text_bytes_max, 1000U);
    const std::string name{own_topics[in_.random.below(std::min(in_.known.names, std::size(own_topics)))]};
    const std::string service{in_.random.one_of(services)};
    const rowe::service_options how{
        .depth = in_.random.one_of(depths), .type = "sim/Add", .text_bytes_max = 2000};
    using namespace rowe::detail;
    switch (kind) {
    case handle_kind::publish_text: open(kind, advertise_request<json_text>(name, topic)); return;
    case handle_kind::publish_value:
      topic.type = {};
      open(kind, advertise_request<reading>(name, topic));
      return;
    case handle_kind::subscribe_text: open(kind, subscribe_request<json_text>(name, topic)); return;
    case handle_kind::subscribe_value:
      topic.type = {};
      open(kind, subscribe_request<reading>(name, topic));
      return;
    case handle_kind::respond:
      open(kind, serve_request<json_text, json_text>(in_.random.one_of(shared_services), how));
      return;
    case handle_kind::call:
    case handle_kind::call_wait: open(kind, client_request<json_text, json_text>(service, how)); return;
    case handle_kind::talk:
      open(kind, {.kind = pair_kind::talk,
                  .priority = topic.priority,
                  .receives = receives && in_.random.one_in(2),
                  .out_depth = 8,
                  .in_depth = 4,
                  .completions_depth = 4,
                  .out_bytes = 2000,
                  .in_bytes = 2000,
                  .completions_bytes = 2000});
      return;
    case handle_kind::latch: open_latch(); return;
    case handle_kind::record: open_recorder(); return;
    }
  }
  void open_recorder() {
    if (std::ranges::count(handles_, handle_kind::record, &handle::kind) +
            std::ranges::count(closing_, handle_kind::record, &handle::kind) >=
        4)
      return;
    recorders_.push_back(std::make_unique<recorder>(in_));
    if (handle* const made = open(handle_kind::record, rowe::detail::record_request(*recorders_.back())))
      made->hears_by(*recorders_.back());
  }
  void open_latch() {
    constexpr rowe::duration times[] = {1ms, 50ms, 100ms, 1s, 10s};
    std::size_t latches = 0;
    for (const auto& one : handles_) latches += one->kind() == handle_kind::latch;
    if (latches >= 3) return;
    open(handle_kind::latch, rowe::detail::latch_request({.name = "loop" + std::to_string(latches),
                                                          .loop_timeout = in_.random.one_of(times)}));
  }

  void close(const handle& which) {
    close(static_cast<std::size_t>(std::ranges::find(handles_, &which, &std::unique_ptr<handle>::get) -
                                   handles_.begin()));
  }
  void close(std::size_t which) {
    handle& gone = *handles_[which];
    in_.say("process closes " + std::string{name_of(gone.kind())} + " " + gone.name());
    note(gone, -1);
    gone.close();
    closing_.push_back(std::move(handles_[which]));
    handles_.erase(handles_.begin() + static_cast<std::ptrdiff_t>(which));
  }
  void close_any() {
    if (handles_.empty()) return;
    const std::size_t which = in_.random.below(handles_.size());
    if (!handles_[which]->honest) close(which);
  }

  void act() {
    if (in_.random.one_in(8)) parameters_.act();
    if (handles_.empty()) return;
    handle& one = *handles_[in_.random.below(handles_.size())];
    if (one.honest) return;
    in_.say("process uses " + std::string{name_of(one.kind())} + " " + one.name());
    one.act();
  }

  // After each cycle: the answers to set-up. A refused handle is closed, as set-up does.
  void look_at_answers() {
    for (const auto& one : closing_) {
      if (one->outlived() && in_.random.one_in(32)) one->let_go();
    }
    std::erase_if(closing_, [](const auto& one) { return one->phase() == pair_phase::free; });
    for (std::size_t i = 0; i < handles_.size();) {
      handle& one = *handles_[i];
      if (one.phase() != pair_phase::refused || one.told) {
        ++i;
        continue;
      }
      one.told = true;
      in_.seen.add(one.kind(), moment::refused);
      if (const std::string why = explained(one); why.empty())
        in_.fail("set_up",
                 "the handle " + std::string{name_of(one.kind())} + " " + one.name() +
                     " of this process is refused: " + std::string{one.pair().lifecycle.refusal().name()});
      one.honest ? ++i : (close(i), i);
    }
  }
  bool has_free_pair() const {
    return std::any_of(in_.on.pairs.begin(), in_.on.pairs.end(),
                       [](const rowe::detail::queue_pair& one) { return one.lifecycle.is_free(); });
  }

  void wait() {
    for (const auto& one : handles_) one->wait();
  }
  void finish_up() {
    for (const auto& one : handles_) {
      if (!one->honest) one->finish_up();
    }
    threads_.finish_up();
  }
  void close_all() {
    while (!handles_.empty()) close(0);
    for (const auto& one : closing_) one->let_go();
  }
  bool all_closed() const { return closing_.empty() && handles_.empty(); }

  // ---- ordinary threads

  threads& ordinary_threads() { return threads_; }
  void use_thread(const recipe& what) {
    const saying said = render(in_.random, what, in_.known);
    const operation& of = operations()[said.operation];
    if (of.goes == form::thread_stop && !in_.stop_in_use) return; // as before there is a latch
    in_.say("an ordinary thread of the process: " + std::string{of.name} + " " + shortened(said.text));
    if (said.resets) in_.resets.insert({said.number, said.tick});
    const state stop = in_.state_of_stop();
    const auto came_upon = threads_.carry_out(in_.random, what, said);
    if (!came_upon) return;
    for (const dimension d : of.of) {
      const state now = d == dimension::stop ? stop : *came_upon;
      in_.seen.add(row_of(what.operation), now);
      for (std::size_t m = 0; m < what.classes.size(); ++m)
        in_.seen.add(row_of(what.operation, m, what.classes[m]), now);
    }
  }

 private:
  void note(const handle& one, int by) {
    const auto add = [by](std::map<std::string, std::uint32_t>& to, const std::string& name) {
      to[name] += static_cast<std::uint32_t>(by);
    };
    if (one.of_topic()) add(in_.own, one.name());
    if (one.latched()) {
      add(in_.own_latched, one.name());
      in_.once_latched.insert(one.name());
    }
    if (one.kind() == handle_kind::respond) add(in_.own_services, one.name());
  }

  // Why set-up may refuse it, for the sake of this process's own other handles.
  std::string explained(const handle& refused) const {
    const auto others = [&](auto&& is) {
      const auto match = [&](const auto& one) {
        return one.get() != &refused && !one->is_detached() && is(*one);
      };
      return std::any_of(handles_.begin(), handles_.end(), match) ||
             std::any_of(closing_.begin(), closing_.end(), match);
    };
    switch (const_cast<handle&>(refused).pair().lifecycle.refusal().code) {
    case rowe::errc::type_conflict:
      return others([&](const handle& one) {
        return one.of_topic() && one.name() == refused.name() && one.type() != refused.type();
      })
                 ? "another handle has another type"
                 : "";
    case rowe::errc::service_taken:
      return others([&](const handle& one) {
        return one.kind() == handle_kind::respond && one.name() == refused.name();
      })
                 ? "another handle serves it"
                 : "";
    case rowe::errc::too_many_topics: {
      std::uint32_t own = in_.drives ? 4 : 3; // the endpoint's, with /rowe/parameters
      for (const auto& [topic, count] : in_.own) own += count != 0;
      for (const auto& one : closing_) own += one->of_topic() && !one->is_detached();
      return own > in_.known.bounds.topics_max ? "all are this process's own" : "";
    }
    case rowe::errc::too_many_services: {
      std::uint32_t own = 0;
      for (const auto& [service, count] : in_.own_services) own += count;
      for (const auto& one : closing_) own += one->kind() == handle_kind::respond && !one->is_detached();
      return own > in_.known.bounds.services_max ? "all are its own" : "";
    }
    default: return "";
    }
  }

  context& in_;
  weights uses_;
  std::vector<std::unique_ptr<recorder>> recorders_; // all that there were
  std::vector<std::unique_ptr<handle>> handles_;
  std::vector<std::unique_ptr<handle>> closing_;
  threads threads_;
  process_parameters parameters_{in_};
  std::set<const rowe::detail::queue_pair*> pairs_used_;
};

} // namespace swarm
