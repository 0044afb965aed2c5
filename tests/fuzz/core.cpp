// SPDX-License-Identifier: Apache-2.0
// The core under arbitrary scripts: connections that open and break, raw bytes and texts made of the input's
// bytes, what the simulation's grammar has for peers of each codec and for ordinary threads (a byte for the
// operation and each class), handles that are opened, used and closed, time. Input: one byte of set-up (bit 0
// the role, bit 1 relaying, bits 2 and 3 the profile, bit 4 whether the queue pair receives, bit 5 whether
// clients may speak by numbers, bit 6 whether there is a stop, bit 7 whether there is a driven topic), then
// commands of one byte each with their arguments. What is required: the core's structures agree after every
// cycle, peers are sent nothing but WebSocket frames, who is told by numbers what there is is told each thing
// once, nothing drives a robot that is stopped or without a driver, and when everyone has left every slot is
// free.
#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/caller.hpp>
#include <rowe/lane.hpp>
#include <rowe/responder.hpp>
#include <rowe/stop_latch.hpp>
#include <rowe/subscriber.hpp>

#include "fuzz/require.hpp"
#include "fuzz/script.hpp"
#include "service/core/core_harness.hpp"
#include "sim/swarm_context.hpp"
#include "sim/swarm_grammar.hpp"
#include "sim/swarm_threads.hpp"

namespace {

using namespace std::chrono_literals;
using rowe::fuzz::input_choices;
using rowe::fuzz::require;
using rowe::fuzz::script;
using rowe::service::side;

struct pair {
  std::int64_t a, b;
};
struct motion { // as the grammar commands it
  std::int64_t n;
  double x;
};

} // namespace

template <>
inline constexpr auto rowe::schema<pair> = rowe::fields<&pair::a, &pair::b>{};
template <>
inline constexpr auto rowe::schema<motion> = rowe::fields<&motion::n, &motion::x>{};

namespace {

rowe::endpoint_options options_of(std::uint8_t setup) {
  auto options = harness::small_options();
  options.relay = (setup & 2) != 0;
  constexpr rowe::websocket_profile profiles[] = {
      rowe::websocket_profile::standard, rowe::websocket_profile::standard, rowe::websocket_profile::hop,
      rowe::websocket_profile::hop_2014};
  options.profile = profiles[setup >> 2 & 3];
  options.limits.handles_max = 7;
  options.limits.small_slots = 12;
  options.limits.calls_max = 6;
  options.limits.queued_max = 40;
  options.limits.queue_depth_max = 8;
  options.limits.long_message_bytes_max = 32 * 1024; // so there are fragments of texts
  options.limits.long_slots = 4;
  return options;
}

// Whatever was counted, each line of /metrics is a whole one.
void check_page(std::span<const std::byte> body) {
  const std::string_view text{reinterpret_cast<const char*>(body.data()), body.size()};
  require(text.ends_with('\n') && body.size() <= rowe::service::metrics_report::bytes_max,
          "a report of the counts is whole");
  for (std::size_t at = 0; at < text.size(); at = text.find('\n', at) + 1)
    require(text[at] == '#' || text.substr(at).starts_with("rowe_"), "a line of the counts is one");
}

// Lives for one input.
class script_run {
 public:
  explicit script_run(std::uint8_t setup)
      : ours_{(setup & 1) != 0 ? side::client : side::server},
        by_numbers_{(setup & 32) != 0 && ours_ == side::server &&
                    options_of(setup).profile == rowe::websocket_profile::standard},
        on_{options_of(setup), ours_, 1, rowe::rt::time_point{1000s},
            by_numbers_ ? &numbers::protocols() : nullptr},
        pairs_{offer_pairs((setup & 16) != 0)} {
    if ((setup & 64) != 0) {
      pairs_.push_back(&on_.offer(rowe::detail::latch_request({.name = "loop"})));
      latch_ = rowe::stop_latch{harness::core_harness::handle_of(*pairs_.back())};
      latch_pair_ = pairs_.size() - 1;
    }
    if ((setup & 128) != 0) {
      pairs_.push_back(
          &on_.offer(rowe::detail::subscribe_request<motion>(swarm::driven_topic, {.lease = 300ms})));
      driven_ = rowe::subscriber<motion>{harness::core_harness::handle_of(*pairs_.back())};
      driven_pair_ = pairs_.size() - 1;
    }
    cycle(1us);
  }

  void act(script& s) {
    const std::uint8_t what = s.byte();
    switch (what % 16) {
    case 0: open(what >> 4 & 1); break;
    case 1: break_off(s.byte()); break;
    case 2:
    case 3:
      if (harness::peer* const p = one(what >> 4)) p->say(s.text());
      break;
    case 4: speak(s, what >> 4); break;
    case 5:
      if (harness::peer* const p = one(what >> 4)) {
        std::string bytes = s.text();
        p->send_raw(std::as_bytes(std::span{bytes}));
      }
      break;
    case 6: reply(what >> 4); break;
    case 7:
      if (harness::peer* const p = one(what >> 4)) on_.net.link_of(p->id()).capacity_bytes = s.byte() * 8U;
      break;
    case 8: talk(s); break;
    case 9: respond(what >> 4); break;
    case 10: call(what >> 4); break;
    case 11: publish(); break;
    case 12: threads(s); break;
    case 13: close_pair(what >> 4); break;
    case 14:
      if (what >> 4 == 15) {
        ask(s);
        break;
      }
      if (harness::peer* const p = one(what >> 4)) hear(*p);
      break;
    default: cycle(s.byte() * 1ms); return;
    }
    cycle(10us);
  }

  void end() {
    held_.clear();
    asked_.clear();
    for (std::size_t i = 0; i < pairs_.size(); ++i) close_pair(i);
    for (auto& p : peers_) p->leave(rowe::service::close_cause::reset);
    peers_.clear();
    threads_.finish_up();
    for (int i = 0; i < 4; ++i) cycle(1ms);
    // A message that would be pending for ever finds a peer.
    open(false);
    for (int i = 0; i < 30; ++i) {
      peers_.back()->say("{}");
      cycle(1ms);
      hear(*peers_.back());
    }
    peers_.back()->leave();
    for (int i = 0; i < 30; ++i) { // a peer is gone, and its calls end, when its backlog was processed
      while (const auto slot = on_.inbox.try_receive(on_.now)) on_.inbox.release(*slot);
      cycle(1ms);
    }
    for (const std::uint32_t slot : waiting_) {
      require(on_.submissions.wait(slot, rowe::time_point{1ns}), "whoever waits gets an outcome");
      on_.submissions.release(slot);
    }
    require(on_.core.slots_in_use() == 0, "every slot is free");
    require(on_.all_slots_free(), "every slot of the submission queue is free");
    require(on_.shared.peers() == 0, "no peer is left");
    check_page(on_.net.get({"/metrics", {}, false}, on_.core).body);
  }

 private:
  std::vector<rowe::detail::queue_pair*> offer_pairs(bool receives) {
    const rowe::service_options small{.depth = 2, .text_bytes_max = 200};
    return {&on_.offer({.kind = rowe::detail::pair_kind::talk,
                        .receives = receives,
                        .out_depth = 4,
                        .in_depth = 2,
                        .completions_depth = 3,
                        .out_bytes = 300,
                        .in_bytes = 300,
                        .completions_bytes = 300}),
            &on_.offer(rowe::detail::serve_request<pair, pair>("/pair", small)),
            &on_.offer(rowe::detail::client_request<pair, pair>("/pair", small)),
            &on_.offer(rowe::detail::advertise_request<pair>("/topic", {.ttl = 5ms, .depth = 4})),
            &on_.offer(rowe::detail::subscribe_request<rowe::json_text>("/topic", {.depth = 2}))};
  }

  // Asks for the last value of a topic; what it waits for may come later, or never.
  void ask(script& s) {
    const std::string name = s.byte() % 2 != 0 ? "topic" : s.text();
    check_value(on_.net.get({"/api/v1/topics/" + name, {}, false}, on_.core));
    const auto page = awaited_;
    const bool last = s.byte() % 4 == 0;
    check_value(on_.net.get({.path = {}, .if_none_match = {}, .awaited = &page, .last = last}, on_.core));
  }
  void check_value(const rowe::service::http_answer& answer) {
    if (answer.later) {
      awaited_ = answer.awaited;
      return;
    }
    require(answer.status == 200 || answer.status == 404 || answer.status == 503, "a value is there or not");
    std::string text{reinterpret_cast<const char*>(answer.body.data()), answer.body.size()};
    if (const auto& body = answer.in_pieces; body.from != nullptr) {
      while (text.size() < body.bytes) {
        const auto piece = body.from->read_body(body.which, text.size());
        require(!piece.empty(), "a long value has all its bytes");
        text.append(reinterpret_cast<const char*>(piece.data()), piece.size());
      }
      require(text.size() == body.bytes, "and no more");
      body.from->end_body(body.which);
      text += '\n'; // as a short one has
    }
    require(text.ends_with('\n'), "an answer is whole");
    if (answer.status != 200) return;
    const std::size_t bytes = text.size();
    text.append(rowe::json::reader::tailroom_bytes, ' ');
    require(static_cast<bool>(on_.validator.validate({text.data(), bytes})), "a value is JSON");
  }

  void cycle(rowe::duration later) {
    if (is_open(latch_pair_) && latch_.engaged(on_.now)) latch_.acknowledge(on_.now);
    on_.cycle(later);
    require(on_.core.check(), "the core's structures agree");
    if (!is_open(driven_pair_) || !driven_.latest_within(on_.now)) return;
    require(on_.shared.peers() != 0, "what drives is of somebody who is there");
    require(!is_open(latch_pair_) || rowe::detail::permit::time_of(on_.shared.permit.read()) != 0,
            "nothing drives a robot that is stopped");
  }
  bool is_open(std::size_t pair) const { return pair < pairs_.size() && pairs_[pair] != nullptr; }

  harness::peer* one(std::size_t which) {
    return peers_.empty() ? nullptr : peers_[which % peers_.size()].get();
  }
  void open(bool by_numbers) {
    if (peers_.size() >= (ours_ == side::client ? 1U : 4U)) return;
    by_numbers = by_numbers && by_numbers_;
    peers_.push_back(std::make_unique<harness::peer>(on_, ours_, "127.0.0.1:50000", "/",
                                                     by_numbers ? numbers::subprotocol : std::string_view{}));
    const harness::connection_id id = peers_.back()->id();
    if (by_numbers) told_[peers_.back().get()] = {};
    threads_.connections.push_back({id.index, id.generation});
  }
  void break_off(std::uint8_t which) {
    if (peers_.empty()) return;
    const auto gone = peers_.begin() + which % static_cast<std::ptrdiff_t>(peers_.size());
    (*gone)->leave(which > 127 ? rowe::service::close_cause::reset : rowe::service::close_cause::peer);
    on_.net.link_of((*gone)->id()) = {};
    told_.erase(gone->get());
    const threads_connection id{(*gone)->id().index, (*gone)->id().generation};
    std::erase(threads_.connections, id);
    threads_.ended.assign(1, id);
    peers_.erase(gone);
  }
  void hear(harness::peer& p) {
    const auto told = told_.find(&p);
    for (auto& text : p.hear()) {
      if (told != told_.end() && swarm::number_lists::is_list(text))
        require(told->second.take(text).empty(), "a peer is told of each topic and service once");
      known_.control_tick = std::max(known_.control_tick, swarm::integer_after(text, R"("tick":)"));
      heard_.push_back(std::move(text));
    }
    if (heard_.size() > 8) heard_.erase(heard_.begin(), heard_.end() - 8);
    const bool unmasked = ours_ == side::client && on_.options.profile == rowe::websocket_profile::hop_2014;
    require(unmasked || p.violated.empty(), "a peer is sent WebSocket frames");
  }
  // Answers something that was received, by whichever peer.
  void reply(std::size_t which) {
    harness::peer* const p = one(which);
    if (p == nullptr || heard_.empty()) return;
    const std::string asked = heard_[which % heard_.size()];
    for (const char* key : {"\"id\":\"", "\"message_id\":\""}) {
      const auto at = asked.find(key);
      if (at == std::string::npos) continue;
      const auto from = at + std::string_view{key}.size() - 1;
      const std::string id = asked.substr(from, asked.find('"', from + 1) + 1 - from);
      if (key[1] == 'i')
        p->say(R"({"op":"service_response","service":"x","result":true,"values":{"a":1,"b":2},"id":)" + id +
               "}");
      if (key[1] == 'm') p->say(R"({"a":1,"b":2,"in_reply_to":)" + id + "}");
    }
  }

  // A text of any codec, as the simulated untrusted peers send it; or what an ordinary thread does.
  void speak(script& s, std::size_t which) {
    harness::peer* const p = one(which);
    if (p == nullptr) return;
    input_choices from{s};
    const std::size_t operation = from.below(swarm::operations().size());
    known_.bounds = on_.options.limits;
    if (const auto told = told_.find(p); told != told_.end()) known_.listed = told->second;
    const swarm::recipe what = swarm::choose_recipe(from, all_, operation, 4);
    const swarm::saying said = swarm::render(from, what, known_);
    const swarm::form goes = swarm::operations()[operation].goes;
    if (swarm::speaker_of(goes) == swarm::speaker::thread)
      return (void)threads_.carry_out(from, what, said); // what it came upon, others count
    if (swarm::is_binary(goes)) return p->send(rowe::wire::opcode::binary, said.text);
    switch (goes) {
    case swarm::form::opening: return open((which & 1) != 0);
    case swarm::form::control: return p->send(rowe::wire::opcode::ping, said.text);
    case swarm::form::close: return p->send(rowe::wire::opcode::close, said.text);
    case swarm::form::no_frame: return p->send_raw(std::as_bytes(std::span{said.text}));
    default: return p->say(said.text);
    }
  }

  static rowe::duration time_of(std::uint8_t choice) {
    constexpr rowe::duration times[] = {0ns, 3ms, 40ms, -1ns};
    return times[choice % 4];
  }
  void talk(script& s) {
    if (pairs_[0] == nullptr) return;
    const std::uint8_t how = s.byte();
    harness::peer* const p = (how & 8) != 0 ? one(how >> 4) : nullptr;
    const auto to = p != nullptr ? rowe::connection{p->id().index, p->id().generation} : rowe::everyone;
    switch (how % 8) {
    case 0: (void)talker_.try_send(s.text(), time_of(how >> 4), on_.now, to); break;
    case 1: (void)talker_.start(s.text(), time_of(how >> 4), on_.now, to); break;
    case 2: (void)talker_.start(R"({"service":"/pair","a":1,"b":2})", time_of(how >> 4), on_.now, to); break;
    case 3: {
      const std::string text = s.text();
      (void)rowe::detail::start_call_to(
          *pairs_[0], to, text,
          rowe::detail::message_header(rowe::detail::entry::message, rowe::detail::ref_of(to), on_.now,
                                       rowe::detail::expiry_after(on_.now, time_of(how >> 4))));
      break;
    }
    case 4: (void)talker_.try_finish(); break;
    case 5:
      if (auto got = talker_.try_receive(on_.now)) held_.push_back(std::move(*got));
      break;
    case 6:
      if (!held_.empty()) (void)talker_.try_reply(held_.back(), s.text(), on_.now);
      break;
    default:
      if (!held_.empty()) held_.pop_back();
      break;
    }
  }
  void respond(std::size_t how) {
    if (pairs_[1] == nullptr) return;
    if (auto asked = responder_.try_next(on_.now); asked && how % 4 != 0) asked_.push_back(std::move(*asked));
    if (asked_.empty() || how % 4 == 1) return;
    if (how % 4 == 2) (void)responder_.reply(asked_.back(), {1, 2}, on_.now);
    asked_.pop_back();
  }
  void call(std::size_t how) {
    if (pairs_[2] == nullptr) return;
    (void)caller_.try_finish();
    (void)caller_.start({1, 2}, time_of(static_cast<std::uint8_t>(how)), on_.now);
  }
  void publish() {
    if (pairs_[3] == nullptr) return;
    const pair value{1, 2};
    (void)rowe::detail::publish_into(*pairs_[3], sizeof value, on_.now,
                                     [&](std::byte* slot) { std::memcpy(slot, &value, sizeof value); });
  }
  void threads(script& s) {
    const std::uint8_t how = s.byte();
    using rowe::detail::entry;
    if (how % 4 == 3) {
      const auto slot = on_.inbox.try_receive(on_.now);
      if (!slot) return;
      const auto call = on_.inbox.header(*slot).call;
      on_.inbox.release(*slot);
      (void)on_.submissions.submit(
          {.what = how > 127 ? entry::reply : entry::refusal, .call = call, .stamped = on_.now}, s.text());
      return;
    }
    const bool invokes = how % 4 == 2;
    const bool waits = invokes || how % 4 == 1;
    const auto slot =
        on_.submissions.submit({.what = invokes ? entry::invocation : entry::message,
                                .wants_outcome = waits,
                                .stamped = on_.now,
                                .expires = rowe::rt::deadline_after(on_.now, time_of(how >> 4))},
                               s.text());
    if (slot && waits) waiting_.push_back(*slot);
  }
  void close_pair(std::size_t which) {
    which %= pairs_.size();
    if (pairs_[which] == nullptr) return;
    if (which == 0) held_.clear();
    if (which == 1) asked_.clear();
    pairs_[which]->lifecycle.close();
    pairs_[which] = nullptr;
  }

  using threads_connection = swarm::threads::connection_ref;
  side ours_;
  bool by_numbers_;
  harness::core_harness on_;
  std::vector<rowe::detail::queue_pair*> pairs_; // null once closed
  rowe::lane talker_{harness::core_harness::handle_of(*pairs_[0])};
  rowe::responder<pair, pair> responder_{harness::core_harness::handle_of(*pairs_[1])};
  rowe::caller<pair, pair> caller_{harness::core_harness::handle_of(*pairs_[2])};
  rowe::stop_latch latch_;
  rowe::subscriber<motion> driven_;
  std::size_t latch_pair_ = SIZE_MAX, driven_pair_ = SIZE_MAX; // none
  swarm::threads threads_{on_};
  std::vector<std::unique_ptr<harness::peer>> peers_;
  std::map<const harness::peer*, swarm::number_lists> told_; // those with numbers
  std::vector<std::string> heard_;
  std::vector<rowe::message_view> held_;
  std::vector<rowe::request<pair>> asked_;
  std::vector<std::uint32_t> waiting_;
  rowe::service::awaited_page awaited_;
  swarm::weights all_{swarm::rows().size()}; // every class as likely as another
  swarm::knowledge known_;
};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return rowe::fuzz::run<script_run>(data, size, 4096);
}
