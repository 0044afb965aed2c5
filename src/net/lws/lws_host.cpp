// SPDX-License-Identifier: Apache-2.0
#include "net/lws/lws_host.hpp"

#include <fcntl.h>
#include <libwebsockets.h>
#include <strings.h>
#include <sys/socket.h>

#include <algorithm>
#include <cassert>
#include <csignal>
#include <cstring>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "net/http/http_page.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::net {

static_assert(wire::frame_headroom_bytes >= LWS_PRE);

namespace {

// Long enough that libwebsockets' timers do not interfere with ours.
constexpr unsigned library_timeout_seconds = 30;
// More than the largest page, so that libwebsockets does not cut one write into several.
constexpr std::size_t write_bytes_max = std::size_t{1} << 24;
// For its pipe, and a margin for descriptors that are being closed while others are handed over.
constexpr std::uint32_t extra_sockets = 16;
// Bytes for the parsed header of one request; more than the filter lets through.
constexpr unsigned short header_data_bytes = 8192;

// What one handshake, or a page without its body, takes at most. Version 4.1.6 takes two thirds of it for the
// longest request that the filter lets through (tests/net/memory_test.cpp).
constexpr std::size_t handshake_bytes_needed = std::size_t{24} << 10;

// All zero: libwebsockets itself pings nobody and closes nothing.
constexpr lws_retry_bo_t no_liveness{};

template <std::size_t Size>
void copy_text(std::array<char, Size>& to, const void* text, std::size_t bytes) noexcept {
  const std::size_t kept = std::min(bytes, Size - 1);
  if (kept) std::memcpy(to.data(), text, kept);
  to[kept] = '\0';
}

// libwebsockets makes the whole process ignore SIGPIPE. A library must not leave that behind, so this
// restores it.
class sigpipe_guard {
 public:
  sigpipe_guard() noexcept { ::sigaction(SIGPIPE, nullptr, &before_); }
  ~sigpipe_guard() { ::sigaction(SIGPIPE, &before_, nullptr); }
  sigpipe_guard(const sigpipe_guard&) = delete;
  sigpipe_guard& operator=(const sigpipe_guard&) = delete;

 private:
  struct sigaction before_ {};
};

// libwebsockets keeps a copy of what the socket does not take at once: at most the whole body, or one piece.
bool has_room_for(const fixed_heap& heap, const service::http_answer& answer) noexcept {
  const std::size_t at_once = answer.lasts ? page_piece_bytes : answer.body.size();
  return heap.has_room_for(std::min(at_once, answer.body.size()) + handshake_bytes_needed);
}

constexpr int close_once_sent = -1; // one request a connection

int serve_page(lws* wsi, lws_watch& watch, const fixed_heap& heap) noexcept {
  if (!watch.judgement || !watch.answer) return close_once_sent;
  const service::http_answer& answer = *watch.answer;
  watch.in_pieces = answer.lasts;
  watch.starved = !has_room_for(heap, answer);
  if (watch.starved) return 0; // adopt() lets go; closing would shut down the socket on which we refuse
  watch.answered = write_page(wsi, *watch.judgement, answer, watch.rest);
  if (!watch.answered || watch.rest.empty()) return close_once_sent;
  lws_set_timeout(wsi, NO_PENDING_TIMEOUT, 0); // the time is ours to measure
  return 0;
}

int serve_rest(lws* wsi, lws_watch& watch) noexcept {
  return write_rest(wsi, watch.rest) && !watch.rest.empty() ? 0 : close_once_sent;
}

// 0, or -1 if it does not fit behind `*end`, where `bytes` are left.
int add_authorization(lws* wsi, std::string_view value, unsigned char** end, std::size_t bytes) noexcept {
  if (value.empty()) return 0;
  const auto* const text = reinterpret_cast<const unsigned char*>(value.data());
  const int failed = lws_add_http_header_by_token(wsi, WSI_TOKEN_HTTP_AUTHORIZATION, text,
                                                  static_cast<int>(value.size()), end, *end + bytes);
  return failed != 0 ? -1 : 0;
}

int on_event(lws* wsi, lws_callback_reasons reason, lws_watch& watch, const fixed_heap& heap, void* in,
             std::size_t bytes) noexcept {
  switch (reason) {
  case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
    // This cannot happen, because the filter writes the request anew. If it did, a refusal by return value
    // would be a use after free in 4.1.6, and h2c would bypass every filter.
    if (::strcasecmp(static_cast<const char*>(in), "websocket") != 0) ::shutdown(watch.duplicate, SHUT_RDWR);
    return 0;
  case LWS_CALLBACK_RAW_ADOPT:
  case LWS_CALLBACK_RAW_RX: return -1; // what CONNECT would lead to; likewise
  case LWS_CALLBACK_HTTP: return serve_page(wsi, watch, heap);
  case LWS_CALLBACK_HTTP_WRITEABLE: return serve_rest(wsi, watch);
  case LWS_CALLBACK_ESTABLISHED:
  case LWS_CALLBACK_CLIENT_ESTABLISHED: watch.established = true; return 0;
  case LWS_CALLBACK_CLIENT_APPEND_HANDSHAKE_HEADER:
    watch.asked = true;
    return add_authorization(wsi, watch.authorization, static_cast<unsigned char**>(in), bytes);
  case LWS_CALLBACK_CLIENT_FILTER_PRE_ESTABLISH: {
    const int copied = lws_hdr_copy(wsi, watch.subprotocol.data(), static_cast<int>(watch.subprotocol.size()),
                                    WSI_TOKEN_PROTOCOL);
    return copied < 0 ? -1 : 0; // longer than any we offer
  }
  case LWS_CALLBACK_CLIENT_CONNECTION_ERROR: copy_text(watch.diagnostic, in, in ? bytes : 0); return 0;
  case LWS_CALLBACK_WSI_DESTROY: watch.wsi = nullptr; return 0;
  default: return 0;
  }
}

} // namespace

struct lws_host::tables {
  std::vector<std::string> names;       // what the protocols' names point to
  std::vector<lws_protocols> protocols; // libwebsockets keeps pointers into it

  // Reasons that belong to no socket, or that come before the socket exists.
  static bool is_general(lws_callback_reasons reason) noexcept {
    return reason == LWS_CALLBACK_PROTOCOL_INIT || reason == LWS_CALLBACK_PROTOCOL_DESTROY ||
           reason == LWS_CALLBACK_GET_THREAD_ID || reason == LWS_CALLBACK_EVENT_WAIT_CANCELLED ||
           reason == LWS_CALLBACK_OPENSSL_LOAD_EXTRA_CLIENT_VERIFY_CERTS ||
           reason == LWS_CALLBACK_OPENSSL_LOAD_EXTRA_SERVER_VERIFY_CERTS;
  }

  static int callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t bytes) noexcept {
    if (is_general(reason)) return 0;
    auto* host = static_cast<lws_host*>(lws_context_user(lws_get_context(wsi)));
    auto* watch = static_cast<lws_watch*>(lws_get_opaque_user_data(wsi));
    if (!watch) {
      if (!host || !host->current_) return 0;
      watch = host->current_;
      host->bind(*watch, wsi);
    }
    return on_event(wsi, reason, *watch, host->heap(), in, bytes);
  }
};

lws_host::lws_host(std::unique_ptr<tables> owned, lws_memory memory) noexcept
    : tables_{std::move(owned)}, memory_{std::move(memory)} {}

lws_host::~lws_host() {
  const lws_memory::lending lent{memory_};
  if (context_) lws_context_destroy(context_);
}

result<std::unique_ptr<lws_host>> lws_host::open(lws_role role,
                                                 std::span<const std::string_view> subprotocols,
                                                 std::uint32_t sockets_max, std::size_t memory_bytes) {
  const error no_memory{errc::no_memory, static_cast<std::int64_t>(memory_bytes)};
  lws_memory memory{memory_bytes};
  if (!memory) return no_memory;
  auto owned = std::make_unique<tables>();
  owned->names.reserve(subprotocols.size());
  const auto add = [&](const char* name) {
    lws_protocols one{};
    one.name = name;
    one.callback = &tables::callback;
    one.tx_packet_size = write_bytes_max;
    owned->protocols.push_back(one);
  };
  add("rowe-any"); // the first one serves whoever offers none
  for (const std::string_view name : subprotocols) add(owned->names.emplace_back(name).c_str());
  owned->protocols.push_back({});

  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
  info.timeout_secs = library_timeout_seconds;
  info.max_http_header_data = header_data_bytes;
  info.max_http_header_pool = static_cast<unsigned short>(sockets_max + extra_sockets);
  info.fd_limit_per_thread = sockets_max + extra_sockets;
  info.retry_and_idle_policy = &no_liveness;

  std::unique_ptr<lws_host> host{new (std::nothrow) lws_host{std::move(owned), std::move(memory)}};
  if (!host) return errc::no_memory;
  const lws_memory::lending lent{host->memory_};
  info.user = host.get();
  lws_set_log_level(0, nullptr);
  {
    const sigpipe_guard guard;
    host->context_ = lws_create_context(&info);
  }
  if (!host->context_) return no_memory;

  info.protocols = host->tables_->protocols.data();
  info.vhost_name = "rowe";
  info.alpn = "http/1.1"; // never h2: it has ways around every filter
  if (role == lws_role::server) info.port = CONTEXT_PORT_NO_LISTEN_SERVER;
  host->vhost_ = lws_create_vhost(host->context_, &info);
  if (!host->vhost_) return no_memory;
  host->turn(); // its deferred initialisation
  return host;
}

void lws_host::bind(lws_watch& watch, lws* wsi) noexcept {
  watch.wsi = wsi;
  lws_set_opaque_user_data(wsi, &watch);
}

void lws_host::adopt(lws_watch& watch, descriptor duplicate, std::string_view request) noexcept {
  const lws_memory::lending lent{memory_};
  watch.duplicate = duplicate.get();
  watch.starved = !heap().has_room_for(handshake_bytes_needed);
  if (watch.starved) return;
  current_ = &watch;
  // Everything happens inside this call; what it returns says nothing (see the top of the header).
  lws_adopt_socket_vhost_readbuf(vhost_, duplicate.release(), request.data(), request.size());
  current_ = nullptr;
  if (!watch.wsi) return;
  if (watch.established && lws_partial_buffered(watch.wsi))
    watch.established = false; // a 101 that did not fit
  const bool page_in_flight = watch.answered && !watch.established;
  if (!page_in_flight) let_go(watch);
}

bool lws_host::connect(lws_watch& watch, const lws_client_target& target) noexcept {
  const lws_memory::lending lent{memory_};
  lws_client_connect_info info{};
  info.context = context_;
  info.vhost = vhost_;
  info.address = target.address;
  info.port = target.port;
  info.host = target.host;
  info.path = target.path;
  info.protocol = target.subprotocols;
  info.local_protocol_name = "rowe-any";
  info.alpn = "http/1.1";
  info.ssl_connection = LCCSCF_HTTP_NO_FOLLOW_REDIRECT;
  info.retry_and_idle_policy = &no_liveness;
  info.opaque_user_data = &watch;
  watch.authorization = target.authorization;
  watch.wsi = lws_client_connect_via_info(&info);
  if (!watch.wsi) return false;
  watch.duplicate = lws_get_socket_fd(watch.wsi);
  if (watch.duplicate < 0) {
    let_go(watch);
    return false;
  }
  lws_rx_flow_control(watch.wsi, 0); // it must not read one byte that we have not seen
  return true;
}

bool lws_host::take_answer(lws_watch& watch, std::string_view header) noexcept {
  const lws_memory::lending lent{memory_};
  // libwebsockets reads the header, and nothing else, from a socket pair. The pair replaces the connection
  // under the same descriptor number.
  int pair[2] = {-1, -1};
  (void)::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, pair); // send() will say so
  const descriptor theirs{pair[0]};
  const descriptor ours{pair[1]};
  const bool swapped =
      ::send(ours.get(), header.data(), header.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(header.size()) &&
      ::dup3(theirs.get(), watch.duplicate, O_CLOEXEC) == watch.duplicate;
  if (swapped) {
    lws_rx_flow_control(watch.wsi, 1);
    service(watch, LWS_POLLIN, LWS_POLLIN);
  }
  const bool upgraded = swapped && watch.established && watch.wsi && !lws_partial_buffered(watch.wsi);
  let_go(watch);
  return upgraded;
}

void lws_host::drive(lws_watch& watch) noexcept {
  const lws_memory::lending lent{memory_};
  lws_rx_flow_control(watch.wsi, 1); // it does nothing at all for a socket whose reading is held
  service(watch, LWS_POLLIN | LWS_POLLOUT, LWS_POLLOUT);
  if (watch.wsi) lws_rx_flow_control(watch.wsi, 0);
}

void lws_host::let_go(lws_watch& watch) noexcept {
  if (!watch.wsi) return;
  const lws_memory::lending lent{memory_};
  if (watch.duplicate < 0)
    return lws_set_timeout(watch.wsi, PENDING_TIMEOUT_KILLED_BY_PARENT, LWS_TO_KILL_SYNC);
  // This is the only way to close that neither shuts the socket down nor sends a frame: only the descriptor
  // is closed.
  service(watch, 0, LWS_POLLHUP);
  assert(!watch.wsi);
}

void lws_host::service(lws_watch& watch, short events, short found) noexcept {
  lws_pollfd one{};
  one.fd = watch.duplicate;
  one.events = events;
  one.revents = found;
  lws_service_fd(context_, &one);
}

void lws_host::turn() noexcept {
  const lws_memory::lending lent{memory_};
  lws_service(context_, -1);
}

} // namespace rowe::net
