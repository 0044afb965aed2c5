// SPDX-License-Identifier: Apache-2.0
// Whose TLS handshake comes first where several wait, step by step, without a thread.
#include "net/tls/relays.hpp"

#include "tls_support.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <vector>

namespace rowe::net::tls {
namespace tls_order_test {
namespace {

struct nobody final : relay_outlet {
  bool report(const arrival& news) noexcept override {
    if (news.what == arrival::kind::newcomer) ::close(news.socket);
    return true;
  }
  void note_eviction() noexcept override {}
  void count(service::counter) noexcept override {}
  void take_requests() noexcept override {}
};

// A client that has said its hello. Its socket is local, so it comes from wherever the test says.
struct stranger {
  explicit stranger(const std::string& address) : from{numeric_address(address, 1).value()} {
    std::tie(socket, theirs) = local_pair();
    context.reset(SSL_CTX_new(TLS_client_method()));
    ssl.reset(SSL_new(context.get()));
    SSL_set_fd(ssl.get(), socket.get());
    SSL_set_connect_state(ssl.get());
    EXPECT_NE(SSL_do_handshake(ssl.get()), 1);
  }
  bool answered() const {
    char first = 0;
    return ::recv(socket.get(), &first, 1, MSG_PEEK) == 1;
  }
  bool ended() const {
    char first = 0;
    return ::recv(socket.get(), &first, 1, MSG_PEEK) <= 0 && errno != EAGAIN;
  }
  bool shaken() const { return SSL_do_handshake(ssl.get()) == 1; }

  socket_address from;
  descriptor socket, theirs;
  context_ptr context;
  ssl_ptr ssl;
};

struct tls_order : testing::Test {
  void come(stranger& one) { places.accept({.socket = std::move(one.theirs), .peer = one.from}); }
  void turn(rt::duration later = {}) {
    now += later;
    places.begin_turn(now);
    for (const socket_event& event : polled.take()) places.on_event(event);
  }

  certified files;
  nobody outlet;
  rt::time_point now{1000s};
  poll_set polled = poll_set::open().value();
  certificates with{end::server, files.server(), context::open(end::server, files.server(), nullptr)};
  reserved_descriptors kept;
  relays places{socket_limits{}, {}, with, polled, kept, outlet};
};

TEST_F(tls_order, puts_a_newcomer_before_those_of_a_source_that_has_begun_many) {
  places.begin_turn(now);
  std::vector<stranger> crowd;
  for (int i = 0; i < 8; ++i) crowd.emplace_back("10.0.0.7");
  stranger newcomer{"10.0.0.8"};
  for (stranger& one : crowd) come(one);
  come(newcomer);
  turn();
  ASSERT_TRUE(places.shake_next()); // the first of either source has begun none before
  EXPECT_TRUE(crowd[0].answered());
  ASSERT_TRUE(places.shake_next());
  EXPECT_TRUE(newcomer.answered());
  for (std::size_t i = 1; i < crowd.size(); ++i) {
    EXPECT_FALSE(crowd[i].answered()) << i;
    ASSERT_TRUE(places.shake_next());
    EXPECT_TRUE(crowd[i].answered()) << i << ": of one source the oldest comes first";
  }
  EXPECT_FALSE(places.shake_next());
}

TEST_F(tls_order, puts_each_step_of_it_first) {
  places.begin_turn(now);
  stranger first{"10.0.0.7"};
  stranger newcomer{"10.0.0.8"};
  come(first);
  come(newcomer);
  turn();
  ASSERT_TRUE(places.shake_next());
  ASSERT_TRUE(places.shake_next());
  std::vector<stranger> crowd;
  for (int i = 0; i < 8; ++i) come(crowd.emplace_back("10.0.0.7"));
  ASSERT_TRUE(newcomer.shaken()); // it says the last word
  turn();
  ASSERT_TRUE(places.shake_next());
  for (const stranger& one : crowd) EXPECT_FALSE(one.answered());
}

TEST_F(tls_order, forgives_what_a_source_has_begun) {
  places.begin_turn(now);
  std::vector<stranger> crowd;
  for (int i = 0; i < 3; ++i) come(crowd.emplace_back("10.0.0.7"));
  turn();
  while (places.shake_next()) continue;
  turn(6s); // one each 2 s
  stranger again{"10.0.0.7"};
  stranger other{"10.0.0.8"};
  come(again);
  come(other);
  turn();
  ASSERT_TRUE(places.shake_next());
  EXPECT_TRUE(again.answered());
  EXPECT_FALSE(other.answered());
}

// Without a word, and without an end.
struct flood {
  tls_order& at;
  int sources;
  std::vector<descriptor> held{};
  int begun = 0;

  void go_on(int count) {
    for (; count > 0; --count, ++begun) {
      auto [theirs, ours] = local_pair();
      held.push_back(std::move(theirs));
      if (held.size() > 64) held.erase(held.begin()); // they come again
      const std::string address = "10.0.9." + std::to_string(begun % sources);
      at.places.accept({.socket = std::move(ours), .peer = numeric_address(address, 1).value()});
      at.turn(rt::duration{500us});
    }
  }
};

TEST_F(tls_order, keeps_the_first_handshakes_of_a_source_beside_a_flood_of_200_sources) {
  flood others{*this, 200};
  others.go_on(400);
  std::vector<stranger> newcomers;
  for (int i = 1; i <= 20; ++i) come(newcomers.emplace_back("10.0.0." + std::to_string(i)));
  others.go_on(1000); // half a second
  turn();
  while (places.shake_next()) continue;
  others.go_on(1000);
  // One of a thousand is taken for one of the 200 (source_tally.hpp).
  const auto in =
      std::count_if(newcomers.begin(), newcomers.end(), [](const stranger& one) { return one.shaken(); });
  EXPECT_GE(in, 18);
}

TEST_F(tls_order, evicts_the_oldest_of_sources_that_are_alike) {
  places.begin_turn(now);
  std::vector<stranger> first;
  for (int i = 0; i < 32; ++i) come(first.emplace_back("10.0.0." + std::to_string(i)));
  stranger newcomer{"10.0.1.1"};
  come(newcomer);
  EXPECT_TRUE(first[0].ended());
  EXPECT_FALSE(first[1].ended());
  EXPECT_FALSE(newcomer.ended());
}

} // namespace
} // namespace tls_order_test
} // namespace rowe::net::tls
