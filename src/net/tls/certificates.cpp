// SPDX-License-Identifier: Apache-2.0
#include "net/tls/certificates.hpp"

#include <algorithm>
#include <utility>

#include "access/files.hpp"

namespace rowe::net::tls {

certificates::certificates(end ours, tls_options options, std::shared_ptr<const context> first)
    : ours_{ours}, options_{std::move(options)}, current_{std::move(first)}, seen_{versions()} {}

certificates::file_versions certificates::versions() const noexcept {
  return {access::version_of(options_.certificate), access::version_of(options_.key),
          access::version_of(ours_ == end::client ? options_.ca : options_.client_ca)};
}

// Whoever replaces both files may be between the two: then they do not belong together. And what cannot be
// read now, because no descriptor is left, can be read later, without any change.
std::optional<file_fault> certificates::look() {
  const auto now = versions();
  if (now == seen_) return std::nullopt;
  file_fault why;
  if (auto next = context::open(ours_, options_, &why)) {
    current_ = std::move(next);
    seen_ = now;
    reported_ = {};
    return std::nullopt;
  }
  if (std::exchange(reported_for_, now) == now && why.file == reported_.file && why.what == reported_.what)
    return std::nullopt;
  reported_ = why;
  return why;
}

int certificates::days_left(std::time_t now) {
  constexpr std::time_t day = 24 * 60 * 60;
  const std::time_t end = current_->ends_at();
  if (end == 0) return -1;
  const auto days = static_cast<int>(std::max<std::time_t>(0, (end - now) / day));
  if (days > warned_days || (said_for_ == end && said_days_ == days)) return -1;
  said_for_ = end;
  said_days_ = days;
  return days;
}

} // namespace rowe::net::tls
