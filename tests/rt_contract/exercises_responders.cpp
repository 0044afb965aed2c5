// SPDX-License-Identifier: Apache-2.0
// Responders, of structs and of texts, and the requests they hand out.
#include <rowe/responder.hpp>

#include "pairs.hpp"

namespace rowe::contract {
namespace {

using struct_responder = responder<odometry, odometry>;
using text_responder = responder<json_text, json_text>;

auto structs_in(real_time& rt) {
  return offer<struct_responder>(rt, detail::serve_request<odometry, odometry>("/add", service));
}
auto texts_in(real_time& rt) {
  return offer<text_responder>(rt, detail::serve_request<json_text, json_text>("/add", service));
}

// Takes a request if there is one, and answers or drops it.
constexpr auto next_each = [](auto& with, auto i) {
  if (i % 3 != 0) ask(with.on);
  {
    auto request = with.handle.try_next(now);
    if (request && i % 3 == 1) use(with.handle.reply(*request, request->value(), now));
  } // dropped unanswered, if it was not
  serve(with.on);
};

constexpr auto next_by_the_clock = [](auto& with) {
  ask(with.on);
  use(with.handle.try_next());
  serve(with.on);
};

constexpr auto reply_by_the_clock = [](auto& with) {
  ask(with.on);
  auto request = with.handle.try_next(now);
  use(with.handle.reply(*request, request->value()));
  serve(with.on);
};

template <class Responder>
void next_where_there_is_none(real_time& rt, offered<Responder> with) {
  close(with.on);
  auto& empty = rt.make<Responder>();
  rt.calls([&](std::uint64_t i) { use((i % 2 == 0 ? with.handle : empty).try_next(now)); });
}

// Who asked is there, gone, or has given up; each request is answered twice.
constexpr auto reply_each = [](auto& with, auto i) {
  ask(with.on, i % 3 == 0 ? now + 1ns : rt::never, i % 3 == 1 ? somebody_gone : somebody);
  auto request = with.handle.try_next(now);
  use(with.handle.reply(*request, request->value(), now + 1ns));
  use(with.handle.reply(*request, request->value(), now + 1ns));
  serve(with.on);
};

// Likewise.
constexpr auto refuse_each = [](auto& with, auto i) {
  ask(with.on, i % 3 == 0 ? now + 1ns : rt::never, i % 3 == 1 ? somebody_gone : somebody);
  auto request = with.handle.try_next(now);
  use(with.handle.refuse(*request, "no", now + 1ns));
  use(with.handle.refuse(*request, "no", now + 1ns));
  serve(with.on);
};

// The endpoint closes while a request is held.
template <class Answer>
constexpr auto when_closed(Answer) {
  return [](auto& with) {
    ask(with.on);
    {
      auto request = with.handle.try_next(now);
      close(with.on);
      Answer{}(with.handle, *request);
    }
    with.on.audience.set(audience::somebody);
    serve(with.on);
  };
}
constexpr auto reply_when_closed =
    when_closed([](auto& by, auto& to) { use(by.reply(to, to.value(), now)); });
constexpr auto refuse_when_closed = when_closed([](auto& by, auto& to) { use(by.refuse(to, "no", now)); });
constexpr auto drop_when_closed = when_closed([](auto&, auto&) {});

// Those who asked have all given up.
constexpr auto next_of_what_is_too_late = [](auto& with) {
  for (std::uint32_t i = 0; i < service.depth; ++i) ask(with.on, now);
  use(with.handle.try_next(now));
};

constexpr auto refuse_by_the_clock = [](auto& with) {
  ask(with.on);
  auto request = with.handle.try_next(now);
  use(with.handle.refuse(*request, "no"));
  serve(with.on);
};

template <class Read>
void read_a_request(real_time& rt, Read read) {
  auto with = structs_in(rt);
  ask(with.on);
  const auto request = with.handle.try_next(now);
  rt.calls([&](std::uint64_t) { use(read(*request)); });
}

constexpr exercise list[] = {
    {"responder::try_next", "of structs", calls_on<structs_in>(next_each)},
    {"responder::try_next", "of texts", calls_on<texts_in>(next_each)},
    {"responder::try_next", "of structs, closed and empty",
     [](real_time& rt) { next_where_there_is_none(rt, structs_in(rt)); }},
    {"responder::try_next", "of texts, closed and empty",
     [](real_time& rt) { next_where_there_is_none(rt, texts_in(rt)); }},
    {"responder::try_next", "of structs, reading the time", calls_on<structs_in>(next_by_the_clock), true},
    {"responder::try_next", "of texts, reading the time", calls_on<texts_in>(next_by_the_clock), true},
    {"responder::try_next", "when no place for an answer is left",
     [](real_time& rt) {
       auto with = structs_in(rt);
       for (std::uint32_t i = 0; i < 2 * service.depth; ++i) {
         ask(with.on);
         auto request = with.handle.try_next(now);
         use(with.handle.reply(*request, {}, now));
       }
       ask(with.on);
       rt.calls([&](std::uint64_t) { use(with.handle.try_next(now)); });
     }},
    {"responder::try_next", "of structs, when all have given up",
     calls_on<structs_in>(next_of_what_is_too_late)},
    {"responder::try_next", "of texts, when all have given up", calls_on<texts_in>(next_of_what_is_too_late)},
    {"responder::reply", "with structs, when it closed", calls_on<structs_in>(reply_when_closed)},
    {"responder::reply", "with texts, when it closed", calls_on<texts_in>(reply_when_closed)},
    {"responder::reply", "with texts that are too big",
     [](real_time& rt) {
       auto with = texts_in(rt);
       const auto many = rt.array<char>(4 * text_bytes);
       ask(with.on);
       auto request = with.handle.try_next(now);
       rt.calls([&](std::uint64_t) {
         use(with.handle.reply(*request, std::string_view{many.data(), many.size()}, now));
       });
     }},
    {"responder::refuse", "of structs, when it closed", calls_on<structs_in>(refuse_when_closed)},
    {"detail::open_request::~open_request", "unanswered, when it closed",
     calls_on<texts_in>(drop_when_closed)},
    {"responder::reply", "with structs", calls_on<structs_in>(reply_each)},
    {"responder::reply", "with texts", calls_on<texts_in>(reply_each)},
    {"responder::reply", "with structs, reading the time", calls_on<structs_in>(reply_by_the_clock), true},
    {"responder::reply", "with texts, reading the time", calls_on<texts_in>(reply_by_the_clock), true},
    {"responder::refuse", "of structs", calls_on<structs_in>(refuse_each)},
    {"responder::refuse", "of texts", calls_on<texts_in>(refuse_each)},
    {"responder::refuse", "of structs, reading the time", calls_on<structs_in>(refuse_by_the_clock), true},
    {"responder::refuse", "of texts, reading the time", calls_on<texts_in>(refuse_by_the_clock), true},

    {"detail::open_request::open_request", "moved from another", calls_on<texts_in>([](auto& with) {
       ask(with.on);
       auto request = with.handle.try_next(now);
       const rowe::request<json_text> moved{std::move(*request)};
       use(moved);
       serve(with.on);
     })},
    {"detail::open_request::operator=", "of two",
     [](real_time& rt) {
       auto with = structs_in(rt);
       ask(with.on);
       auto kept = with.handle.try_next(now);
       rt.calls([&](std::uint64_t) {
         serve(with.on);
         ask(with.on);
         auto next = with.handle.try_next(now);
         *kept = std::move(*next);
       });
     }},
    {"detail::open_request::~open_request", "unanswered", calls_on<structs_in>([](auto& with) {
       ask(with.on);
       use(with.handle.try_next(now));
       serve(with.on);
     })},
    {"request::value", "of a request",
     [](real_time& rt) { read_a_request(rt, [](const auto& r) { return r.value().x; }); }},
    {"request::operator*", "of a request",
     [](real_time& rt) { read_a_request(rt, [](const auto& r) { return (*r).x; }); }},
    {"request::operator->", "of a request",
     [](real_time& rt) { read_a_request(rt, [](const auto& r) { return r->x; }); }},
    {"detail::open_request::from", "of a request",
     [](real_time& rt) { read_a_request(rt, [](const auto& r) { return r.from(); }); }},
    {"detail::open_request::arrived", "of a request",
     [](real_time& rt) { read_a_request(rt, [](const auto& r) { return r.arrived(); }); }},
    {"detail::open_request::expires", "of a request",
     [](real_time& rt) { read_a_request(rt, [](const auto& r) { return r.expires(); }); }},
};

} // namespace

std::span<const exercise> exercises_of_responders() { return list; }

} // namespace rowe::contract
