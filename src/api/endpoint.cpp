// SPDX-License-Identifier: Apache-2.0
// The composition root: which transport, which page, behind the public handles.
#include <rowe/endpoint.hpp>

#include <new>
#include <string>
#include <vector>

#include "api/check_opening.hpp"
#include "api/endpoint_state.hpp"
#include "api/url.hpp"
#include "net/transport/socket_transport.hpp"
#include "wire/protocols/protocols.hpp"

namespace rowe {
namespace {

constexpr bool is_hop(websocket_profile profile) noexcept { return profile != websocket_profile::standard; }

// Hop has no pings, so the kernel has to notice that it is gone.
net::socket_limits socket_limits_of(const endpoint_options& options) noexcept {
  return {.connections_max = options.limits.connections_max,
          .connections_per_address_max = options.limits.connections_per_address_max,
          .handshakes_max = options.limits.handshakes_max,
          .handshake_bytes = options.limits.handshake_bytes,
          .vanished_after = is_hop(options.profile) ? options.silence_max : duration::zero()};
}

std::vector<std::string_view> views_of(const std::vector<std::string>& texts) {
  return {texts.begin(), texts.end()};
}

// Opens an endpoint; if there is no memory, that is an error like the others.
template <class Open>
result<endpoint> with_memory(Open&& open) {
  try {
    return open();
  } catch (const std::bad_alloc&) {
    return errc::no_memory;
  }
}

} // namespace

result<endpoint> endpoint::listen(std::uint16_t port, const endpoint_options& options) {
  return with_memory([&]() -> result<endpoint> {
    if (const status ok = detail::check_listen(options); !ok) return ok.error();
    const auto origins = views_of(options.allow_origins);
    const auto hosts = views_of(options.allow_hosts);
    auto sockets = net::socket_transport::listen({.address = options.address,
                                                  .port = port,
                                                  .insecure = detail::may_be_reached(options),
                                                  .allow_origins = origins,
                                                  .allow_hosts = hosts,
                                                  .subprotocols = wire::protocols_of(options.profile).accepts,
                                                  .lenient_handshake = is_hop(options.profile),
                                                  .tls = options.tls,
                                                  .limits = socket_limits_of(options)});
    if (!sockets) return sockets.error();
    auto bound = std::move(sockets).value();
    const std::uint16_t bound_port = bound->port();
    auto state = detail::endpoint_state::open(options, service::side::server, std::move(bound), bound_port);
    if (!state) return state.error();
    return endpoint{std::move(state).value()};
  });
}

result<endpoint> endpoint::listen(const endpoint_options& options) { return listen(options.port, options); }

result<endpoint> endpoint::connect(std::string_view url, const endpoint_options& options) {
  return with_memory([&]() -> result<endpoint> {
    const auto parts = split_url(url);
    if (!parts) return parts.error();
    const auto token = detail::token_to_show(options);
    if (!token) return token.error();
    auto sockets = net::socket_transport::connect({.host = parts->host,
                                                   .port = parts->port,
                                                   .path = parts->path,
                                                   .subprotocols = wire::protocols_of(options.profile).offers,
                                                   .token = *token,
                                                   .secure = parts->secure,
                                                   .tls = options.tls,
                                                   .limits = socket_limits_of(options)});
    if (!sockets) return sockets.error();
    auto state = detail::endpoint_state::open(options, service::side::client, std::move(sockets).value(), 0);
    if (!state) return state.error();
    return endpoint{std::move(state).value()};
  });
}

endpoint::endpoint(std::shared_ptr<detail::endpoint_state> state) noexcept : state_{std::move(state)} {}
endpoint::endpoint(endpoint&&) noexcept = default;

endpoint& endpoint::operator=(endpoint&& from) noexcept {
  if (this != &from) {
    if (state_) (void)state_->close(duration::zero()); // as the destructor
    state_ = std::move(from.state_);
  }
  return *this;
}

status endpoint::usable() const noexcept {
  if (!state_) return errc::misuse;
  return state_->forked() ? status{errc::forked} : status{};
}

endpoint::~endpoint() {
  if (state_) (void)state_->close(duration::zero()); // with nothing to drain there is nothing to report
}

result<detail::pair_handle> endpoint::open(const detail::pair_request& asked) {
  if (const status mine = usable(); !mine) return mine.error();
  auto pair = state_->open_pair(asked);
  if (!pair) return pair.error();
  return detail::pair_handle{state_, **pair};
}

result<detail::parameter_handle> endpoint::open(const detail::parameter_request& asked) {
  if (const status mine = usable(); !mine) return mine.error();
  auto cell = state_->open_parameter(asked);
  if (!cell) return cell.error();
  return detail::parameter_handle{state_, **cell};
}

result<lane> endpoint::open_lane(const lane_options& options) {
  auto handle = open(detail::talk_request(options));
  if (!handle) return handle.error();
  return lane{std::move(*handle)};
}

result<rowe::stop_latch> endpoint::stop_latch(const latch_options& options) {
  if (const status mine = usable(); !mine) return mine.error();
  const stop_times times = state_->stop_times_of(options.loop_timeout, rt::this_thread_is_real_time());
  auto handle = open(detail::latch_request({.name = options.name, .loop_timeout = times.loop_timeout}));
  if (!handle) return handle.error();
  return rowe::stop_latch{std::move(*handle), times};
}

status endpoint::set_access(const access_options& access, std::string* why) {
  if (const status mine = usable(); !mine) return mine.error();
  std::string wrong = check_access(access);
  status done = errc::bad_access;
  try {
    if (wrong.empty()) done = state_->set_access(access, wrong);
  } catch (const std::bad_alloc&) {
    return errc::no_memory;
  }
  if (why != nullptr && !wrong.empty()) *why = std::move(wrong);
  return done;
}

status endpoint::wait_peer(duration timeout) {
  const status mine = usable();
  return mine ? state_->wait_peer(timeout) : mine;
}
std::uint32_t endpoint::peers() const noexcept { return usable() ? state_->peers() : 0; }
std::vector<peer> endpoint::connections() const {
  return usable() ? state_->connections() : std::vector<peer>{};
}
identity_name endpoint::identity_of(connection of) const noexcept {
  return usable() ? state_->identity_of(of) : identity_name{};
}
std::uint16_t endpoint::port() const noexcept { return usable() ? state_->port() : std::uint16_t{0}; }
int endpoint::wake_descriptor() const noexcept { return usable() ? state_->wake_descriptor() : -1; }
std::optional<event> endpoint::try_event() noexcept { return usable() ? state_->try_event() : std::nullopt; }
std::vector<count> endpoint::counts() const { return usable() ? state_->counts() : std::vector<count>{}; }
const rt::grants& endpoint::service_grants() const noexcept {
  static constexpr rt::grants of_none{};
  return usable() ? state_->service_grants() : of_none;
}
bool endpoint::memory_locked() const noexcept { return usable() && state_->memory_locked(); }
std::size_t endpoint::memory_unlocked_bytes() const noexcept {
  return usable() ? state_->memory_unlocked_bytes() : 0;
}
status endpoint::close(duration drain) {
  const status mine = usable();
  return mine ? state_->close(drain) : mine;
}

} // namespace rowe
