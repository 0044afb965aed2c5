// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include <rowe/endpoint.hpp>
#include <rowe/rowe.h>

// C's name of an endpoint. Behind the pointer, so that C may call it const everywhere, as the paper does.
struct rowe_endpoint {
  std::unique_ptr<rowe::endpoint> inside;
};

namespace rowe::capi {

// Milliseconds of C as a duration: negative is for ever, and so is what a duration cannot hold.
ROWE_RT inline duration duration_of(long ms) noexcept {
  constexpr long ms_max = rt::for_ever.count() / 1'000'000;
  if (ms < 0 || ms > ms_max) return rt::for_ever;
  return std::chrono::milliseconds{ms};
}

} // namespace rowe::capi
