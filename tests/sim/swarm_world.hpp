// SPDX-License-Identifier: Apache-2.0
// A world in which everybody may do anything. Untrusted peers say whatever a codec has, in any order and at
// any speed. This process's handles are in every stage of their lives, and its ordinary threads send, call,
// receive, stop and reset. The network stalls and disconnects. Time moves in small steps, and jumps. Among
// them are peers that keep to the rules, one by names and one by numbers. Each seed chooses the
// endpoint's options and limits, leaves half of everything out and weighs the rest anew. invariants() lists
// the invariants, which are checked after each cycle.
#pragma once
#include <array>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sim_base.hpp"
#include "swarm_context.hpp"
#include "swarm_driving.hpp"
#include "swarm_goals.hpp"
#include "swarm_honest.hpp"
#include "swarm_honest_numbers.hpp"
#include "swarm_peer.hpp"
#include "swarm_process.hpp"
#include "swarm_rights.hpp"

namespace swarm {

struct invariant {
  std::string_view name;
  std::string_view says;
};
inline const std::vector<invariant>& invariants() {
  static const std::vector<invariant> all = {
      {"structures", "the core's structures agree, and references counted from outside equal the slots' own"},
      {"counters", "each counter is monotone, and none jumps by more than what happened"},
      {"json", "every text that a peer is sent is valid JSON and of its codec"},
      {"grammar", "a server says nothing that only clients say"},
      {"ids", "an answer or a status has an id that its peer gave, as it stood there; likewise a number"},
      {"listing", "a peer with numbers is greeted first, and told of each topic and service once"},
      {"listing_changes", "who was told of all changes knows the same as who comes now"},
      {"frames", "a peer is sent nothing that breaks the WebSocket protocol"},
      {"latch", "a late subscriber gets what its publisher asked to be kept, as long as that is there"},
      {"calls", "a caller is given the completions of calls that it wants, and of no others"},
      {"rows_of_calls", "a caller whose calls have all ended or been given up can call"},
      {"set_up", "a handle is refused for the sake of this process's own other handles only"},
      {"answers", "a call is answered with its own answer"},
      {"floor_call", "the honest peer's call is answered within 40 cycles"},
      {"floor_large_call", "likewise one whose answer needs a large slot"},
      {"floor_parameters", "the honest peer of Foxglove's protocol hears of parameters within 40 cycles"},
      {"parameters", "a loop reads a value in the range of its parameter"},
      {"parameters_told", "who wants to be told of parameters is told what who asks hears"},
      {"graph_changes", "who was told of all changes of the connection graph knows the same as who comes"},
      {"floor_topic", "of 100 messages of a topic of 20 Hz the honest peer gets at least 90"},
      {"floor_latched", "it gets the latched value of a topic within 40 cycles"},
      {"floor_echo", "its plain message, which a thread sends back, comes back within 40 cycles"},
      {"goals", "what is said of a goal reaches who sent it, until its end, and nobody else"},
      {"floor_goal",
       "a goal reaches its provider, its end who sent it, and that nobody wants it any more its "
       "provider, within 40 cycles"},
      {"throttle", "a subscription gets a message each throttle_rate, by the options of the moment"},
      {"rights", "a peer that asks what it may do is told that, whatever else it asks"},
      {"honest_cut", "the honest peer is not disconnected"},
      {"honest_refused", "the honest peer is refused nothing"},
      {"statistics", "rates are those of the last seconds"},
      {"stop_number",
       "the number of the stop rises, by less than a turn of its low 16 bits in a loop_timeout"},
      {"stop_holds",
       "no loop moves after a stop until a reset that named its number and a tick issued later, or until one "
       "that a thread of this process asked for later"},
      {"stop_of_threads",
       "a stop of a thread is carried out in the next cycle, and it hears of it when no loop moves any more"},
      {"reset_of_threads", "a reset of a thread is answered, at the latest when its time is over"},
      {"commands", "what drives is not older than its lease, nor of a peer that has gone; nothing does while "
                   "the robot is "
                   "stopped"},
      {"end", "when everybody has left and everything is closed, every slot is free and nothing waits"},
  };
  return all;
}

// Of the stream of choices about what only worlds with Foxglove's protocol have.
inline constexpr std::uint64_t of_foxglove = 0xf0f0f0f0f0f0f0f0U;

// What one seed does.
struct plan {
  rowe::endpoint_options options;
  rowe::service::side ours = rowe::service::side::server;
  bool roomy = true;      // limits as small robots have them: the floors hold
  bool has_honest = true; //
  bool jumps = false;     // of time, by seconds
  bool freezes = false;   // the service thread gets no core now and then
  bool floods = false;    // of stops: more than a number of 16 bits counts
  std::uint64_t bad_in = 6;
  std::uint64_t untrusted_max = 5;
  bool crowd = false;    // of peers that come one by one, each taking what it gets
  bool numbers = false;  // clients may speak by numbers, too
  bool foxglove = false; // likewise by Foxglove's protocol
  bool goals = false;    // two honest peers have an action
  bool drives = false;   // there is a driven topic
  bool rights = false;   // peers ask what they may do
};

// Whether those who speak by numbers speak Foxglove's protocol. The seed draws it from a stream of its own.
// Only worlds `by_seed` have a driven topic, or peers that ask what they may do.
enum class tongues : std::uint8_t { by_seed, numbers, foxglove };

inline plan draw_plan(std::uint64_t seed, tongues speak) {
  seeded_choices random{seed ^ 0x5bd1e995U};
  plan p;
  auto& o = p.options;
  auto& l = o.limits;
  if (random.one_in(5)) p.ours = rowe::service::side::client;
  o.relay = random.one_in(2);
  o.answers_any = random.one_in(3);
  o.plain_unasked = random.one_in(4);
  constexpr rowe::idle idles[] = {rowe::idle::poll, rowe::idle::poll, rowe::idle::spin, rowe::idle::wake,
                                  rowe::idle::phase};
  o.idle_policy = random.one_of(idles);
  if (random.one_in(6))
    o.profile = random.one_in(2) ? rowe::websocket_profile::hop : rowe::websocket_profile::hop_2014;
  if (random.one_in(4)) o.inbound_ttl = 200ms;
  o.stop.unguarded = random.one_in(2);
  constexpr rowe::duration timeouts[] = {100ms, 500ms, 5s};
  o.stop.guard_timeout = random.one_of(timeouts);
  o.stop.service_timeout = random.one_in(2) ? 50ms : 1s;
  o.stop.observe_timeout = random.one_in(2) ? 50ms : 5ms;
  l.connections_max = 8;
  l.message_bytes_max = 8 * 1024;
  l.topics_max = 24;
  l.subscriptions_max = 64;
  l.subscriptions_per_connection_max = 12;
  l.advertisements_per_connection_max = 6;
  l.small_slot_bytes = 1024;
  l.small_slots = random.one_in(2) ? 128 : 64;
  l.large_slots = random.one_in(2) ? 16 : 8;
  l.queue_depth_max = 32;
  l.queued_max = 1024;
  l.handles_max = 14;
  l.handle_bytes = 6 * 1024 * 1024;
  l.services_max = 16;
  l.calls_max = 32;
  l.calls_per_connection_max = 4;
  l.door_slots = 4;
  l.door_slot_bytes = 2048;
  constexpr std::uint32_t rates[] = {50'000, 50'000, 1'000, 0};
  l.messages_per_second_max = random.one_of(rates);
  l.refusals_per_second_max = random.one_in(2) ? 20 : random.one_in(2) ? 1 : 0;
  l.latched_bytes = random.one_in(2) ? 64 * 1024 : 8 * 1024;
  if (random.one_in(2)) o.call_timeout = 300ms;
  if (random.one_in(2)) { // only the shares bound what one peer holds
    l.subscriptions_per_connection_max = l.subscriptions_max;
    l.calls_per_connection_max = l.calls_max;
    l.advertisements_per_connection_max = l.topics_max;
  }
  p.roomy = !random.one_in(4);
  if (p.roomy) { // of each pool there is enough for eight peers
    l.topics_max = 64;
    l.services_max = 32;
    l.calls_max = 64;
    l.door_slots = 32;
  } else {
    if (random.one_in(2)) l.small_slots = 4 + static_cast<std::uint32_t>(random.below(12));
    if (random.one_in(2)) l.large_slots = 1;
    if (random.one_in(2)) l.queue_depth_max = 1 + static_cast<std::uint32_t>(random.below(4));
    if (random.one_in(2)) l.queued_max = 12;
    if (random.one_in(2)) l.calls_max = 4;
    if (random.one_in(2)) l.topics_max = 8;
    if (random.one_in(2)) l.subscriptions_max = 8;
    if (random.one_in(2)) l.services_max = 2;
    if (random.one_in(2)) l.door_slots = 1;
    if (random.one_in(2)) l.message_bytes_max = 1024;
  }
  p.has_honest =
      p.roomy && p.ours == rowe::service::side::server && o.profile == rowe::websocket_profile::standard;
  if (p.has_honest) l.latched_bytes = 16 * 1024; // half for peers, and as much as this process latches
  p.jumps = random.one_in(3);
  p.freezes = random.one_in(3);
  p.floods = random.one_in(4);
  p.bad_in = random.one_in(2) ? 6 : random.one_in(2) ? 2 : 40;
  p.untrusted_max = p.ours == rowe::service::side::client ? 1 : 1 + random.below(5);
  p.numbers = p.ours == rowe::service::side::server && o.profile == rowe::websocket_profile::standard &&
              random.one_in(2);          // whose clients alone speak it
  if (p.numbers) l.connections_max += 2; // for the honest ones
  p.goals = p.has_honest && o.relay;
  if (p.goals) l.connections_max += 2;
  seeded_choices others{seed ^ of_foxglove};
  p.foxglove = p.numbers && (speak == tongues::foxglove || (speak == tongues::by_seed && others.one_in(2)));
  const bool may_have_more = speak == tongues::by_seed && p.ours == rowe::service::side::server &&
                             o.profile == rowe::websocket_profile::standard;
  p.drives = may_have_more && seed % 4 == 0;
  p.rights = may_have_more && seed % 4 == 2;
  if (p.drives) l.handles_max += 3; // one of them may be closing
  p.crowd = p.has_honest && random.one_in(4);
  if (p.crowd) {
    p.untrusted_max = 12;
    l.connections_max = p.goals ? 20 : 18;
    l.subscriptions_max = 256;
    l.topics_max = 96;
    l.services_max = 64;
    l.door_slots = 64;
    l.large_slots = 8;
  }
  return p;
}

class world {
 public:
  world(std::uint64_t seed, coverage& seen, const std::set<std::string>& without, bool trace = false,
        tongues speak = tongues::by_seed)
      : seed_{seed},
        plan_{draw_plan(seed, speak)},
        random_{seed},
        result_{without},
        on_{plan_.options, plan_.ours, seed, time_point{1000s},
            plan_.numbers ? &numbers::protocols() : nullptr},
        context_{.on = on_,
                 .random = random_,
                 .seen = seen,
                 .result = result_,
                 .ours = plan_.ours,
                 .known = {},
                 .trace = trace},
        process_{context_},
        honest_{context_, process_, check_, random_.below(random_.one_in(2) ? 200 : 1000),
                random_.one_in(2) ? 0 : random_.below(800)},
        honest_by_number_{context_, check_, random_.below(random_.one_in(2) ? 200 : 1000)},
        honest_goals_{context_, check_, seed % 300},
        driven_{context_, process_, seed},
        start_{on_.now} {
    context_.numbers = plan_.numbers;
    context_.foxglove = plan_.foxglove;
    context_.drives = plan_.drives;
    context_.rights = plan_.rights;
    if (plan_.foxglove) honest_by_number_.speaks = tongue::foxglove;
    context_.known.bounds = plan_.options.limits;
    context_.takes_rest = plan_.crowd || random_.one_in(2);
    context_.known.honest_topics = !plan_.options.relay;
    context_.known.message_number = &context_.message_number;
    constexpr std::size_t few[] = {1, 2, 3, 6, 6};
    context_.known.names = random_.one_of(few);
    honest_.operates = !random_.one_in(3);
    honest_.echoes = plan_.has_honest && plan_.options.inbound_ttl == rowe::rt::for_ever && random_.one_in(3);
    process_.receives = !honest_.echoes;
    uses_ = weights{rows().size()};
    seeded_choices others{seed, of_foxglove};
    const std::size_t first = operation_named(first_of_foxglove);
    uses_.randomise(random_, 0, row_of(first));
    const std::size_t driving = operation_named(first_of_driving);
    uses_.randomise(others, row_of(first), row_of(driving));
    seeded_choices of_drivers{seed, of_driving};
    const std::size_t asking = operation_named(first_of_rights);
    uses_.randomise(of_drivers, row_of(driving), row_of(asking));
    seeded_choices of_askers{seed, of_rights};
    uses_.randomise(of_askers, row_of(asking), rows().size());
    for (const auto& [operation, member] : mostly_good)
      uses_[row_of(operation_named(operation), member, 0)] += 12; // the first class is the usual one
    for (std::size_t row = 0; row < rows().size(); ++row) {
      if (rows()[row].own) continue;
      const value_class& one = classes_of(domain_of(rows()[row]))[rows()[row].value];
      if (one.name == "absent" && one.good) uses_[row] += 6; // most texts leave out most members
      if (!one.good) uses_[row] = std::max(uses_[row], 1U);  // few texts have such a class, and each has one
    }
    operations_ = weights{operations().size()};
    operations_.randomise(random_, 0, first);
    operations_.randomise(others, first, driving);
    operations_.randomise(of_drivers, driving, asking);
    for (std::size_t i = driving; i < asking; ++i) operations_[i] = plan_.drives ? operations_[i] + 2 : 0;
    operations_.randomise(of_askers, asking, operations().size());
    for (std::size_t i = asking; i < operations().size(); ++i)
      operations_[i] = plan_.rights ? operations_[i] + 8 : 0;
    if (plan_.drives) operations_[driving] += 12;
    if (plan_.drives && of_drivers.one_in(2)) { // they contend for control
      const std::size_t control = operation_named("control");
      operations_[control] += 12;
      uses_[row_of(control, 3, 2)] += 24; // take_over
    }
    // Operations that undo another are of use only where that one was used.
    std::size_t left = std::size(pairs_of_operations);
    for (const auto& [takes, gives] : pairs_of_operations) {
      const unsigned weight = operations_[operation_named(takes)];
      if (!(left-- > opposites_of_foxglove ? random_ : others).one_in(4))
        operations_[operation_named(gives)] = weight;
    }
    // Publishing needs a channel.
    unsigned& offers = operations_[operation_named("offer")];
    offers = std::max(offers, operations_[operation_named("publish_by_number")]);
    // Where something sends back what it is sent, there is a peer that sends much, and perhaps does not read.
    if (honest_.echoes) operations_[operation_named("message")] += random_.one_of(chattiness);
    honest_.takes_at_once = random_.one_of(chattiness_of_echo);
    actions_ = weights{action_count};
    actions_.randomise(random_);
    if (plan_.floods) actions_[static_cast<std::size_t>(action::burst)] += 2;
    for (const action always : {action::connect, action::say, action::read, action::wait})
      actions_[static_cast<std::size_t>(always)] += 4;
    actions_[static_cast<std::size_t>(action::say)] += 12;
    has_spread_ = random_.one_in(2);
    if (trace) describe();
    if (plan_.drives) driven_.begin();
  }

  void step(std::uint64_t number) {
    context_.step = number;
    random_.restart(seed_, number + 1);
    forget_those_cut();
    if (plan_.drives) driven_.act();
    const auto what = static_cast<action>(actions_.choose(
        random_, 0, action_count, static_cast<std::size_t>(action::wait), [](std::size_t) { return true; }));
    switch (what) {
    case action::connect: connect(); break;
    case action::disconnect: disconnect(); break;
    case action::conditions:
      if (untrusted_peer* const p = one()) p->change_conditions();
      break;
    case action::say: say_something(); break;
    case action::read:
      if (untrusted_peer* const p = one()) p->hear(random_.one_in(2) ? SIZE_MAX : random_.below(2000));
      break;
    case action::open: process_.open_any(); break;
    case action::close:
      if (random_.one_in(2)) process_.close_any();
      break;
    case action::act:
    case action::act_too: process_.act(); break;
    case action::ordinary_thread: use_thread(); break;
    case action::freeze: freeze(); return;
    case action::burst: burst(); break;
    case action::in_turn: in_turn(); break;
    case action::wait: break;
    }
    wait();
    act_honestly();
    process_.wait();
    look_of_loops();
    cycle();
  }

  // Everybody reads, leaves, closes; nothing may be left.
  void finish(std::uint64_t number) {
    context_.step = number;
    honest_.leave();
    honest_by_number_.leave();
    honest_goals_.leave();
    for (int i = 0; i < 20; ++i) quiesce();
    while (!untrusted_.empty()) leave(0, rowe::service::close_cause::reset); // a flood is not read to its end
    for (const auto& one : leaving_) one->link().leave(rowe::service::close_cause::reset);
    for (int i = 0; i < 5; ++i) quiesce();
    driven_.end();
    process_.close_all();
    for (int i = 0; i < 40; ++i) quiesce();
    far_end last{on_, plan_.ours}; // pending messages wait for a peer
    last.say("{}");
    for (int i = 0; i < 40; ++i) {
      last.hear();
      quiesce();
    }
    last.leave();
    for (int i = 0; i < 5; ++i) quiesce();
    for (int left = 4000; left > 0 && !broken() && (on_.shared.peers() != 0 || !on_.all_slots_free()); --left)
      quiesce(); // what has come is taken
    if (broken()) return;
    if (on_.core.slots_in_use() != 0)
      result_.fail("end", std::to_string(on_.core.slots_in_use()) + " slots are not free");
    if (!process_.all_closed()) result_.fail("end", "a handle that is closed stays");
    if (!on_.core.drained()) result_.fail("end", "something waits for nobody");
    if (!on_.all_slots_free()) {
      const char* const wrong = on_.check_slots();
      const bool waits = on_.inbox.try_receive(on_.now).has_value();
      result_.fail("end", std::string{"a slot of the submission queue is not free: "} +
                              (wrong != nullptr ? wrong
                               : waits          ? "a message waits to be received"
                                                : "one is lost"));
    }
    if (on_.shared.peers() != 0)
      result_.fail("end", std::to_string(on_.shared.peers()) + " peers are counted that have left, after " +
                              std::to_string(on_.count(counter::messages_in)) + " messages");
  }

  bool broken() const { return result_.broken(); }
  const run_result& result() const { return result_; }
  std::uint64_t trace_hash() const { return hash_; }
  harness::core_harness& on() { return on_; }
  const honest& honest_peer() const { return honest_; }

 private:
  enum class action : std::uint8_t {
    connect,
    disconnect,
    conditions,
    say,
    read,
    open,
    close,
    act,
    act_too,
    ordinary_thread,
    freeze,
    burst,
    in_turn,
    wait
  };
  static constexpr std::size_t action_count = 14;

  void describe() {
    const auto& o = plan_.options;
    context_.say("seed " + std::to_string(seed_) +
                 (plan_.ours == rowe::service::side::client ? " client" : " server") +
                 (o.relay ? " relay" : "") + (o.answers_any ? " answers_any" : "") +
                 (o.plain_unasked ? " plain_unasked" : "") + (plan_.roomy ? " roomy" : " tight") +
                 (plan_.has_honest ? " honest" : "") + (plan_.numbers ? " numbers" : "") +
                 (plan_.foxglove ? " foxglove" : "") + (plan_.drives ? " drives" : "") +
                 (plan_.rights ? " rights" : "") + " profile " + std::to_string(static_cast<int>(o.profile)) +
                 " idle " + std::to_string(static_cast<int>(o.idle_policy)));
  }

  untrusted_peer* one() {
    return untrusted_.empty() ? nullptr : untrusted_[random_.below(untrusted_.size())].get();
  }

  void act_honestly() {
    if (plan_.has_honest) honest_.act();
    if (plan_.has_honest && plan_.numbers) honest_by_number_.act(honest_.is_ready());
    if (plan_.goals) honest_goals_.act();
  }

  void connect() {
    const recipe how = choose_opening();
    if (!open(how, state::times_once)) return;
    untrusted_peer& fresh = *untrusted_.back();
    // A bad text as the first one is rare otherwise.
    if (!random_.one_in(4)) fresh.say(choose_text(fresh, 2), 1, false);
    if (!plan_.crowd) return;
    if (random_.one_in(2)) fresh.change_conditions();
    fresh.say(choose_greedy(fresh), 60, true);
    if (random_.one_in(2)) fresh.say(choose_greedy(fresh), 60, true);
  }
  recipe choose_opening() {
    recipe how = choose_recipe(random_, uses_, operation_named("open"), 0);
    give_value(how, "path", random_.one_in(12) ? "stop" : "root");
    if (context_.numbers && !random_.one_in(4))
      give_value(how, "codec", random_.one_in(2) ? "numbers" : "none");
    return how;
  }
  bool open(const recipe& how, state times) {
    if (untrusted_.size() + leaving_.size() >= plan_.untrusted_max) return false;
    untrusted_.push_back(std::make_unique<untrusted_peer>(context_, check_, how));
    const auto id = untrusted_.back()->link().id();
    process_.ordinary_threads().connections.push_back({id.index, id.generation});
    context_.say(untrusted_.back()->name() + " comes by " + std::string{value_of(how, "codec")} + ", " +
                 std::string{value_of(how, "path")} + ", " + std::string{value_of(how, "address")});
    context_.seen.add(row_of(how.operation), times);
    for (std::size_t m = 0; m < how.classes.size(); ++m)
      context_.seen.add(row_of(how.operation, m, how.classes[m]), times);
    return true;
  }
  void note_end(const untrusted_peer& of) {
    auto& workers = process_.ordinary_threads();
    const auto id = const_cast<untrusted_peer&>(of).link().id();
    std::erase(workers.connections, threads::connection_ref{id.index, id.generation});
    if (workers.ended.size() == 8) workers.ended.erase(workers.ended.begin());
    workers.ended.push_back({id.index, id.generation});
  }
  // A request by which a peer can hold much.
  recipe choose_greedy(const untrusted_peer& by) {
    constexpr std::string_view greedy[] = {"subscribe",    "advertise",        "advertise_service",
                                           "call_service", "send_action_goal", "invocation"};
    constexpr std::string_view by_number[] = {"want", "offer", "call_by_number"};
    const std::string_view name = by.speaks_numbers() ? random_.one_of(by_number) : random_.one_of(greedy);
    recipe chosen = choose_recipe(random_, uses_, operation_named(name), 0);
    if (by.speaks_numbers() && random_.one_in(2)) give_value(chosen, "list", "many");
    // Large answers, where it calls.
    constexpr std::string_view large[] = {"stats", "stats", "lists", "list_topics", "list_services"};
    if (random_.one_in(2)) give_value(chosen, "service", random_.one_of(large));
    return chosen;
  }
  void leave(std::size_t which, rowe::service::close_cause how) {
    untrusted_peer& gone = *untrusted_[which];
    note_end(gone);
    if (gone.flooded()) how = rowe::service::close_cause::reset; // else all of it would be read first
    context_.say(gone.name() + " leaves");
    if (!gone.link().cut()) gone.end_conditions(); // else its last bytes might never arrive
    gone.link().leave(how);
    leaving_.push_back(std::move(untrusted_[which]));
    untrusted_.erase(untrusted_.begin() + static_cast<std::ptrdiff_t>(which));
    cycle();
    cycle();
    forget_those_gone();
  }
  // What they said before they left is read first; of a peer that is parked, that may be much later.
  void forget_those_gone() {
    std::erase_if(leaving_, [](const auto& one) { return one->link().cut(); });
  }
  // The place of a connection that has ended may be another's already.
  void forget_those_cut() {
    forget_those_gone();
    std::erase_if(untrusted_, [&](const auto& one) {
      if (!one->link().cut()) return false;
      one->hear(SIZE_MAX);
      note_end(*one);
      context_.say(one->name() + " was disconnected");
      return true;
    });
  }
  void disconnect() {
    if (untrusted_.empty() || random_.one_in(2)) return;
    const std::size_t which = random_.below(untrusted_.size());
    leave(which, random_.one_in(2) ? rowe::service::close_cause::reset : rowe::service::close_cause::peer);
  }

  recipe choose_text(const untrusted_peer& by) { return choose_text(by, plan_.bad_in); }
  recipe choose_text(const untrusted_peer& by, std::uint64_t bad_in) {
    if (by.knows_number_of_peers_service() && random_.one_in(2)) { // which is rare
      recipe chosen = choose_recipe(random_, uses_, operation_named("call_by_number"), bad_in);
      give_value(chosen, "service", "shared");
      return chosen;
    }
    const bool another = random_.one_in(24); // codec than its own
    std::size_t what = operations_.choose(random_, 0, operations().size(), 0, [&](std::size_t i) {
      const form goes = operations()[i].goes;
      const speaker says = speaker_of(goes);
      if (says == speaker::thread || goes == form::opening) return false;
      if (says == speaker::foxglove_peer) {
        if (!plan_.foxglove || by.speaks_foxglove() == another) return false;
      } else if (says != speaker::any_peer &&
                 ((says == speaker::numbers_peer) == by.speaks_numbers()) == another) {
        return false;
      }
      // What ends the connection, or makes it useless, is rare.
      const bool ends = goes == form::close || goes == form::no_frame || goes == form::binary ||
                        goes == form::partial || (is_binary(goes) && !by.speaks_numbers());
      return !ends || random_.one_in(4);
    });
    return choose_recipe(random_, uses_, what, bad_in);
  }
  void say_something() {
    untrusted_peer* const p = one();
    if (p == nullptr) return;
    p->say(choose_text(*p), 1, false);
    while (p->closing() && !random_.one_in(3)) p->say(choose_text(*p), 1, false); // it does not stop there
  }
  void burst() {
    untrusted_peer* const p = one();
    if (p == nullptr || !random_.one_in(2)) return;
    constexpr std::uint64_t times[] = {2, 3, 17, 40, 100};
    std::uint64_t count = random_.one_of(times);
    if (random_.one_in(16)) count = 1000;
    if (flood_left_ && context_.stop_in_use && random_.one_in(6)) {
      flood_left_ = false;
      constexpr std::string_view stops[] = {"stop", "stop_in_plain", "stop_by_publish"};
      const std::string_view name = p->speaks_numbers() ? "stop_by_number" : random_.one_of(stops);
      const recipe one = choose_recipe(random_, uses_, operation_named(name), 0);
      // More often than a number of 16 bits counts. Repeats change nothing, so there need not be many.
      const bool differ = value_of(one, "source") == "one_of_many";
      return flood(*p, one, differ ? 70'000 : 2'000);
    }
    const recipe what = random_.one_in(2) ? choose_text(*p) : choose_greedy(*p);
    const form goes = operations()[what.operation].goes;
    if (count > 100 && goes != form::stop_call && goes != form::stop_plain && goes != form::stop_publish &&
        goes != form::number_stop)
      count = 100;
    p->say(what, count, random_.one_in(2) || count > 100);
  }

  // Takes and gives back, over and over: who is told of it has much to read. Or comes and goes.
  void in_turn() {
    if (random_.one_in(8)) return come_and_go();
    untrusted_peer* const p = one();
    if (p == nullptr) return;
    weights may{std::size(pairs_of_operations)};
    const std::size_t which = may.choose(random_, 0, may.size(), 0, [&](std::size_t i) {
      const form goes = operations()[operation_named(pairs_of_operations[i].takes)].goes;
      if (speaker_of(goes) == speaker::foxglove_peer) return p->speaks_foxglove();
      return (speaker_of(goes) == speaker::numbers_peer) == p->speaks_numbers();
    });
    const recipe takes = choose_recipe(random_, uses_, operation_named(pairs_of_operations[which].takes), 0);
    recipe gives = choose_recipe(random_, uses_, operation_named(pairs_of_operations[which].gives), 0);
    for (const std::string_view member :
         {"id", "topic", "service", "action", "list", "tag", "channel", "parameterNames"})
      give_value(gives, member, value_of(takes, member));
    constexpr std::uint64_t times[] = {2, 9, 40};
    p->say(takes, random_.one_of(times), random_.one_in(2), &gives);
  }
  void come_and_go() {
    const recipe how = choose_opening();
    for (std::uint64_t left = 2 + random_.below(16); left > 0 && open(how, state::times_burst); --left) {
      if (random_.one_in(2)) cycle();
      leave(untrusted_.size() - 1,
            random_.one_in(2) ? rowe::service::close_cause::reset : rowe::service::close_cause::peer);
    }
  }

  // Where the honest peer's thread receives, others do not.
  void use_thread() {
    const std::size_t what =
        operations_.choose(random_, 0, operations().size(), operations().size(), [&](std::size_t i) {
          const form goes = operations()[i].goes;
          return goes == form::thread_stop || (goes == form::submission && process_.receives);
        });
    if (what != operations().size()) process_.use_thread(choose_recipe(random_, uses_, what, plan_.bad_in));
  }

  // As fast as it is read, which takes most of a second; nobody else does anything meanwhile.
  void flood(untrusted_peer& by, const recipe& what, std::uint64_t times) {
    by.end_conditions();
    const std::uint64_t until = on_.count(counter::messages_in) + times;
    by.say(what, times, true);
    for (int left = 4000; left > 0 && on_.count(counter::messages_in) < until && !by.link().cut(); --left) {
      on_.now += 100us;
      act_honestly();
      look_of_loops();
      cycle();
      if (broken()) return;
    }
  }

  void wait() {
    constexpr duration waits[] = {1us, 50us, 500us, 1ms, 5ms, 20ms};
    on_.now += random_.one_of(waits);
    if (plan_.jumps && random_.one_in(400)) {
      const duration time = random_.one_in(4) ? 9s : 3s; // longer than anybody may be silent
      on_.now += time;
      context_.jumped += time;
      context_.say("the process does not run for " + std::to_string(time / 1s) + " s");
    }
  }
  // The service thread gets no core; the others go on.
  void freeze() {
    if (!plan_.freezes) return;
    const std::uint64_t turns = 1 + random_.below(30);
    context_.say("the service thread gets no core for " + std::to_string(turns * 5) + " ms");
    for (std::uint64_t left = turns; left > 0; --left) {
      on_.now += 5ms;
      process_.act();
      if (random_.one_in(4)) use_thread();
      process_.wait();
      look_of_loops();
    }
  }

  void quiesce() {
    forget_those_cut();
    for (const auto& p : untrusted_) {
      p->end_conditions();
      p->link().answers_pings = true;
      p->hear(SIZE_MAX);
    }
    process_.finish_up();
    on_.now += 20ms;
    cycle();
  }

  // ---- the cycle and what is checked after it

  void cycle() {
    if (broken()) return;
    const std::uint64_t stops = on_.count(counter::stops);
    on_.core.cycle(on_.now);
    ++context_.cycles;
    if (sim::looks_inside(seed_, context_.step)) {
      if (const auto wrong = on_.core.inconsistency(); !wrong.empty())
        result_.fail("structures", "do not agree: " + std::string{wrong});
    }
    if (broken()) return;
    process_.look_at_answers();
    honest_.stop.fresh = false;
    if (plan_.has_honest) honest_.look();
    if (plan_.has_honest && plan_.numbers) honest_by_number_.look();
    if (plan_.goals) honest_goals_.look();
    if (plan_.drives) driven_.look();
    check_counters();
    const bool reset_here = check_threads(stops);
    check_stop(on_.count(counter::stops) != stops, reset_here);
    hash_ = (hash_ ^ on_.core.slots_in_use() ^ (on_.count(counter::messages_out) << 20)) * 1099511628211U + 1;
  }

  void check_counters() {
    const auto& l = plan_.options.limits;
    const std::uint64_t in =
        on_.count(counter::messages_in) - counts_[static_cast<std::size_t>(counter::messages_in)];
    // What one message, value or tick of the wheel can cause at most, generously: a copy for each
    // subscription.
    const std::uint64_t bound =
        (in + 64 * l.handles_max + l.door_slots + l.small_slots + l.large_slots + 16) *
            (l.subscriptions_max + 4) +
        l.queued_max;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      const auto which = static_cast<counter>(i);
      const std::uint64_t before = std::exchange(counts_[i], on_.count(which));
      if (which == counter::bytes_in || which == counter::bytes_out ||
          which == counter::handshake_bytes_used || which == counter::phase_watched_ns ||
          which == counter::cycle_ns_max)
        continue;
      if (counts_[i] >= before && counts_[i] - before <= bound) continue;
      const std::string name{rowe::service::counter_descriptions[i].name};
      if (counts_[i] < before)
        return result_.fail("counters", name + " fell from " + std::to_string(before) + " to " +
                                            std::to_string(counts_[i]));
      return result_.fail("counters",
                          name + " rose by " + std::to_string(counts_[i] - before) + " in one cycle");
    }
  }

  // ---- the stop

  void look_of_loops() {
    for (const auto& one : process_.handles()) {
      if (one->kind() != handle_kind::latch || one->phase() != pair_phase::active) continue;
      if (random_.one_in(64)) one->looks = !one->looks;
      if (!one->looks && !random_.one_in(64)) continue;
      one->acknowledges = true;
      const bool moved = one->moves;
      const bool moves = one->look();
      if (moves && !may_move_ && context_.cycles > 0)
        result_.fail("stop_holds",
                     one->name() + (moved ? " goes on" : " begins to move") + " after " + forbidden_);
    }
  }

  // What threads of this process asked of the stop. Before the cycle `stops` had been counted. Returns
  // whether it carried out their reset, and rightly so.
  bool check_threads(std::uint64_t stops) {
    threads& all = process_.ordinary_threads();
    const bool in_use = std::exchange(stop_is_in_use_, stop_is_in_use_ || has_loop());
    const bool stop_asked = in_use && all.take_asked(); // until then it stays asked for
    if (stop_asked && in_use && on_.count(counter::stops) == stops)
      result_.fail("stop_of_threads", "a stop of a thread was not carried out");
    const bool reset_waited = all.resets();
    const bool stop_waited = all.waits_for_stop();
    const std::uint64_t acknowledged = all.answered().stops;
    all.listen();
    if (stop_waited && all.answered().stops != acknowledged) {
      for (const auto& one : process_.handles()) {
        if (one->kind() == handle_kind::latch && one->phase() == pair_phase::active && one->moves)
          result_.fail("stop_of_threads", one->name() + " moves, and a thread hears that it acknowledged");
      }
    }
    if (!reset_waited) return false;
    if (all.resets()) {
      if (in_use && on_.now >= all.reset_until())
        result_.fail("reset_of_threads", "a thread waits for its reset longer than it wanted");
      if (in_use) all.note_looked();
      return false;
    }
    const bool was_last = !all.stops_at_reset() || *all.stops_at_reset() == stops + (stop_asked ? 1 : 0);
    return all.answered().reset_outcome && was_last && !all.reset_overtaken();
  }
  bool has_loop() {
    const auto& all = process_.handles();
    return std::any_of(all.begin(), all.end(), [](const auto& one) {
      return one->kind() == handle_kind::latch && one->phase() == pair_phase::active;
    });
  }

  // The permit, and who may have caused it. `reset_here`: a thread of this process.
  void check_stop(bool stopped, bool reset_here) {
    const std::uint64_t word = on_.shared.permit.read();
    const bool running = rowe::detail::permit::time_of(word) != 0;
    check_latch(rowe::detail::permit::number_of(word));
    if (honest_.stop.fresh) {
      const std::int64_t number = honest_.stop.number;
      if (number_known_ && number < newest_number_)
        return result_.fail("stop_number", "the number of the stop fell from " +
                                               std::to_string(newest_number_) + " to " +
                                               std::to_string(number));
      if (number_known_ && number - newest_number_ > 1000)
        context_.say("the number of the stop rises from " + std::to_string(newest_number_) + " to " +
                     std::to_string(number));
      if (!number_known_ || number != newest_number_) {
        context_.known.old_stops.emplace_back(honest_.stop.number, honest_.stop.tick);
        if (context_.known.old_stops.size() > 12)
          context_.known.old_stops.erase(context_.known.old_stops.begin() +
                                         static_cast<std::ptrdiff_t>(context_.known.old_stops.size() / 2));
      }
      before_number_ = number_known_ ? newest_number_ : number;
      newest_number_ = number;
      number_known_ = true;
      const std::int64_t since_start =
          std::chrono::floor<std::chrono::milliseconds>(on_.now - start_).count();
      if (!first_tick_) first_tick_ = honest_.stop.tick - since_start;
      context_.known.stop_number = number;
      context_.known.tick = honest_.stop.tick;
    } else if (first_tick_) {
      context_.known.tick =
          *first_tick_ + std::chrono::floor<std::chrono::milliseconds>(on_.now - start_).count();
    }
    if (stopped) {
      last_stop_ = on_.now;
      stop_was_asked_ = true;
    }
    if (running && (!context_.running || stopped) && first_tick_ && honest_.stop.fresh) {
      if (!reset_here && !somebody_reset()) {
        may_move_ = false;
        forbidden_ = "a stop at " + std::to_string((last_stop_ - start_) / 1ms) +
                     " ms, which nobody reset (number " + std::to_string(before_number_) + " to " +
                     std::to_string(newest_number_) + ")";
      } else {
        may_move_ = true;
      }
    } else if (!running) {
      may_move_ = !number_known_; // without a peer to ask, nothing is known
      forbidden_ = "a stop at " + std::to_string((last_stop_ - start_) / 1ms) + " ms";
    }
    context_.running = running;
  }

  // Loops tell stops apart by a number of 16 bits that rises once a millisecond, so that it wraps around
  // later than any loop looks again. It may skip numbers that loops still have.
  void check_latch(std::int64_t latch) {
    constexpr std::int64_t turn = rowe::detail::latch_number_max;
    constexpr std::int64_t passed_over_max = 16;
    if (latch_ != 0 && latch != 0) {
      const std::int64_t risen = (latch - latch_ + turn) % turn;
      const std::int64_t most = (on_.now - latch_at_) / 1ms + 1 + passed_over_max;
      if (risen > most)
        result_.fail("stop_number", "the latch number rose by " + std::to_string(risen) + " in " +
                                        std::to_string((on_.now - latch_at_) / 1ms) + " ms");
    }
    latch_ = latch;
    latch_at_ = on_.now;
  }

  // Whether there was a reset that named a number between those of the last cycle and this one, and a tick
  // that may have been issued after the last stop.
  bool somebody_reset() const {
    const std::int64_t stopped_at =
        std::chrono::floor<std::chrono::milliseconds>(last_stop_ - start_).count();
    for (const auto& [number, tick] : context_.resets) {
      if (number < before_number_ || number > newest_number_ || tick < 0) continue;
      if (!stop_was_asked_ || tick - *first_tick_ >= stopped_at) return true;
    }
    return false;
  }

  std::uint64_t seed_;
  plan plan_;
  seeded_choices random_;
  run_result result_;
  core_harness on_;
  codec_check check_;
  context context_;
  process process_;
  honest honest_;
  honest_by_number honest_by_number_;
  honest_goals honest_goals_;
  driven_loop driven_;
  time_point start_;
  static constexpr unsigned chattiness[] = {0, 4, 100};
  static constexpr unsigned chattiness_of_echo[] = {1, 2, 8};
  // Members of what drivers say, by their places: else next to nothing would count.
  static constexpr std::pair<std::string_view, std::size_t> mostly_good[] = {
      {"command", 1}, {"command", 2}, {"command", 3}, {"control", 2}, {"control", 3}, {"control", 5}};

  weights uses_, operations_, actions_;
  bool has_spread_ = false;
  bool flood_left_ = plan_.floods;
  std::vector<std::unique_ptr<untrusted_peer>> untrusted_, leaving_;
  std::array<std::uint64_t, rowe::service::counter_descriptions.size()> counts_{};
  std::uint64_t hash_ = 1469598103934665603U;

  bool may_move_ = true;
  std::string forbidden_;
  bool number_known_ = false;
  std::int64_t newest_number_ = 0, before_number_ = 0;
  std::optional<std::int64_t> first_tick_;
  std::int64_t latch_ = 0; // the low 16 bits, as loops see them
  time_point latch_at_{};
  time_point last_stop_{};
  bool stop_was_asked_ = false;
  bool stop_is_in_use_ = false; // there was a loop before this cycle
};

} // namespace swarm
