// SPDX-License-Identifier: Apache-2.0
// What TLS adds to a message in the service thread, in calls that can be counted: those of the heap, which
// are all OpenSSL's, and none of whose blocks outlives the call; of locks, none; of the kernel, none more
// than without TLS. One connection of each version, whose client is this thread as well. The clock stands
// while it is counted, so that nothing is due.
#include <rowe/rt/tripwire.hpp>

#include <gtest/gtest.h>

#include <cstdlib>
#include <ostream>
#include <string>

#include <openssl/crypto.h>

#include "net/tls_support.hpp"

namespace rowe::net {
namespace {

// OpenSSL's own, of this thread: the terminator's has the handshakes.
thread_local std::uint64_t taken = 0;
thread_local std::uint64_t given_back = 0;
thread_local std::size_t largest = 0;

void* take(std::size_t bytes, const char*, int) {
  ++taken;
  largest = std::max(largest, bytes);
  return std::malloc(bytes);
}
void* take_more(void* old, std::size_t bytes, const char*, int) {
  if (old == nullptr) ++taken;
  largest = std::max(largest, bytes);
  return std::realloc(old, bytes);
}
void give_back(void* old, const char*, int) {
  if (old != nullptr) ++given_back;
  std::free(old);
}
const bool counted = CRYPTO_set_mem_functions(take, take_more, give_back) == 1; // before OpenSSL has any

struct quiet_sink final : service::transport_sink {
  service::admit_answer admit(const service::credentials&) const noexcept override { return {}; }
  void on_open(connection_id id, const service::peer_info&) noexcept override { newest = id; }
  void on_bytes(connection_id, std::span<std::byte> got) noexcept override { bytes += got.size(); }
  void on_writable(connection_id) noexcept override {}
  void on_close(connection_id, close_cause) noexcept override { closed = true; }
  void on_rejected(const service::rejection&) noexcept override {}
  service::http_answer on_http(const service::http_request&) noexcept override { return {}; }

  connection_id newest{};
  std::size_t bytes = 0;
  bool closed = false;
};

struct figures {
  rt::tripwire::report seen;
  std::uint64_t taken, given_back;
  std::size_t largest;
};

template <class Call>
figures count(Call call) {
  const std::uint64_t before = taken;
  const std::uint64_t before_back = given_back;
  largest = 0;
  auto wire = rt::tripwire::arm();
  call();
  return {wire.disarm(), taken - before, given_back - before_back, largest};
}

// Made before this thread is watched, for it can start no terminator afterwards.
struct world {
  certified files;
  std::unique_ptr<socket_transport> transport = listening({.tls = files.server()});
  quiet_sink sink;
  rt::time_point stands_at = rt::monotonic_clock::now();

  struct side {
    std::unique_ptr<tls_socket> client;
    connection_id id;
  };
  side of_1_3 = open(TLS1_3_VERSION);
  side of_1_2 = open(TLS1_2_VERSION);

  void turn() { transport->poll(stands_at, sink); }
  side open(int version) {
    auto client = std::make_unique<tls_socket>(transport->port(), [version](SSL_CTX* to) {
      SSL_CTX_set_min_proto_version(to, version);
      SSL_CTX_set_max_proto_version(to, version);
    });
    while (!client->shaken() && !client->failed()) turn();
    EXPECT_FALSE(client->failed()) << client->fault;
    EXPECT_TRUE(client->send(upgrade_request(transport->port())));
    while (!client->has("\r\n\r\n")) turn();
    client->text.clear();
    return {std::move(client), sink.newest};
  }
};
std::unique_ptr<world> all;

struct version {
  const char* name;
  world::side world::*side;
  std::uint64_t sealing, opening; // allocations for a record

  friend void PrintTo(const version& one, std::ostream* to) { *to << one.name; }
};

struct tls_records : testing::TestWithParam<version> {
  static void SetUpTestSuite() {
    ASSERT_TRUE(counted);
    if (!all) all = std::make_unique<world>();
    ASSERT_TRUE(rt::tripwire::watch_system_calls());
  }
  static void TearDownTestSuite() { all.reset(); }

  world::side& side() { return (*all).*GetParam().side; }
  static void expect_openssls_own(const figures& of, std::uint64_t allocations) {
    EXPECT_EQ(of.taken, allocations);
    EXPECT_EQ(of.given_back, of.taken); // nothing is left of it
    EXPECT_LE(of.largest, 40U);
    EXPECT_EQ(of.seen.allocations, of.taken + of.given_back) << of.seen.last_call; // nothing is ours
    EXPECT_EQ(of.seen.locks, 0U) << of.seen.last_call;
  }
};

TEST_P(tls_records, are_sealed_by_allocations_that_are_known_and_sent_by_one_call) {
  for (const std::size_t bytes : {1U, 64U, 512U, 16384U}) {
    const std::string text(bytes, 'x');
    for (int i = 0; i < 200; ++i) {
      std::size_t written = 0;
      const figures of = count([&] { written = write(*all->transport, side().id, text); });
      ASSERT_EQ(written, bytes);
      expect_openssls_own(of, GetParam().sealing);
      ASSERT_EQ(of.seen.system_calls, 1U); // send
      while (!side().client->has(text)) continue;
      side().client->text.clear();
    }
  }
}

TEST_P(tls_records, are_four_for_a_batch_of_sixty_kibibytes) {
  const std::string batch(60 * 1024, 'x');
  std::size_t written = 0;
  const figures of = count([&] { written = write(*all->transport, side().id, batch); });
  ASSERT_EQ(written, batch.size());
  expect_openssls_own(of, 4 * GetParam().sealing);
  EXPECT_EQ(of.seen.system_calls, 4U);
  while (!side().client->has(batch)) continue;
  side().client->text.clear();
}

TEST_P(tls_records, are_opened_by_allocations_that_are_known_and_received_by_one_call) {
  for (const std::size_t bytes : {1U, 64U, 512U, 4096U}) {
    for (int i = 0; i < 200; ++i) {
      all->sink.bytes = 0;
      ASSERT_TRUE(side().client->send(std::string(bytes, 'x')));
      for (;;) { // the kernel may take its time to bring it; turns before find nothing
        const figures of = count([] { all->turn(); });
        if (all->sink.bytes == 0) {
          ASSERT_EQ(of.seen.system_calls, 1U); // epoll_wait
          continue;
        }
        ASSERT_EQ(all->sink.bytes, bytes);
        expect_openssls_own(of, GetParam().opening);
        ASSERT_EQ(of.seen.system_calls, 2U); // epoll_wait, recv
        break;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, tls_records,
                         testing::Values(version{"tls_1_3", &world::of_1_3, 3, 1},
                                         version{"tls_1_2", &world::of_1_2, 2, 0}),
                         [](const auto& of) { return of.param.name; });

} // namespace
} // namespace rowe::net
