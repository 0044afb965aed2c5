// SPDX-License-Identifier: Apache-2.0
// An echo below the JSON: sockets, handshake and frames as rowe has them, and nothing of the core. Every text
// and binary message goes back as it came, of up to 16 MiB; pings are answered; the close handshake is the
// core's. Conformance suites, our own and third parties', run against it in both roles (README.md).
//
//   transport_echo [--port N | --listen ADDR:PORT] [--subprotocol NAME]...   a server until SIGTERM; one line
//                                                                            with its port goes to stdout
//   transport_echo --connect ws://HOST:PORT[/PATH] [--subprotocol NAME]...   a client, for one connection
//
// With --certificate and --key the server speaks TLS; a client of wss:// trusts --ca.
//
// One thread. What a peer does not read yet is kept, and the peer is not read meanwhile; so the memory of a
// connection is bounded by one message and the answers to one read.
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <sys/random.h>
#include <vector>

#include "net/transport/socket_transport.hpp"
#include "service/base/transport.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "wire/websocket/websocket.hpp"

namespace {

using namespace rowe;

constexpr std::size_t message_bytes_max = std::size_t{16} << 20;
// A message in as many frames as it has bytes is what some suites ask for.
constexpr std::uint32_t fragments_max = message_bytes_max + 1;
// Suites stall on purpose, and run on loaded machines.
constexpr rt::duration write_timeout = std::chrono::seconds{30};
constexpr std::size_t kept_bytes_max = 65536; // of a connection's buffer, once it is written

class echo final : public service::transport_sink {
 public:
  echo(service::transport& sockets, std::uint32_t connections_max)
      : transport_{sockets}, peers_(connections_max) {}

  bool met_anyone() const noexcept { return met_anyone_; }
  bool has_peers() const noexcept { return count_ > 0; }

  service::admit_answer admit(const service::credentials&) const noexcept override { return {}; }
  void on_open(service::connection_id id, const service::peer_info& info) noexcept override {
    peer& p = peers_[id.index];
    p = peer{};
    p.id = id;
    p.ours = info.ours == service::side::server ? wire::role::server : wire::role::client;
    // Not written beforehand: pages that no message needs are never there.
    p.assembly = std::make_unique_for_overwrite<std::byte[]>(message_bytes_max + service::tailroom_bytes);
    p.parser.reset(p.ours, {.message_bytes_max = message_bytes_max, .fragments_max = fragments_max},
                   {p.assembly.get(), message_bytes_max});
    met_anyone_ = true;
    ++count_;
  }

  void on_bytes(service::connection_id id, std::span<std::byte> bytes) noexcept override {
    peer& p = peers_[id.index];
    while (!p.leaving && !bytes.empty()) {
      const wire::frame_step step = p.parser.next(bytes);
      bytes = bytes.subspan(step.consumed);
      if (step.event != wire::frame_event::need_more) take(p, step);
    }
    flush(p);
  }

  void on_writable(service::connection_id id) noexcept override { flush(peers_[id.index]); }

  void on_close(service::connection_id id, service::close_cause) noexcept override {
    peers_[id.index] = peer{};
    --count_;
  }

  void on_rejected(const service::rejection& reason) noexcept override {
    std::fprintf(stderr, "transport_echo: %.*s (%.*s)\n", static_cast<int>(reason.what.size()),
                 reason.what.data(), static_cast<int>(reason.remedy.size()), reason.remedy.data());
    refused_ = true;
  }
  bool refused() const noexcept { return refused_; }

  service::http_answer on_http(const service::http_request&) noexcept override { return {}; } // 404

 private:
  struct peer {
    service::connection_id id;
    wire::role ours = wire::role::server;
    wire::frame_parser parser;
    std::unique_ptr<std::byte[]> assembly;
    std::vector<std::byte> out; // frames, of which `written` bytes are
    std::size_t written = 0;
    bool leaving = false; // a Close frame is the last thing in `out`
  };

  void take(peer& p, const wire::frame_step& step) {
    switch (step.event) {
    case wire::frame_event::text: return send(p, wire::opcode::text, step.payload);
    case wire::frame_event::binary: return send(p, wire::opcode::binary, step.payload);
    case wire::frame_event::ping: return send(p, wire::opcode::pong, step.payload);
    case wire::frame_event::close: {
      const bool none = step.close_code == wire::close_code::none_given;
      return leave(p, none ? wire::close_code::normal : step.close_code, {});
    }
    case wire::frame_event::violation: return leave(p, step.close_code, step.reason);
    case wire::frame_event::pong:
    case wire::frame_event::piece: // no message is long here
    case wire::frame_event::need_more: return;
    }
  }

  void leave(peer& p, std::uint16_t code, std::string_view reason) {
    std::array<std::byte, wire::control_bytes_max> body;
    send(p, wire::opcode::close, std::span{body}.first(wire::close_payload(code, reason, body)));
    p.leaving = true;
  }

  static void send(peer& p, wire::opcode what, std::span<const std::byte> payload) {
    std::optional<wire::mask_key> key;
    if (p.ours == wire::role::client) {
      key.emplace();
      if (::getrandom(key->data(), key->size(), 0) != static_cast<ssize_t>(key->size())) std::abort();
    }
    const std::size_t header = wire::frame_header_bytes(payload.size(), p.ours);
    const std::size_t begin = p.out.size();
    p.out.resize(begin + header + payload.size());
    wire::write_frame_header(p.out.data() + begin, what, payload.size(), key);
    wire::mask_copy(std::span{p.out}.subspan(begin + header), payload, key.value_or(wire::mask_key{}));
  }

  void flush(peer& p) {
    if (p.written < p.out.size()) {
      const std::span<const std::byte> rest{p.out.data() + p.written, p.out.size() - p.written};
      p.written += transport_.write(p.id, rest);
    }
    const bool all = p.written == p.out.size();
    if (all) {
      p.out.clear();
      p.written = 0;
      if (p.out.capacity() > kept_bytes_max) p.out.shrink_to_fit();
      if (p.leaving) return transport_.close(p.id, service::close_how::flushed);
    }
    transport_.read_enabled(p.id, all);
  }

  service::transport& transport_;
  std::vector<peer> peers_;
  std::size_t count_ = 0;
  bool met_anyone_ = false;
  bool refused_ = false;
};

struct place {
  std::string host;
  std::uint16_t port = 0;
  std::string path;
};

// HOST:PORT[/PATH], IPv6 in brackets.
std::optional<place> read_place(std::string_view text) {
  place to;
  const std::size_t host_end = text.starts_with('[') ? text.find(']') + 1 : text.find(':');
  if (host_end == 0 || host_end >= text.size() || text[host_end] != ':') return std::nullopt;
  to.host = text.substr(0, host_end);
  if (to.host.starts_with('[')) to.host = to.host.substr(1, to.host.size() - 2);
  const std::string_view behind = text.substr(host_end + 1);
  const auto read = std::from_chars(behind.data(), behind.data() + behind.size(), to.port);
  if (read.ec != std::errc{}) return std::nullopt;
  to.path = behind.substr(static_cast<std::size_t>(read.ptr - behind.data()));
  if (to.path.empty()) to.path = "/";
  return to;
}

struct arguments {
  std::optional<place> listen;
  std::optional<place> connect;
  bool secure = false;
  tls_options tls;
  std::vector<std::string_view> subprotocols;
};

std::optional<arguments> read(std::span<char*> given) {
  arguments to;
  if (given.size() % 2 != 0) return std::nullopt;
  for (std::size_t i = 0; i < given.size(); i += 2) {
    const std::string_view name = given[i];
    const std::string_view value = given[i + 1];
    constexpr std::string_view scheme = "ws://", secure_scheme = "wss://";
    if (name == "--port") {
      to.listen = read_place(std::string{"127.0.0.1:"}.append(value));
    } else if (name == "--listen") {
      to.listen = read_place(value);
    } else if (name == "--connect" && value.starts_with(scheme)) {
      to.connect = read_place(value.substr(scheme.size()));
    } else if (name == "--connect" && value.starts_with(secure_scheme)) {
      to.connect = read_place(value.substr(secure_scheme.size()));
      to.secure = true;
    } else if (name == "--certificate") {
      to.tls.certificate = value;
    } else if (name == "--key") {
      to.tls.key = value;
    } else if (name == "--ca") {
      to.tls.ca = value;
    } else if (name == "--subprotocol") {
      to.subprotocols.push_back(value);
    } else {
      return std::nullopt;
    }
  }
  if (to.listen.has_value() == to.connect.has_value()) return std::nullopt;
  return to;
}

service::transport* signalled = nullptr; // set before the handler is
std::atomic<bool> ended{false};

void on_signal(int) {
  ended = true;
  signalled->wake(); // a write to a descriptor: a handler may
}

// Signals end what runs while it runs, and nothing behind it.
struct signals_heard {
  explicit signals_heard(service::transport& woken) {
    signalled = &woken;
    for (const int one : {SIGTERM, SIGINT}) std::signal(one, on_signal);
  }
  ~signals_heard() {
    for (const int one : {SIGTERM, SIGINT}) std::signal(one, SIG_IGN); // the program ends by itself
  }
};

// Runs until a signal, or for a client until its one connection is over.
int run(net::socket_transport& sockets, const arguments& given) {
  net::socket_limits limits;
  echo echoes{sockets, limits.connections_max};
  const signals_heard heard{sockets};
  if (given.connect) {
    sockets.connect();
  } else {
    std::printf("transport_echo listens on %s, port %u\n", given.listen->host.c_str(), sockets.port());
    std::fflush(stdout);
  }
  while (!ended) {
    sockets.poll(rt::monotonic_clock::now(), echoes);
    if (given.connect && echoes.refused()) return 1;
    if (given.connect && echoes.met_anyone() && !echoes.has_peers()) return 0;
    sockets.wait(rt::monotonic_clock::now(), rt::never);
  }
  return 0;
}

result<std::unique_ptr<net::socket_transport>> open(const arguments& given) {
  net::socket_limits limits;
  limits.write_timeout = write_timeout;
  if (given.connect) {
    return net::socket_transport::connect({.host = given.connect->host,
                                           .port = given.connect->port,
                                           .path = given.connect->path,
                                           .subprotocols = given.subprotocols,
                                           .secure = given.secure,
                                           .tls = given.tls,
                                           .limits = limits});
  }
  static constexpr std::string_view any[] = {"*"};
  const bool on_loopback = given.listen->host == "127.0.0.1" || given.listen->host == "::1";
  if (!on_loopback) limits.connections_per_address_max = limits.connections_max; // a suite is one address
  return net::socket_transport::listen(
      {.address = given.listen->host,
       .port = given.listen->port,
       .insecure = !on_loopback,
       .allow_hosts = on_loopback ? std::span<const std::string_view>{} : any,
       .subprotocols = given.subprotocols,
       .tls = given.tls,
       .limits = limits});
}

} // namespace

int main(int count, char** values) {
  const auto given = read(std::span{values, static_cast<std::size_t>(count)}.subspan(1));
  if (!given) {
    std::fputs("usage: transport_echo --port N | --listen ADDR:PORT | --connect ws[s]://HOST:PORT[/PATH]\n"
               "                      [--subprotocol NAME]... [--certificate FILE --key FILE | --ca FILE]\n",
               stderr);
    return 2;
  }
  auto sockets = open(*given);
  if (!sockets) {
    std::fprintf(stderr, "transport_echo: %s\n", sockets.error().message().c_str());
    return 1;
  }
  return run(**sockets, *given);
}
