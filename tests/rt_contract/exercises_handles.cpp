// SPDX-License-Identifier: Apache-2.0
// Publishers and subscribers of text, and what handles are made of.
#include <rowe/publisher.hpp>
#include <rowe/subscriber.hpp>

#include "pairs.hpp"

namespace rowe::contract {
namespace {

using detail::queue_pair;

queue_pair& publishing_pair(real_time& rt, audience listening, rowe::keep kept = rowe::keep::all) {
  return pair_for(rt,
                  {.kind = detail::pair_kind::publish_value,
                   .name = "/odom",
                   .keep = kept,
                   .ttl = 20ms,
                   .out_depth = depth,
                   .out_bytes = std::max(sizeof(odometry), std::size_t{text_bytes})},
                  listening);
}

queue_pair& subscribing_pair(real_time& rt, audience listening) {
  return pair_for(
      rt, detail::subscribe_request<json_text>("/odom", {.depth = depth, .text_bytes_max = text_bytes}),
      listening);
}

publisher<odometry>& publisher_on(real_time& rt, queue_pair& on) {
  return rt.make<publisher<odometry>>(handle_of(on));
}
publisher<json_text>& text_publisher_on(real_time& rt, queue_pair& on) {
  return rt.make<publisher<json_text>>(handle_of(on));
}
subscriber<json_text>& subscriber_on(real_time& rt, queue_pair& on) {
  return rt.make<subscriber<json_text>>(handle_of(on));
}

offered<publisher<json_text>> saying_in(real_time& rt) {
  queue_pair& on = publishing_pair(rt, audience::somebody);
  return {on, text_publisher_on(rt, on)};
}
offered<publisher<json_text>> saying_the_newest(real_time& rt) {
  queue_pair& on = publishing_pair(rt, audience::somebody, rowe::keep::newest);
  return {on, text_publisher_on(rt, on)};
}
offered<subscriber<json_text>> taking_in(real_time& rt) {
  queue_pair& on = subscribing_pair(rt, audience::somebody);
  return {on, subscriber_on(rt, on)};
}
subscriber<json_text>& closed_subscriber(real_time& rt) {
  return subscriber_on(rt, subscribing_pair(rt, audience::closed));
}
queue_pair& wanted_pair(real_time& rt) { return publishing_pair(rt, audience::somebody); }
detail::pair_handle& handle_in(real_time& rt) {
  return rt.make<detail::pair_handle>(handle_of(publishing_pair(rt, audience::nobody)));
}

// `take(subscriber)` when something has arrived.
template <class Take>
void take_each(real_time& rt, Take take) {
  rt.calls_on(taking_in(rt), [take](auto& with, auto) {
    arrive(with.on);
    return take(with.handle);
  });
}
template <class Read>
void read_a_view(real_time& rt, Read read) {
  take_each(rt, [read](auto& seen) {
    const auto taken = seen.try_take();
    return read(*taken);
  });
}

void publish_each_in_turn(real_time& rt, rowe::keep kept) {
  queue_pair& on = publishing_pair(rt, audience::somebody, kept);
  auto& odom = publisher_on(rt, on);
  rt.calls([&](std::uint64_t i) {
    use(odom.publish({static_cast<double>(i), 1, 2, 3, 4}, now));
    if (i % (2 * depth) == 0) serve(on);
  });
}

void publish_to(real_time& rt, audience listening) {
  auto& odom = publisher_on(rt, publishing_pair(rt, listening));
  rt.calls([&](std::uint64_t) { use(odom.publish({}, now)); });
}

template <class Read>
void read_from_publishers(real_time& rt, Read read) {
  auto& odom = publisher_on(rt, publishing_pair(rt, audience::somebody));
  auto& empty = rt.make<publisher<odometry>>();
  rt.calls([&](std::uint64_t i) { use(read(i % 2 == 0 ? odom : empty)); });
}

template <class Read>
void read_from_text_publishers(real_time& rt, Read read) {
  auto& said = text_publisher_on(rt, publishing_pair(rt, audience::nobody));
  auto& empty = rt.make<publisher<json_text>>();
  rt.calls([&](std::uint64_t i) { use(read(i % 2 == 0 ? said : empty)); });
}

constexpr exercise list[] = {
    {"detail::pair_slots::header", "each in turn", calls_on<wanted_pair>([](auto& on, auto i) {
       on.user.out.memory.header(static_cast<std::uint32_t>(i % depth))->bytes =
           static_cast<std::uint32_t>(i);
     })},
    {"detail::pair_slots::value", "each in turn, written to", calls_on<wanted_pair>([](auto& on, auto i) {
       *on.user.out.memory.value(static_cast<std::uint32_t>(i % depth)) = std::byte{1};
     })},
    {"detail::parked_slots::push", "until all places are taken, and popped",
     [](real_time& rt) {
       detail::parked_slots parked{rt.array<std::uint32_t>(depth)};
       rt.calls([&](std::uint64_t i) {
         if (parked.count == depth) parked.count = 0;
         parked.push(static_cast<std::uint32_t>(i));
       });
     }},
    {"detail::parked_slots::pop", "round and round",
     [](real_time& rt) {
       detail::parked_slots parked{rt.array<std::uint32_t>(depth)};
       rt.calls([&](std::uint64_t i) {
         parked.push(static_cast<std::uint32_t>(i));
         use(parked.pop());
       });
     }},
    {"detail::pair_handle::operator bool", "with and without a queue pair",
     [](real_time& rt) {
       auto& handle = handle_in(rt);
       auto& empty = rt.make<detail::pair_handle>();
       rt.calls([&](std::uint64_t i) { use(static_cast<bool>(i % 2 == 0 ? handle : empty)); });
     }},
    {"detail::pair_handle::operator->", "with a queue pair",
     calls_on<handle_in>([](auto& handle) { return handle->ttl; })},
    {"detail::pair_handle::operator*", "with a queue pair",
     calls_on<handle_in>([](auto& handle) { return (*handle).ttl; })},
    {"detail::audience_word::advice", "whatever it says",
     calls_on<made<detail::audience_word<>>>([](auto& word) { return word.advice(); })},
    {"detail::audience_word::look", "whatever it says",
     calls_on<made<detail::audience_word<>>>([](auto& word) { return word.look(); })},
    {"detail::audience_word::closed", "closed",
     [](real_time& rt) {
       auto& word = rt.make<detail::audience_word<>>();
       word.close();
       rt.calls([&](std::uint64_t) { use(word.closed()); });
     }},
    {"detail::publish_into", "a queue pair with room", calls_on<wanted_pair>([](auto& on) {
       use(detail::publish_into(on, 8, now, [](std::byte* slot) { *slot = std::byte{1}; }));
       serve(on);
     })},

    {"publisher::publish", "a struct, each slot in turn until full",
     [](real_time& rt) { publish_each_in_turn(rt, rowe::keep::all); }},
    {"publisher::publish", "a struct of which the newest is kept",
     [](real_time& rt) { publish_each_in_turn(rt, rowe::keep::newest); }},
    {"publisher::publish", "a struct to nobody", [](real_time& rt) { publish_to(rt, audience::nobody); }},
    {"publisher::publish", "a struct to a closed endpoint",
     [](real_time& rt) { publish_to(rt, audience::closed); }},
    {"publisher::publish", "a struct when the queue is full",
     [](real_time& rt) { publish_to(rt, audience::somebody); }},
    {"publisher::publish", "a struct by an empty handle",
     calls_on<made<publisher<odometry>>>([](auto& empty) { return empty.publish({}, now); })},
    {"publisher::publish", "a struct, reading the time",
     [](real_time& rt) {
       queue_pair& on = wanted_pair(rt);
       auto& odom = publisher_on(rt, on);
       rt.calls([&](std::uint64_t) {
         use(odom.publish({}));
         serve(on);
       });
     },
     true},
    {"publisher::publish", "a text, of every length up to too big",
     [](real_time& rt) {
       auto [on, said] = saying_in(rt);
       const auto many = rt.array<char>(2 * text_bytes);
       rt.calls([&, &on = on, &said = said](std::uint64_t i) {
         use(said.publish(std::string_view{many.data(), i % many.size()}, now));
         if (i % 50 == 0) serve(on);
       });
     }},
    {"publisher::publish", "a message, and one that outgrew its room",
     calls_on<saying_in>([](auto& with, auto i) {
       use(i % 2 == 0 ? with.handle.publish(message_of<16>{"n", i % 9}, now)
                      : with.handle.publish(message_of<4>{"n", 1}, now));
       if (i % 50 == 0) serve(with.on);
     })},
    {"publisher::publish", "a text to nobody, and to a closed endpoint",
     [](real_time& rt) {
       auto& to_nobody = text_publisher_on(rt, publishing_pair(rt, audience::nobody));
       auto& closed = text_publisher_on(rt, publishing_pair(rt, audience::closed));
       rt.calls([&](std::uint64_t i) { use((i % 2 == 0 ? to_nobody : closed).publish(text, now)); });
     }},
    {"publisher::publish", "a text of which the newest is kept",
     calls_on<saying_the_newest>([](auto& with, auto i) {
       use(with.handle.publish(text, now));
       if (i % 3 == 0) serve(with.on);
     })},
    {"publisher::publish", "a text when the queue is full",
     [](real_time& rt) {
       auto& said = text_publisher_on(rt, publishing_pair(rt, audience::somebody));
       while (said.publish(text, now)) continue;
       rt.calls([&](std::uint64_t) { use(said.publish(text, now)); });
     }},
    {"publisher::publish", "a text by an empty handle",
     calls_on<made<publisher<json_text>>>([](auto& empty) { return empty.publish(text, now); })},
    {"publisher::publish", "a text, reading the time", calls_on<saying_in>([](auto& with) {
       use(with.handle.publish(text));
       serve(with.on);
     }),
     true},
    {"publisher::wanted", "of structs, with and without a queue pair",
     [](real_time& rt) { read_from_publishers(rt, [](auto& p) { return p.wanted(); }); }},
    {"publisher::wanted", "of texts, with and without a queue pair",
     [](real_time& rt) { read_from_text_publishers(rt, [](auto& p) { return p.wanted(); }); }},
    {"publisher::published", "of structs, with and without a queue pair",
     [](real_time& rt) { read_from_publishers(rt, [](auto& p) { return p.published(); }); }},
    {"publisher::published", "of texts, with and without a queue pair",
     [](real_time& rt) { read_from_text_publishers(rt, [](auto& p) { return p.published(); }); }},
    {"publisher::dropped_no_peer", "of structs, with and without a queue pair",
     [](real_time& rt) { read_from_publishers(rt, [](auto& p) { return p.dropped_no_peer(); }); }},
    {"publisher::dropped_no_peer", "of texts, with and without a queue pair",
     [](real_time& rt) { read_from_text_publishers(rt, [](auto& p) { return p.dropped_no_peer(); }); }},
    {"publisher::dropped_full", "of structs, with and without a queue pair",
     [](real_time& rt) { read_from_publishers(rt, [](auto& p) { return p.dropped_full(); }); }},
    {"publisher::dropped_full", "of texts, with and without a queue pair",
     [](real_time& rt) { read_from_text_publishers(rt, [](auto& p) { return p.dropped_full(); }); }},

    {"subscriber::try_take", "when nothing has arrived",
     calls_on<taking_in>([](auto& with) { return with.handle.try_take(); })},
    {"subscriber::try_take", "when something has",
     [](real_time& rt) { take_each(rt, [](auto& seen) { return seen.try_take(); }); }},
    {"subscriber::try_take", "from a closed endpoint",
     calls_on<closed_subscriber>([](auto& seen) { return seen.try_take(); })},
    {"subscriber::try_take", "by an empty handle",
     calls_on<made<subscriber<json_text>>>([](auto& empty) { return empty.try_take(); })},
    {"subscriber::latest", "when nothing has arrived",
     calls_on<taking_in>([](auto& with) { return with.handle.latest(); })},
    {"subscriber::latest", "when its queue is full", calls_on<taking_in>([](auto& with) {
       for (std::uint32_t i = 0; i < depth; ++i) arrive(with.on);
       use(with.handle.latest());
     })},
    {"subscriber::latest", "from a closed endpoint, and by an empty handle",
     [](real_time& rt) {
       auto& seen = closed_subscriber(rt);
       auto& empty = rt.make<subscriber<json_text>>();
       rt.calls([&](std::uint64_t i) { use((i % 2 == 0 ? seen : empty).latest()); });
     }},
    {"message_view::~message_view", "when it closed meanwhile", calls_on<taking_in>([](auto& with) {
       arrive(with.on);
       const auto taken = with.handle.try_take(); // what came before it closed is still there
       close(with.on);
       use(taken->value().front());
     })},
    {"message_view::message_view", "from what has arrived",
     [](real_time& rt) { take_each(rt, [](auto& seen) { return seen.try_take(); }); }},
    {"message_view::message_view", "moved from another",
     [](real_time& rt) {
       take_each(rt, [](auto& seen) {
         auto taken = seen.try_take();
         const message_view moved{std::move(*taken)};
         use(moved);
       });
     }},
    {"message_view::operator=", "of two",
     [](real_time& rt) {
       queue_pair& on = subscribing_pair(rt, audience::somebody);
       auto& seen = subscriber_on(rt, on);
       arrive(on);
       auto kept = seen.try_take();
       rt.calls([&](std::uint64_t) {
         arrive(on);
         auto next = seen.try_take();
         *kept = std::move(*next);
       });
     }},
    {"message_view::~message_view", "which gives its slot back",
     [](real_time& rt) { take_each(rt, [](auto& seen) { return seen.try_take(); }); }},
    {"message_view::value", "of each slot in turn",
     [](real_time& rt) { read_a_view(rt, [](auto& view) { return view.value().front(); }); }},
    {"message_view::operator*", "of each slot in turn",
     [](real_time& rt) { read_a_view(rt, [](auto& view) { return (*view).front(); }); }},
    {"message_view::from", "of each slot in turn",
     [](real_time& rt) { read_a_view(rt, [](auto& view) { return view.from(); }); }},
    {"message_view::arrived", "of each slot in turn",
     [](real_time& rt) { read_a_view(rt, [](auto& view) { return view.arrived(); }); }},
};

} // namespace

std::span<const exercise> exercises_of_handles() { return list; }

} // namespace rowe::contract
