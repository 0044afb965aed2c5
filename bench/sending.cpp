// SPDX-License-Identifier: Apache-2.0
// Question: how many messages a second does the service thread write to one peer, and read from one, next to
// what the sockets alone carry?
//
// Measured, in one process over loopback, the sender (receiver) on core --here and the other end on core
// --there, which spins: messages a second that have arrived at the other end (here), medians over the rounds
// and ratios inside a round. Messages are 300 B of JSON in a frame of their own:
//   send_300/raw                plain send() of one batch of 64 KiB, over and over: the limit
//   send_300/rowe_unclamped     the frame layer: each message is copied and gets its header in a batch, the
//                               transport writes the batch; no bound on what is in flight (flood.hpp)
//   send_300/rowe               the same as shipped
//   publish_300/rowe            a whole core and one queue pair, of a struct whose encoding is a copy:
//                               publish(), wire slot, queue, frame, socket
//   publish_odometry/encoder    no more than the encoder, over 256 different odometry messages
//   publish_odometry/rowe       these messages through the same core
//   receive_300/raw             recv() of up to 64 KiB and unmasking what is in it, frame by frame: the limit
//   receive_300/rowe            transport and frame parser as shipped: as much in a turn as is handled in 50
//   us receive_300/rowe_16k        the same with 16 KiB a turn
// `calls_per_message` are system calls of the thread that is measured, for each message; `allocations` what
// it took from the heap meanwhile.
//
// Publishing is done by the service thread itself, before each cycle, and counted: there are two cores, and
// the other one reads. With a loop's thread on a third core it would be less, and the lines of the slots
// would have to come from there.
//
// Excluded: handshakes, the first 30 ms of each connection (the credit learns meanwhile), validation of what
// arrives.
//
// What would make it lie: other load on either core; an other end that is the slower one (it looks at headers
// only); a kernel that has less than 64 KiB of room in loopback's buffers.
//
// Run: bench_sending [--rounds=11] [--here=CPU] [--there=CPU] [Google Benchmark's options]
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>

#include <rowe/publisher.hpp>
#include <rowe/ros.hpp>

#include "costs.hpp"
#include "far_end.hpp"
#include "flood.hpp"
#include "net/transport/socket_transport.hpp"
#include "sending_core.hpp"

namespace rowe::bench {

// A number behind a name of such a length that the message has 300 bytes: its encoding is a copy, or nearly.
struct counted {
  std::uint32_t count = 1'000'000'000;
};
struct odometry {
  ros::header header;
  ros::frame_name child_frame_id;
  ros::pose pose;
  ros::twist twist;
};

} // namespace rowe::bench

template <>
inline constexpr auto rowe::schema<rowe::bench::counted> = rowe::fields<
    rowe::field<&rowe::bench::counted::count,
                "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
                "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
                "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
                "xxxxxx">>{};
template <>
inline constexpr auto rowe::schema<rowe::bench::odometry> =
    rowe::fields<&rowe::bench::odometry::header, &rowe::bench::odometry::child_frame_id,
                 &rowe::bench::odometry::pose, &rowe::bench::odometry::twist>{};

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration warm_up = 30ms;
constexpr rt::duration stretch = 100ms;
constexpr std::size_t message_bytes = 300;
constexpr std::size_t batch_bytes = 64 * 1024;
constexpr std::uint32_t pair_depth = 256;

struct speed {
  double per_second, calls_per_message, allocations;
};

// Takes turns for a while, and then until the time is over; `arrived` says how many messages there are.
template <class Turn, class Arrived>
speed measure(Turn&& turn, Arrived&& arrived) {
  for (const auto until = monotonic_clock::now() + warm_up; monotonic_clock::now() < until;) turn();
  const auto allocated = costs::allocations();
  const auto called = costs::calls();
  const std::uint64_t before = arrived();
  const auto begin = monotonic_clock::now();
  auto now = begin;
  while (now < begin + stretch) {
    turn();
    now = monotonic_clock::now();
  }
  const auto count = static_cast<double>(arrived() - before);
  return {count / nanoseconds(now - begin) * 1e9, static_cast<double>(costs::calls() - called) / count,
          static_cast<double>(costs::allocations() - allocated)};
}

std::string text_of_300() { return std::string(message_bytes, 'x'); }

std::string batch_of(std::string_view frame) {
  std::string batch;
  while (batch.size() + frame.size() <= batch_bytes) batch += frame;
  return batch;
}

net::socket_limits limits_of(flood::in_flight how) {
  net::socket_limits limits;
  if (how == flood::in_flight::unbounded) limits.unsent_bytes_max = 1 << 30;
  return limits;
}

// ---- sockets alone

struct socket_pair {
  socket_pair() {
    net::descriptor listening{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t bytes = sizeof at;
    const bool listens = ::bind(listening.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0 &&
                         ::listen(listening.get(), 1) == 0 &&
                         ::getsockname(listening.get(), reinterpret_cast<sockaddr*>(&at), &bytes) == 0;
    if (!listens) std::abort();
    far = std::make_unique<far_end>(ntohs(at.sin_port));
    near.reset(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC));
    const int yes = 1;
    (void)::setsockopt(near.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // a hint
  }
  net::descriptor near;
  std::unique_ptr<far_end> far;
};

std::string server_frame() {
  std::string frame(wire::frame_header_bytes(message_bytes, wire::role::server), '\0');
  (void)wire::write_frame_header(reinterpret_cast<std::byte*>(frame.data()), wire::opcode::text,
                                 message_bytes);
  return frame + text_of_300();
}

speed send_raw() {
  socket_pair pair;
  pair.far->swallow();
  const std::string batch = batch_of(server_frame());
  std::string_view rest = batch;
  return measure(
      [&] {
        const ssize_t sent = ::send(pair.near.get(), rest.data(), rest.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent > 0) rest.remove_prefix(static_cast<std::size_t>(sent));
        if (rest.empty()) rest = batch;
      },
      [&] { return pair.far->messages(); });
}

std::string client_frame() {
  constexpr wire::mask_key key{std::byte{0x5a}, std::byte{0x81}, std::byte{0x3c}, std::byte{0xe7}};
  return far_end::frame_of(wire::opcode::text, text_of_300(), key);
}

// What is not whole in one read is moved to the front.
speed receive_raw() {
  socket_pair pair;
  pair.far->flood(batch_of(client_frame()));
  std::vector<std::byte> buffer(batch_bytes + 2 * message_bytes);
  std::size_t kept = 0;
  std::uint64_t messages = 0;
  constexpr std::size_t header = 8; // two, two of length, four of mask
  return measure(
      [&] {
        const ssize_t got = ::recv(pair.near.get(), buffer.data() + kept, batch_bytes, MSG_DONTWAIT);
        if (got <= 0) return;
        std::span<std::byte> rest{buffer.data(), kept + static_cast<std::size_t>(got)};
        while (rest.size() >= header) {
          const std::size_t payload =
              std::to_integer<std::size_t>(rest[2]) << 8 | std::to_integer<std::size_t>(rest[3]);
          if (rest.size() < header + payload) break;
          std::uint32_t key = 0;
          std::memcpy(&key, &rest[4], sizeof key);
          std::byte* at = rest.data() + header;
          for (const std::byte* const end = at + payload; at < end; at += sizeof key) { // -O3 makes it wide
            std::uint32_t word = 0;
            std::memcpy(&word, at, sizeof word);
            word ^= key;
            std::memcpy(at, &word, sizeof word);
          }
          ++messages;
          rest = rest.subspan(header + payload);
        }
        kept = rest.size();
        std::memmove(buffer.data(), rest.data(), kept);
      },
      [&] { return messages; });
}

// ---- the transport and the frames

class frames final : public service::transport_sink {
 public:
  explicit frames(const net::socket_limits& limits)
      : transport_{net::socket_transport::listen({.limits = limits}).value()} {
    far = std::make_unique<far_end>(transport_->port());
    far->ask_for_upgrade();
    while (!open_) poll();
    far->take_answer();
  }

  void poll() { transport_->poll(monotonic_clock::now(), *this); }
  void begin_flood(std::string_view text, flood::in_flight how) {
    flood_.emplace(*transport_, peer_, std::as_bytes(std::span{text}), how);
  }
  void send() {
    while (!flood_->write(monotonic_clock::now())) poll();
  }

  service::admit_answer admit(const service::credentials&) const noexcept override { return {}; }
  void on_open(service::connection_id id, const service::peer_info&) noexcept override {
    peer_ = id;
    open_ = true;
    parser_.reset(wire::role::server, {.message_bytes_max = 4096, .fragments_max = 1}, assembly_);
  }
  void on_bytes(service::connection_id, std::span<std::byte> bytes) noexcept override {
    while (!bytes.empty()) {
      const wire::frame_step step = parser_.next(bytes);
      bytes = bytes.subspan(step.consumed);
      received += step.event == wire::frame_event::text;
      if (step.event == wire::frame_event::pong) flood_->take_pong(step.payload, monotonic_clock::now());
    }
  }
  void on_writable(service::connection_id) noexcept override { flood_->on_writable(); }
  void on_close(service::connection_id, service::close_cause) noexcept override { std::abort(); }
  void on_rejected(const service::rejection&) noexcept override { std::abort(); }
  service::http_answer on_http(const service::http_request&) noexcept override { return {}; }

  std::unique_ptr<far_end> far;
  std::uint64_t received = 0;

 private:
  std::unique_ptr<net::socket_transport> transport_;
  service::connection_id peer_{};
  bool open_ = false;
  std::optional<flood> flood_;
  std::array<std::byte, 4096 + 64> assembly_{};
  wire::frame_parser parser_;
};

speed send_frames(flood::in_flight how) {
  frames to{limits_of(how)};
  to.far->swallow();
  to.begin_flood(text_of_300(), how);
  return measure([&] { to.send(); }, [&] { return to.far->messages(); });
}

speed receive_frames(std::uint32_t alone_bytes_max) {
  net::socket_limits limits;
  if (alone_bytes_max != 0) limits.read_alone_bytes_max = alone_bytes_max;
  frames from{limits};
  from.far->flood(batch_of(client_frame()));
  return measure([&] { from.poll(); }, [&] { return from.received; });
}

// ---- a whole core

template <class T>
speed publish(const std::vector<T>& values) {
  sending_core robot{net::socket_limits{}};
  detail::queue_pair& pair =
      robot.offer(detail::advertise_request<T>("/sent", {.ttl = 1s, .depth = pair_depth}));
  far_end far{robot.port()};
  far.ask_for_upgrade();
  while (robot.peers() == 0) robot.cycle();
  far.take_answer();
  far.say(R"({"op":"subscribe","topic":"/sent","queue_length":256})");
  publisher<T> to{sending_core::handle_of(pair)};
  while (!to.wanted()) robot.cycle();
  far.swallow();
  std::size_t next = 0;
  const speed seen = measure(
      [&] {
        const auto now = monotonic_clock::now();
        if (robot.idle()) {
          while (to.publish(values[next], now)) next = (next + 1) % values.size();
        }
        robot.cycle();
      },
      [&] { return far.messages(); });
  if (robot.lost() != 0)
    std::fprintf(stderr, "%llu messages were lost\n", static_cast<unsigned long long>(robot.lost()));
  return seen;
}

// ---- what is published

std::vector<odometry> odometries() {
  std::mt19937_64 random_bits{20'240'229};
  std::normal_distribution<double> metres;
  const auto number = [&] { return metres(random_bits); };
  std::vector<odometry> all;
  for (std::uint32_t i = 0; i < 256; ++i) {
    all.push_back({.header = {.seq = 100'000 + i, .stamp = {1'700'000'000, 123'456'789}, .frame_id = "odom"},
                   .child_frame_id = "base_link",
                   .pose = {{number(), number(), number()}, {number(), number(), number(), number()}},
                   .twist = {{number(), number(), number()}, {number(), number(), number()}}});
  }
  return all;
}

speed encode_only(const std::vector<odometry>& values) {
  const auto encoder = json::encoder::compile(describe<odometry>()).value();
  std::array<char, 2048> buffer;
  std::uint64_t written = 0;
  return measure(
      [&] {
        for (const odometry& each : values) {
          json::writer into{buffer};
          encoder.encode(&each, into);
          benchmark::DoNotOptimize(buffer);
        }
        written += values.size();
      },
      [&] { return written; });
}

// ---- rounds

struct contender {
  std::string name;       // what is measured, and who
  std::string ratio_name; // to the last before it that has none
  std::function<speed()> run;
  std::vector<double> per_second{}, ratio{}, calls{}, allocations{};
};

void report(const contender& each) {
  benchmark::RegisterBenchmark(each.name.c_str(),
                               [&each](benchmark::State& state) {
                                 const double rate = median(each.per_second);
                                 for (auto _ : state) state.SetIterationTime(1 / rate);
                                 state.counters["million_per_s"] = rate / 1e6;
                                 state.counters["calls_per_message"] = median(each.calls);
                                 state.counters["allocations"] = median(each.allocations);
                                 if (!each.ratio_name.empty())
                                   state.counters[each.ratio_name] = median(each.ratio);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kNanosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  const std::vector<counted> encoded(1);
  const std::vector<odometry> poses = odometries();
  std::vector<contender> all{
      {"send_300/raw", "", send_raw},
      {"send_300/rowe_unclamped", "of_raw", [] { return send_frames(flood::in_flight::unbounded); }},
      {"send_300/rowe", "of_raw", [] { return send_frames(flood::in_flight::as_shipped); }},
      {"publish_300/rowe", "", [&] { return publish(encoded); }},
      {"publish_odometry/encoder", "", [&] { return encode_only(poses); }},
      {"publish_odometry/rowe", "of_encoder", [&] { return publish(poses); }},
      {"receive_300/raw", "", receive_raw},
      {"receive_300/rowe", "of_raw", [] { return receive_frames(0); }},
      {"receive_300/rowe_16k", "of_raw", [] { return receive_frames(16 * 1024); }},
  };
  return run_on_two_cores("bench_sending", count, arguments, [&](int rounds) {
    for (int round = 0; round < rounds; ++round) {
      double baseline = 0; // the one that stands before
      for (contender& each : all) {
        const speed seen = each.run();
        if (each.ratio_name.empty()) baseline = seen.per_second;
        each.per_second.push_back(seen.per_second);
        each.ratio.push_back(seen.per_second / baseline);
        each.calls.push_back(seen.calls_per_message);
        each.allocations.push_back(seen.allocations);
      }
    }
    for (const contender& each : all) report(each);
    return true;
  });
}
