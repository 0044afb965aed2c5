// SPDX-License-Identifier: Apache-2.0
// Question: what does a message cost as peers, topics, handles and calls become many?
//
// Measured, for each size, all in one run and in turn:
//   peers_quiet      one of so many peers says something and hears it; the others say nothing
//   peers_sending    each of so many peers publishes one message, which a handle takes
//   peers_receiving  one message goes to so many peers; `raw` is a loop of `send` over as many bare sockets
//   topics           one peer has subscribed to so many topics, another publishes on one after the other
//   handles          so many handles publish, one after the other, each on its own topic
//   calls            a peer asks one more question, and is answered, while so many calls are open
// cpu_ns: what the thread that runs the core used for one message to or from one peer, by its own CPU clock,
// from the bytes that lie in a socket or the value that lies in a handle's slots to the last byte given to
// the kernel, over real connections; that thread does nothing else and never sleeps. of_one: the ratio to the
// smallest size, of_raw to the bare sockets, taken inside a round. cycle_p50_us, cycle_p99_us: how long the
// cycles took in which that was done. memory_kib: what `limits` say that the endpoint takes, raised from the
// defaults by no more than the size asks for; resident_kib: by how much this process grew when it was opened
// and all had connected. Medians over the rounds.
//
// Excluded: the peers' own work, which this thread does between the measured stretches; what the kernel holds
// for a socket; waiting and waking.
//
// What would make it lie: a limit of open files below 6000 (`ulimit -n`), which is refused with words. The
// kernel delivers to a socket of this machine inside the sender's `send`: towards a network that is cheaper.
//
// Run: bench_scale [--rounds=11]
#include <array>
#include <cstdio>
#include <ctime>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <benchmark/benchmark.h>

#include "net/base/descriptor.hpp"
#include "net/transport/socket_transport.hpp"
#include "raw_client.hpp"
#include "service/core/core_harness.hpp"
#include "stand.hpp"

namespace rowe::bench {
namespace {

using service::counter;

constexpr std::uint32_t messages_per_round = 1000; // at least, of each size

double cpu_ns() {
  timespec used{};
  (void)::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used); // always there
  return static_cast<double>(used.tv_sec) * 1e9 + static_cast<double>(used.tv_nsec);
}

std::size_t resident_kib() {
  std::size_t total = 0, resident = 0;
  std::ifstream{"/proc/self/statm"} >> total >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) / 1024;
}

// Sockets, under a core in its harness.
class loopback final : public service::transport {
 public:
  explicit loopback(std::uint32_t connections_max)
      : sockets_{net::socket_transport::listen({.limits = {.connections_max = connections_max}}).value()} {}
  std::uint16_t port() const { return sockets_->port(); }

  void poll(rt::time_point now, service::transport_sink& sink) noexcept override {
    sockets_->poll(now, sink);
  }
  void wait(rt::time_point now, rt::time_point until) noexcept override { sockets_->wait(now, until); }
  void wake() noexcept override { sockets_->wake(); }
  int wake_descriptor() const noexcept override { return sockets_->wake_descriptor(); }
  std::size_t write(service::connection_id id, std::span<const std::byte> bytes) noexcept override {
    return sockets_->write(id, bytes);
  }
  void close(service::connection_id id, service::close_how how) noexcept override {
    sockets_->close(id, how);
  }
  void limit_send_buffer(service::connection_id id, std::size_t bytes) noexcept override {
    sockets_->limit_send_buffer(id, bytes);
  }
  void read_enabled(service::connection_id id, bool enabled) noexcept override {
    sockets_->read_enabled(id, enabled);
  }
  void connect() noexcept override {}

 private:
  std::unique_ptr<net::socket_transport> sockets_;
};

// The other end of a connection.
class client {
 public:
  explicit client(std::uint16_t port) : socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)} {
    const sockaddr_in to = loopback_at(port);
    send_at_once(socket_.get());
    ok_ = ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
    send_bytes("GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
               "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
               "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
  }
  // Once the server has answered.
  void take_answer() {
    std::array<char, 1024> answer;
    ok_ = ok_ && ::recv(socket_.get(), answer.data(), answer.size(), MSG_DONTWAIT) > 0;
  }
  bool ok() const { return ok_; }

  void say(std::string_view text) { send_bytes(frame(wire::opcode::text, text)); }
  // Reads what has come; pings are answered.
  void hear() {
    std::array<std::byte, 16 * 1024> buffer;
    for (;;) {
      const ssize_t got =
          ::recv(socket_.get(), buffer.data() + held_.size(), buffer.size() - held_.size(), MSG_DONTWAIT);
      if (got <= 0) return;
      std::copy(held_.begin(), held_.end(), buffer.begin());
      const auto all = std::span{buffer}.first(held_.size() + static_cast<std::size_t>(got));
      std::size_t at = 0;
      for (std::size_t bytes; (bytes = frame_bytes(all.subspan(at))) != 0; at += bytes) {
        if (all[at] != std::byte{0x89}) continue;
        send_bytes(
            frame(wire::opcode::pong, {reinterpret_cast<const char*>(all.data() + at + 2), bytes - 2}));
      }
      held_.assign(all.begin() + static_cast<std::ptrdiff_t>(at), all.end());
    }
  }

 private:
  // Masked with zeros.
  static std::string frame(wire::opcode what, std::string_view payload) {
    std::string bytes(wire::frame_header_bytes(payload.size(), wire::role::client), '\0');
    (void)wire::write_frame_header(reinterpret_cast<std::byte*>(bytes.data()), what, payload.size(),
                                   wire::mask_key{}); // its size is that
    return bytes.append(payload);
  }
  // Of the server's frame that stands here whole; 0: it does not. None is larger than 64 KiB.
  static std::size_t frame_bytes(std::span<const std::byte> at) {
    if (at.size() < 2) return 0;
    std::size_t bytes = 2 + std::to_integer<std::size_t>(at[1]);
    if (at[1] == std::byte{126}) {
      if (at.size() < 4) return 0;
      bytes = 4 + (std::to_integer<std::size_t>(at[2]) << 8 | std::to_integer<std::size_t>(at[3]));
    }
    return bytes <= at.size() ? bytes : 0;
  }
  void send_bytes(std::string_view bytes) { ok_ = ok_ && send_whole(socket_.get(), bytes); }

  net::descriptor socket_;
  bool ok_ = false;
  std::vector<std::byte> held_; // the beginning of a frame
};

std::string topic_of(std::uint32_t n) { return "/topic/" + std::to_string(n); }
std::string subscribe_to(std::string_view topic) {
  return R"({"op":"subscribe","topic":")" + std::string{topic} + R"("})";
}
std::string publish_on(std::string_view topic) {
  return R"({"op":"publish","topic":")" + std::string{topic} + R"(","msg":{"x":1.5,"y":-2.25,"theta":0.1}})";
}

struct samples {
  std::vector<double> cost, of_one, of_raw; // of each round
  std::vector<double> cycles;               // ns, of all
};

// A core with its peers, all of them on this thread.
class stand {
 public:
  stand(const endpoint_options& options, std::uint32_t count_of_peers)
      : before_kib_{resident_kib()}, on{options} {
    for (std::uint32_t i = 0; i < count_of_peers; ++i) {
      client& added = peers.emplace_back(on.net.port());
      const auto until = monotonic_clock::now() + std::chrono::seconds{5};
      while (on.core.peers() == i && monotonic_clock::now() < until) cycle();
      added.take_answer();
      ok = ok && added.ok();
    }
    tend();
    memory_kib = static_cast<double>(options.limits.footprint_bytes()) / 1024;
    grown_kib = static_cast<double>(resident_kib() - before_kib_);
  }

  void cycle() {
    const rt::time_point begin = monotonic_clock::now();
    on.now = begins_ + (begin - opened_);
    on.next_wake = on.core.cycle(on.now);
    if (cycles != nullptr) cycles->push_back(nanoseconds_since(begin));
  }
  std::uint64_t count(counter which) const { return on.shared.counts.read(which); }
  // Cycles until so many more are counted; returns what that took of the CPU.
  double until(counter which, std::uint64_t more) {
    const std::uint64_t due = count(which) + more;
    const double begin = cpu_ns();
    while (count(which) < due) cycle();
    return cpu_ns() - begin;
  }
  // What peers do in between.
  void tend() {
    std::vector<double>* const measured = std::exchange(cycles, nullptr);
    for (client& one : peers) one.hear();
    do cycle();
    while (on.next_wake <= on.now);
    cycles = measured;
  }
  // Says it and lets it be carried out.
  void ask(client& by, std::string_view text) {
    by.say(text);
    for (const auto due = count(counter::messages_in) + 1; count(counter::messages_in) < due;) cycle();
    tend();
    ok = ok && count(counter::refused_requests) == 0;
  }
  detail::queue_pair& advertise(std::string_view topic) {
    detail::queue_pair& made = on.offer(detail::pair_kind::publish_text, topic, 64, {.depth = 8});
    tend();
    return made;
  }
  void publish(detail::queue_pair& by) {
    constexpr std::string_view text = R"({"x":1.5,"y":-2.25,"theta":0.1})";
    (void)detail::publish_into(by, text.size(), on.now, [&](std::byte* slot) { // there is a slot
      text.copy(reinterpret_cast<char*>(slot), text.size());
    });
  }

 private:
  std::size_t before_kib_;
  rt::time_point opened_ = monotonic_clock::now();

 public:
  harness::core_harness_over<loopback> on;
  std::vector<client> peers;
  std::vector<double>* cycles = nullptr; // where their times go
  double memory_kib = 0, grown_kib = 0;
  bool ok = true;

 private:
  const rt::time_point begins_ = on.now;
};

// One thing to measure, of one size. step() does a part of it and returns the CPU time of so many messages.
struct subject {
  virtual ~subject() = default;
  virtual double step() = 0;

  const char* name = nullptr;
  const char* contender = "rowe";
  std::uint32_t size = 0;
  std::uint32_t messages = 1;   // of a step
  std::shared_ptr<stand> in;    // rowe
  const subject* raw = nullptr; // of the same size, measured before
  samples seen;
};

endpoint_options options_for(std::uint32_t peers) {
  endpoint_options chosen;
  chosen.relay = true;
  chosen.limits.connections_max = peers + 2; // the last two are kept for the stop
  chosen.limits.subscriptions_max = 4 * peers + 64;
  chosen.limits.messages_per_second_max = 0; // one peer stands for many
  return chosen;
}

struct quiet final : subject {
  explicit quiet(std::shared_ptr<stand> of) {
    name = "peers_quiet";
    in = std::move(of);
    in->ask(in->peers.back(), subscribe_to("/echo"));
  }
  double step() override {
    in->peers.back().say(message_);
    const double took = in->until(counter::messages_out, 1);
    in->peers.back().hear();
    return took;
  }
  const std::string message_ = publish_on("/echo");
};

struct sending final : subject {
  explicit sending(std::shared_ptr<stand> of) {
    name = "peers_sending";
    in = std::move(of);
    messages = static_cast<std::uint32_t>(in->peers.size());
    inbox_ = &in->on.offer(detail::pair_kind::subscribe_text, "/up", 64, {.depth = 1024});
    in->tend();
  }
  double step() override {
    for (client& one : in->peers) one.say(message_);
    const double took = in->until(counter::messages_in, messages);
    while (const auto slot = inbox_->user.in.ring->try_pop()) inbox_->user.in.free_ring->release(*slot);
    return took;
  }
  detail::queue_pair* inbox_;
  const std::string message_ = publish_on("/up");
};

struct receiving final : subject {
  explicit receiving(std::shared_ptr<stand> of) {
    name = "peers_receiving";
    in = std::move(of);
    messages = static_cast<std::uint32_t>(in->peers.size());
    publisher_ = &in->advertise("/down");
    for (client& one : in->peers) in->ask(one, subscribe_to("/down"));
  }
  double step() override {
    in->publish(*publisher_);
    const double took = in->until(counter::messages_out, messages);
    for (client& one : in->peers) one.hear();
    return took;
  }
  detail::queue_pair* publisher_;
};

struct raw_receiving final : subject {
  explicit raw_receiving(std::uint32_t peers) : pairs_(peers) {
    name = "peers_receiving";
    contender = "raw";
    messages = peers;
  }
  double step() override {
    const double begin = cpu_ns();
    for (const socket_pair& one : pairs_)
      (void)::send(one.ours(), frame_.data(), frame_.size(), MSG_NOSIGNAL | MSG_DONTWAIT); // there is room
    const double took = cpu_ns() - begin;
    std::array<char, 1024> buffer;
    for (const socket_pair& one : pairs_)
      while (::recv(one.theirs(), buffer.data(), buffer.size(), MSG_DONTWAIT) > 0) continue;
    return took;
  }
  std::vector<socket_pair> pairs_;
  const std::string frame_ = std::string(2, '\0') + publish_on("/down");
};

struct topics final : subject {
  explicit topics(std::uint32_t count) {
    name = "topics";
    endpoint_options options = options_for(8);
    options.limits.topics_max = 4 * count + 64; // one peer may hold no more than it leaves
    options.limits.subscriptions_max = 4 * count + 64;
    options.limits.subscriptions_per_connection_max = count;
    in = std::make_shared<stand>(options, 2);
    for (std::uint32_t i = 0; i < count; ++i) {
      in->ask(in->peers[0], subscribe_to(topic_of(i)));
      says_.push_back(publish_on(topic_of(i)));
    }
  }
  double step() override {
    in->peers[1].say(says_[next_++ % says_.size()]);
    const double took = in->until(counter::messages_out, 1);
    in->peers[0].hear();
    return took;
  }
  std::vector<std::string> says_;
  std::size_t next_ = 0;
};

struct handles final : subject {
  explicit handles(std::uint32_t count) {
    name = "handles";
    endpoint_options options = options_for(8);
    options.limits.subscriptions_max = 4 * count + 64; // one peer may hold no more than it leaves
    in = std::make_shared<stand>(options, 1);
    for (std::uint32_t i = 0; i < count; ++i) {
      publishers_.push_back(&in->advertise(topic_of(i)));
      in->ask(in->peers[0], subscribe_to(topic_of(i)));
    }
  }
  double step() override {
    in->publish(*publishers_[next_++ % publishers_.size()]);
    const double took = in->until(counter::messages_out, 1);
    in->peers[0].hear();
    return took;
  }
  std::vector<detail::queue_pair*> publishers_;
  std::size_t next_ = 0;
};

struct calls final : subject {
  explicit calls(std::uint32_t count) {
    name = "calls";
    endpoint_options options = options_for(8);
    options.limits.calls_max = 4 * count + 64; // a quarter is ours, half of the rest for one
    options.limits.calls_per_connection_max = count + 8;
    in = std::make_shared<stand>(options, 2);
    in->ask(in->peers[0], R"({"op":"advertise_service","service":"/slow"})");
    for (std::uint32_t i = 0; i < count; ++i) {
      in->ask(in->peers[1],
              R"({"op":"call_service","id":"slow )" + std::to_string(i) + R"(","service":"/slow"})");
    }
  }
  double step() override {
    in->peers[1].say(R"({"op":"call_service","id":"quick","service":"/rosapi/topic_type"})");
    const double took = in->until(counter::messages_out, 1);
    in->peers[1].hear();
    return took;
  }
};

using subjects = std::vector<std::unique_ptr<subject>>;

// Each kind's smallest size first.
subjects make_all() {
  subjects all;
  const auto add = [&](std::uint32_t size, std::unique_ptr<subject> one) {
    one->size = size;
    all.push_back(std::move(one));
  };
  std::vector<std::shared_ptr<stand>> crowds;
  constexpr std::uint32_t sizes[] = {1, 10, 100, 1000};
  for (const std::uint32_t n : sizes) crowds.push_back(std::make_shared<stand>(options_for(n), n));
  for (std::size_t i = 0; i < crowds.size(); ++i) add(sizes[i], std::make_unique<quiet>(crowds[i]));
  for (std::size_t i = 0; i < crowds.size(); ++i) add(sizes[i], std::make_unique<sending>(crowds[i]));
  for (std::size_t i = 0; i < crowds.size(); ++i) {
    add(sizes[i], std::make_unique<raw_receiving>(sizes[i]));
    const subject* const raw = all.back().get();
    add(sizes[i], std::make_unique<receiving>(crowds[i]));
    all.back()->raw = raw;
  }
  for (const std::uint32_t n : sizes) add(n, std::make_unique<topics>(n));
  for (const std::uint32_t n : {1U, 8U, 32U}) add(n, std::make_unique<handles>(n));
  for (const std::uint32_t n : sizes) add(n, std::make_unique<calls>(n));
  return all;
}

void measure(subject& one) {
  if (one.in) {
    one.in->tend(); // what fell due meanwhile
    one.in->cycles = &one.seen.cycles;
  }
  double took = 0;
  std::uint32_t messages = 0;
  for (; messages < messages_per_round; messages += one.messages) took += one.step();
  if (one.in) one.in->cycles = nullptr;
  one.seen.cost.push_back(took / messages);
  if (one.raw != nullptr) one.seen.of_raw.push_back(one.seen.cost.back() / one.raw->seen.cost.back());
}

void report(subject& one) {
  const std::string name = std::string{one.name} + "/" + one.contender + "/" + std::to_string(one.size);
  benchmark::RegisterBenchmark(name.c_str(),
                               [&one](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(median(one.seen.cost) * 1e-9);
                                 state.counters["cpu_ns"] = median(one.seen.cost);
                                 state.counters["of_one"] = median(one.seen.of_one);
                                 if (!one.in) return;
                                 if (one.raw != nullptr) state.counters["of_raw"] = median(one.seen.of_raw);
                                 state.counters["memory_kib"] = one.in->memory_kib;
                                 state.counters["resident_kib"] = one.in->grown_kib;
                                 state.counters["cycle_p50_us"] = quantile(one.seen.cycles, 0.5) / 1000;
                                 state.counters["cycle_p99_us"] = quantile(one.seen.cycles, 0.99) / 1000;
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kNanosecond);
}

void raise_open_files() {
  rlimit files{};
  (void)::getrlimit(RLIMIT_NOFILE, &files); // as raised as may be: what is too little is said below
  files.rlim_cur = files.rlim_max;
  (void)::setrlimit(RLIMIT_NOFILE, &files);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  raise_open_files();
  subjects all;
  return run_on_two_cores("bench_scale", count, arguments, [&](int rounds) {
    all = make_all();
    for (const auto& one : all) {
      if (!one->in || one->in->ok) continue;
      std::fprintf(stderr, "%s: connections or requests were refused; is `ulimit -n` at least 6000?\n",
                   std::string{one->name}.c_str());
      return false;
    }
    for (int round = 0; round < rounds; ++round) {
      std::map<std::string, double> smallest;
      for (const auto& one : all) {
        measure(*one);
        double& base = smallest[std::string{one->name} + one->contender];
        if (one->size == 1) base = one->seen.cost.back();
        one->seen.of_one.push_back(one->seen.cost.back() / base);
      }
    }
    for (const auto& one : all) report(*one);
    return true;
  });
}
