// SPDX-License-Identifier: Apache-2.0
// The queue pairs of services whose structs only run time knows, as detail::serve_request() and
// client_request() ask for those of types; and how their handles are opened. Set-up.
#pragma once
#include <algorithm>
#include <string>
#include <utility>

#include <rowe/detail/pair_request.hpp>
#include <rowe/service.h>

#include "capi/handle_options.hpp"
#include "capi/struct_payload.hpp"

namespace rowe::capi {

struct service_types {
  const schema_description& request;
  const schema_description& answer;

  // Of a slot; a refusal's diagnostic must fit, too.
  std::size_t answer_bytes() const noexcept { return std::max(answer.bytes, detail::diagnostic_bytes_max); }
  std::uint32_t depth(const service_options& options) const noexcept {
    return detail::of_services.or_asked(options.depth, std::max(request.bytes, answer_bytes()));
  }
};

inline detail::pair_request serve_request(const char* name, const service_options& options,
                                          const service_types& of) noexcept {
  const std::uint32_t depth = of.depth(options);
  return {.kind = detail::pair_kind::respond_value,
          .name = name,
          .type = options.type,
          .replaces_own = options.replaces_own,
          .out_depth = 2 * depth, // on their way, and reserved
          .in_depth = depth,
          .out_bytes = of.answer_bytes(),
          .in_bytes = of.request.bytes,
          .encoded = &of.answer,
          .decoded = &of.request};
}

inline detail::pair_request client_request(const char* name, const service_options& options,
                                           const service_types& of) noexcept {
  const std::uint32_t depth = of.depth(options);
  return {.kind = detail::pair_kind::call_value,
          .name = name,
          .type = options.type,
          .out_depth = depth,
          .completions_depth = depth,
          .out_bytes = of.request.bytes,
          .completions_bytes = of.answer_bytes(),
          .encoded = &of.request,
          .decoded = &of.answer};
}

// Opens the queue pair that `request_of(name, options, types)` asks for, as C's `Handle`, which has the pair
// and the bytes of both structs.
template <class Handle, class Request>
Handle* opened_for(const rowe_endpoint* on, const char* name, const rowe_struct* request,
                   const rowe_struct* answer, const rowe_service_options* options,
                   Request&& request_of) noexcept {
  if (on == nullptr || name == nullptr || request == nullptr || answer == nullptr) return no(errc::misuse);
  return pointer_with_memory([&]() -> Handle* {
    std::string why;
    const auto asked = on->structs->describe(*request, why);
    if (!asked) return no(asked.error(), why);
    const auto answered = on->structs->describe(*answer, why);
    if (!answered) return no(answered.error(), why);
    const service_types types{**asked, **answered};
    return opened<Handle>(on, options, [&](endpoint& by, const service_options& o) -> result<Handle> {
      auto pair = detail::pair_opener::open(by, request_of(name, o, types));
      if (!pair) return pair.error();
      return Handle{std::move(*pair), types.request.bytes, types.answer.bytes};
    });
  });
}

} // namespace rowe::capi
