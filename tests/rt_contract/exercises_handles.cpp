// SPDX-License-Identifier: Apache-2.0
// Publishers and subscribers, on lanes that are built here as an endpoint builds them, with this thread in
// the service thread's place: so every state can be brought about at will. service_test.cpp has the real
// thread.
#include "contract.hpp"

#include <rowe/publisher.hpp>
#include <rowe/subscriber.hpp>

#include "api/lane_memory.hpp"

struct contract_odometry {
  double stamp, x, y, heading, speed;
};
template <>
inline constexpr auto rowe::schema<contract_odometry> =
    rowe::fields<&contract_odometry::stamp, &contract_odometry::x, &contract_odometry::y,
                 &contract_odometry::heading, &contract_odometry::speed>{};

namespace rowe::contract {
namespace {

using namespace std::chrono_literals;
using detail::audience;
using detail::lane;
using odometry = contract_odometry;

constexpr std::uint32_t depth = 64; // of 192 bytes each: three pages
constexpr std::size_t text_bytes = 100;
constexpr rt::time_point now{1000s};
constexpr std::string_view text = R"({"data":"hello"})";

lane& new_lane(real_time& rt, audience heard_by) {
  auto& made = rt.make<lane>();
  made.heard_by.store(heard_by,
                      std::memory_order_release); // release: as the service thread stores it; one thread here
  made.ttl = 20ms;
  return made;
}

lane& publishing_lane(real_time& rt, audience heard_by, rowe::keep kept = rowe::keep::all) {
  lane& made = new_lane(rt, heard_by);
  constexpr std::size_t bytes = std::max(sizeof(odometry), text_bytes);
  detail::build_path(rt.array<std::byte>(detail::path_bytes(kept, depth, bytes)), kept, depth, bytes,
                     made.publisher, made.service.out);
  return made;
}

lane& subscribing_lane(real_time& rt, audience heard_by) {
  lane& made = new_lane(rt, heard_by);
  detail::build_path(rt.array<std::byte>(detail::path_bytes(rowe::keep::all, depth, text_bytes)),
                     rowe::keep::all, depth, text_bytes, made.service.in, made.subscriber);
  return made;
}

// What the service thread does with what was published: takes it and gives the slots back.
void serve(lane& on) {
  if (on.service.out.newest != nullptr) {
    use(on.service.out.newest->begin_read());
    return;
  }
  on.service.out.out->drain([&](std::uint32_t slot) { on.service.out.home->give(slot); }, depth);
}

// What the service thread does with a message that arrived.
void arrive(lane& on) {
  const auto slot = on.service.in.home->try_take();
  if (!slot) return;
  *on.service.in.slots.header(*slot) = {0, 0, text.size()};
  std::memcpy(on.service.in.slots.value(*slot), text.data(), text.size());
  use(on.service.in.out->try_push(*slot));
}

detail::lane_handle handle_of(lane& on) { return {nullptr, on}; }

publisher<odometry>& publisher_on(real_time& rt, lane& on) {
  return rt.make<publisher<odometry>>(handle_of(on));
}
publisher<json_text>& text_publisher_on(real_time& rt, lane& on) {
  return rt.make<publisher<json_text>>(handle_of(on));
}
subscriber<json_text>& subscriber_on(real_time& rt, lane& on) {
  return rt.make<subscriber<json_text>>(handle_of(on));
}

void publish_each_in_turn(real_time& rt, rowe::keep kept) {
  lane& on = publishing_lane(rt, audience::somebody, kept);
  auto& odom = publisher_on(rt, on);
  rt.calls([&](std::uint64_t i) {
    use(odom.publish({static_cast<double>(i), 1, 2, 3, 4}, now));
    if (i % 50 == 0) serve(on);
  });
}

void publish_to(real_time& rt, audience heard_by) {
  auto& odom = publisher_on(rt, publishing_lane(rt, heard_by));
  rt.calls([&](std::uint64_t) { use(odom.publish({}, now)); });
}

template <class Read>
void read_from_publishers(real_time& rt, Read read) {
  auto& odom = publisher_on(rt, publishing_lane(rt, audience::somebody));
  auto& empty = rt.make<publisher<odometry>>();
  rt.calls([&](std::uint64_t i) { use(read(i % 2 == 0 ? odom : empty)); });
}

template <class Read>
void read_from_text_publishers(real_time& rt, Read read) {
  auto& said = text_publisher_on(rt, publishing_lane(rt, audience::nobody));
  auto& empty = rt.make<publisher<json_text>>();
  rt.calls([&](std::uint64_t i) { use(read(i % 2 == 0 ? said : empty)); });
}

constexpr exercise list[] = {
    {"detail::lane_slots::header", "each in turn",
     [](real_time& rt) {
       const auto slots = publishing_lane(rt, audience::somebody).publisher.slots;
       rt.calls([&](std::uint64_t i) { slots.header(static_cast<std::uint32_t>(i % depth))->bytes = i; });
     }},
    {"detail::lane_slots::value", "each in turn, written to",
     [](real_time& rt) {
       const auto slots = publishing_lane(rt, audience::somebody).publisher.slots;
       rt.calls([&](std::uint64_t i) { *slots.value(static_cast<std::uint32_t>(i % depth)) = std::byte{1}; });
     }},
    {"detail::lane_handle::operator bool", "with and without a lane",
     [](real_time& rt) {
       auto& handle = rt.make<detail::lane_handle>(handle_of(new_lane(rt, audience::nobody)));
       auto& empty = rt.make<detail::lane_handle>();
       rt.calls([&](std::uint64_t i) { use(static_cast<bool>(i % 2 == 0 ? handle : empty)); });
     }},
    {"detail::lane_handle::operator->", "with a lane",
     [](real_time& rt) {
       auto& handle = rt.make<detail::lane_handle>(handle_of(new_lane(rt, audience::nobody)));
       rt.calls([&](std::uint64_t) { use(handle->ttl); });
     }},
    {"detail::lane_handle::operator*", "with a lane",
     [](real_time& rt) {
       auto& handle = rt.make<detail::lane_handle>(handle_of(new_lane(rt, audience::nobody)));
       rt.calls([&](std::uint64_t) { use((*handle).ttl); });
     }},
    {"detail::publish_into", "a lane with room",
     [](real_time& rt) {
       lane& on = publishing_lane(rt, audience::somebody);
       rt.calls([&](std::uint64_t) {
         use(detail::publish_into(on, 8, now, [](std::byte* slot) { *slot = std::byte{1}; }));
         serve(on);
       });
     }},

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
     [](real_time& rt) {
       auto& empty = rt.make<publisher<odometry>>();
       rt.calls([&](std::uint64_t) { use(empty.publish({}, now)); });
     }},
    {"publisher::publish", "a struct, reading the time",
     [](real_time& rt) {
       lane& on = publishing_lane(rt, audience::somebody);
       auto& odom = publisher_on(rt, on);
       rt.calls([&](std::uint64_t) {
         use(odom.publish({}));
         serve(on);
       });
     },
     true},
    {"publisher::publish", "a text, of every length up to too big",
     [](real_time& rt) {
       lane& on = publishing_lane(rt, audience::somebody);
       auto& said = text_publisher_on(rt, on);
       const auto many = rt.array<char>(2 * text_bytes);
       rt.calls([&](std::uint64_t i) {
         use(said.publish(std::string_view{many.data(), i % many.size()}, now));
         if (i % 50 == 0) serve(on);
       });
     }},
    {"publisher::publish", "a text by an empty handle",
     [](real_time& rt) {
       auto& empty = rt.make<publisher<json_text>>();
       rt.calls([&](std::uint64_t) { use(empty.publish(text, now)); });
     }},
    {"publisher::publish", "a text, reading the time",
     [](real_time& rt) {
       lane& on = publishing_lane(rt, audience::somebody);
       auto& said = text_publisher_on(rt, on);
       rt.calls([&](std::uint64_t) {
         use(said.publish(text));
         serve(on);
       });
     },
     true},
    {"publisher::wanted", "of structs, with and without a lane",
     [](real_time& rt) { read_from_publishers(rt, [](auto& p) { return p.wanted(); }); }},
    {"publisher::wanted", "of texts, with and without a lane",
     [](real_time& rt) { read_from_text_publishers(rt, [](auto& p) { return p.wanted(); }); }},
    {"publisher::published", "of structs, with and without a lane",
     [](real_time& rt) { read_from_publishers(rt, [](auto& p) { return p.published(); }); }},
    {"publisher::published", "of texts, with and without a lane",
     [](real_time& rt) { read_from_text_publishers(rt, [](auto& p) { return p.published(); }); }},
    {"publisher::dropped_no_peer", "of structs, with and without a lane",
     [](real_time& rt) { read_from_publishers(rt, [](auto& p) { return p.dropped_no_peer(); }); }},
    {"publisher::dropped_no_peer", "of texts, with and without a lane",
     [](real_time& rt) { read_from_text_publishers(rt, [](auto& p) { return p.dropped_no_peer(); }); }},
    {"publisher::dropped_full", "of structs, with and without a lane",
     [](real_time& rt) { read_from_publishers(rt, [](auto& p) { return p.dropped_full(); }); }},
    {"publisher::dropped_full", "of texts, with and without a lane",
     [](real_time& rt) { read_from_text_publishers(rt, [](auto& p) { return p.dropped_full(); }); }},

    {"subscriber::try_take", "when nothing has arrived",
     [](real_time& rt) {
       auto& seen = subscriber_on(rt, subscribing_lane(rt, audience::somebody));
       rt.calls([&](std::uint64_t) { use(seen.try_take()); });
     }},
    {"subscriber::try_take", "when something has",
     [](real_time& rt) {
       lane& on = subscribing_lane(rt, audience::somebody);
       auto& seen = subscriber_on(rt, on);
       rt.calls([&](std::uint64_t) {
         arrive(on);
         use(seen.try_take());
       });
     }},
    {"subscriber::try_take", "from a closed endpoint",
     [](real_time& rt) {
       auto& seen = subscriber_on(rt, subscribing_lane(rt, audience::closed));
       rt.calls([&](std::uint64_t) { use(seen.try_take()); });
     }},
    {"subscriber::try_take", "by an empty handle",
     [](real_time& rt) {
       auto& empty = rt.make<subscriber<json_text>>();
       rt.calls([&](std::uint64_t) { use(empty.try_take()); });
     }},
    {"subscriber::latest", "when nothing has arrived",
     [](real_time& rt) {
       auto& seen = subscriber_on(rt, subscribing_lane(rt, audience::somebody));
       rt.calls([&](std::uint64_t) { use(seen.latest()); });
     }},
    {"subscriber::latest", "when its queue is full",
     [](real_time& rt) {
       lane& on = subscribing_lane(rt, audience::somebody);
       auto& seen = subscriber_on(rt, on);
       rt.slow_calls([&](std::uint64_t) {
         for (std::uint32_t i = 0; i < depth; ++i) arrive(on);
         use(seen.latest());
       });
     }},
    {"message_view::message_view", "from what has arrived",
     [](real_time& rt) {
       lane& on = subscribing_lane(rt, audience::somebody);
       auto& seen = subscriber_on(rt, on);
       rt.calls([&](std::uint64_t) {
         arrive(on);
         use(seen.try_take());
       });
     }},
    {"message_view::message_view", "moved from another",
     [](real_time& rt) {
       lane& on = subscribing_lane(rt, audience::somebody);
       auto& seen = subscriber_on(rt, on);
       rt.calls([&](std::uint64_t) {
         arrive(on);
         auto taken = seen.try_take();
         const message_view moved{std::move(*taken)};
         use(moved);
       });
     }},
    {"message_view::operator=", "of two",
     [](real_time& rt) {
       lane& on = subscribing_lane(rt, audience::somebody);
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
     [](real_time& rt) {
       lane& on = subscribing_lane(rt, audience::somebody);
       auto& seen = subscriber_on(rt, on);
       rt.calls([&](std::uint64_t) {
         arrive(on);
         use(seen.try_take());
       });
     }},
    {"message_view::text", "of each slot in turn",
     [](real_time& rt) {
       lane& on = subscribing_lane(rt, audience::somebody);
       auto& seen = subscriber_on(rt, on);
       rt.calls([&](std::uint64_t) {
         arrive(on);
         const auto taken = seen.try_take();
         use(taken->text().front());
       });
     }},
    {"message_view::arrived", "of each slot in turn",
     [](real_time& rt) {
       lane& on = subscribing_lane(rt, audience::somebody);
       auto& seen = subscriber_on(rt, on);
       rt.calls([&](std::uint64_t) {
         arrive(on);
         use(seen.try_take()->arrived());
       });
     }},
};

} // namespace

std::span<const exercise> exercises_of_handles() { return list; }

} // namespace rowe::contract
