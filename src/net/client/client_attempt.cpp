// SPDX-License-Identifier: Apache-2.0
#include "net/client/client_attempt.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <utility>

#include "net/base/socket_options.hpp"
#include "net/tls/terminator.hpp"
#include "wire/http/http_fields.hpp"

namespace rowe::net {

using service::transport_sink;

namespace {

// libwebsockets writes at most 128 bytes of Host header and cuts what is longer.
constexpr std::size_t host_bytes_max = 100;
constexpr std::size_t path_bytes_max = 1024;
constexpr std::uint16_t switching_protocols = 101;

// A diagnostic, for rejection::what and the like.
class diagnostic {
 public:
  template <class... Values>
  explicit diagnostic(const char* format, Values... values) noexcept {
    std::snprintf(text_, sizeof text_, format, values...);
  }
  operator std::string_view() const noexcept { return text_; } // NOLINT(google-explicit-constructor)

 private:
  char text_[384];
};

bool is_visible(char c) noexcept { return c > ' ' && c < '\x7f'; }

status check(const connect_options& options) noexcept {
  const auto too_big = [](std::size_t bytes, std::size_t limit) {
    return error{errc::too_big, static_cast<std::int64_t>(bytes), static_cast<std::int64_t>(limit)};
  };
  if (options.host.size() > host_bytes_max) return too_big(options.host.size(), host_bytes_max);
  if (options.path.size() > path_bytes_max) return too_big(options.path.size(), path_bytes_max);
  const auto belongs_in_a_host = [](char c) {
    return is_visible(c) && c != '/' && c != '[' && c != ']' && c != '@';
  };
  if (options.host.empty() || options.port == 0 || !options.path.starts_with('/')) return errc::bad_url;
  if (!std::all_of(options.host.begin(), options.host.end(), belongs_in_a_host)) return errc::bad_url;
  if (!std::all_of(options.path.begin(), options.path.end(), is_visible)) return errc::bad_url;
  return {};
}

// The status of "HTTP/1.x NNN …"; nothing for any other text.
std::optional<std::uint16_t> status_of(std::string_view header) noexcept {
  constexpr std::string_view version = "HTTP/1.";
  constexpr std::size_t digits = 9; // where they begin
  if (!header.starts_with(version) || header.size() < digits + 4 || header[8] != ' ') return std::nullopt;
  unsigned status = 0;
  for (std::size_t i = digits; i < digits + 3; ++i) {
    if (header[i] < '0' || header[i] > '9') return std::nullopt;
    status = status * 10 + static_cast<unsigned>(header[i] - '0');
  }
  return static_cast<std::uint16_t>(status);
}

// What is wrong with the lines of an answer, as the end of "HOST answered ...", or null. libwebsockets checks
// the fields, but it takes the first of two equal ones and repairs malformed ones.
const char* fault_of(std::string_view header) noexcept {
  struct once {
    std::string_view name;
    const char* fault;
    bool seen = false;
  };
  once fields[] = {{"upgrade", "with two Upgrade headers"},
                   {"sec-websocket-accept", "with two Sec-WebSocket-Accept headers"},
                   {"sec-websocket-protocol", "with two Sec-WebSocket-Protocol headers"}};
  wire::http_lines lines{header};
  (void)lines.request_line(); // the status line, which is known to be one
  while (const auto field = lines.next_field()) {
    for (once& one : fields) {
      if (wire::equal_ignoring_case(field->name, one.name) && std::exchange(one.seen, true)) return one.fault;
    }
  }
  return lines.fault() == wire::line_fault::none ? nullptr : "with a malformed header";
}

const char* remedy_of(std::uint16_t status) noexcept {
  switch (status) {
  case 400: return "check the path; if the port speaks TLS, connect to wss://";
  case 401: return "send a token that it knows: --token-file FILE or $ROWE_TOKEN (client.token_file)";
  case 403: return "the other side must allow this host";
  case 404: return "check the path";
  case 429: return "too many attempts from this address have failed: wait, then send a token that it knows";
  case 503: return "the other side has no room; try again later";
  default:
    return status >= 300 && status < 400 ? "connect to the address it redirects to"
                                         : "check that a WebSocket server is at this host, port and path";
  }
}

// Whether the same request will be answered so again: not where the server is only busy or begins.
bool is_lasting(std::uint16_t status) noexcept {
  constexpr std::uint16_t request_timeout = 408, too_early = 425, too_many_requests = 429;
  return status >= 200 && status < 500 && status != request_timeout && status != too_early &&
         status != too_many_requests;
}

} // namespace

client_attempt::client_attempt(const connect_options& options, poll_set& polled, lws_host& host,
                               established& connections, socket_counters& counters,
                               std::span<std::byte> scratch)
    : limits_{options.limits},
      host_{options.host},
      port_{options.port},
      path_{options.path},
      polled_{polled},
      lws_{host},
      connections_{connections},
      counters_{counters},
      scratch_{scratch} {
  const bool brackets = host_.find(':') != std::string::npos;
  authority_ = (brackets ? '[' + host_ + ']' : host_) + ':' + std::to_string(port_);
  if (!options.token.empty()) authorization_.append("Bearer ").append(options.token);
  for (const std::string_view one : options.subprotocols) {
    if (!subprotocols_.empty()) subprotocols_ += ',';
    subprotocols_ += one;
  }
}

result<std::unique_ptr<client_attempt>> client_attempt::open(const connect_options& options, poll_set& polled,
                                                             lws_host& host, established& connections,
                                                             socket_counters& counters,
                                                             std::span<std::byte> scratch, int waker) {
  if (const status good = check(options); !good) return good.error();
  std::unique_ptr<client_attempt> made{
      new client_attempt{options, polled, host, connections, counters, scratch}};
  if (const auto address = numeric_address(options.host, options.port)) {
    resolved_host only;
    only.addresses[0] = *address;
    only.count = 1;
    made->use(only);
    return made;
  }
  auto helper = resolver::open(options.host, options.port, waker);
  if (!helper) return helper.error();
  made->resolver_ = std::move(*helper);
  return made;
}

client_attempt::~client_attempt() { drop_socket(); }

void client_attempt::use(const resolved_host& addresses) noexcept {
  resolver_.reset();
  found_ = addresses;
}

void client_attempt::step(rt::time_point now, transport_sink& sink) noexcept {
  if (std::exchange(asked_, false) && now_ == phase::idle) begin(now, sink);
  if (now_ == phase::resolving) resolve(now, sink);
  if (now_ != phase::idle && now >= std::min(deadline_, address_deadline_)) time_out(now, sink);
}

rt::time_point client_attempt::next_deadline() const noexcept {
  return now_ == phase::idle ? rt::never : std::min(deadline_, address_deadline_);
}

void client_attempt::begin(rt::time_point now, transport_sink& sink) noexcept {
  next_ = 0;
  if (connections_.full())
    return fail(sink, 0,
                diagnostic{"all %u connections are taken", static_cast<unsigned>(limits_.connections_max)},
                "close one, or raise connections_max");
  deadline_ = rt::deadline_after(now, limits_.connect_timeout);
  address_deadline_ = rt::never;
  if (!resolver_) return next_address(now, sink);
  now_ = phase::resolving;
  resolver_->ask();
}

void client_attempt::resolve(rt::time_point now, transport_sink& sink) noexcept {
  if (!resolver_->try_take(found_)) return;
  const char* name = host_.c_str();
  if (found_.failure == EAI_AGAIN)
    return fail(sink, 0, diagnostic{"no name server answered for \"%s\"", name},
                "check the network, or give the numeric address");
  if (found_.failure == EAI_SYSTEM)
    return fail(sink, 0, diagnostic{"\"%s\" cannot be looked up: %s", name, ::strerrordesc_np(found_.code)},
                "check the network, or give the numeric address");
  if (found_.failure != 0 || found_.count == 0)
    return fail(sink, 0, diagnostic{"no host of the name \"%s\" is known", name},
                "check the name, or give the numeric address");
  next_address(now, sink);
}

// Tries the next address, and if that fails at once, those behind it. Each address may take an equal part of
// the time that is left.
void client_attempt::next_address(rt::time_point now, transport_sink& sink) noexcept {
  drop_socket();
  while (next_ < found_.count) {
    const auto left = static_cast<rt::duration::rep>(found_.count - next_);
    peer_ = found_.addresses[next_++];
    char address[address_text_bytes_max];
    write_host(address, peer_);
    watch_ = {};
    if (!lws_.connect(watch_, {.address = address,
                               .port = port_,
                               .host = authority_.c_str(),
                               .path = path_.c_str(),
                               .subprotocols = subprotocols_.empty() ? nullptr : subprotocols_.c_str(),
                               .authorization = authorization_}))
      continue;
    socket_.reset(::fcntl(watch_.duplicate, F_DUPFD_CLOEXEC, 0));
    if (++generation_ == 0) generation_ = 1;
    if (!socket_ || !polled_.add(socket_.get(), EPOLLOUT, {source::attempt, 0, generation_})) {
      socket_.reset();
      return fail_for_descriptors(sink);
    }
    now_ = phase::connecting;
    address_deadline_ = rt::deadline_after(now, (deadline_ - now) / left);
    return;
  }
  fail(sink, 0, diagnostic{"%s cannot be reached", authority_.c_str()}, "check the network and the address");
}

void client_attempt::on_event(const socket_event& event, rt::time_point now, transport_sink& sink) noexcept {
  if (event.token.generation != generation_) return; // given up earlier in this batch
  if (now_ == phase::connecting) return on_connected(now, sink);
  if (now_ == phase::waiting) read_answer(event.events, sink);
}

void client_attempt::on_connected(rt::time_point now, transport_sink& sink) noexcept {
  // This comes before libwebsockets, which would read the error, too, and not report it.
  if (const int code = socket_error(socket_.get()); code != 0) {
    if (next_ < found_.count) return next_address(now, sink);
    return fail_by_error(sink, code);
  }
  if (terminator_ && !place_) return secure(sink);
  lws_.drive(watch_);
  if (!watch_.wsi) {
    const bool said = watch_.diagnostic.front() != '\0';
    return fail(sink, 0,
                diagnostic{"%s: the request could not be sent (%s)", authority_.c_str(),
                           said ? watch_.diagnostic.data() : "the connection ended"},
                "check that a WebSocket server is at this host and port");
  }
  if (!watch_.asked) return; // connected, but not written yet
  now_ = phase::waiting;
  scanned_ = 0;
  polled_.modify(socket_.get(), EPOLLIN | EPOLLRDHUP | EPOLLET, {source::attempt, 0, generation_});
}

// ---- TLS. libwebsockets sees nothing of it: it writes its request into a local socket.

void client_attempt::secure(transport_sink& sink) noexcept {
  polled_.remove(socket_.get());
  now_ = phase::securing;
  if (!terminator_->connect(std::move(socket_), generation_))
    fail(sink, 0, "too many TLS handshakes are under way", "try again");
}

void client_attempt::on_secured(tls::place_id place, descriptor plain, transport_sink& sink) noexcept {
  if (now_ != phase::securing || place.generation != generation_) return terminator_->drop(place);
  place_ = place;
  socket_ = std::move(plain);
  if (::dup3(socket_.get(), watch_.duplicate, O_CLOEXEC) != watch_.duplicate ||
      !polled_.add(socket_.get(), EPOLLOUT, {source::attempt, 0, generation_})) {
    socket_.reset();
    return fail_for_descriptors(sink);
  }
  now_ = phase::connecting; // it is writable, and so libwebsockets goes on
}

void client_attempt::on_not_secured(tls::place_id place, const wire::http_rejection& why,
                                    transport_sink& sink) noexcept {
  const bool ours = now_ == phase::securing || place_;
  if (!ours || place.generation != generation_) return;
  const std::string_view what = why.what();
  fail(sink, 0, diagnostic{"%s: %.*s", authority_.c_str(), static_cast<int>(what.size()), what.data()},
       why.remedy(), why.lasting);
}

void client_attempt::read_answer(std::uint32_t events, transport_sink& sink) noexcept {
  const std::string_view name = authority_;
  auto* text = reinterpret_cast<char*>(scratch_.data());
  const ssize_t peeked = ::recv(socket_.get(), text, limits_.header_bytes_max, MSG_PEEK | MSG_DONTWAIT);
  if (peeked < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (peeked < 0) return fail_by_error(sink, errno);
  const std::string_view seen{text, static_cast<std::size_t>(peeked)};
  const std::size_t end = wire::find_header_end(seen, scanned_);
  if (end != 0) {
    const ssize_t taken = ::recv(socket_.get(), text, end, MSG_DONTWAIT);
    if (taken == static_cast<ssize_t>(end)) return finish(seen.substr(0, end), sink);
    return fail_by_error(sink, ECONNRESET);
  }
  if (seen.size() == limits_.header_bytes_max)
    return fail(sink, 0,
                diagnostic{"%s answered with a header of more than %u bytes", name.data(),
                           static_cast<unsigned>(limits_.header_bytes_max)},
                remedy_of(0), true);
  if (seen.empty() || (events & (EPOLLRDHUP | EPOLLHUP | EPOLLERR)))
    return fail(sink, 0, diagnostic{"%s closed the connection instead of answering", name.data()},
                remedy_of(0));
  scanned_ = static_cast<std::uint32_t>(seen.size());
}

void client_attempt::finish(std::string_view header, transport_sink& sink) noexcept {
  const auto status = status_of(header);
  if (!status)
    return fail(sink, 0, diagnostic{"%s answered with something that is not HTTP", authority_.c_str()},
                remedy_of(0), true);
  if (*status != switching_protocols)
    return fail(sink, *status,
                diagnostic{"%s answered HTTP status %u to the upgrade of %s", authority_.c_str(),
                           static_cast<unsigned>(*status), path_.c_str()},
                remedy_of(*status), is_lasting(*status));
  // Upgrade is no part of HTTP/1.0 (RFC 7230 6.7), so a proxy that passes it on in HTTP/1.0 has not
  // understood it.
  const char* const fault =
      header.starts_with("HTTP/1.1 ") ? fault_of(header) : "the upgrade in another HTTP than 1.1";
  if (fault)
    return fail(sink, *status, diagnostic{"%s answered %s", authority_.c_str(), fault}, remedy_of(0), true);
  if (!lws_.take_answer(watch_, header))
    return fail(
        sink, *status,
        diagnostic{"%s answered the upgrade wrongly (%s)", authority_.c_str(), watch_.diagnostic.data()},
        remedy_of(0), true);
  const service::connection_id id = place_ ? connections_.open(place_, peer_, established::purpose::any)
                                           : connections_.open(std::move(socket_), peer_);
  place_ = {}; // it is the connection's now
  drop_socket();
  now_ = phase::idle;
  ++counters_.opened;
  char address[address_text_bytes_max];
  sink.on_open(id, {.ours = service::side::client,
                    .address = write_address(address, peer_),
                    .path = std::string_view{path_}.substr(0, path_.find('?')),
                    .subprotocol = watch_.subprotocol.data()});
}

void client_attempt::time_out(rt::time_point now, transport_sink& sink) noexcept {
  if (now < deadline_ && next_ < found_.count) return next_address(now, sink);
  const auto seconds = std::chrono::duration<double>{limits_.connect_timeout}.count();
  if (now_ == phase::resolving)
    return fail(sink, 0, diagnostic{"no name server answered for \"%s\" within %g s", host_.c_str(), seconds},
                "check the network, or give the numeric address");
  if (now_ == phase::connecting)
    return fail(sink, 0, diagnostic{"no connection to %s within %g s", authority_.c_str(), seconds},
                "check the network, the address and firewalls");
  if (now_ == phase::securing)
    return fail(sink, 0,
                diagnostic{"the TLS handshake with %s did not end within %g s", authority_.c_str(), seconds},
                "check that this port speaks TLS; else connect to ws://");
  fail(sink, 0, diagnostic{"%s did not answer the upgrade within %g s", authority_.c_str(), seconds},
       remedy_of(0));
}

void client_attempt::drop_socket() noexcept {
  lws_.let_go(watch_);
  if (place_ || now_ == phase::securing) terminator_->drop({0, generation_});
  place_ = {};
  if (!socket_) return;
  polled_.remove(socket_.get());
  socket_.reset();
}

void client_attempt::fail(transport_sink& sink, std::uint16_t status, std::string_view what,
                          std::string_view remedy, bool lasting) noexcept {
  char address[address_text_bytes_max];
  const std::string_view peer = next_ == 0 ? std::string_view{} : write_address(address, peer_);
  drop_socket();
  now_ = phase::idle;
  sink.on_rejected({.http_status = status, .peer = peer, .what = what, .remedy = remedy, .lasting = lasting});
}

void client_attempt::fail_for_descriptors(transport_sink& sink) noexcept {
  fail(sink, 0, "this process has no file descriptor left", "raise its limit of open files (ulimit -n)");
}

void client_attempt::fail_by_error(transport_sink& sink, int code) noexcept {
  if (code == ECONNREFUSED)
    return fail(sink, 0, diagnostic{"nobody listens at %s", authority_.c_str()},
                "start the program there, or check host and port");
  fail(sink, 0, diagnostic{"%s cannot be reached: %s", authority_.c_str(), ::strerrordesc_np(code)},
       "check the network and the address");
}

} // namespace rowe::net
