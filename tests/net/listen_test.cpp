// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>

#include <csignal>

#include "support.hpp"

namespace rowe::net {
namespace listen_test {
namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr bool needs_descriptors_itself = true; // preset asan: with the sanitizer of undefined behaviour
#else
constexpr bool needs_descriptors_itself = false;
#endif

error refusal_of(const listen_options& options) {
  const auto made = socket_transport::listen(options);
  EXPECT_FALSE(made);
  return made ? error{errc::full} : made.error();
}

TEST(listen, on_loopback_cannot_be_reached_by_another_address_of_this_machine) {
  auto transport = listening();
  EXPECT_TRUE(raw_socket(transport->port()).connected());
  const std::string address = address_beyond_loopback(AF_INET);
  if (address.empty()) GTEST_SKIP() << "this machine has no address beyond loopback";
  EXPECT_FALSE(raw_socket(transport->port(), address.c_str()).connected());
  EXPECT_FALSE(raw_socket(transport->port(), "127.0.0.2").connected());
}

TEST(listen, on_every_ipv6_address_takes_no_ipv4) {
  const auto made = socket_transport::listen({.address = "::", .insecure = true});
  if (!made && made.error().value == EAFNOSUPPORT) GTEST_SKIP() << "no IPv6 here";
  ASSERT_TRUE(made);
  EXPECT_FALSE(raw_socket((*made)->port()).connected());
}

TEST(listen, serves_ipv6) {
  auto made = socket_transport::listen({.address = "::1"});
  if (!made && made.error().value == EADDRNOTAVAIL) GTEST_SKIP() << "no IPv6 here";
  ASSERT_TRUE(made);
  driver drive{**made};
  raw_socket client{(*made)->port(), "::1"};
  std::string text = upgrade_request((*made)->port());
  ASSERT_TRUE(client.send(text.replace(text.find("127.0.0.1"), 9, "[::1]")));
  ASSERT_TRUE(drive.until([&] { return client.has("\r\n\r\n"); }));
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 101");
  EXPECT_EQ(drive.sink().opens.at(0).address.substr(0, 6), "[::1]:");
}

TEST(listen, beyond_loopback_needs_insecure) {
  EXPECT_EQ(refusal_of({.address = "0.0.0.0"}).code, errc::not_loopback);
  EXPECT_EQ(refusal_of({.address = "::"}).code, errc::not_loopback);
  EXPECT_EQ(refusal_of({.address = "192.0.2.1"}).code, errc::not_loopback);
}

TEST(listen, insecurely_answers_to_this_machines_names_and_addresses_only) {
  const std::string address = address_beyond_loopback(AF_INET);
  if (address.empty()) GTEST_SKIP() << "this machine has no address beyond loopback";
  auto transport = listening({.address = "0.0.0.0", .insecure = true});
  driver drive{*transport};
  char name[256] = {};
  ASSERT_EQ(::gethostname(name, sizeof name - 1), 0);
  const auto status_for = [&](const std::string& host) {
    raw_socket client{transport->port(), address.c_str()};
    std::string text = upgrade_request(transport->port());
    EXPECT_TRUE(client.send(text.replace(text.find("127.0.0.1"), 9, host)));
    EXPECT_TRUE(drive.until([&] { return client.has("\r\n\r\n"); }));
    return client.text.substr(9, 3);
  };
  EXPECT_EQ(status_for(address), "101");
  EXPECT_EQ(status_for(name), "101");
  EXPECT_EQ(status_for(std::string{name} + ".local"), "101");
  EXPECT_EQ(status_for("evil.example"), "403");
}

TEST(listen, refuses_what_is_no_numeric_address_or_not_of_this_machine) {
  EXPECT_EQ(refusal_of({.address = "localhost"}), (error{errc::bad_address, EINVAL}));
  EXPECT_EQ(refusal_of({.address = ""}), (error{errc::bad_address, EINVAL}));
  EXPECT_EQ(refusal_of({.address = "127.0.0.1:80"}), (error{errc::bad_address, EINVAL}));
  EXPECT_EQ(refusal_of({.address = "192.0.2.77", .insecure = true}),
            (error{errc::bad_address, EADDRNOTAVAIL}));
}

TEST(listen, refuses_a_port_that_is_in_use) {
  auto transport = listening();
  EXPECT_EQ(refusal_of({.port = transport->port()}), (error{errc::address_in_use, transport->port()}));
}

TEST(listen, takes_a_port_again_whose_connections_linger) {
  std::uint16_t port = 0;
  {
    auto transport = listening();
    port = transport->port();
    driver drive{*transport};
    raw_socket client = upgraded(drive, *transport);
    transport->close(drive.sink().opens[0].id, close_how::flushed); // our side ends in TIME_WAIT
    ASSERT_TRUE(drive.until([&] { return client.ended(); }));
    client.close();
    ASSERT_TRUE(drive.until([&] { return !drive.sink().closes.empty(); }));
  }
  EXPECT_TRUE(socket_transport::listen({.port = port}));
}

TEST(listen, refuses_limits_out_of_their_range_with_value_and_bound) {
  EXPECT_EQ(refusal_of({.limits = {.connections_max = 0}}), (error{errc::bad_argument, 0, 1}));
  EXPECT_EQ(refusal_of({.limits = {.connections_max = 65537}}), (error{errc::bad_argument, 65537, 65536}));
  EXPECT_EQ(refusal_of({.limits = {.handshakes_max = 1025}}), (error{errc::bad_argument, 1025, 1024}));
  EXPECT_EQ(refusal_of({.limits = {.header_bytes_max = 255}}), (error{errc::bad_argument, 255, 256}));
  EXPECT_EQ(refusal_of({.limits = {.handshake_bytes = 65535}}), (error{errc::bad_argument, 65535, 65536}));
  EXPECT_EQ(refusal_of({.limits = {.handshake_bytes = (64 << 20) + 1}}),
            (error{errc::bad_argument, (64 << 20) + 1, 64 << 20}));
  EXPECT_EQ(refusal_of({.limits = {.read_quantum_bytes = 8192, .read_alone_bytes_min = 4096}}),
            (error{errc::bad_argument, 4096, 8192}));
  EXPECT_EQ(refusal_of({.limits = {.read_alone_bytes_max = 8192}}), (error{errc::bad_argument, 8192, 16384}));
  EXPECT_EQ(refusal_of({.limits = {.write_timeout = 0s}}), (error{errc::bad_argument, 0, 1}));
}

TEST(listen, leaves_the_disposition_of_sigpipe_alone) {
  for (const auto disposition : {SIG_DFL, SIG_IGN}) {
    const auto before = std::signal(SIGPIPE, disposition);
    { auto transport = listening(); }
    EXPECT_EQ(std::signal(SIGPIPE, before), disposition);
  }
}

TEST(listen, leaves_the_limit_of_open_files_alone) {
  rlimit before{};
  rlimit after{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  auto transport = listening({.limits = {.connections_max = 60000}});
  ::getrlimit(RLIMIT_NOFILE, &after);
  EXPECT_EQ(before.rlim_cur, after.rlim_cur);
}

// This many more can be opened; `none`: none, and less than are open. Puts the limit back.
class few_descriptors {
 public:
  static constexpr rlim_t none = RLIM_INFINITY;
  explicit few_descriptors(rlim_t spare) {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const descriptor lowest{::open("/dev/null", O_RDONLY | O_CLOEXEC)};
    rlimit few = before_;
    few.rlim_cur = spare == none ? 0 : static_cast<rlim_t>(lowest.get()) + spare;
    ::setrlimit(RLIMIT_NOFILE, &few);
  }
  ~few_descriptors() { ::setrlimit(RLIMIT_NOFILE, &before_); }

 private:
  rlimit before_{};
};

struct without_descriptors : served {
  void SetUp() override {
    if (needs_descriptors_itself)
      GTEST_SKIP() << "the sanitizer of undefined behaviour opens a pipe to look at objects";
  }
};

TEST_F(without_descriptors, a_listener_pauses_and_does_not_spin) {
  drive.stop_clock();
  drive.turn();
  raw_socket waiting{transport->port()};
  {
    const few_descriptors none{few_descriptors::none};
    ASSERT_TRUE(drive.until([&] { return transport->counters().accept_pauses == 1; }));
    ASSERT_EQ(drive.sink().rejections.size(), 1U);
    EXPECT_NE(drive.sink().rejections[0].remedy.find("ulimit"), std::string::npos);
    for (int i = 0; i < 100; ++i) drive.turn();
    EXPECT_EQ(transport->counters().accept_pauses, 1U);
    // The pause bounds a wait, and nothing else ends it.
    const auto begin = rt::monotonic_clock::now();
    transport->wait(drive.now(), drive.now() + 20ms);
    EXPECT_GE(rt::monotonic_clock::now() - begin, 20ms);
    drive.skip(110ms);
    drive.turn();
    ASSERT_TRUE(drive.until([&] { return transport->counters().accept_pauses == 2; }));
  }
  drive.skip(110ms);
  ASSERT_TRUE(waiting.send(upgrade_request(transport->port())));
  EXPECT_TRUE(drive.until([&] { return waiting.has("\r\n\r\n"); }));
  EXPECT_EQ(waiting.text.substr(0, 12), "HTTP/1.1 101");
}

TEST_F(without_descriptors, for_libwebsockets_an_upgrade_is_answered_503) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == 1; }));
  {
    const few_descriptors none{0};
    ASSERT_TRUE(client.send(upgrade_request(transport->port())));
    ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  }
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 503");
  EXPECT_FALSE(client.failed);
}

TEST(listen, lets_go_of_every_descriptor) {
  const std::size_t before = open_descriptors();
  {
    auto transport = listening();
    driver drive{*transport};
    const raw_socket client = upgraded(drive, *transport);
    raw_socket silent{transport->port()};
    raw_socket answered = answered_whole(drive, *transport, "GET / HTTP/1.0\r\n\r\n");
    // A page under way, a connection being closed
    static const std::string body(8 << 20, 'x');
    drive.sink().answer = [](const service::http_request&) { return page_of(body); };
    raw_socket reader = reader_of(drive, *transport, "/");
    const raw_socket closing = upgraded(drive, *transport);
    transport->close(drive.sink().opens[1].id, close_how::flushed);
    drive.turn();
    EXPECT_GT(open_descriptors(), before + 10);
  }
  EXPECT_EQ(open_descriptors(), before);
}

TEST(listen, twice_in_one_process_keeps_the_endpoints_apart) {
  auto one = listening();
  auto other = listening();
  driver drive{*one};
  driver drive_other{*other};
  const raw_socket first = upgraded(drive, *one);
  {
    const raw_socket second = upgraded(drive_other, *other);
    one.reset(); // its libwebsockets context goes, the other one's stays
    const raw_socket third = upgraded(drive_other, *other);
    EXPECT_EQ(drive_other.sink().opens.size(), 2U);
  }
  EXPECT_TRUE(drive_other.until([&] { return drive_other.sink().closes.size() == 2; }));
}

} // namespace
} // namespace listen_test
} // namespace rowe::net
