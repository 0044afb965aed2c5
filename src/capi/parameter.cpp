// SPDX-License-Identifier: Apache-2.0
// Parameters in C: on the heap, the C++ parameter of one of four types inside.
#include <rowe/parameter.h>

#include <cstring>
#include <utility>
#include <variant>

#include "capi/endpoint.hpp"
#include "capi/error.hpp"
#include "capi/handles.hpp"

using namespace rowe::capi;
using rowe::errc;

namespace {

using text = rowe_parameter::text;

template <class T>
rowe_parameter* opened_parameter(const rowe_endpoint* on, const char* name, const T& first,
                                 const rowe::range<T>& allowed = {}) noexcept {
  if (on == nullptr || name == nullptr) return no(errc::misuse);
  return pointer_with_memory([&]() -> rowe_parameter* {
    auto made = on->inside->parameter<T>(name, first, allowed);
    if (!made) return no(made.error());
    return new rowe_parameter{.inside = std::move(*made)};
  });
}

template <class T>
rowe::parameter<T>* of_type(rowe_parameter* given) noexcept {
  return given == nullptr ? nullptr : std::get_if<rowe::parameter<T>>(&given->inside);
}

template <class T>
T get(rowe_parameter* from) noexcept {
  auto* const one = of_type<T>(from);
  return one == nullptr ? T{} : one->get();
}

template <class T>
int set(rowe_parameter* into, const T& value) noexcept {
  auto* const one = of_type<T>(into);
  return one == nullptr ? static_cast<int>(rowe_error_misuse) : number_of(one->set(value));
}

} // namespace

struct rowe_parameter* rowe_parameter_bool(const struct rowe_endpoint* endpoint, const char* name,
                                           bool first) {
  return opened_parameter<bool>(endpoint, name, first);
}

struct rowe_parameter* rowe_parameter_integer(const struct rowe_endpoint* endpoint, const char* name,
                                              int64_t first, int64_t least, int64_t most) {
  return opened_parameter<std::int64_t>(endpoint, name, first, {least, most});
}

struct rowe_parameter* rowe_parameter_double(const struct rowe_endpoint* endpoint, const char* name,
                                             double first, double least, double most) {
  return opened_parameter<double>(endpoint, name, first, {least, most});
}

struct rowe_parameter* rowe_parameter_text(const struct rowe_endpoint* endpoint, const char* name,
                                           const char* first) {
  if (first == nullptr) return no(errc::misuse);
  text begins;
  if (!begins.assign(first))
    return no(rowe::error{errc::too_long, static_cast<std::int64_t>(std::strlen(first)), text::capacity()});
  return opened_parameter<text>(endpoint, name, begins);
}

void rowe_parameter_free(struct rowe_parameter* parameter) { delete parameter; }

bool rowe_parameter_get_bool(struct rowe_parameter* parameter) { return get<bool>(parameter); }
int64_t rowe_parameter_get_integer(struct rowe_parameter* parameter) { return get<std::int64_t>(parameter); }
double rowe_parameter_get_double(struct rowe_parameter* parameter) { return get<double>(parameter); }

const char* rowe_parameter_get_text(struct rowe_parameter* parameter) {
  auto* const one = of_type<text>(parameter);
  if (one == nullptr) return "";
  const std::string_view now = one->get().view();
  parameter->read[now.copy(parameter->read.data(), text::capacity())] = '\0';
  return parameter->read.data();
}

int rowe_parameter_set_bool(struct rowe_parameter* parameter, bool value) { return set(parameter, value); }
int rowe_parameter_set_integer(struct rowe_parameter* parameter, int64_t value) {
  return set<std::int64_t>(parameter, value);
}
int rowe_parameter_set_double(struct rowe_parameter* parameter, double value) {
  return set(parameter, value);
}

int rowe_parameter_set_text(struct rowe_parameter* parameter, const char* value) {
  if (value == nullptr) return rowe_error_misuse;
  text to;
  if (!to.assign(value)) return rowe_error_too_long;
  return set(parameter, to);
}
