// SPDX-License-Identifier: Apache-2.0
#include "config/keys.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <utility>

#include "config/rows.hpp"
#include "service/base/limit_table.hpp"

namespace rowe::config {
namespace {

using namespace std::chrono_literals;

// ---- the rows

// In the order of their enums.
constexpr std::array<std::string_view, 4> idle_words{"poll", "spin", "wake", "phase"};
static_assert(static_cast<std::size_t>(idle::phase) + 1 == idle_words.size());
constexpr std::array<std::string_view, 3> profile_words{"standard", "hop", "hop_2014"};
static_assert(static_cast<std::size_t>(websocket_profile::hop_2014) + 1 == profile_words.size());

constexpr std::int64_t day = ns(24h);

template <auto Member>
consteval key<configuration> of_endpoint(const facts& of) noexcept {
  return row<configuration, Member>("endpoint", of);
}
using options = endpoint_options;
constexpr std::array endpoint_rows{
    of_endpoint<&options::name>(named("name", "--name", "shown to peers; empty: the host's name")),
    of_endpoint<&options::address>(
        named("address", "--address",
              "numeric; beyond loopback only with a certificate and identities, or `insecure`")),
    of_endpoint<&options::port>(
        named("port", "--port", "TCP port; 0 takes any free one").within(0, 65535, argument::port)),
    of_endpoint<&options::page>(named("page", "--page", "serve the page at /")),
    of_endpoint<&options::web>(
        named("web", "--web", "serve the files of this folder, before the page's").path()),
    of_endpoint<&options::insecure>(
        named("insecure", "--insecure", "whoever reaches the port may read and publish everything")),
    of_endpoint<&options::allow_origins>(
        named("allow_origins", "--allow-origin", "pages of these origins may connect, http://HOST[:PORT]")),
    of_endpoint<&options::allow_hosts>(
        named("allow_hosts", "--allow-host", "host names to answer to, besides localhost")),
    of_endpoint<&options::relay>(
        named("relay", "--relay", "a hub: what one peer publishes reaches every peer that subscribed")),
    of_endpoint<&options::profile>(
        named("profile", "--profile",
              "the kind of WebSocket of the peers: hop and hop_2014 are for Hop programs")
            .one_of(profile_words, argument::profile)),
    of_endpoint<&options::idle_policy>(
        named("idle", "--idle", "how the service thread waits").one_of(idle_words, argument::idle_policy)),
    of_endpoint<&options::poll_period>(
        named("poll_period", "--poll-period", "the period of idle poll and phase")
            .within(ns(50us), ns(10ms), argument::poll_period)),
    of_endpoint<&options::service_cpu>(named("cpu", "--cpu", "pin the service thread to this core; -1: any")
                                           .within(-1, 4095, argument::service_cpu)),
    of_endpoint<&options::service_priority>(
        named("priority", "--priority", "SCHED_FIFO priority of the service thread; 0: an ordinary one")
            .within(0, 99, argument::service_priority)),
    of_endpoint<&options::ping_period>(
        named("ping_period", "--ping-period", "a peer that is silent this long is pinged")
            .within(ns(10ms), day, argument::ping_period)),
    of_endpoint<&options::silence_max>(
        named("silence_max", "--silence-max", "a peer that is silent this long is disconnected")
            .within(ns(10ms), day, argument::silence_max)
            .bounded_by("ping_period or more")),
    of_endpoint<&options::message_time_max>(named("message_time_max", "--message-time-max",
                                                  "the longest time from a message's first byte to its last")
                                                .within(ns(10ms), day, argument::message_time_max)),
    of_endpoint<&options::stats_period>(
        named("stats_period", "--stats-period", "the period of the topic /rowe/stats")
            .within(ns(100ms), day, argument::stats_period)),
    of_endpoint<&options::inbound_ttl>(
        named("inbound_ttl", "--inbound-ttl",
              "a plain message or call that is not taken within this time ends")
            .within(ns(1ms), for_ever_ns, argument::inbound_ttl)),
    of_endpoint<&options::call_timeout>(
        named("call_timeout", "--call-timeout", "the timeout of a peer's call that has none")
            .within(ns(1ms), for_ever_ns, argument::call_timeout)),
    of_endpoint<&options::plain_unasked>(
        named("plain_unasked", "--plain-unasked",
              "plain messages also go to peers that never used the plain codec")),
    of_endpoint<&options::answers_any>(named(
        "answers_any", "--answers-any", "calls that no handle serves wait for the program to receive them")),
    of_endpoint<&options::retry_min>(
        named("retry_min", "--retry-min", "the time until a client's second attempt to connect")
            .within(ns(1ms), day, argument::retry_min)),
    of_endpoint<&options::retry_max>(
        named("retry_max", "--retry-max", "the longest time between its later attempts")
            .within(ns(1ms), day, argument::retry_max)
            .bounded_by("retry_min or more")),
};

template <auto Member>
consteval key<configuration> of_stop(const facts& of) noexcept {
  return row<configuration, Member>("stop", of);
}
constexpr std::array stop_rows{
    of_stop<&stop_options::guard_timeout>(
        named("guard_timeout", "--stop-guard-timeout", "a guard that is silent for this long stops the robot")
            .within(ns(20ms), ns(60s), argument::guard_timeout)),
    of_stop<&stop_options::tick>(
        named("tick", "--stop-tick", "how often guards get the state, with a new tick")
            .within(ns(1ms), ns(30s), argument::tick)
            .bounded_by("half of guard_timeout at most")),
    of_stop<&stop_options::service_timeout>(
        named("service_timeout", "--stop-service-timeout",
              "loops stop when the service thread is silent for this long; "
              "0: 50 ms if it was granted its priority, else 250 ms")
            .within(0, ns(10s), argument::service_timeout)
            .bounded_by("2 ms or more, or 0")),
    of_stop<&stop_options::observe_timeout>(
        named("observe_timeout", "--stop-observe-timeout", "a stop is answered within this time")
            .within(ns(1ms), ns(10s), argument::observe_timeout)),
    of_stop<&stop_options::unguarded>(
        named("unguarded", "--stop-unguarded", "the robot may move without any guard")),
};

constexpr std::array access_rows{
    row<configuration, &access_options::local_role>(
        "access", named("local_role", "--access-local-role",
                        "the role of peers on this machine that show no token; empty: none")),
    row<configuration, &access_options::anonymous_may_stop>(
        "access", named("anonymous_may_stop", "--access-anonymous-may-stop",
                        "peers without a token may connect to stop the robot")),
};

constexpr std::array tls_rows{
    row<configuration, &tls_options::certificate>(
        "tls", named("certificate", "--certificate",
                     "speak TLS alone (https, wss), with this certificate in PEM; with `key`. An endpoint "
                     "that connects shows it to the server")
                   .path()),
    row<configuration, &tls_options::key>(
        "tls", named("key", "--key", "the certificate's key in PEM, which only its owner can read").path()),
    row<configuration, &tls_options::client_ca>(
        "tls",
        named("client_ca", "--client-ca",
              "roots in PEM: clients may show a certificate that one of them signed, in place of a token")
            .path()),
};

template <auto Member>
consteval key<configuration> of_client(const facts& of) noexcept {
  return row<configuration, Member>("client", of);
}
constexpr std::array client_rows{
    of_client<&options::token_file>(
        named("token_file", "", "its first line is the client's token; only its owner can read it").path()),
    of_client<&tls_options::ca>(
        named("ca", "", "the roots that may vouch for a wss:// server, in PEM; empty: those of the system")
            .path()),
    of_client<&tls_options::pin>(named("pin", "",
                                       "the SHA-256 of the server's public key, 64 hexadecimal digits, "
                                       "colons or none between them; empty: any")),
};

constexpr std::array<std::string_view, 2> log_words{"text", "json"};
static_assert(static_cast<std::size_t>(log_format::json) + 1 == log_words.size());
constexpr std::array serve_rows{
    row<configuration, &serve_options::demo>(
        "serve",
        named("demo", "--demo", "drive a simulated robot at 1 kHz: topic /odom, service /robot/set_speed")),
    row<configuration, &serve_options::guarded>(
        "serve", named("guarded", "--guarded",
                       "the demo's robot stays stopped until a page guards it and resets its stop")),
    row<configuration, &serve_options::log>(
        "serve", named("log", "--log", "the form of the lines of the log").one_of(log_words)),
    row<configuration, &serve_options::quiet>("serve",
                                              named("quiet", "--quiet", "print errors and warnings only")),
};

constexpr std::array<std::string_view, 3> packing_words{"none", "lz4", "zstd"};
static_assert(static_cast<std::size_t>(compression::zstd) + 1 == packing_words.size());
constexpr std::int64_t file_bytes_most = std::int64_t{1} << 50;
template <auto Member>
consteval key<configuration> of_record(const facts& of) noexcept {
  return row<configuration, Member>("record", of);
}
constexpr std::array record_rows{
    of_record<&record_settings::path>(
        named("path", "--record", "record into this file, or into files in this folder (it ends in /)")
            .path()),
    of_record<&record_settings::topics>(
        named("topics", "--record-topic", "only these topics, or patterns; none: all")),
    of_record<&record_settings::exclude>(named("exclude", "--record-exclude", "but not these")),
    of_record<&record_settings::packed>(
        named("compression", "--record-compression", "of the files").one_of(packing_words)),
    of_record<&record_settings::split_bytes>(
        named("split_size", "--record-split-size",
              "a file that has as much ends, and the next begins; 0: never")
            .bytes(0, file_bytes_most)),
    of_record<&record_settings::split_time>(
        named("split_time", "--record-split-time", "likewise, when it is as old; 0: never")
            .within(0, 366 * day, argument::unnamed)),
    of_record<&record_settings::total_bytes>(
        named("total", "--record-total", "of all files: the oldest ones are deleted; 0: no limit")
            .bytes(0, file_bytes_most)
            .bounded_by("1 MiB or more, or 0")),
    of_record<&record_settings::sync>(
        named("sync", "--record-sync", "wait for the disk after each chunk: for when the power may fail")),
};
template <auto Member>
consteval key<configuration> of_black_box(const facts& of) noexcept {
  return row<configuration, Member>("black_box", of);
}
constexpr std::array black_box_rows{
    of_black_box<&black_box_settings::path>(
        named("path", "--black-box", "the folder for what led to a stop; empty: there is no black box")
            .path()),
    of_black_box<&black_box_settings::topics>(
        named("topics", "--black-box-topic", "only these topics, or patterns; none: all")),
    of_black_box<&black_box_settings::exclude>(named("exclude", "--black-box-exclude", "but not these")),
    of_black_box<&black_box_settings::packed>(
        named("compression", "--black-box-compression", "of the memory and the files").one_of(packing_words)),
    of_black_box<&black_box_settings::before>(
        named("before", "--black-box-before", "how far back a file goes")
            .within(ns(1s), ns(1h), argument::unnamed)),
    of_black_box<&black_box_settings::after>(
        named("after", "--black-box-after", "how long it goes on").within(0, ns(1min), argument::unnamed)),
    of_black_box<&black_box_settings::bytes>(
        named("memory", "--black-box-memory", "that it takes at most, compressed")
            .bytes(1 << 20, std::int64_t{1} << 40)),
    of_black_box<&black_box_settings::files_max>(
        named("files_max", "--black-box-files", "of each cause: the oldest ones are deleted")
            .within(1, 100'000, argument::unnamed)),
    of_black_box<&black_box_settings::on_stop>(
        named("on_stop", "--black-box-on-stop", "write when the robot is stopped")),
    of_black_box<&black_box_settings::on_lease>(
        named("on_lease", "--black-box-on-lease", "write when who drives falls silent")),
};

template <std::size_t Index>
consteval key<configuration> limit_row() noexcept {
  constexpr const service::limit_row& of = service::limit_table[Index];
  return {
      .section = "limits",
      .name = name_of(of.which),
      .what = {kind::integer, static_cast<std::int64_t>(of.least), static_cast<std::int64_t>(of.most), {}},
      .get = [](const configuration& all) -> value {
        return static_cast<std::int64_t>(service::limit_table[Index].of(all.endpoint.limits));
      },
      .set =
          [](configuration& all, value&& to) {
            const auto number = static_cast<std::uint64_t>(std::get<std::int64_t>(to));
            service::limit_table[Index].set(all.endpoint.limits, number);
          },
      .number = [](const endpoint_options& all) noexcept -> std::int64_t {
        return static_cast<std::int64_t>(service::limit_table[Index].of(all.limits));
      },
      .which = of.which,
      .bounded_by =
          of.which == argument::small_slot_bytes ? "message_bytes_max at most" : std::string_view{}};
}
template <std::size_t... Index>
consteval auto limit_rows_of(std::index_sequence<Index...>) noexcept {
  return std::array{limit_row<Index>()...};
}
constexpr auto limit_rows = limit_rows_of(std::make_index_sequence<service::limit_table.size()>{});

constexpr std::array of_roles{
    row<role, &role::name>("role", named("name")),
    row<role, &role::subscribe>("role", named("subscribe", "", "topics")),
    row<role, &role::publish>("role", named("publish", "", "topics")),
    row<role, &role::advertise>("role", named("advertise", "", "topics")),
    row<role, &role::call>("role", named("call", "", "services")),
    row<role, &role::provide>("role", named("provide", "", "services")),
    row<role, &role::set>("role", named("set", "", "parameters")),
    row<role, &role::reset>("role", named("reset", "", "the stop")),
    row<role, &role::guard>("role", named("guard", "", "be a guard of the stop")),
    row<role, &role::take_over>("role", named("take_over", "", "take control from who drives")),
};

constexpr std::array of_identities{
    row<identity, &identity::name>("identity", named("name")),
    row<identity, &identity::role>("identity", named("role")),
    row<identity, &identity::token_sha256>(
        "identity", named("token_sha256", "", "the token's hash, 64 hexadecimal digits")),
    row<identity, &identity::token_in_url>("identity",
                                           named("token_in_url", "", "the token may also come as `?token=`")),
    row<identity, &identity::certificate>(
        "identity", named("certificate", "", "the common name in the certificate of a client (`client_ca`)")),
};

template <std::size_t... Sizes>
consteval auto joined(const std::array<key<configuration>, Sizes>&... parts) noexcept {
  std::array<key<configuration>, (Sizes + ...)> all{};
  std::size_t at = 0;
  ((std::copy(parts.begin(), parts.end(),
              all.begin() + static_cast<std::ptrdiff_t>(std::exchange(at, at + Sizes)))),
   ...);
  return all;
}
constexpr auto all_rows = joined(endpoint_rows, tls_rows, client_rows, stop_rows, access_rows, limit_rows,
                                 record_rows, black_box_rows, serve_rows);

// ---- none is missing: a struct has as many members as it can be initialised with

template <class Struct, std::size_t... Index>
consteval bool takes(std::index_sequence<Index...>) noexcept {
  return requires { Struct{(static_cast<void>(Index), service::anything{})...}; };
}
template <class Struct>
consteval bool has_members(std::size_t count) noexcept {
  constexpr std::size_t most = 48;
  std::size_t found = 0;
  [&]<std::size_t... Count>(std::index_sequence<Count...>) {
    ((found = takes<Struct>(std::make_index_sequence<Count>{}) ? Count : found), ...);
  }
  (std::make_index_sequence<most>{});
  return found == count;
}
constexpr std::size_t sections_of_endpoint = 4;    // limits, stop, access and tls
constexpr std::size_t endpoint_keys_of_client = 1; // token_file, a key of [client]
constexpr std::size_t members_without_key = 1;     // token: it is a secret, and a configuration none
constexpr std::size_t lists_of_access = 2;         // [[role]] and [[identity]]
static_assert(has_members<endpoint_options>(endpoint_rows.size() + endpoint_keys_of_client +
                                            sections_of_endpoint + members_without_key),
              "each option has its key");
static_assert(has_members<tls_options>(tls_rows.size() + client_rows.size() - endpoint_keys_of_client),
              "each option of TLS has its key");
static_assert(has_members<stop_options>(stop_rows.size()), "each option of the stop has its key");
static_assert(has_members<access_options>(access_rows.size() + lists_of_access),
              "each option of access has its key");
static_assert(has_members<record_settings>(record_rows.size()), "each option of recordings has its key");
static_assert(has_members<black_box_settings>(black_box_rows.size()),
              "each option of black boxes has its key");
static_assert(has_members<serve_options>(serve_rows.size()), "each option of the program has its key");
static_assert(has_members<role>(of_roles.size()), "each right has its key");
static_assert(has_members<identity>(of_identities.size()), "each member has its key");

} // namespace

std::span<const key<configuration>> keys() noexcept { return all_rows; }
std::span<const key<role>> role_keys() noexcept { return of_roles; }
std::span<const key<identity>> identity_keys() noexcept { return of_identities; }

std::size_t find(std::string_view section, std::string_view name) noexcept {
  const auto* const found = std::ranges::find_if(
      all_rows, [&](const key<configuration>& one) { return one.section == section && one.name == name; });
  return static_cast<std::size_t>(found - all_rows.data());
}

std::size_t find(argument which) noexcept {
  if (which == argument::unnamed) return all_rows.size();
  const auto* const found = std::ranges::find(all_rows, which, &key<configuration>::which);
  return static_cast<std::size_t>(found - all_rows.data());
}

} // namespace rowe::config
