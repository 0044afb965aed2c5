// SPDX-License-Identifier: Apache-2.0
// Responders in C, of text and of structs. A request lies in the struct of the C program; the call that is to
// be answered, and the slot that is reserved for its answer, are inside.
#include <rowe/service.h>

#include <cstring>
#include <new>
#include <type_traits>

#include <rowe/detail/responding.hpp>

#include "capi/error.hpp"
#include "capi/handles.hpp"
#include "capi/outside.hpp"
#include "capi/service_requests.hpp"

using namespace rowe::capi;
using rowe::errc;
namespace detail = rowe::detail;

namespace {

// A call that a C program holds. Its text's slot is held until it is answered; that of a struct is released
// once the struct was copied.
class held_call : public detail::open_request {
 public:
  held_call(detail::queue_pair& on, detail::request_slots both, bool holds_text) noexcept
      : open_request{on, both, holds_text} {}
  using open_request::answer;
  using open_request::refuse;
};

// Whether there is a call stands in the last word, so that a request of zeroes has none.
constexpr std::size_t call_words = std::extent_v<decltype(rowe_request::reserved)> - 1;
static_assert(sizeof(held_call) <= call_words * sizeof(std::uint64_t) &&
              alignof(held_call) <= alignof(std::uint64_t));

held_call& call_of(rowe_request& request) noexcept {
  return *std::launder(reinterpret_cast<held_call*>(request.reserved));
}
bool has_call(const rowe_request* request) noexcept {
  return request != nullptr && request->reserved[call_words] != 0;
}

void release(rowe_request& request) noexcept {
  call_of(request).~held_call();
  request = {};
}

// Takes the next call; `copy` takes what a struct's slot holds, and is null for text.
rowe::status next(const detail::pair_handle& pair, rowe::time_point now, void* copy, std::size_t bytes,
                  rowe_request& into) noexcept {
  const auto both = detail::next_request(pair, now);
  if (!both) return both.error();
  const detail::pair_slots& in = pair->user.in.memory;
  const detail::value_header header = *in.header(both->in);
  into = {};
  if (copy != nullptr) {
    std::memcpy(copy, in.value(both->in), bytes);
  } else {
    into.text = reinterpret_cast<const char*>(in.value(both->in));
    into.bytes = header.bytes;
  }
  into.arrived_ns = header.stamped_ns;
  into.expires_ns = header.expires_ns;
  into.from = {header.peer.index, header.peer.generation};
  new (into.reserved) held_call{*pair, *both, copy == nullptr};
  into.reserved[call_words] = 1;
  return {};
}

// The same; waits for one.
rowe::status wait_next(const detail::pair_handle& pair, long timeout_ms, void* copy, std::size_t bytes,
                       rowe_request& into) noexcept {
  return detail::wait_next(pair, duration_of(timeout_ms),
                           [&] { return next(pair, rowe::rt::monotonic_clock::now(), copy, bytes, into); });
}

// Ends a call by `answer(call)`, unless it can be answered still.
template <class Answer>
int end(rowe_request* request, Answer&& answer) noexcept {
  if (!has_call(request)) return rowe_error_misuse;
  const rowe::status answered = answer(call_of(*request));
  const bool still_open = !answered && (answered.code() == errc::misuse || answered.code() == errc::too_big);
  if (!still_open) release(*request);
  return number_of(answered);
}

int refuse(const detail::pair_handle& by, rowe_request* request, const char* diagnostic,
           int64_t now_ns) noexcept {
  if (diagnostic == nullptr) return rowe_error_misuse;
  const std::string_view shown{diagnostic, ::strnlen(diagnostic, detail::diagnostic_bytes_max)};
  return end(request, [&](held_call& call) { return call.refuse(by, shown, time_of(now_ns)); });
}

} // namespace

void rowe_request_release(struct rowe_request* request) {
  if (has_call(request)) release(*request);
}

// ---- text

struct rowe_responder* rowe_responder_open(const struct rowe_endpoint* endpoint, const char* name,
                                           const struct rowe_service_options* options) {
  if (endpoint == nullptr || name == nullptr) return no(errc::misuse);
  return opened<rowe_responder>(endpoint, options, [&](rowe::endpoint& on, const rowe::service_options& o) {
    return detail::pair_opener::open(on, detail::serve_request<rowe::json_text, rowe::json_text>(name, o));
  });
}
void rowe_responder_free(struct rowe_responder* responder) { delete responder; }

int rowe_responder_try_next(struct rowe_responder* responder, int64_t now_ns, struct rowe_request* into) {
  if (responder == nullptr || into == nullptr) return rowe_error_misuse;
  return number_of(next(responder->pair, time_of(now_ns), nullptr, 0, *into));
}

int rowe_responder_next(struct rowe_responder* responder, long timeout_ms, struct rowe_request* into) {
  if (responder == nullptr || into == nullptr) return rowe_error_misuse;
  return number_of(wait_next(responder->pair, timeout_ms, nullptr, 0, *into));
}

int rowe_responder_reply(struct rowe_responder* responder, struct rowe_request* request, const char* text,
                         size_t bytes, int64_t now_ns) {
  if (responder == nullptr || text == nullptr) return rowe_error_misuse;
  return end(request, [&](held_call& call) {
    return call.answer(responder->pair, rowe::body{std::string_view{text, bytes}}, time_of(now_ns));
  });
}

int rowe_responder_refuse(struct rowe_responder* responder, struct rowe_request* request,
                          const char* diagnostic, int64_t now_ns) {
  if (responder == nullptr) return rowe_error_misuse;
  return refuse(responder->pair, request, diagnostic, now_ns);
}

// ---- structs

struct rowe_struct_responder* rowe_struct_responder_open(const struct rowe_endpoint* endpoint,
                                                         const char* name, const struct rowe_struct* request,
                                                         const struct rowe_struct* answer,
                                                         const struct rowe_service_options* options) {
  return opened_for<rowe_struct_responder>(endpoint, name, request, answer, options, serve_request);
}
void rowe_struct_responder_free(struct rowe_struct_responder* responder) { delete responder; }

int rowe_struct_responder_try_next(struct rowe_struct_responder* responder, int64_t now_ns, void* value,
                                   struct rowe_request* into) {
  if (responder == nullptr || value == nullptr || into == nullptr) return rowe_error_misuse;
  return number_of(next(responder->pair, time_of(now_ns), value, responder->request_bytes, *into));
}

int rowe_struct_responder_next(struct rowe_struct_responder* responder, long timeout_ms, void* value,
                               struct rowe_request* into) {
  if (responder == nullptr || value == nullptr || into == nullptr) return rowe_error_misuse;
  return number_of(wait_next(responder->pair, timeout_ms, value, responder->request_bytes, *into));
}

int rowe_struct_responder_reply(struct rowe_struct_responder* responder, struct rowe_request* request,
                                const void* answer, int64_t now_ns) {
  if (responder == nullptr || answer == nullptr) return rowe_error_misuse;
  return end(request, [&](held_call& call) {
    return call.answer(responder->pair, detail::entry::reply, answer, responder->answer_bytes,
                       time_of(now_ns));
  });
}

int rowe_struct_responder_refuse(struct rowe_struct_responder* responder, struct rowe_request* request,
                                 const char* diagnostic, int64_t now_ns) {
  if (responder == nullptr) return rowe_error_misuse;
  return refuse(responder->pair, request, diagnostic, now_ns);
}
