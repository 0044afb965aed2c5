// SPDX-License-Identifier: Apache-2.0
// Callers in C: of text, the C++ caller; of structs, what that consists of, with bytes in place of a type.
#include <rowe/service.h>

#include <cstring>
#include <utility>

#include "capi/error.hpp"
#include "capi/handles.hpp"
#include "capi/outside.hpp"
#include "capi/service_requests.hpp"
#include "capi/views.hpp"

using namespace rowe::capi;
using rowe::errc;
namespace detail = rowe::detail;

namespace {

// A view as a C string, in the handle's own memory.
const char* c_string(std::string_view from,
                     std::array<char, detail::diagnostic_bytes_max + 1>& into) noexcept {
  into[from.copy(into.data(), into.size() - 1)] = '\0';
  return into.data();
}

// What a completion holds: the answer is copied. Releases its slot.
rowe::status open(rowe_struct_caller& caller, std::uint32_t slot, void* answer) noexcept {
  detail::queue_pair& on = *caller.pair;
  const detail::pair_slots& memory = on.user.completions.memory;
  if (memory.header(slot)->failed) return detail::fail_with(on, slot, caller.refusal);
  std::memcpy(answer, memory.value(slot), caller.answer_bytes);
  detail::release_completion(on, slot);
  return {};
}

rowe::result<rowe::call_id> start(rowe_struct_caller& caller, const void* request, long timeout_ms,
                                  rowe::time_point now) noexcept {
  const detail::value_header header = detail::call_header(now, duration_of(timeout_ms));
  return detail::named(detail::start_call(*caller.pair, header, request, caller.request_bytes));
}

} // namespace

// ---- text

struct rowe_caller* rowe_caller_open(const struct rowe_endpoint* endpoint, const char* name,
                                     const struct rowe_service_options* options) {
  if (endpoint == nullptr || name == nullptr) return no(errc::misuse);
  return opened<rowe_caller>(endpoint, options, [&](rowe::endpoint& on, const rowe::service_options& o) {
    return on.client<rowe::json_text, rowe::json_text>(name, o);
  });
}
void rowe_caller_free(struct rowe_caller* caller) { delete caller; }

int rowe_caller_start(struct rowe_caller* caller, const char* text, size_t bytes, long timeout_ms,
                      int64_t now_ns, struct rowe_call* started) {
  if (caller == nullptr || text == nullptr || started == nullptr) return rowe_error_misuse;
  const auto call =
      caller->inside.start(std::string_view{text, bytes}, duration_of(timeout_ms), time_of(now_ns));
  if (!call) return number_of(call.code());
  *started = {call->index, call->generation};
  return rowe_ok;
}

int rowe_caller_try_finish(struct rowe_caller* caller, struct rowe_call_end* into) {
  if (caller == nullptr || into == nullptr) return rowe_error_misuse;
  auto end = caller->inside.try_finish();
  if (!end) return number_of(end.code());
  into->call = {end->id.index, end->id.generation};
  into->reply = {};
  into->outcome = give(std::move(end->reply), &into->reply);
  return rowe_ok;
}

void rowe_caller_cancel(struct rowe_caller* caller, struct rowe_call call) {
  if (caller != nullptr) caller->inside.cancel({call.index, call.generation});
}

int rowe_caller_call(struct rowe_caller* caller, const char* text, size_t bytes, long timeout_ms,
                     struct rowe_view* reply) {
  if (caller == nullptr || text == nullptr || reply == nullptr) return rowe_error_misuse;
  return give(caller->inside.call(std::string_view{text, bytes}, duration_of(timeout_ms)), reply);
}

const char* rowe_caller_refusal(struct rowe_caller* caller) {
  return caller == nullptr ? "" : c_string(caller->inside.refusal(), caller->refusal);
}

// ---- structs

struct rowe_struct_caller* rowe_struct_caller_open(const struct rowe_endpoint* endpoint, const char* name,
                                                   const struct rowe_struct* request,
                                                   const struct rowe_struct* answer,
                                                   const struct rowe_service_options* options) {
  return opened_for<rowe_struct_caller>(endpoint, name, request, answer, options, client_request);
}
void rowe_struct_caller_free(struct rowe_struct_caller* caller) { delete caller; }

int rowe_struct_caller_start(struct rowe_struct_caller* caller, const void* request, long timeout_ms,
                             int64_t now_ns, struct rowe_call* started) {
  if (caller == nullptr || request == nullptr || started == nullptr) return rowe_error_misuse;
  const auto call = start(*caller, request, timeout_ms, time_of(now_ns));
  if (!call) return number_of(call.code());
  *started = {call->index, call->generation};
  return rowe_ok;
}

int rowe_struct_caller_try_finish(struct rowe_struct_caller* caller, void* answer,
                                  struct rowe_struct_call_end* into) {
  if (caller == nullptr || answer == nullptr || into == nullptr) return rowe_error_misuse;
  const auto slot = detail::next_completion(caller->pair);
  if (!slot) return number_of(slot.code());
  const rowe::call_id id = detail::id_of_completion(*caller->pair, *slot);
  into->call = {id.index, id.generation};
  into->outcome = number_of(open(*caller, *slot, answer));
  return rowe_ok;
}

void rowe_struct_caller_cancel(struct rowe_struct_caller* caller, struct rowe_call call) {
  if (caller != nullptr) detail::cancel(*caller->pair, {call.index, call.generation});
}

int rowe_struct_caller_call(struct rowe_struct_caller* caller, const void* request, long timeout_ms,
                            void* answer) {
  if (caller == nullptr || request == nullptr || answer == nullptr) return rowe_error_misuse;
  const rowe::time_point now = rowe::rt::monotonic_clock::now();
  detail::reclaim_rows(*caller->pair);
  const auto started = start(*caller, request, timeout_ms, now);
  if (!started) return number_of(started.code());
  const auto slot = detail::wait_call(caller->pair, *started, now, duration_of(timeout_ms));
  return slot ? number_of(open(*caller, *slot, answer)) : number_of(slot.code());
}

const char* rowe_struct_caller_refusal(struct rowe_struct_caller* caller) {
  return caller == nullptr ? "" : c_string(caller->refusal.view(), caller->refusal_text);
}
