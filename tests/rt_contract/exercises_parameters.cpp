// SPDX-License-Identifier: Apache-2.0
// Parameters, in C++ and in C, with a value that comes now and then.
#include <algorithm>
#include <limits>
#include <utility>

#include <rowe/parameter.h>
#include <rowe/parameter.hpp>

#include "capi/handles.hpp"
#include "pairs.hpp"
#include "service/threads/parameter_table.hpp"

namespace rowe::contract {
namespace {

using text = rowe_parameter::text;

template <class T>
struct parameter_harness {
  detail::parameter_cell& cell;
  parameter<T> handle;

  explicit parameter_harness(real_time& rt, const T& first = {}) : cell{rt.make<detail::parameter_cell>()} {
    service::parameter_table::build(cell, detail::parameter_request_of("/x", first, range<T>{}),
                                    rt.make<rt::std_atomics::variable<bool>>(), -1);
    handle = {detail::parameter_handle{nullptr, cell}, first, range<T>{}};
  }
};

// One of each type in C.
struct parameter_in_c {
  detail::parameter_cell& cell;
  rowe_parameter& one;
};
template <class T>
parameter_in_c in_c(real_time& rt) {
  parameter_harness<T> made{rt};
  return {made.cell, rt.make<rowe_parameter>(rowe_parameter{.inside = std::move(made.handle)})};
}

constexpr exercise list[] = {
    {"parameter::get", "with a value that comes now and then",
     [](real_time& rt) {
       parameter_harness<double> on{rt};
       rt.calls([&](std::uint64_t i) {
         if (i % 3 == 0)
           on.cell.service_in->write(detail::parameter_value::of_number(static_cast<double>(i)));
         use(on.handle.get());
       });
     }},
    {"parameter::refresh", "of a text, and of an empty handle",
     [](real_time& rt) {
       parameter_harness<text> on{rt};
       parameter<text> empty;
       rt.calls([&](std::uint64_t i) {
         if (i % 3 == 0) on.cell.service_in->write(detail::parameter_value::of_text("odom"));
         use((i % 5 == 0 ? empty : on.handle).refresh());
       });
     }},
    {"parameter::set", "in range and beyond, and when the endpoint is closed",
     [](real_time& rt) {
       parameter_harness<double> on{rt};
       rt.calls([&](std::uint64_t i) {
         if (i == 50'000) on.cell.closed.store(true, std::memory_order_relaxed);
         use(on.handle.set(i % 3 == 0 ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(i)));
       });
     }},
    {"rowe_parameter_get_bool", "of its type and of another",
     [](real_time& rt) {
       rowe_parameter& one = in_c<bool>(rt).one;
       rowe_parameter& other = in_c<double>(rt).one;
       rt.calls([&](std::uint64_t i) { use(rowe_parameter_get_bool(i % 2 == 0 ? &one : &other)); });
     }},
    {"rowe_parameter_get_integer", "with a value that comes now and then",
     calls_on<in_c<std::int64_t>>([](auto& with, auto i) {
       if (i % 3 == 0)
         with.cell.service_in->write(detail::parameter_value::of_number(static_cast<std::int64_t>(i)));
       use(rowe_parameter_get_integer(i % 5 == 0 ? nullptr : &with.one));
     })},
    {"rowe_parameter_get_double", "with a value that comes now and then",
     calls_on<in_c<double>>([](auto& with, auto i) {
       if (i % 3 == 0)
         with.cell.service_in->write(detail::parameter_value::of_number(static_cast<double>(i)));
       use(rowe_parameter_get_double(i % 5 == 0 ? nullptr : &with.one));
     })},
    {"rowe_parameter_get_text", "with a value that comes now and then",
     calls_on<in_c<text>>([](auto& with, auto i) {
       if (i % 3 == 0) with.cell.service_in->write(detail::parameter_value::of_text("odom"));
       use(rowe_parameter_get_text(i % 5 == 0 ? nullptr : &with.one));
     })},
    {"rowe_parameter_set_bool", "of its type and of none", calls_on<in_c<bool>>([](auto& with, auto i) {
       use(rowe_parameter_set_bool(i % 5 == 0 ? nullptr : &with.one, i % 2 == 0));
     })},
    {"rowe_parameter_set_integer", "of its type and of none",
     calls_on<in_c<std::int64_t>>([](auto& with, auto i) {
       use(rowe_parameter_set_integer(i % 5 == 0 ? nullptr : &with.one, static_cast<std::int64_t>(i)));
     })},
    {"rowe_parameter_set_double", "of its type and of none", calls_on<in_c<double>>([](auto& with, auto i) {
       use(rowe_parameter_set_double(i % 5 == 0 ? nullptr : &with.one, static_cast<double>(i)));
     })},
    {"rowe_parameter_set_text", "of its type, too long, and of none",
     [](real_time& rt) {
       rowe_parameter& one = in_c<text>(rt).one;
       static char longer[200];
       std::fill_n(longer, sizeof longer - 1, 'x');
       rt.calls([&](std::uint64_t i) {
         use(rowe_parameter_set_text(i % 5 == 0 ? nullptr : &one, i % 3 == 0 ? longer : "odom"));
       });
     }},
};

} // namespace

std::span<const exercise> exercises_of_parameters() { return list; }

} // namespace rowe::contract
