// SPDX-License-Identifier: Apache-2.0
// A core with COUNT peers, topics, handles, calls ..., and what is done with it in each step. Each kind is a
// struct below. For tests that count instructions: scale_steps.cpp compares few with many,
// tests/counts/path_steps.cpp adds further paths and holds their counts.
//
// The transport is one that costs nothing for who is quiet: its peers read at once, answer pings, and say
// what they are told to.
#pragma once
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core_harness.hpp"

namespace scale {

using namespace std::chrono_literals;
using rowe::service::connection_id;
using rowe::service::transport_sink;

// From the harness into the core, or from the core into the harness. Whoever counts the core alone lets
// callgrind begin and stop counting here: --toggle-collect='*scale::crossing<*'.
template <class Call>
[[gnu::noinline]] auto crossing(const Call& call) {
  return call();
}

class lean_transport final : public rowe::service::transport {
 public:
  explicit lean_transport(std::uint32_t connections_max) : readers_(connections_max, true) {}

  void open(std::uint32_t index) { opening_.push_back(index); }
  void say(std::uint32_t index, std::string_view text) { send(index, 0x81, text); }
  void leave(std::uint32_t index) { leaving_.push_back(index); }
  void stop_reading(std::uint32_t index) { readers_[index] = false; }
  void read_again(std::uint32_t index) {
    readers_[index] = true;
    writable_.push_back(index);
  }

  void poll(rowe::rt::time_point, transport_sink& sink) noexcept override {
    crossing([&] { report(sink); });
  }
  std::size_t write(connection_id id, std::span<const std::byte> bytes) noexcept override {
    return crossing([&] { return take(id, bytes); });
  }
  void wait(rowe::rt::time_point, rowe::rt::time_point) noexcept override {}
  void wake() noexcept override {}
  int wake_descriptor() const noexcept override { return -1; }
  void close(connection_id, rowe::service::close_how) noexcept override {}
  void limit_send_buffer(connection_id, std::size_t) noexcept override {}
  void read_enabled(connection_id, bool) noexcept override {}
  void connect() noexcept override {}

  bool has_more() const { return !said_.empty(); }

  std::uint64_t frames = 0; // texts that peers were given
  std::string last;         // of them

 private:
  struct saying {
    std::uint32_t index;
    std::size_t at, size;
  };

  void report(transport_sink& sink) {
    for (const std::uint32_t i : opening_) {
      const rowe::service::peer_info info{
          .ours = rowe::service::side::server, .address = "127.0.0.1:1", .path = "/", .subprotocol = {}};
      crossing([&] { sink.on_open({i, 1}, info); });
    }
    opening_.clear();
    std::swap(said_, hearing_);
    std::swap(arriving_, bytes_);
    bytes_.resize(bytes_.size() + rowe::service::tailroom_bytes);
    for (const saying& one : hearing_) {
      const auto bytes = std::span{bytes_}.subspan(one.at, one.size);
      if (crossing([&] { return sink.wanted_bytes({one.index, 1}); }) != 0) {
        crossing([&] { sink.on_bytes({one.index, 1}, bytes); });
      } else { // later, then
        said_.push_back({one.index, arriving_.size(), one.size});
        arriving_.insert(arriving_.end(), bytes.begin(), bytes.end());
      }
    }
    hearing_.clear();
    bytes_.clear();
    for (const std::uint32_t i : writable_) crossing([&] { sink.on_writable({i, 1}); });
    writable_.clear();
    for (const std::uint32_t i : leaving_)
      crossing([&] { sink.on_close({i, 1}, rowe::service::close_cause::peer); });
    leaving_.clear();
  }
  std::size_t take(connection_id id, std::span<const std::byte> all) {
    if (!readers_[id.index]) return 0;
    for (auto rest = all; !rest.empty();) { // whole frames: all is taken
      const std::size_t bytes = rowe::wire::whole_frame_bytes(rest);
      const char* const frame = reinterpret_cast<const char*>(rest.data());
      if (rest[0] == std::byte{0x81}) {
        ++frames;
        const std::size_t header = rest[1] < std::byte{126} ? 2 : 4;
        last.assign(frame + header, bytes - header);
      }
      if (rest[0] == std::byte{0x89}) send(id.index, 0x8a, {frame + 2, bytes - 2}); // a ping
      rest = rest.subspan(bytes);
    }
    return all.size();
  }

  // Masked with zeros.
  void send(std::uint32_t index, int opcode, std::string_view text) {
    const std::size_t at = arriving_.size();
    const auto put = [&](int byte) { arriving_.push_back(static_cast<std::byte>(byte)); };
    put(opcode);
    put(0x80 | static_cast<int>(text.size() < 126 ? text.size() : 126));
    if (text.size() >= 126) {
      put(static_cast<int>(text.size() >> 8));
      put(static_cast<int>(text.size() & 0xff));
    }
    arriving_.resize(arriving_.size() + 4);
    const auto bytes = std::as_bytes(std::span{text});
    arriving_.insert(arriving_.end(), bytes.begin(), bytes.end());
    said_.push_back({index, at, arriving_.size() - at});
  }

  std::vector<bool> readers_;
  std::vector<std::uint32_t> opening_, writable_, leaving_;
  std::vector<saying> said_, hearing_;
  std::vector<std::byte> arriving_, bytes_;
};

using core_harness = harness::core_harness_over<lean_transport>;

inline rowe::endpoint_options options_for(std::uint32_t count, std::uint32_t queue_depth) {
  rowe::endpoint_options chosen;
  chosen.relay = true;
  chosen.stop.unguarded = true;
  rowe::limits& l = chosen.limits;
  l.connections_max = count + 8;
  l.message_bytes_max = 4096;
  l.topics_max = 4 * count + 64;
  l.subscriptions_max = 4 * count + 64;
  l.subscriptions_per_connection_max = count + 8;
  l.calls_max = 4 * count + 64;
  l.calls_per_connection_max = 2 * count + 64;
  l.small_slots = 4 * count + 512;
  l.queue_depth_max = queue_depth;
  return chosen;
}

inline std::string topic_of(std::uint32_t n) { return "/topic/" + std::to_string(n); }
inline std::string subscribe_to(std::string_view topic) {
  return R"({"op":"subscribe","topic":")" + std::string{topic} + R"("})";
}
inline std::string publish_on(std::string_view topic) {
  return R"({"op":"publish","topic":")" + std::string{topic} + R"(","msg":{"data":1}})";
}

struct place {
  explicit place(std::uint32_t many, std::uint32_t queue_depth = 256)
      : on{options_for(many, queue_depth)}, count{many} {}

  void connect(std::uint32_t peers) {
    for (std::uint32_t i = 0; i < peers; ++i) on.net.open(i);
    settle();
  }
  // Cycles until there is nothing left to do at once.
  void settle() {
    do cycle();
    while (on.next_wake <= on.now || on.net.has_more());
  }
  void cycle() {
    on.now += 1us;
    on.next_wake = crossing([this] { return on.core.cycle(on.now); });
  }
  rowe::detail::queue_pair& advertise(std::string_view topic, rowe::topic_options how = {}) {
    return on.offer(rowe::detail::pair_kind::publish_text, topic, 64, how);
  }
  void publish(rowe::detail::queue_pair& by) {
    constexpr std::string_view text = R"({"data":1})";
    const auto done = rowe::detail::publish_into(by, text.size(), on.now, [&](std::byte* slot) {
      text.copy(reinterpret_cast<char*>(slot), text.size());
    });
    if (!done) std::abort();
  }

  core_harness on;
  std::uint32_t count;
  std::uint32_t frames_a_step = 0; // texts that peers are given; 0: who measures does not look
};

// COUNT peers that say nothing; one message is sent to one of them, and one read from it, in each step.
struct quiet : place {
  explicit quiet(std::uint32_t peers) : place{peers} {
    connect(peers);
    pair_ = &advertise("/down");
    inbox_ = &on.offer(rowe::detail::pair_kind::subscribe_text, "/up", 64);
    on.net.say(peers - 1, subscribe_to("/down"));
    settle();
    frames_a_step = 1;
  }
  void step() {
    publish(*pair_);
    on.net.say(count - 1, publish_on("/up"));
    settle();
    while (const auto slot = inbox_->user.in.ring->try_pop()) inbox_->user.in.free_ring->release(*slot);
  }
  rowe::detail::queue_pair* pair_;
  rowe::detail::queue_pair* inbox_;
};

// COUNT peers, each of which sends one message before any sends another.
struct sending : place {
  explicit sending(std::uint32_t peers) : place{peers} { connect(peers); }
  void step() {
    on.net.say(next_, R"({"op":"publish","topic":"/up","msg":{"data":1}})");
    if (++next_ < count) return;
    next_ = 0;
    settle();
  }
  std::uint32_t next_ = 0;
};

// COUNT peers that get every message; a step is one message to one peer.
struct receiving : place {
  explicit receiving(std::uint32_t peers) : place{peers} {
    connect(peers);
    pair_ = &advertise("/down");
    for (std::uint32_t i = 0; i < peers; ++i) on.net.say(i, subscribe_to("/down"));
    settle();
    frames_a_step = 1;
  }
  void step() {
    if (next_++ % count != 0) return;
    publish(*pair_);
    settle();
  }
  rowe::detail::queue_pair* pair_;
  std::uint32_t next_ = 0;
};

// COUNT topics that one peer has subscribed to; each step another one publishes on one of them.
struct topics : place {
  explicit topics(std::uint32_t names) : place{names} {
    connect(2);
    for (std::uint32_t i = 0; i < names; ++i) {
      says_.push_back(publish_on(topic_of(i)));
      on.net.say(0, subscribe_to(topic_of(i)));
      settle();
    }
    frames_a_step = 1;
  }
  void step() {
    on.net.say(1, says_[next_++ % count]);
    settle();
  }
  std::vector<std::string> says_;
  std::uint32_t next_ = 0;
};

// The same, but the subscriber reads only when each topic has a message for it.
struct topics_at_once : topics {
  explicit topics_at_once(std::uint32_t names) : topics{names} {}
  void step() {
    if (next_ % count == 0) on.net.stop_reading(0);
    topics::step();
    if (next_ % count != 0) return;
    on.net.read_again(0);
    settle();
  }
};

// COUNT handles that publish in turn, each on its own topic.
struct handles : place {
  explicit handles(std::uint32_t pairs) : place{pairs} {
    connect(1);
    for (std::uint32_t i = 0; i < pairs; ++i) {
      pairs_.push_back(&advertise(topic_of(i), {.depth = 8}));
      on.net.say(0, subscribe_to(topic_of(i)));
      settle();
    }
    frames_a_step = 1;
  }
  void step() {
    publish(*pairs_[next_++ % count]);
    settle();
  }
  std::vector<rowe::detail::queue_pair*> pairs_;
  std::uint32_t next_ = 0;
};

// COUNT calls of one peer that nobody has answered yet; each step it asks one more, which is.
struct calls : place {
  explicit calls(std::uint32_t open) : place{open} {
    connect(2);
    on.net.say(0, R"({"op":"advertise_service","service":"/slow"})");
    settle();
    for (std::uint32_t i = 0; i < open; ++i) {
      on.net.say(1, R"({"op":"call_service","id":"slow )" + std::to_string(i) + R"(","service":"/slow"})");
      settle();
    }
    frames_a_step = 1;
  }
  void step() {
    on.net.say(1, R"({"op":"call_service","id":"quick","service":"/rosapi/topic_type"})");
    settle();
  }
};

// COUNT peers that do not read and have no room for the message that waits for one. A step is a cycle.
struct waiting : place {
  explicit waiting(std::uint32_t peers) : place{peers, 1} {
    connect(peers + 1);
    for (std::uint32_t i = 0; i < peers; ++i) on.net.stop_reading(i);
    for (std::uint32_t i = 0; i <= peers; ++i) on.net.say(i, R"({"data":1})"); // they use the plain one
    settle();
    send_to_all();
    on.net.stop_reading(peers);
    send_to_all(); // the last one has read the first: it alone has room
    on.net.leave(peers);
    settle();
  }
  void send_to_all() {
    const auto sent = on.submissions.submit({.what = rowe::detail::entry::message}, R"({"data":1})");
    if (!sent) std::abort();
    settle();
  }
  void step() { cycle(); }
};

// COUNT peers, the last of which does not read: what it has not read keeps all slots, and each message takes
// one from it.
struct slow : place {
  explicit slow(std::uint32_t peers) : place{peers, 8192} {
    connect(peers);
    pair_ = &advertise("/down");
    for (std::uint32_t i = peers - 2; i < peers; ++i) on.net.say(i, subscribe_to("/down"));
    settle();
    on.net.stop_reading(peers - 1);
    while (on.count(rowe::service::counter::outbox_full) == 0) step();
    frames_a_step = 1;
  }
  void step() {
    publish(*pair_);
    settle();
  }
  rowe::detail::queue_pair* pair_;
};

// COUNT pages that show the state of the stop. A step is a cycle in which nothing changes.
struct shown : place {
  explicit shown(std::uint32_t pages) : place{pages} {
    connect(pages);
    on.offer(rowe::detail::latch_request({}));
    for (std::uint32_t i = 0; i < pages; ++i) on.net.say(i, subscribe_to("/rowe/stop/state"));
    settle();
  }
  void step() { cycle(); }
};

} // namespace scale
