// SPDX-License-Identifier: Apache-2.0
// What TLS takes of the heap is at most what the memory plan has for it: for a connection that has done
// everything that takes memory, and for a handshake of which a hostile client keeps as much as OpenSSL lets
// it. The clients are another process, so their own is not counted.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include <malloc.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <rowe/limits.hpp>

#include "net/tls_support.hpp"
#include "service/base/service_limits.hpp"
#include "service/core/memory_plan.hpp"

namespace rowe::net {
namespace {

enum class asked : std::uint32_t { connect, hold_handshake };
struct order {
  std::uint16_t port;
  asked what;
  std::uint32_t count;
};

// The header of a hello that is as long as OpenSSL takes one, and all of it but the last byte.
std::string endless_hello() {
  constexpr std::size_t hello_bytes = 131'396;
  std::string body{'\x01', '\x02', '\x01', '\x44'}; // a hello, and its length
  body.append(hello_bytes - 1, '\x03');
  std::string records;
  for (std::size_t at = 0; at < body.size();) {
    const std::string part = body.substr(at, 16'384);
    records += {'\x16', '\x03', '\x01', static_cast<char>(part.size() >> 8), static_cast<char>(part.size())};
    records += part;
    at += part.size();
  }
  return records;
}

template <class Condition>
void spin(Condition condition) {
  const auto watchdog = rt::monotonic_clock::now() + 60s;
  while (!condition() && rt::monotonic_clock::now() < watchdog) (void)::poll(nullptr, 0, 1);
}

// A process of clients, which connect as they are told to and stay.
class clients {
 public:
  explicit clients(int version) { // there must be no other thread yet
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) return;
    end_.reset(ends[0]);
    const descriptor theirs{ends[1]};
    child_ = ::fork();
    if (child_ != 0) return;
    end_.reset();
    serve(theirs.get(), version);
    ::_exit(0);
  }
  ~clients() {
    end_.reset(); // it ends with that
    if (child_ > 0) ::waitpid(child_, nullptr, 0);
  }
  clients(const clients&) = delete;
  clients& operator=(const clients&) = delete;

  // Turns the transport until all have done what they were told.
  bool open(driver& drive, const order& wanted) {
    if (::send(end_.get(), &wanted, sizeof wanted, MSG_NOSIGNAL) != sizeof wanted) return false;
    bool fine = false;
    return drive.until([&] { return ::recv(end_.get(), &fine, sizeof fine, MSG_DONTWAIT) >= 0; }) && fine;
  }

 private:
  static bool connect(tls_socket& one, std::uint16_t port) {
    spin([&] { return one.shaken() || one.failed(); });
    if (one.failed() || !one.send(upgrade_request(port))) return false;
    spin([&] { return one.has("\r\n\r\n"); });
    one.text.clear();
    const std::string record(tls::session::record_bytes_max, 'x'); // and its echo
    if (!one.send(record)) return false;
    spin([&] { return one.has(record); });
    if (SSL_version(one.get()) == TLS1_3_VERSION) { // keys of both ends
      SSL_key_update(one.get(), SSL_KEY_UPDATE_REQUESTED);
      if (!one.send("keys")) return false;
      spin([&] { return one.has("keys"); });
    }
    return one.text.size() >= record.size();
  }
  static void serve(int end, int version) {
    std::vector<std::unique_ptr<tls_socket>> all;
    order wanted{};
    while (::recv(end, &wanted, sizeof wanted, 0) == sizeof wanted) {
      bool fine = true;
      for (std::uint32_t i = 0; fine && i < wanted.count; ++i) {
        all.push_back(std::make_unique<tls_socket>(wanted.port, [version](SSL_CTX* to) {
          SSL_CTX_set_min_proto_version(to, version);
          SSL_CTX_set_max_proto_version(to, version);
        }));
        tls_socket& one = *all.back();
        if (wanted.what == asked::connect) {
          fine = connect(one, wanted.port);
          continue;
        }
        const std::string hello = endless_hello();
        for (std::size_t sent = 0; sent < hello.size();) {
          const ssize_t now = ::send(one.raw.fd(), hello.data() + sent, hello.size() - sent, MSG_NOSIGNAL);
          if (now > 0) sent += static_cast<std::size_t>(now);
          if (now < 0 && errno != EAGAIN) return;
        }
        spin([&] { return one.raw.all_arrived(); });
      }
      (void)::send(end, &fine, sizeof fine, MSG_NOSIGNAL); // else nobody is there any more
    }
  }

  descriptor end_;
  pid_t child_ = -1;
};

std::size_t heap_bytes() {
  const struct mallinfo2 now = ::mallinfo2();
  return now.uordblks + now.hblkhd;
}

struct tls_memory : testing::TestWithParam<int> {
  void SetUp() override {
    transport = listening({.tls = files.server(), .limits = {.header_timeout = 120s}});
    drive = std::make_unique<driver>(*transport);
    drive->sink().when_bytes = [this](connection_id from, std::span<std::byte> bytes) {
      (void)transport->write(from, bytes);
      drive->sink().received.clear(); // the sink's own heap
      drive->sink().reads.clear();
    };
  }
  std::size_t of_each(asked what, std::uint32_t count) {
    EXPECT_TRUE(peers.open(*drive, {transport->port(), what, 6})); // what is taken once is taken by them
    const std::size_t before = heap_bytes();
    EXPECT_TRUE(peers.open(*drive, {transport->port(), what, count}));
    for (int i = 0; i < 200; ++i) { // what was ended is destroyed
      drive->turn();
      transport->wait(drive->now(), drive->now() + 1ms);
    }
    return (heap_bytes() - before) / count;
  }

  clients peers{GetParam()}; // before there is a thread
  certified files;
  std::unique_ptr<socket_transport> transport;
  std::unique_ptr<driver> drive;
};

TEST_P(tls_memory, of_a_connection_is_at_most_what_is_planned) {
  const std::size_t each = of_each(asked::connect, 40);
  std::printf("%zu\n", each);
  EXPECT_LE(each, service::tls_connection_bytes);
  EXPECT_GT(each, service::tls_connection_bytes * 4 / 5) << "the plan has more than it need have";
}

TEST_P(tls_memory, of_a_handshake_is_at_most_what_is_planned) {
  const std::size_t each = of_each(asked::hold_handshake, 20);
  std::printf("%zu\n", each);
  EXPECT_LE(each, service::tls_handshake_bytes);
  EXPECT_GT(each, service::tls_handshake_bytes * 4 / 5) << "the plan has more than it need have";
}

INSTANTIATE_TEST_SUITE_P(, tls_memory, testing::Values(TLS1_3_VERSION, TLS1_2_VERSION),
                         [](const auto& of) { return of.param == TLS1_3_VERSION ? "tls_1_3" : "tls_1_2"; });

// What an endpoint takes more than one without TLS, before anybody comes.
std::size_t taken_at_once(const certified& files, std::uint32_t handshakes) {
  const auto taken = [&](const tls_options& with) {
    const socket_limits limits{.connections_max = 40, .handshakes_max = handshakes};
    const auto first = listening({.tls = with, .limits = limits}); // and what the process has once
    const std::size_t before = heap_bytes();
    const auto second = listening({.tls = with, .limits = limits});
    return heap_bytes() - before;
  };
  return taken(files.server()) - taken({});
}

TEST(tls_memory_at_once, is_at_most_what_is_planned) {
  const certified files;
  const std::size_t of_one = taken_at_once(files, 1);
  const std::size_t of_many = taken_at_once(files, 101);
  std::printf("%zu %zu\n", of_one, (of_many - of_one) / 100);
  EXPECT_LE(of_one, service::tls_bytes + service::tls_place_bytes);
  EXPECT_GT(of_one, service::tls_bytes / 2) << "the plan has more than it need have";
  EXPECT_LE((of_many - of_one) / 100, service::tls_place_bytes);
  EXPECT_GT((of_many - of_one) / 100, service::tls_place_bytes / 2) << "the plan has more than it need have";
}

} // namespace
} // namespace rowe::net
