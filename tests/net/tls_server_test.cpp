// SPDX-License-Identifier: Apache-2.0
// A port that speaks TLS, and who connects to it.
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <random>

#include "tls_support.hpp"

namespace rowe::net {
namespace tls_server_test {
namespace {

using service::counter;

struct tls_server : served_tls {
  bool shake(tls_socket& client) {
    return drive.until([&] { return client.shaken() || client.failed(); }) && !client.failed();
  }
  // Behind its upgrade; `text` is empty again.
  void upgrade(tls_socket& client, std::string_view behind = {}, std::string_view path = "/") {
    ASSERT_TRUE(shake(client)) << client.fault;
    const std::size_t before = drive.sink().opens.size();
    ASSERT_TRUE(client.send(upgrade_request(transport->port(), {}, path) + std::string{behind}));
    ASSERT_TRUE(drive.until([&] { return client.has("\r\n\r\n"); }));
    ASSERT_EQ(drive.sink().opens.size(), before + 1);
    client.text.erase(0, client.text.find("\r\n\r\n") + 4);
  }
  connection_id newest() { return drive.sink().opens.back().id; }
  bool closed() { return !drive.sink().closes.empty(); }
  bool closes_by(close_cause cause) {
    return drive.until([&] { return closed(); }) && drive.sink().closes[0].cause == cause;
  }
  std::string said() { // of the first rejection
    return drive.sink().rejections.empty() ? "" : drive.sink().rejections[0].what;
  }
  std::uint64_t count(counter which) { return count_of(*transport, which); }
  // That one handshake has failed, and none in another way.
  void expect_failed(counter which) {
    EXPECT_TRUE(drive.until([&] { return failed_handshakes(*transport) != 0; }));
    EXPECT_EQ(count(which), 1U);
    EXPECT_EQ(failed_handshakes(*transport), 1U);
  }
  // How connections ended that did not in good order.
  void expect_ends(std::uint64_t cuts, std::uint64_t key_floods, std::uint64_t alerts) {
    const auto counted = [&] {
      return std::array{count(counter::tls_cuts), count(counter::tls_key_floods), count(counter::tls_alerts)};
    };
    const std::array wanted{cuts, key_floods, alerts};
    EXPECT_TRUE(drive.until([&] { return counted() == wanted; })) << testing::PrintToString(counted());
  }
};

TEST_F(tls_server, reads_first_what_came_with_the_request) {
  tls_socket client{transport->port()};
  upgrade(client, "behind the header");
  ASSERT_TRUE(drive.until([&] { return !drive.sink().reads.empty(); }));
  ASSERT_TRUE(client.send(", and later"));
  ASSERT_TRUE(
      drive.until([&] { return drive.sink().received[newest().index] == "behind the header, and later"; }));
  EXPECT_EQ(drive.sink().opens[0].address.substr(0, 10), "127.0.0.1:");
  EXPECT_EQ(count(counter::tls_handshakes), 1U);
  EXPECT_EQ(failed_handshakes(*transport), 0U);
}

TEST_F(tls_server, gives_pages_that_are_larger_than_any_buffer) {
  listen({.handshake_bytes = std::size_t{1} << 20});
  const std::string body(600'000, 'p');
  drive.sink().answer = [&](const service::http_request&) { return page_of(body); };
  tls_socket client{transport->port(), {}, 4096};
  ASSERT_TRUE(asks(drive, client, request(transport->port(), "/"))) << client.fault;
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.ended_well);
  EXPECT_TRUE(client.text.ends_with(body)) << client.text.size();
}

TEST_F(tls_server, answers_a_request_that_is_wrong_in_words) {
  tls_socket client{transport->port()};
  ASSERT_TRUE(asks(drive, client,
                   request(transport->port(), "/", "Origin: http://127.0.0.1:1\r\nUpgrade: websocket\r\n")))
      << client.fault;
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.ended_well);
  EXPECT_TRUE(client.text.starts_with("HTTP/1.1 4")) << client.text;
}

TEST_F(tls_server, tells_who_does_not_speak_tls_what_to_open) {
  raw_socket client = answered_whole(drive, *transport, request(transport->port(), "/"));
  EXPECT_TRUE(client.text.starts_with("HTTP/1.1 400 ")) << client.text;
  EXPECT_NE(client.text.find("https://"), std::string::npos);
  ASSERT_TRUE(drive.until([&] { return !said().empty(); }));
  EXPECT_EQ(said(), "this port speaks TLS, and the client does not");
  expect_failed(counter::tls_failed_plain);
}

TEST_F(tls_server, counts_who_leaves_in_the_middle_of_a_handshake) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(client.send("\x16\x03\x01"));
  client.shut();
  expect_failed(counter::tls_failed_lost);
}

TEST_F(tls_server, counts_who_speaks_no_sense) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(client.send(std::string{"\x16\x03\x01\x00\x04\xff\x00\x00\x00", 9}));
  expect_failed(counter::tls_failed_protocol);
}

// ---- what is spoken

preparation only_protocol(std::string name) {
  name.insert(name.begin(), static_cast<char>(name.size()));
  return [name](SSL_CTX* to) {
    SSL_CTX_set_alpn_protos(to, reinterpret_cast<const unsigned char*>(name.data()),
                            static_cast<unsigned>(name.size()));
  };
}

TEST_F(tls_server, speaks_or_refuses_it) {
  struct {
    const char* name;
    bool good;
    preparation prepare;
  } const clients[] = {
      {"TLS 1.3", true, only_version(TLS1_3_VERSION)},
      {"TLS 1.2", true, only_version(TLS1_2_VERSION)},
      {"TLS 1.1", false, only_version(TLS1_1_VERSION)},
      {"ChaCha20", true, [](SSL_CTX* to) { SSL_CTX_set_ciphersuites(to, "TLS_CHACHA20_POLY1305_SHA256"); }},
      {"P-256", true, only_group("P-256")},
      {"P-384", false, only_group("P-384")},
      {"X448", false, only_group("X448")},
      {"no forward secrecy", false, only_cipher_of_tls_1_2("AES128-GCM-SHA256")},
      {"CBC", false, only_cipher_of_tls_1_2("ECDHE-ECDSA-AES128-SHA")},
      {"HTTP/1.1", true, only_protocol("http/1.1")},
      {"HTTP/2", false, only_protocol("h2")}};
  for (const auto& [name, good, prepare] : clients) {
    SCOPED_TRACE(name);
    listen({});
    tls_socket client{transport->port(), prepare};
    EXPECT_EQ(shake(client), good) << client.fault;
    if (good) {
      upgrade(client);
      continue;
    }
    ASSERT_TRUE(drive.until([&] { return !said().empty(); }));
    EXPECT_NE(said().find("the TLS handshake failed: "), std::string::npos);
    expect_failed(counter::tls_failed_protocol);
  }
}

TEST_F(tls_server, gives_nothing_to_come_back_with) {
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION}) {
    tls_socket client{transport->port(), only_version(version)};
    upgrade(client);
    client.read(); // where tickets would be
    EXPECT_EQ(SSL_SESSION_has_ticket(SSL_get_session(client.get())), 0);
    EXPECT_EQ(SSL_SESSION_get_max_early_data(SSL_get_session(client.get())), 0U);
  }
}

TEST_F(tls_server, negotiates_once_only) {
  tls_socket client{transport->port(), only_version(TLS1_2_VERSION)};
  upgrade(client);
  ASSERT_EQ(SSL_renegotiate(client.get()), 1);
  (void)SSL_do_handshake(client.get());
  ASSERT_TRUE(drive.until([&] { return client.ended() || closed(); }));
  EXPECT_EQ(SSL_num_renegotiations(client.get()), 1); // asked for; never done:
  EXPECT_TRUE(drive.sink().reads.empty());
}

// ---- new keys

TEST_F(tls_server, takes_new_keys_now_and_then) {
  tls_socket client{transport->port(), only_version(TLS1_3_VERSION)};
  upgrade(client);
  for (int i = 0; i < 40; ++i) {
    client.take_new_keys(2);
    const std::string text = std::to_string(i) + ";";
    ASSERT_TRUE(client.send(text));
    ASSERT_TRUE(drive.until([&] { return drive.sink().received[newest().index].ends_with(text); }));
    drive.skip(2s);
  }
  EXPECT_FALSE(closed());
}

TEST_F(tls_server, ends_who_asks_for_new_keys_again_and_again) {
  tls_socket client{transport->port(), only_version(TLS1_3_VERSION)};
  upgrade(client);
  client.take_new_keys(9);
  (void)client.send("never read");
  ASSERT_TRUE(closes_by(close_cause::reset));
  EXPECT_EQ(drive.sink().received[newest().index], "");
  expect_ends(0, 1, 0);
}

// ---- ends

TEST_F(tls_server, tells_an_end_from_a_cut) {
  tls_socket one{transport->port()};
  upgrade(one);
  ASSERT_TRUE(one.send("last words"));
  one.say_end();
  ASSERT_TRUE(closes_by(close_cause::peer));
  EXPECT_EQ(drive.sink().received[newest().index], "last words");
  ASSERT_TRUE(drive.until([&] { return one.ended(); })); // our direction, too
  one.raw.close();

  tls_socket other{transport->port()};
  upgrade(other);
  other.raw.shut(); // somebody on the way, without a word of TLS
  ASSERT_TRUE(drive.until([&] { return drive.sink().closes.size() == 2; }));
  EXPECT_EQ(drive.sink().closes[1].cause, close_cause::reset);
  expect_ends(1, 0, 0);
  tls_socket gone{transport->port()};
  upgrade(gone);
  gone.raw.reset();
  expect_ends(2, 0, 0);
  tls_socket silent{transport->port()}; // before its request
  ASSERT_TRUE(shake(silent));
  silent.raw.shut();
  expect_ends(3, 0, 0);
  EXPECT_EQ(count(counter::tls_handshakes), 4U);
}

TEST_F(tls_server, tells_an_end_that_comes_with_the_last_words) {
  tls_socket one{transport->port()};
  upgrade(one);
  one.in_one_segment([&] {
    ASSERT_TRUE(one.send("last words"));
    one.say_end();
  });
  ASSERT_TRUE(closes_by(close_cause::peer));
  EXPECT_EQ(drive.sink().received[newest().index], "last words");

  tls_socket other{transport->port()};
  upgrade(other);
  other.in_one_segment([&] {
    ASSERT_TRUE(other.send("last words"));
    (void)::send(other.raw.fd(), "no record", 9, MSG_NOSIGNAL);
  });
  ASSERT_TRUE(drive.until([&] { return drive.sink().closes.size() == 2; }));
  EXPECT_EQ(drive.sink().closes[1].cause, close_cause::reset);
  expect_ends(0, 0, 1);
}

TEST_F(tls_server, leaves_after_a_second_who_does_not_close) {
  drive.stop_clock();
  tls_socket client{transport->port()};
  upgrade(client);
  transport->close(newest(), close_how::flushed);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  drive.turn();
  EXPECT_FALSE(closed());
  drive.skip(service::close_time_max + 1ms);
  ASSERT_TRUE(closes_by(close_cause::asked));
}

TEST_F(tls_server, sends_all_that_it_has_taken_before_it_closes_in_good_order) {
  tls_socket client{transport->port(), {}, 4096};
  upgrade(client);
  const std::string piece(100'000, 'x');
  std::size_t taken = 0;
  for (std::size_t now = piece.size(); now == piece.size();)
    taken += now = write(*transport, newest(), piece);
  transport->close(newest(), close_how::flushed);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.ended_well);
  EXPECT_EQ(client.text.size(), taken);
  EXPECT_FALSE(closed()); // the peer's end is awaited
  client.raw.close();
  ASSERT_TRUE(closes_by(close_cause::asked));
}

TEST_F(tls_server, cuts_who_reads_nothing) {
  drive.stop_clock();
  tls_socket client{transport->port(), {}, 4096};
  upgrade(client);
  const std::string piece(100'000, 'x');
  while (write(*transport, newest(), piece) == piece.size()) {
  }
  drive.skip(2s);
  ASSERT_TRUE(closes_by(close_cause::timed_out));
}

// ---- bounds

TEST_F(tls_server, refuses_what_has_no_room_and_loses_nothing) {
  tls_socket client{transport->port()};
  upgrade(client);
  write_beyond_its_room(drive, *transport, newest(), client, 70'000, 10'000'000);
}

TEST_F(tls_server, reads_a_quantum_in_a_turn_while_others_send) {
  std::array<std::unique_ptr<tls_socket>, 2> clients;
  for (auto& one : clients) {
    one = std::make_unique<tls_socket>(transport->port());
    upgrade(*one);
    SSL_set_mode(one->get(), SSL_MODE_ENABLE_PARTIAL_WRITE);
  }
  const std::string record(16384, 'r');
  std::size_t all = 0;
  for (auto& one : clients) {
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(one->send(record));
      all += record.size();
    }
  }
  std::size_t got = 0;
  std::map<std::uint32_t, std::size_t> in_turn;
  drive.sink().when_bytes = [&](connection_id from, std::span<std::byte> bytes) {
    in_turn[from.index] += bytes.size();
    got += bytes.size();
  };
  ASSERT_TRUE(drive.until([&] {
    const bool together = in_turn.size() == 2;
    for (const auto& [index, bytes] : in_turn) {
      // The last of them may be alone with what is left.
      if (together) {
        EXPECT_LE(bytes, service::transport_sink::read_bytes_in_turn) << index;
      }
    }
    in_turn.clear();
    return got == all;
  }));
}

// Bytes that are opened already are no event of the kernel's, but must be read all the same.
TEST_F(tls_server, reads_on_what_the_core_did_not_want_at_once) {
  tls_socket client{transport->port()};
  upgrade(client);
  ASSERT_TRUE(client.send(std::string(16000, 'r')));
  transport->read_enabled(newest(), false);
  for (int i = 0; i < 20; ++i) drive.turn();
  EXPECT_TRUE(drive.sink().reads.empty());
  transport->read_enabled(newest(), true);
  ASSERT_TRUE(drive.until([&] { return drive.sink().received[newest().index].size() == 16000; }));
}

TEST_F(tls_server, does_not_open_a_flood_of_empty_records_at_once) {
  tls_socket one{transport->port()}, other{transport->port()};
  upgrade(one);
  upgrade(other);
  for (int i = 0; i < 4000; ++i) ASSERT_TRUE(one.send("1"));
  for (int i = 0; i < 4000; ++i) ASSERT_TRUE(other.send("2"));
  ASSERT_TRUE(drive.until([&] {
    return drive.sink().received[drive.sink().opens[0].id.index].size() == 4000 &&
           drive.sink().received[drive.sink().opens[1].id.index].size() == 4000;
  }));
  // 23 bytes each; no more of them than a quantum holds.
  const std::size_t most = service::transport_sink::read_bytes_in_turn / 23 + 1;
  const auto shared = std::count_if(drive.sink().reads.begin(), drive.sink().reads.end(),
                                    [&](std::size_t bytes) { return bytes <= most; });
  EXPECT_GE(shared, 2);
}

// Also alone, where the transport lets a connection read much more, once it has shown that this is quick.
TEST_F(tls_server, opens_so_many_records_at_once_for_one_that_is_alone) {
  tls_socket client{transport->port()};
  upgrade(client);
  const std::string large(16'384, 'r');
  for (int i = 0; i < 40; ++i) {
    ASSERT_TRUE(drive.until([&] { return client.send(large); }));
  }
  ASSERT_TRUE(drive.until([&] { return drive.sink().received[newest().index].size() == 40 * large.size(); }));
  drive.sink().reads.clear();
  constexpr std::size_t count = 5000;
  for (std::size_t i = 0; i < count; ++i) ASSERT_TRUE(drive.until([&] { return client.send("1"); }));
  ASSERT_TRUE(
      drive.until([&] { return drive.sink().received[newest().index].size() == 40 * large.size() + count; }));
  for (const std::size_t bytes : drive.sink().reads) EXPECT_LE(bytes, tls::session::records_at_once);
}

// ---- handshakes that do not end

struct tls_handshakes : served_tls {};

// Each of those who come begins a handshake and leaves it. One from elsewhere who is slow is not displaced.
TEST_F(tls_handshakes, that_are_begun_without_end_displace_each_other_and_not_who_is_slow) {
  listen({.handshakes_max = 8});
  tls_socket slow{transport->port()};
  (void)slow.shaken(); // says hello
  std::vector<raw_socket> mute;
  const auto flood = [&] {
    for (int i = 0; i < 20; ++i) {
      mute.emplace_back(transport->port(), "127.0.0.1", 0, "127.0.0.2");
      ASSERT_TRUE(mute.back().send("\x16\x03\x01"));
      const std::size_t beyond = mute.size() > 7 ? mute.size() - 7 : 0; // one place is that of the slow one
      ASSERT_TRUE(drive.until([&] { return transport->memory().evictions >= beyond; }));
    }
  };
  flood();
  (void)slow.shaken(); // answers the server's hello
  flood();
  ASSERT_TRUE(drive.until([&] { return slow.shaken() || slow.failed(); }));
  ASSERT_FALSE(slow.failed()) << slow.fault;
  flood();
  ASSERT_TRUE(slow.send(upgrade_request(transport->port(), {}, service::stop_path)));
  ASSERT_TRUE(drive.until([&] { return slow.has("101 Switching"); }));
}

TEST_F(tls_handshakes, that_do_not_end_keep_nobody_out) {
  listen({.handshakes_max = 8});
  std::vector<raw_socket> mute;
  for (int i = 0; i < 40; ++i) {
    mute.emplace_back(transport->port());
    if (i % 2 != 0) continue;
    ASSERT_TRUE(mute.back().send("\x16\x03\x01")); // the beginning of a hello
  }
  tls_socket client{transport->port()};
  ASSERT_TRUE(asks(drive, client, upgrade_request(transport->port(), {}, service::stop_path)))
      << client.fault;
  ASSERT_TRUE(drive.until([&] { return client.has("101 Switching"); }));
  EXPECT_GE(transport->memory().evictions, 40U - 8U);
  EXPECT_TRUE(drive.until(
      [&] { return count_of(*transport, counter::tls_failed_evicted) == transport->memory().evictions; }));
  EXPECT_EQ(failed_handshakes(*transport), count_of(*transport, counter::tls_failed_evicted));
}

TEST_F(tls_handshakes, end_in_time_or_are_cut) {
  listen({.header_timeout = 200ms});
  raw_socket mute{transport->port()}, begun{transport->port()};
  ASSERT_TRUE(begun.send("\x16\x03\x01"));
  tls_socket half{transport->port()};
  ASSERT_TRUE(asks(drive, half, "GET / HTTP/1.1\r\nHost")) << half.fault;
  ASSERT_TRUE(drive.until([&] { return mute.ended() && begun.ended() && half.ended(); }));
  EXPECT_EQ(count_of(*transport, counter::tls_failed_silent), 1U);
  EXPECT_EQ(count_of(*transport, counter::tls_failed_timeout), 1U);
  EXPECT_TRUE(half.ended_well);
  EXPECT_TRUE(half.text.starts_with("HTTP/1.1 408 ")) << half.text;
}

TEST_F(tls_handshakes, leave_no_descriptor_behind) {
  transport.reset();
  const std::size_t before = open_descriptors();
  {
    listen({});
    tls_socket open{transport->port()}, shaken{transport->port()}, asked{transport->port()};
    raw_socket mute{transport->port()};
    ASSERT_TRUE(drive.until([&] { return open.shaken() && shaken.shaken() && asked.shaken(); }));
    ASSERT_TRUE(open.send(upgrade_request(transport->port())) && asked.send(request(transport->port(), "/")));
    ASSERT_TRUE(drive.until([&] { return open.has("101 ") && asked.ended(); }));
  }
  transport.reset();
  EXPECT_EQ(open_descriptors(), before);
}

// Whatever clients do, and in whatever order: each was counted once.
TEST_F(tls_handshakes, are_each_counted_once) {
  std::signal(SIGPIPE, SIG_IGN); // of OpenSSL's own socket BIO
  const std::uint64_t seed = std::random_device{}();
  SCOPED_TRACE(testing::Message{} << "seed " << seed);
  std::mt19937_64 random{seed};
  listen({.handshakes_max = 6, .header_timeout = 50ms, .close_timeout = 50ms});
  const auto counted = [&] {
    return count_of(*transport, counter::tls_handshakes) + failed_handshakes(*transport);
  };
  std::vector<std::unique_ptr<tls_socket>> clients;
  constexpr std::uint64_t count = 300;
  for (std::uint64_t i = 0; i < count; ++i) {
    clients.push_back(std::make_unique<tls_socket>(transport->port()));
    tls_socket& newest = *clients.back();
    ASSERT_TRUE(newest.raw.connected());
    switch (random() % 4) {
    case 0: (void)newest.raw.send("GET / HTTP/1.1\r\n\r\n"); break;
    case 1: (void)newest.raw.send("\x16\x03\x01\x02"); break;
    default: break; // it shakes, or says nothing
    }
    for (auto& one : clients)
      if (random() % 8 == 0 && one->raw.fd() >= 0) (void)one->shaken();
    tls_socket& any = *clients[random() % clients.size()];
    if (random() % 4 == 0) any.raw.reset();
    if (random() % 2 == 0) drive.turn();
  }
  ASSERT_TRUE(drive.until([&] { return counted() == count; })) << counted();
  clients.clear();
  for (int i = 0; i < 100; ++i) drive.turn();
  EXPECT_EQ(counted(), count);
}

// ---- files

TEST_F(tls_server, takes_a_new_certificate_without_a_restart) {
  const auto shown = [&] {
    tls_socket client{transport->port()};
    EXPECT_TRUE(shake(client)) << client.fault;
    X509* const one = SSL_get0_peer_certificate(client.get());
    char name[64] = {};
    X509_NAME_get_text_by_NID(X509_get_subject_name(one), NID_commonName, name, sizeof name);
    return std::string{name};
  };
  const auto ends_in = [&](long days) { // the certificate, by what is counted
    return drive.until([&] {
      const auto end = static_cast<long>(count(counter::tls_certificate_end));
      return std::abs(end - static_cast<long>(std::time(nullptr)) - days * day) <= day;
    });
  };
  tls_socket before{transport->port()};
  upgrade(before);
  EXPECT_EQ(shown(), "robot");
  EXPECT_TRUE(ends_in(397));

  test::write_private(files.files / "certificate.pem", "no certificate");
  const auto& warnings = drive.sink().warnings;
  ASSERT_TRUE(drive.until([&] { return !warnings.empty() && count(counter::tls_reload_faults) == 1; }));
  EXPECT_NE(warnings[0].find("it holds no certificate in PEM"), std::string::npos) << warnings[0];
  EXPECT_EQ(said(), ""); // nobody was refused
  EXPECT_EQ(shown(), "robot");
  EXPECT_EQ(count(counter::tls_reloads), 0U);

  test::write_files(files.files.path(), files.root,
                    test::make_leaf(files.root, {.valid_to_s = 40 * day, .common_name = "new"}));
  ASSERT_TRUE(drive.until([&] { return shown() == "new"; }));
  EXPECT_TRUE(drive.until([&] { return count(counter::tls_reloads) != 0; }));
  EXPECT_TRUE(ends_in(40));
  ASSERT_TRUE(before.send("goes on"));
  ASSERT_TRUE(
      drive.until([&] { return drive.sink().received[drive.sink().opens[0].id.index] == "goes on"; }));
}

TEST(tls_files, that_are_wrong_are_named) {
  const certified files;
  const auto wrong = [&](tls_options options) {
    EXPECT_EQ(socket_transport::listen({.tls = options}).code(), errc::bad_certificate);
    return check_tls(options);
  };
  tls_options options = files.server();
  EXPECT_EQ(check_tls(options), "");
  options.certificate = files.files / "nowhere.pem";
  EXPECT_EQ(wrong(options), options.certificate + ": No such file or directory");
  options = files.server();
  options.key = "";
  EXPECT_EQ(wrong(options), options.certificate + ": a certificate needs its key: set `key`");
  options.key = files.files / "ca.pem";
  EXPECT_EQ(wrong(options), options.key + ": it holds no unencrypted private key in PEM");
  test::write_private(files.files / "other.pem", test::make_root().key);
  options.key = files.files / "other.pem";
  EXPECT_EQ(wrong(options), options.key + ": it is not the key of " + options.certificate);
  options = files.server();
  ASSERT_EQ(::chmod(options.key.c_str(), 0640), 0);
  EXPECT_EQ(wrong(options), options.key + ": others can read it (mode 0640): chmod 600");
  ::setenv("CREDENTIALS_DIRECTORY", files.files.path().c_str(), 1);
  EXPECT_EQ(check_tls(options), "");
  ::unsetenv("CREDENTIALS_DIRECTORY");
  EXPECT_EQ(check_tls({.key = "x.pem"}), "x.pem: a key without its certificate: set `certificate`");
  EXPECT_EQ(check_tls({.pin = "12"}), "pin \"12\": it must be 64 hexadecimal digits");
}

TEST(tls_files, that_end_soon_are_told_of) {
  certified files;
  test::write_files(files.files.path(), files.root,
                    test::make_leaf(files.root, {.valid_to_s = 5 * day + day / 2}));
  const auto transport = listening({.tls = files.server()});
  driver drive{*transport};
  ASSERT_TRUE(drive.until([&] { return !drive.sink().warnings.empty(); }));
  EXPECT_EQ(drive.sink().warnings[0], "the certificate ends in 5 days");
}

} // namespace
} // namespace tls_server_test
} // namespace rowe::net
