// SPDX-License-Identifier: Apache-2.0
// Errors on their way to C: the code is returned, and stays with the thread, together with its diagnostic,
// until the next one. Calls of real-time loops return the code only.
#pragma once
#include <new>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <rowe/result.hpp>
#include <rowe/rowe.h>

namespace rowe::capi {

// The number that C knows this error by. Never waits, never allocates.
ROWE_RT int number_of(errc code) noexcept;

ROWE_RT inline int number_of(const status& s) noexcept {
  return s ? static_cast<int>(rowe_ok) : number_of(s.code());
}

// Makes it the thread's last error; returns its number. `more` is said after its diagnostic: what the other
// side gave as its reason.
int fail(const error& reason, std::string_view more = {}) noexcept;
inline int fail(errc code) noexcept { return fail(error{code}); }

// The same for functions that return pointers.
inline std::nullptr_t no(const error& reason, std::string_view more = {}) noexcept {
  fail(reason, more);
  return nullptr;
}
inline std::nullptr_t no(errc code) noexcept { return no(error{code}); }

inline int done(const status& s) noexcept { return s ? static_cast<int>(rowe_ok) : fail(s.error()); }

// What `act` returns; where memory runs out (or a length no memory can have), `otherwise(error)`. Nothing
// else in this room throws.
template <class Act, class Otherwise>
auto with_memory(Act&& act, Otherwise&& otherwise) noexcept -> decltype(act()) {
  try {
    return act();
  } catch (const std::bad_alloc&) {
    return otherwise(error{errc::no_memory});
  } catch (const std::length_error&) {
    return otherwise(error{errc::no_memory});
  }
}
template <class Act>
int code_with_memory(Act&& act) noexcept {
  return with_memory(std::forward<Act>(act), [](const error& reason) { return fail(reason); });
}
template <class Act>
auto pointer_with_memory(Act&& act) noexcept -> decltype(act()) {
  return with_memory(std::forward<Act>(act), [](const error& reason) { return no(reason); });
}

} // namespace rowe::capi
