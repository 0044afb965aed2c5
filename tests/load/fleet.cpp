// SPDX-License-Identifier: Apache-2.0
#include "fleet.hpp"

#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "client.hpp"

namespace rowe::load {
namespace {

using namespace std::chrono_literals;
using rt::monotonic_clock;

constexpr int openings_at_once = 16;
constexpr int small_buffer = 4096;
constexpr rt::duration reading_nothing_max = 4s; // of one that reads nothing, if it is not cut before

struct openssl_freed {
  void operator()(SSL_CTX* one) const { SSL_CTX_free(one); }
};

// What all actors have.
struct world {
  board& shown;
  std::uint16_t port = 0;
  std::unique_ptr<SSL_CTX, openssl_freed> context{SSL_CTX_new(TLS_client_method())};
  net::descriptor polled{::epoll_create1(EPOLL_CLOEXEC)};
  std::mt19937_64 random{1};
};

// Whoever has a connection, or none.
class actor {
 public:
  explicit actor(world& in) : world_{in} {}
  virtual ~actor() = default;
  actor(const actor&) = delete;
  actor& operator=(const actor&) = delete;
  virtual void on_event(std::uint32_t events) = 0;

  bool has_connection() const { return client_ != nullptr; }

 protected:
  void begin(const char* shown_token, bool secure = true, int receive_buffer = 0) {
    client_ = std::make_unique<client>(world_.port, secure ? world_.context.get() : nullptr, shown_token,
                                       receive_buffer);
    watched_ = EPOLLIN | EPOLLRDHUP;
    epoll_event wanted{.events = watched_, .data = {.ptr = this}};
    (void)::epoll_ctl(world_.polled.get(), EPOLL_CTL_ADD, client_->fd(), &wanted);
  }
  void watch(std::uint32_t events) {
    if (std::exchange(watched_, events) == events) return;
    epoll_event wanted{.events = events, .data = {.ptr = this}};
    (void)::epoll_ctl(world_.polled.get(), EPOLL_CTL_MOD, client_->fd(), &wanted);
  }
  // Goes on; false: it is over, and there is no connection any more.
  template <class Hear>
  bool step(Hear hear) {
    if (client_->step(hear)) {
      watch(EPOLLIN | EPOLLRDHUP | (client_->wants_write() ? EPOLLOUT : 0U));
      return true;
    }
    leave();
    return false;
  }
  bool step() {
    return step([](std::string_view) {});
  }
  void leave() { client_.reset(); } // a closed descriptor leaves the epoll by itself

  world& world_;
  std::unique_ptr<client> client_;

 private:
  std::uint32_t watched_ = 0;
};

std::string subscribe_to(std::string_view topic) {
  return R"({"op":"subscribe","topic":")" + std::string{topic} + "\"}";
}

// ---- healthy ones

class healthy final : public actor {
 public:
  healthy(world& in, bool fast) : actor{in}, fast_{fast} {}
  void open() {
    begin(fleet_token);
    on_event(EPOLLOUT);
  }
  bool is_ready() const { return subscribed_; }
  bool is_fast() const { return fast_; }
  std::uint64_t has_of_all() const { return of_all_; }
  std::uint64_t has_of_loop() const { return of_loop_; }

  void on_event(std::uint32_t) override {
    if (!client_) return;
    if (!step([this](std::string_view text) { hear(text); })) {
      world_.shown.broken.add();
      subscribed_ = false;
      return;
    }
    if (subscribed_ || !client_->is_open()) return;
    subscribed_ = true;
    client_->say(subscribe_to(topic_for_all));
    if (fast_) client_->say(subscribe_to(topic_of_loop));
    (void)step([this](std::string_view text) { hear(text); }); // if it ended, an event says so
  }

 private:
  void hear(std::string_view text) {
    constexpr std::string_view before = "\"n\":";
    const std::size_t at = text.find(before);
    if (at == text.npos) return; // a status
    std::uint64_t value = 0;
    (void)std::from_chars(text.data() + at + before.size(), text.data() + text.size(), value);
    std::uint64_t& last = text.find(topic_for_all) != text.npos ? of_all_ : of_loop_;
    world_.shown.heard.add();
    if (last != 0 && value > last + 1) world_.shown.lost.add(value - last - 1);
    if (value <= last) world_.shown.wrong.add();
    last = value;
  }

  const bool fast_;
  bool subscribed_ = false;
  std::uint64_t of_all_ = 0;
  std::uint64_t of_loop_ = 0;
};

// ---- hostile ones

class hostile final : public actor {
 public:
  hostile(world& in, misdeed what) : actor{in}, what_{what} {}

  void tick(rt::time_point now) {
    const bool welcome = world_.shown.disturbed.get();
    if (what_ == misdeed::reads_nothing && client_ && done_ && (now >= leaves_at_ || !welcome)) leave();
    if (client_ || now < again_at_ || !welcome) return;
    again_at_ = now + std::chrono::milliseconds{300 + world_.random() % 700};
    leaves_at_ = now + reading_nothing_max;
    done_ = false;
    switch (what_) {
    case misdeed::half_handshake:
      begin("", false);
      (void)::send(client_->fd(), "\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11, MSG_NOSIGNAL);
      return note();
    case misdeed::wrong_token: begin("a-token-that-nobody-has"); break;
    case misdeed::reads_nothing: begin(fleet_token, true, small_buffer); break;
    default: begin(fleet_token);
    }
    on_event(EPOLLOUT);
  }

  void on_event(std::uint32_t events) override {
    if (!client_) return;
    if (what_ == misdeed::half_handshake || done_) {
      // Only whether it is over matters; one that reads nothing hears of a reset alone.
      if ((events & (EPOLLERR | EPOLLHUP | EPOLLRDHUP)) != 0) return leave();
      if (what_ == misdeed::reads_nothing) return;
      char thrown_away[4096];
      const ssize_t got = ::recv(client_->fd(), thrown_away, sizeof thrown_away, 0);
      if (got == 0 || (got < 0 && errno != EAGAIN)) leave();
      return;
    }
    if (!step()) {
      if (what_ == misdeed::wrong_token) note(); // it was refused
      return;
    }
    if (client_->is_open()) misbehave();
  }

 private:
  void note() {
    done_ = true;
    world_.shown.done[static_cast<std::size_t>(what_)].add();
  }
  void misbehave() {
    switch (what_) {
    case misdeed::reads_nothing:
      client_->say(subscribe_to(topic_for_all));
      client_->say(subscribe_to(topic_of_loop));
      (void)step();
      if (!client_) return;
      watch(EPOLLRDHUP);
      return note();
    case misdeed::takes_new_keys:
      for (int i = 0; i < 12; ++i) {
        SSL_key_update(client_->ssl(), SSL_KEY_UPDATE_NOT_REQUESTED);
        (void)SSL_do_handshake(client_->ssl());
      }
      return note();
    case misdeed::wrong_record:
      (void)::send(client_->fd(), "\x17\x03\x03\x00\x18 no record, but bytes....", 29, MSG_NOSIGNAL);
      return note();
    case misdeed::cut:
      client_->say(R"({"op":"publish","topic":"/of/nobody","msg":{"n":1}})");
      (void)step();
      note();
      return leave();
    case misdeed::half_handshake:
    case misdeed::wrong_token: return;
    }
  }

  const misdeed what_;
  rt::time_point again_at_{};
  rt::time_point leaves_at_{};
  bool done_ = false;
};

// ---- visitors

class visitor final : public actor {
 public:
  using actor::actor;
  void come() {
    begin(fleet_token);
    on_event(EPOLLOUT);
  }
  void on_event(std::uint32_t) override {
    if (!client_) return;
    if (!step()) return world_.shown.visits_failed.add();
    if (!client_->is_open()) return;
    client_->say_end();
    leave();
    world_.shown.visits.add();
  }
};

// ---- all of them

class crowd {
 public:
  // It ends with the robot's process.
  crowd(const plan& of, board& shown, pid_t robot) : plan_{of}, robot_{robot}, world_{.shown = shown} {
    SSL_CTX_set_min_proto_version(world_.context.get(), TLS1_3_VERSION); // new keys are its own
    for (std::uint32_t i = 0; i < of.healthy; ++i)
      healthy_.push_back(std::make_unique<healthy>(world_, i < of.fast));
    for (std::uint32_t i = 0; i < of.hostile; ++i)
      hostile_.push_back(std::make_unique<hostile>(world_, static_cast<misdeed>(i % misdeeds)));
    for (std::uint32_t i = 0; i < visitors_max; ++i) visitors_.push_back(std::make_unique<visitor>(world_));
  }

  void live() {
    while (world_.shown.port.get() == 0 && !over()) rest(1);
    world_.port = static_cast<std::uint16_t>(world_.shown.port.get());
    std::vector<epoll_event> events(256);
    while (!over()) {
      const int found = ::epoll_wait(world_.polled.get(), events.data(), static_cast<int>(events.size()), 5);
      for (int i = 0; i < found; ++i) {
        const epoll_event& one = events[static_cast<std::size_t>(i)];
        static_cast<actor*>(one.data.ptr)->on_event(one.events);
      }
      open_some();
      const auto now = monotonic_clock::now();
      for (auto& one : hostile_) one->tick(now);
      let_visit(now);
      show();
    }
  }

 private:
  bool over() const { return world_.shown.over.get() || ::getppid() != robot_; }

  void open_some() {
    if (next_ == healthy_.size()) return;
    auto under_way = std::count_if(healthy_.begin(), healthy_.end(),
                                   [](const auto& one) { return one->has_connection() && !one->is_ready(); });
    for (; next_ < healthy_.size() && under_way < openings_at_once; ++under_way) healthy_[next_++]->open();
  }
  void let_visit(rt::time_point now) {
    if (plan_.visits_per_s == 0 || !world_.shown.disturbed.get()) {
      visit_at_ = now;
      return;
    }
    visit_at_ = std::max(visit_at_, now - 100ms); // what it could not do in time it leaves
    for (; visit_at_ <= now; visit_at_ += rt::duration{1s} / plan_.visits_per_s) {
      const auto idle = std::find_if(visitors_.begin(), visitors_.end(),
                                     [](const auto& one) { return !one->has_connection(); });
      if (idle == visitors_.end()) return;
      (*idle)->come();
    }
  }
  void show() {
    std::uint32_t ready = 0;
    std::optional<std::uint64_t> all, loop;
    for (const auto& one : healthy_) {
      ready += one->is_ready() ? 1U : 0U;
      all = std::min(all.value_or(UINT64_MAX), one->has_of_all());
      if (one->is_fast()) loop = std::min(loop.value_or(UINT64_MAX), one->has_of_loop());
    }
    const auto connected = [](const auto& some) {
      return static_cast<std::uint32_t>(
          std::count_if(some.begin(), some.end(), [](const auto& one) { return one->has_connection(); }));
    };
    world_.shown.open.set(ready);
    world_.shown.all_have.set(all.value_or(0));
    world_.shown.fast_have.set(loop.value_or(0));
    world_.shown.strangers.set(connected(hostile_) + connected(visitors_));
  }

  const plan plan_;
  const pid_t robot_;
  world world_;
  std::vector<std::unique_ptr<healthy>> healthy_;
  std::vector<std::unique_ptr<hostile>> hostile_;
  std::vector<std::unique_ptr<visitor>> visitors_;
  std::size_t next_ = 0;
  rt::time_point visit_at_{};
};

} // namespace

void raise_descriptor_limit() {
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) != 0) return;
  files.rlim_cur = files.rlim_max;
  (void)::setrlimit(RLIMIT_NOFILE, &files); // refused: a connection will fail
}

fleet::fleet(const plan& of, board& shown) : board_{shown} {
  const pid_t robot = ::getpid();
  child_ = ::fork();
  if (child_ != 0) return;
  std::signal(SIGPIPE, SIG_IGN); // of OpenSSL's own sockets
  raise_descriptor_limit();
  crowd{of, shown, robot}.live();
  ::_exit(0);
}

fleet::~fleet() {
  board_.over.set(true);
  if (child_ > 0) ::waitpid(child_, nullptr, 0);
}

} // namespace rowe::load
