// SPDX-License-Identifier: Apache-2.0
// Callers, of structs and of texts: calling without waiting.
#include <rowe/caller.hpp>

#include "pairs.hpp"

namespace rowe::contract {
namespace {

constexpr auto timeout = 50ms;

using struct_caller = caller<odometry, odometry>;
using text_caller = caller<json_text, json_text>;

auto structs_in(real_time& rt) {
  return offer<struct_caller>(rt, detail::client_request<odometry, odometry>("/add", service));
}
auto texts_in(real_time& rt) {
  return offer<text_caller>(rt, detail::client_request<json_text, json_text>("/add", service));
}

auto start(struct_caller& c) { return c.start({1, 2, 3, 4, 5}, timeout, now); }
auto start(text_caller& c) { return c.start(text, timeout, now); }

constexpr auto start_each_in_turn = [](auto& with, auto i) {
  use(start(with.handle));
  if (i % (2 * service.depth) != 0) return;
  serve(with.on);
  while (with.handle.try_finish()) {
  }
};

constexpr auto finish_each = [](auto& with, auto i) {
  if (i % 3 == 0) return use(with.handle.try_finish()); // none has ended
  use(start(with.handle));
  serve(with.on, i % 3 == 1 ? status{} : status{errc::refused});
  use(with.handle.try_finish());
};

template <class Caller>
void closed_and_empty(real_time& rt, offered<Caller> with) {
  close(with.on);
  auto& empty = rt.make<Caller>();
  rt.calls([&](std::uint64_t i) {
    Caller& one = i % 2 == 0 ? with.handle : empty;
    use(start(one));
    use(one.try_finish());
  });
}

template <class Caller>
void cancel_each(real_time& rt, offered<Caller> with) {
  auto& empty = rt.make<Caller>();
  rt.calls([&](std::uint64_t i) {
    if (i % 7 == 0) empty.cancel({0, 1});
    if (const auto begun = start(with.handle)) with.handle.cancel(*begun);
    serve(with.on);
    use(with.handle.try_finish());
  });
}

// Nobody finishes any: rows become free because cancelling drops completions that nobody wants.
constexpr auto start_among_cancelled = [](auto& with, auto i) {
  const auto begun = start(with.handle);
  with.handle.cancel(begun ? *begun : call_id{});
  if (i % service.depth == 0) serve(with.on);
};

// Waiting for the last call has parked the completions of the others.
constexpr auto finish_what_was_parked = [](auto& with) {
  call_id last;
  for (std::uint32_t i = 0; i < service.depth; ++i) {
    last = *start(with.handle);
    if (i % 2 == 0) with.handle.cancel(last);
  }
  serve(with.on);
  if (const auto end = detail::take_completion_of(with.on, {last.index, last.generation}))
    detail::release_completion(with.on, *end);
  while (with.handle.try_finish()) {
  }
};

constexpr exercise list[] = {
    {"caller::start", "with structs, until all calls are in flight",
     calls_on<structs_in>(start_each_in_turn)},
    {"caller::start", "with texts, until all calls are in flight", calls_on<texts_in>(start_each_in_turn)},
    {"caller::start", "with structs, among calls that were cancelled",
     calls_on<structs_in>(start_among_cancelled)},
    {"caller::start", "with texts, among calls that were cancelled",
     calls_on<texts_in>(start_among_cancelled)},
    {"caller::start", "with structs, closed and empty",
     [](real_time& rt) { closed_and_empty(rt, structs_in(rt)); }},
    {"caller::start", "with texts, closed and empty",
     [](real_time& rt) { closed_and_empty(rt, texts_in(rt)); }},
    {"caller::try_finish", "with structs", calls_on<structs_in>(finish_each)},
    {"caller::try_finish", "with texts", calls_on<texts_in>(finish_each)},
    {"caller::start", "with texts that are too big",
     [](real_time& rt) {
       auto& calls = texts_in(rt).handle;
       const auto many = rt.array<char>(4 * text_bytes);
       rt.calls([&](std::uint64_t) {
         use(calls.start(std::string_view{many.data(), many.size()}, timeout, now));
       });
     }},
    {"caller::try_finish", "with structs, when completions were parked",
     calls_on<structs_in>(finish_what_was_parked)},
    {"caller::try_finish", "with texts, when completions were parked",
     calls_on<texts_in>(finish_what_was_parked)},
    {"caller::cancel", "of structs", [](real_time& rt) { cancel_each(rt, structs_in(rt)); }},
    {"caller::cancel", "of texts", [](real_time& rt) { cancel_each(rt, texts_in(rt)); }},
    {"caller::cancel", "of calls in flight, when it closed",
     [](real_time& rt) {
       auto with = structs_in(rt);
       const auto begun = start(with.handle);
       close(with.on);
       rt.calls([&](std::uint64_t) {
         with.handle.cancel(*begun);
         use(with.handle.try_finish());
       });
     }},
    {"caller::try_finish", "when the peer is gone, or the time is over",
     calls_on<texts_in>([](auto& with, auto i) {
       use(start(with.handle));
       serve(with.on, i % 2 == 0 ? errc::peer_lost : errc::timed_out);
       use(with.handle.try_finish());
     })},
    {"caller::refusal", "of structs",
     calls_on<structs_in>([](auto& with) { return with.handle.refusal().size(); })},
    {"caller::refusal", "of texts",
     calls_on<texts_in>([](auto& with) { return with.handle.refusal().size(); })},
};

} // namespace

std::span<const exercise> exercises_of_callers() { return list; }

} // namespace rowe::contract
