// SPDX-License-Identifier: Apache-2.0
#include "stop_ways.hpp"

#include <algorithm>
#include <utility>

#include "../interrupt.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view stop_path = "/rowe/stop";
constexpr std::uint32_t stops_max = 4;    // one that timed out here keeps its place until its end is known
constexpr rt::duration look_period = 1ms; // at one connection while another is waited for
constexpr rt::duration unhurried = 200ms; // who waits longer is told
constexpr rt::duration kept_retry_min = 20ms; // the places that are kept change hands quickly
constexpr rt::duration kept_retry_max = 100ms;

endpoint_options ordinary_options(endpoint_options options) {
  options.poll_period = 50us; // the least: this process lives for moments
  return options;
}

endpoint_options kept_options(const endpoint_options& shared) {
  endpoint_options options = ordinary_options(shared);
  options.limits.connections_max = 1;
  options.retry_min = kept_retry_min;
  options.retry_max = kept_retry_max;
  return options;
}

} // namespace

std::string stop_url(const std::string& url) {
  constexpr std::string_view scheme = "ws://";
  const std::size_t at = std::min(url.find('/', scheme.size()), url.size());
  const std::size_t end = std::min(url.find('?', at), url.size());
  std::string path = url.substr(at, end - at);
  while (path.ends_with('/')) path.pop_back();
  if (path.ends_with(stop_path)) return {};
  return joined(url.substr(0, at), path, stop_path, url.substr(end));
}

stop_way::stop_way(endpoint via, const std::string& url, const console& to)
    : hub{std::move(via)}, connection{hub, url, to}, waits{connection} {}

bool stop_way::open(bool named, const console& to) {
  const auto client = [&](std::optional<service>& into, std::string_view name, std::uint32_t calls,
                          std::uint32_t bytes) {
    auto made = hub.client<json_text, json_text>(name, {.depth = calls, .text_bytes_max = bytes});
    if (made) {
      into.emplace(std::move(*made));
    } else {
      to.error("cannot ask ", connection.url(), ": ", made.error().message());
    }
    return into.has_value();
  };
  return client(stopping, "/rowe/stop", stops_max, text_bytes_max) &&
         client(stating, "/rowe/stop/state", 1, text_bytes_max) &&
         (!named || client(stats, "/rowe/stats", 1, limits{}.message_bytes_max));
}

std::optional<exit_code> stop_ways::open() {
  auto hub = endpoint::connect(url_, ordinary_options(shared_));
  if (!hub) return cannot_open(url_, hub.error(), to_);
  ordinary_ = std::make_unique<stop_way>(std::move(hub).value(), url_, to_);
  if (!ordinary_->open(true, to_)) return exit_code::failed;
  chosen_ = ordinary_.get();
  return std::nullopt;
}

// False where there is none, or it cannot be had: the ordinary way goes on.
bool stop_ways::open_kept() {
  const std::string url = stop_url(url_);
  if (url.empty()) return false;
  auto hub = endpoint::connect(url, kept_options(shared_));
  if (!hub) return false;
  kept_ = std::make_unique<stop_way>(std::move(hub).value(), url, silent_);
  if (kept_->open(false, silent_)) return true;
  kept_.reset();
  return false;
}

std::optional<exit_code> stop_ways::connect(rt::duration timeout) {
  const auto begin = rt::monotonic_clock::now();
  const auto end = rt::deadline_after(begin, timeout);
  bool tried = kept_ != nullptr;
  bool told = false;
  for (;;) {
    const auto now = rt::monotonic_clock::now();
    const rt::duration left = end - std::min(now, end);
    const bool connected = ordinary_->hub.wait_peer(std::min(left, look_period)).has_value();
    ordinary_->connection.report();
    if (connected) {
      chosen_ = ordinary_.get();
      return std::nullopt;
    }
    const std::string& why = ordinary_->connection.failure();
    if (!tried && (!why.empty() || now - begin >= hedge)) {
      tried = true;
      (void)open_kept();
    }
    if (kept_ != nullptr) {
      kept_->connection.report();
      if (kept_->hub.peers() != 0) {
        chosen_ = kept_.get();
        const bool reason_reported = ordinary_->connection.failure_reported();
        to_.note("no ordinary connection",
                 reason_reported ? "" : joined(" (", why.empty() ? "no answer" : why, ")"), "; asking on ",
                 kept_->connection.url(), ", where places are reserved for a stop");
        return std::nullopt;
      }
    }
    if (interrupt::seen()) return exit_code::interrupted;
    const bool in_vain = ordinary_->connection.in_vain() && (kept_ == nullptr || kept_->connection.in_vain());
    if (now >= end || in_vain) break;
    if (!told && now - begin >= unhurried) {
      to_.note("waiting for ", url_, " (Ctrl-C to stop)");
      told = true;
    }
  }
  const std::string& why = ordinary_->connection.failure();
  const exit_code end_as = ordinary_->connection.give_up(timeout);
  if (kept_ != nullptr && !kept_->connection.failure().empty() && kept_->connection.failure() != why)
    to_.error("nor to ", kept_->connection.url(), ": ", kept_->connection.failure());
  return end_as;
}

} // namespace rowe::tools
