// SPDX-License-Identifier: Apache-2.0
// What C programs want of handles, as C++ says it, and how handles are opened. Set-up.
#pragma once
#include <utility>

#include <rowe/loop.h>
#include <rowe/options.hpp>
#include <rowe/result.hpp>
#include <rowe/service.h>

#include "capi/endpoint.hpp"
#include "capi/error.hpp"
#include "capi/outside.hpp"

namespace rowe::capi {

// Errors: bad_argument (a priority that is none).
result<lane_options> options_of(const rowe_lane_options& given);
result<topic_options> options_of(const rowe_topic_options& given);
result<latch_options> options_of(const rowe_latch_options& given);
result<service_options> options_of(const rowe_service_options& given);

// Opens a handle by `open(endpoint&, options)` and puts it on the heap as C's `Handle`.
template <class Handle, class Options, class Open>
Handle* opened(const rowe_endpoint* on, const Options* given, Open&& open) noexcept {
  return pointer_with_memory([&]() -> Handle* {
    const auto options = whole(given);
    if (!options) return no(options.error());
    const auto converted = options_of(*options);
    if (!converted) return no(converted.error());
    auto handle = open(*on->inside, *converted);
    if (!handle) return no(handle.error());
    return new Handle{std::move(*handle)};
  });
}

} // namespace rowe::capi
