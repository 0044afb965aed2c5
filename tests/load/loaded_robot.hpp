// SPDX-License-Identifier: Apache-2.0
// A robot for a fleet (fleet.hpp): an endpoint under TLS with tokens, and a loop of 1 kHz that publishes and
// heeds the stop. What it publishes has numbers, and a number that was refused is published again. So what a
// client misses, the endpoint has lost.
#pragma once
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <poll.h>

#include <rowe/rowe.hpp>
#include <rowe/rt/histogram.hpp>
#include <rowe/rt/periodic.hpp>
#include <rowe/rt/thread.hpp>

#include "certificates/certificates.hpp"
#include "client.hpp"
#include "fleet.hpp"
#include "rt/folder.hpp"

namespace rowe::load {
struct numbered {
  std::uint64_t n;
};
} // namespace rowe::load
template <>
inline constexpr auto rowe::schema<rowe::load::numbered> = rowe::fields<&rowe::load::numbered::n>{};

namespace rowe::load {

// A root, and a server's files below it.
class server_files {
 public:
  server_files() {
    const test::made_certificate root = test::make_root();
    test::write_files(files_.path(), root, test::make_leaf(root));
  }
  tls_options options() const {
    return {.certificate = files_ / "certificate.pem", .key = files_ / "key.pem"};
  }

 private:
  tests::folder files_;
};

// Room for eight seconds of the loop's values: so long may the machine keep a healthy client from its core.
inline endpoint_options options_for(const plan& of, const server_files& files) {
  constexpr std::uint32_t backlog = 8192;
  endpoint_options options;
  options.tls = files.options();
  options.access.identities = {{"fleet", "driver", hash_token(fleet_token)}};
  options.page = false;
  options.stop.unguarded = true;
  options.silence_max = std::chrono::seconds{20};
  limits& bounds = options.limits;
  bounds.connections_max = of.healthy + of.hostile + visitors_max + 16;
  bounds.handshakes_max = std::min(1024U, of.hostile + visitors_max + 64);
  bounds.handshake_bytes = std::size_t{4} << 20;
  bounds.subscriptions_max = std::max(bounds.subscriptions_max, 16 * bounds.connections_max);
  bounds.message_bytes_max = 8192;
  bounds.small_slots = 2 * backlog;
  bounds.small_slot_bytes = 512;
  bounds.queue_depth_max = backlog;
  bounds.queued_max = 128 * 1024;
  return options;
}

// The loop, on a thread of its own. All functions are for other threads.
class loop {
 public:
  loop(endpoint& of, const plan& loaded, rt::thread_options on = {})
      : every_{std::max(1U, 1000 / loaded.values_per_s)},
        for_all_{of.advertise<numbered>(topic_for_all, {.depth = 256}).value()},
        of_loop_{of.advertise<numbered>(topic_of_loop, {.depth = 256}).value()},
        latch_{of.stop_latch({.name = "base", .loop_timeout = std::chrono::seconds{10}}).value()} {
    thread_ = rt::thread{std::move(on), [this](const rt::grants&) { run(); }};
  }
  ~loop() {
    timed_.stop();
    thread_.join();
  }

  // Ends publishing, and waits until it has ended.
  void be_silent() {
    silent_.set(true);
    while (!is_silent_.get()) rest(1);
  }
  std::uint64_t published_for_all() const { return all_.get(); }
  std::uint64_t published_of_loop() const { return fast_.get(); }
  std::uint64_t refused() const { return refused_.get(); }
  // How late it woke, by the part that the measurement was in.
  void measure(std::size_t part) { part_.set(part); }
  const rt::histogram& lateness(std::size_t part) const { return lateness_[part]; }

 private:
  void run() {
    rt::time_point due = rt::never;
    for (std::uint64_t cycle = 0; const auto now = timed_.wait(); ++cycle) {
      if (*now >= due) lateness_[part_.get()].record(*now - due);
      due = timed_.next_deadline();
      if (latch_.engaged(*now)) latch_.acknowledge(*now);
      if (silent_.get()) {
        is_silent_.set(true);
        continue;
      }
      publish(of_loop_, fast_, *now);
      if (cycle % every_ == 0) publish(for_all_, all_, *now);
    }
  }
  void publish(publisher<numbered>& by, number<std::uint64_t>& last, rt::time_point now) {
    if (by.publish({last.get() + 1}, now))
      last.add();
    else
      refused_.add();
  }

  const std::uint32_t every_;
  publisher<numbered> for_all_;
  publisher<numbered> of_loop_;
  stop_latch latch_;
  rt::periodic timed_{std::chrono::milliseconds{1}};
  number<bool> silent_, is_silent_;
  number<std::size_t> part_;
  std::array<rt::inline_histogram<>, 2> lateness_;
  number<std::uint64_t> all_, fast_, refused_;
  rt::thread thread_;
};

// Calls the stop over a connection of its own, one call after the other. One thread.
class stop_caller {
 public:
  explicit stop_caller(std::uint16_t port)
      : context_{SSL_CTX_new(TLS_client_method())}, client_{port, context_.get(), fleet_token} {
    ok_ = go_on([this] { return client_.is_open(); });
  }
  bool ok() const { return ok_; }
  void send(std::string_view) { // it knows what it calls
    client_.say(R"({"op":"call_service","id":"1","service":"/rowe/stop"})");
    answered_ = false;
    ok_ = ok_ && step();
  }
  bool hear() {
    return ok_ = ok_ && go_on([this] { return answered_; });
  }

 private:
  bool step() {
    return client_.step([this](std::string_view text) {
      answered_ = answered_ || text.find("service_response") != text.npos;
    });
  }
  // Ten seconds at most.
  template <class Condition>
  bool go_on(Condition reached) {
    const auto end = rt::monotonic_clock::now() + std::chrono::seconds{10};
    while (step()) {
      if (reached()) return true;
      if (rt::monotonic_clock::now() > end) return false;
      pollfd one{.fd = client_.fd(),
                 .events = static_cast<short>(POLLIN | (client_.wants_write() ? POLLOUT : 0)),
                 .revents = 0};
      (void)::poll(&one, 1, 100); // a signal may end it early
    }
    return false;
  }

  struct freed {
    void operator()(SSL_CTX* one) const { SSL_CTX_free(one); }
  };
  std::unique_ptr<SSL_CTX, freed> context_;
  client client_;
  bool answered_ = false;
  bool ok_ = false;
};

inline std::uint64_t count_of(const endpoint& robot, std::string_view name) {
  for (const rowe::count& one : robot.counts())
    if (one.name == name) return one.value;
  return 0;
}

// Waits up to so long until it is true.
template <class Condition>
bool eventually(Condition condition, rt::duration most) {
  const auto end = rt::monotonic_clock::now() + most;
  while (!condition()) {
    if (rt::monotonic_clock::now() > end) return false;
    rest(5);
  }
  return true;
}

} // namespace rowe::load
