// SPDX-License-Identifier: Apache-2.0
// For paths.py, which counts the instructions of each path of the service thread under callgrind. Every path
// has a core of its own in a harness. It is walked a thousand times, to be warm, and then a thousand times
// more in counted_steps(). Only what the core does is counted: not the transport, and not what handles do,
// which instructions.py counts.
//
// Prints the paths' names, in the order in which counted_steps() is called.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include <rowe/caller.hpp>
#include <rowe/detail/pair_request.hpp>
#include <rowe/lane.hpp>
#include <rowe/publisher.hpp>
#include <rowe/responder.hpp>
#include <rowe/stop_latch.hpp>
#include <rowe/subscriber.hpp>

#include "service/core/scale_kinds.hpp"

struct pathed_odometry {
  double stamp, x, y, heading, speed;
};
template <>
inline constexpr auto rowe::schema<pathed_odometry> =
    rowe::fields<&pathed_odometry::stamp, &pathed_odometry::x, &pathed_odometry::y, &pathed_odometry::heading,
                 &pathed_odometry::speed>{};

namespace {

using namespace std::chrono_literals;
using odometry = pathed_odometry;
using scale::place, scale::publish_on, scale::subscribe_to, scale::core_harness;

constexpr std::uint32_t steps = 1000; // paths.py says so, too
constexpr odometry value{1000.25, 1.5, -2.5, 0.125, 0.75};
constexpr std::string_view text = R"({"data":1})";

template <class Outcome>
void need(const Outcome& fine) {
  if (!fine) std::abort();
}

template <class Handle>
Handle handle_on(core_harness& on, const rowe::detail::pair_request& asked) {
  return Handle{core_harness::handle_of(on.offer(asked))};
}

// One peer publishes, four others get it as it is.
struct relay : place {
  explicit relay(std::uint32_t peers) : place{peers} {
    connect(peers + 1);
    for (std::uint32_t i = 0; i < peers; ++i) on.net.say(i, subscribe_to("/up"));
    settle();
    frames_a_step = peers;
  }
  void step() {
    on.net.say(count, says);
    settle();
  }
  const std::string says = publish_on("/up");
};

// One peer publishes and gets it back.
struct echo : place {
  echo() : place{1} {
    connect(1);
    on.net.say(0, subscribe_to("/up"));
    settle();
    frames_a_step = 1;
  }
  void step() {
    on.net.say(0, says);
    settle();
  }
  const std::string says = publish_on("/up");
};

// A struct of a handle goes to one peer.
struct publish_value : place {
  explicit publish_value(rowe::keep kept = rowe::keep::all)
      : place{1},
        by{handle_on<rowe::publisher<odometry>>(
            on, rowe::detail::advertise_request<odometry>("/odom", {.keep = kept}))} {
    connect(1);
    on.net.say(0, subscribe_to("/odom"));
    settle();
    frames_a_step = 1;
  }
  void step() {
    need(by.publish(value, on.now));
    settle();
  }
  rowe::publisher<odometry> by;
};
struct publish_newest : publish_value {
  publish_newest() : publish_value{rowe::keep::newest} {}
};

// A struct of a handle goes to another handle of this process.
struct publish_to_handle : place {
  publish_to_handle()
      : place{1},
        by{handle_on<rowe::publisher<odometry>>(on, rowe::detail::advertise_request<odometry>("/odom", {}))},
        to{handle_on<rowe::subscriber<odometry>>(on,
                                                 rowe::detail::subscribe_request<odometry>("/odom", {}))} {
    settle();
  }
  void step() {
    need(by.publish(value, on.now));
    settle();
    need(to.try_take());
  }
  rowe::publisher<odometry> by;
  rowe::subscriber<odometry> to;
};

// What a peer publishes is read into a struct of a handle.
struct receive_value : place {
  receive_value()
      : place{1},
        to{handle_on<rowe::subscriber<odometry>>(on,
                                                 rowe::detail::subscribe_request<odometry>("/odom", {}))} {
    connect(1);
  }
  void step() {
    on.net.say(0, R"({"op":"publish","topic":"/odom","msg":)"
                  R"({"stamp":1000.25,"x":1.5,"y":-2.5,"heading":0.125,"speed":0.75}})");
    settle();
    need(to.try_take());
  }
  rowe::subscriber<odometry> to;
};

struct subscribe_and_unsubscribe : place {
  subscribe_and_unsubscribe() : place{1} { connect(1); }
  void step() {
    on.net.say(0, subscribe_to("/down"));
    on.net.say(0, R"({"op":"unsubscribe","topic":"/down"})");
    settle();
  }
};

// A peer calls, a handle answers.
struct call_answered_by_handle : place {
  call_answered_by_handle()
      : place{1},
        by{handle_on<rowe::responder<odometry, odometry>>(
            on, rowe::detail::serve_request<odometry, odometry>("/same", {}))} {
    connect(1);
    frames_a_step = 1;
  }
  void step() {
    on.net.say(0, R"({"op":"call_service","id":"1","service":"/same","args":)"
                  R"({"stamp":1000.25,"x":1.5,"y":-2.5,"heading":0.125,"speed":0.75}})");
    settle();
    auto asked = by.try_next(on.now);
    need(asked);
    need(by.reply(*asked, asked->value(), on.now));
    settle();
  }
  rowe::responder<odometry, odometry> by;
};

// What a peer answers to the call that it was sent last.
std::string answer_to(std::string_view call) {
  constexpr std::string_view before = R"("id":")";
  const auto at = call.find(before);
  need(at != std::string_view::npos);
  const auto id = call.substr(at + before.size());
  return R"({"op":"service_response","id":")" + std::string{id.substr(0, id.find('"'))} +
         R"(","service":"/same","values":)"
         R"({"stamp":1000.25,"x":1.5,"y":-2.5,"heading":0.125,"speed":0.75},"result":true})";
}

// A handle calls, a peer answers.
struct call_asked_of_peer : place {
  call_asked_of_peer()
      : place{1},
        by{handle_on<rowe::caller<odometry, odometry>>(
            on, rowe::detail::client_request<odometry, odometry>("/same", {}))} {
    connect(1);
    on.net.say(0, R"({"op":"advertise_service","service":"/same"})");
    settle();
    frames_a_step = 1;
  }
  void step() {
    need(by.start(value, 1s, on.now));
    settle();
    on.net.say(0, answer_to(on.net.last));
    settle();
    const auto end = by.try_finish();
    need(end);
    need(end->reply);
  }
  rowe::caller<odometry, odometry> by;
};

// A peer calls, another one answers.
struct call_between_peers : place {
  call_between_peers() : place{2} {
    connect(2);
    on.net.say(0, R"({"op":"advertise_service","service":"/same"})");
    settle();
    frames_a_step = 2;
  }
  void step() {
    on.net.say(1, R"({"op":"call_service","id":"1","service":"/same","args":{"a":38,"b":4}})");
    settle();
    on.net.say(0, answer_to(on.net.last));
    settle();
  }
};

// A handle's plain message goes to a peer.
struct direct_message : place {
  direct_message() : place{1}, by{handle_on<rowe::lane>(on, rowe::detail::talk_request({.receive = true}))} {
    connect(1);
    on.net.say(0, text); // from now on it uses the plain format
    settle();
    need(by.try_receive(on.now));
    frames_a_step = 1;
  }
  void step() {
    need(by.try_send(text, rowe::rt::for_ever, on.now));
    settle();
  }
  rowe::lane by;
};
// It tells the peer what is left of its time to live.
struct direct_message_with_ttl : direct_message {
  void step() {
    need(by.try_send(text, 20ms, on.now));
    settle();
  }
};
// And a peer's to a handle.
struct message_of_peer : direct_message {
  message_of_peer() { frames_a_step = 0; }
  void step() {
    on.net.say(0, text);
    settle();
    need(by.try_receive(on.now));
  }
};
// And one of any thread's to a peer.
struct message_of_thread : direct_message {
  void step() {
    need(on.submissions.submit({.what = rowe::detail::entry::message}, text));
    settle();
  }
};

// A peer stops, and is answered when the loop has looked.
struct stop : place {
  stop() : place{1}, latch{handle_on<rowe::stop_latch>(on, rowe::detail::latch_request({.name = "base"}))} {
    connect(1);
    frames_a_step = 1;
  }
  void step() {
    on.net.say(0, R"({"op":"call_service","id":"1","service":"/rowe/stop","args":{"source":"hand"}})");
    settle();
    need(latch.engaged(on.now));
    latch.acknowledge(on.now);
    settle();
  }
  rowe::stop_latch latch;
};

// A cycle in which none of the pairs that were used has anything.
struct idle_cycle : scale::handles {
  explicit idle_cycle(std::uint32_t pairs) : handles{pairs} {
    for (std::uint32_t i = 0; i < pairs; ++i) handles::step();
    frames_a_step = 0;
  }
  void step() { cycle(); }
};

} // namespace

extern "C" [[gnu::noinline]] void counted_steps(void (*walk)(void*), void* path) { walk(path); }

namespace {

template <class Path>
void walk(void* path) {
  for (std::uint32_t i = 0; i < steps; ++i) static_cast<Path*>(path)->step();
}

template <class Path, class... Many>
void count(const char* name, Many... many) {
  Path path{many...};
  walk<Path>(&path);
  const std::uint64_t before = path.on.net.frames;
  counted_steps(walk<Path>, &path);
  if (path.frames_a_step != 0) need(path.on.net.frames - before == std::uint64_t{path.frames_a_step} * steps);
  need(path.on.core.check());
  std::puts(name);
}

} // namespace

int main() {
  count<scale::quiet>("quiet_peers", 1U);
  count<scale::sending>("sending_peers", 1U);
  count<scale::receiving>("receiving_peers", 1U);
  count<scale::topics>("topics", 1U);
  count<scale::topics_at_once>("topics_at_once", 50U);
  count<scale::handles>("handles", 1U);
  count<scale::calls>("calls", 1U);
  count<scale::waiting>("full_peers", 1U);
  count<scale::slow>("readers", 2U);
  count<scale::shown>("pages", 1U);
  count<relay>("relay", 4U);
  count<echo>("echo");
  count<publish_value>("publish_value");
  count<publish_newest>("publish_newest");
  count<publish_to_handle>("publish_to_handle");
  count<receive_value>("receive_value");
  count<subscribe_and_unsubscribe>("subscribe_and_unsubscribe");
  count<call_answered_by_handle>("call_answered_by_handle");
  count<call_asked_of_peer>("call_asked_of_peer");
  count<call_between_peers>("call_between_peers");
  count<direct_message>("direct_message");
  count<direct_message_with_ttl>("direct_message_with_ttl");
  count<message_of_peer>("message_of_peer");
  count<message_of_thread>("message_of_thread");
  count<stop>("stop");
  count<idle_cycle>("idle_cycle_32_pairs", 32U);
}
