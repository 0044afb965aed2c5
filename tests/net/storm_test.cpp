// SPDX-License-Identifier: Apache-2.0
// Many peers that do what peers do, in an order that a seed decides: arrive, ask for pages and upgrades whole
// or in pieces, send, read or do not, shut one end, vanish with a reset; and a core that writes, closes and
// holds back reading, while time jumps. Whatever the order, every connection is reported open once and closed
// once, nobody is reported under an id that is not open, and every descriptor comes back.
#include <random>

#include "rt/asked.hpp"
#include "support.hpp"

namespace rowe::net {
namespace storm_test {
namespace {

class storm_sink final : public service::transport_sink {
 public:
  service::admit_answer admit(const service::credentials&) const noexcept override { return {}; }
  void on_open(connection_id id, const service::peer_info&) noexcept override {
    EXPECT_TRUE(open_.emplace(key_of(id), id).second) << "opened twice";
    ++opened;
  }
  void on_bytes(connection_id id, std::span<std::byte> bytes) noexcept override {
    EXPECT_TRUE(is_open(id));
    EXPECT_FALSE(bytes.empty());
    if (when_bytes) when_bytes(id);
  }
  void on_writable(connection_id id) noexcept override { EXPECT_TRUE(is_open(id)); }
  void on_close(connection_id id, close_cause) noexcept override {
    EXPECT_EQ(open_.erase(key_of(id)), 1U) << "closed without being open";
  }
  void on_rejected(const service::rejection& why) noexcept override {
    EXPECT_FALSE(why.what.empty());
    ++refused;
  }
  service::http_answer on_http(const service::http_request&) noexcept override {
    static const std::string body(300'000, 'b');
    ++pages;
    return page_of(body);
  }

  bool is_open(connection_id id) const { return open_.contains(key_of(id)); }
  connection_id any(std::mt19937_64& random) const {
    if (open_.empty()) return {};
    auto one = open_.begin();
    std::advance(one, static_cast<std::ptrdiff_t>(random() % open_.size()));
    return one->second;
  }
  std::size_t open_count() const { return open_.size(); }

  int opened = 0;
  int refused = 0;
  int pages = 0;
  std::function<void(connection_id)> when_bytes;

 private:
  static std::uint64_t key_of(connection_id id) { return std::uint64_t{id.index} << 32 | id.generation; }
  std::map<std::uint64_t, connection_id> open_;
};

class storm : public testing::TestWithParam<std::uint64_t> {};

TEST_P(storm, leaves_everything_in_order) {
  const std::uint64_t seed = tests::asked_of("ROWE_STORM_SEED", GetParam());
  RecordProperty("seed", std::to_string(seed));
  SCOPED_TRACE("ROWE_STORM_SEED=" + std::to_string(seed));
  std::mt19937_64 random{seed};
  const auto one_of = [&](std::uint64_t count) { return random() % count; };

  auto transport =
      listening({.limits = {.connections_max = 12, .handshakes_max = 6, .handshake_bytes = 1 << 20}});
  const std::size_t before = open_descriptors();
  storm_sink sink;
  rt::duration skipped{};
  const auto now = [&] { return rt::monotonic_clock::now() + skipped; };
  sink.when_bytes = [&](connection_id id) {
    switch (one_of(20)) {
    case 0: return transport->close(id, close_how::flushed);
    case 1: return transport->close(sink.any(random), close_how::aborted);
    default: (void)write(*transport, id, "echo"); // taken or not
    }
  };

  struct peer {
    raw_socket socket;
    std::string rest; // of a request that goes out in pieces
  };
  std::vector<peer> peers;
  const auto act_as_peer = [&] {
    if (peers.size() < 4 || (peers.size() < 30 && one_of(3) == 0)) {
      peer next{raw_socket{transport->port(), "127.0.0.1", one_of(4) ? 0 : 4096}, {}};
      switch (one_of(6)) {
      case 0: next.rest = request(transport->port(), "/"); break;
      case 1: next.rest = "GET / HTTP/1.0\r\n\r\n"; break;
      case 2: break; // silent
      default: next.rest = upgrade_request(transport->port()) + "behind";
      }
      peers.push_back(std::move(next));
      return;
    }
    const std::size_t which = one_of(peers.size());
    peer& one = peers[which];
    switch (one_of(9)) {
    case 0: one.socket.shut(); break;
    case 1:
      one.socket.reset();
      peers.erase(peers.begin() + static_cast<std::ptrdiff_t>(which));
      break;
    case 2: peers.erase(peers.begin() + static_cast<std::ptrdiff_t>(which)); break;
    case 3: (void)one.socket.read(); break;
    default: {
      const std::size_t bytes =
          one_of(2) ? one.rest.size() : std::min<std::size_t>(one.rest.size(), one_of(40));
      (void)one.socket.send(one.rest.empty() ? "frame"
                                             : one.rest.substr(0, bytes)); // the other end may be gone
      one.rest.erase(0, bytes);
    }
    }
  };
  const auto act_as_core = [&] {
    const connection_id id = sink.any(random);
    switch (one_of(8)) {
    case 0: return transport->close(id, one_of(2) ? close_how::flushed : close_how::aborted);
    case 1: return transport->read_enabled(id, one_of(2) == 0);
    case 2: (void)write(*transport, id, std::string(300'000, 'w')); return; // taken or not
    case 3: skipped += std::chrono::milliseconds{one_of(700)}; return;
    default:
      (void)write(*transport, {id.index, id.generation + static_cast<std::uint32_t>(one_of(2))}, "x");
      return;
    }
  };

  for (int step = 0; step < 3000; ++step) {
    act_as_peer();
    if (one_of(3) == 0) act_as_core();
    if (one_of(5) == 0) transport->wait(now(), now() + 100us);
    transport->poll(now(), sink);
    ASSERT_LE(sink.open_count(), 12U);
  }
  EXPECT_GT(sink.opened, 0);
  EXPECT_GT(sink.pages, 0);
  EXPECT_GT(sink.refused, 0);

  sink.when_bytes = nullptr;
  peers.clear();
  const auto watchdog = rt::monotonic_clock::now() + 20s;
  while ((sink.open_count() || open_descriptors() != before) && rt::monotonic_clock::now() < watchdog) {
    while (sink.open_count()) {
      transport->close(sink.any(random), close_how::aborted);
      transport->poll(now(), sink);
    }
    skipped += 1s;
    transport->poll(now(), sink);
  }
  EXPECT_EQ(sink.open_count(), 0U);
  EXPECT_EQ(open_descriptors(), before);
}

INSTANTIATE_TEST_SUITE_P(seeds, storm, testing::Range(std::uint64_t{1}, std::uint64_t{9}));

} // namespace
} // namespace storm_test
} // namespace rowe::net
