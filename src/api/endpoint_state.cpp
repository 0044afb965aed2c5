// SPDX-License-Identifier: Apache-2.0
#include "api/endpoint_state.hpp"

#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <rowe/detail/calls.hpp>

#include "api/check_options.hpp"
#include "api/endpoint_recorder.hpp"
#include "api/forks.hpp"
#include "page/page.hpp"
#include "service/base/service_limits.hpp"
#include "service/core/memory_plan.hpp"
#include "service/handles/pair_release.hpp"
#include "wire/protocols/protocols.hpp"

namespace rowe::detail {
namespace {

using service::counter;

std::string host_name() {
  std::array<char, 64> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return "rowe";
  return name.data();
}

} // namespace

void kernel_entropy::fill(std::span<std::byte> bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t got = ::getrandom(bytes.data(), bytes.size(), 0);
    if (got < 0 && errno != EINTR) {
      std::memset(bytes.data(), 0, bytes.size());
      return;
    }
    if (got > 0) bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
}

// ---- opening

result<std::shared_ptr<endpoint_state>> endpoint_state::open(const endpoint_options& options,
                                                             service::side ours,
                                                             std::unique_ptr<service::transport> sockets,
                                                             std::uint16_t port) {
  if (const status ok = check_options(options); !ok) return ok.error();
  // In a child of fork() it stays as it is: its sockets are the parent's, its threads are not here.
  const auto dispose = [](endpoint_state* gone) {
    if (gone->forked()) return;
    forks::forget(*gone);
    delete gone;
  };
  std::shared_ptr<endpoint_state> state{new endpoint_state{options, std::move(sockets), port}, dispose};
  const bool has_site = ours == service::side::server && !options.web.empty();
  if (has_site && !state->site_.load(options.web).empty()) return errc::bad_web;
  if (const status ok = state->start(ours); !ok) return ok.error();
  forks::watch(*state);
  return state;
}

endpoint_state::endpoint_state(const endpoint_options& options, std::unique_ptr<service::transport> sockets,
                               std::uint16_t port)
    : options_{options},
      access_{std::make_unique<const access::policy>(options.access)},
      port_{port},
      name_{options.name.empty() ? host_name() : options.name},
      site_{options.page ? page::answer : page::login_alone},
      transport_{std::move(sockets)} {}

// All handles are gone, and so is the service thread. If views are left, by mistake, the memory stays mapped,
// so they stay valid.
endpoint_state::~endpoint_state() {
  (void)close(duration::zero()); // no caller is left that could get the error
  const bool looked_at = std::any_of(pairs_.begin(), pairs_.end(), [](queue_pair& one) {
    return !one.lifecycle.is_free() && !service::all_slots_released(one);
  });
  if (!looked_at) return;
  memory_.abandon();
  pair_memory_.abandon();
}

status endpoint_state::start(service::side ours) {
  ours_ = ours;
  const service::memory_plan plan = service::plan_memory(options_.limits);
  memory_ = rt::arena{plan.arena(), rt::page_lock::attempted};
  if (!memory_) return error{errc::no_memory, static_cast<std::int64_t>(plan.arena()), memory_.map_errno()};
  pair_memory_ = rt::arena{plan.pair_memory, rt::page_lock::in_parts};
  if (!pair_memory_)
    return error{errc::no_memory, static_cast<std::int64_t>(plan.pair_memory), pair_memory_.map_errno()};
  if (plan.chunks != 0) {
    chunk_pool_.emplace(plan.chunks); // not touched here
    if (chunk_pool_->bytes().empty())
      return error{errc::no_memory, static_cast<std::int64_t>(plan.chunks), chunk_pool_->map_errno()};
  }
  auto validator = json::reader::create(options_.limits.message_bytes_max, options_.limits.depth_max);
  if (!validator) return validator.error();
  validator_.emplace(std::move(validator).value());
  pairs_ = memory_.carve<queue_pair>(options_.limits.handles_max);
  pair_bytes_ = pair_memory_.carve_bytes(options_.limits.handle_bytes);
  pair_locked_.resize(pairs_.size());
  codecs_.resize(pairs_.size());
  given_up_.resize(pairs_.size());
  shared_ = memory_.make<service::shared_state>(memory_, options_.limits);
  submissions_ = memory_.make<service::submission_queue>(memory_, options_.limits);
  inbox_ = memory_.make<service::shared_inbox>(memory_, options_.limits);
  stops_.emplace(shared_->stops, *submissions_, *transport_, options_.stop.observe_timeout);
  waker_ = memory_.make<rt::waker<>>(rt::eventfd_signal{transport_->wake_descriptor()});
  auto chosen = service::core_options::from(options_, ours, name_);
  chosen.wall_offset_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                              std::chrono::system_clock::now().time_since_epoch())
                              .count() -
                          rt::nanoseconds_of(rt::monotonic_clock::now());
  core_ = memory_.make<service::core>(
      memory_, chosen, service::shared_parts{pairs_, *shared_, *submissions_, *inbox_},
      service::core_seams{*transport_, random_, *validator_, &site_, wire::protocols_of(options_.profile),
                          rights_, rt::monotonic_clock::now,
                          chunk_pool_ ? chunk_pool_->bytes() : std::span<std::byte>{},
                          chunk_pool_ ? &*chunk_pool_ : nullptr},
      rt::monotonic_clock::now());
  if (!rt::clock_is_cheap()) {
    event warning;
    warning.what_kind = event::kind::warning;
    warning.what = "reading the clock enters the kernel on this machine, in every cycle of a loop too";
    warning.remedy = "choose the clock source tsc or arch_sys_counter "
                     "(/sys/devices/system/clocksource/clocksource0/current_clocksource)";
    shared_->post(warning); // the service thread, the ring's producer, does not run yet
  }
  loop_.emplace(*core_, *transport_, *waker_, options_.idle_policy, options_.poll_period);

  rt::thread_options how{.name = "rowe", .priority = options_.service_priority};
  if (options_.service_cpu >= 0) how.cpu = options_.service_cpu;
  thread_ = rt::thread{how, [this](const rt::grants& granted) {
                         core_->describe_thread(granted, memory_.locked());
                         report_refused(granted);
                         loop_->run(static_cast<bool>(granted.fifo));
                       }};
  if (!thread_.joinable()) return error{errc::no_thread, thread_.error()};
  granted_ = thread_.grants();
  return {};
}

// On the service thread, the only producer of events.
void endpoint_state::report_refused(const rt::grants& granted) noexcept {
  if (!granted.pinned.refused() && !granted.fifo.refused()) return;
  constexpr std::string_view begin = "the service thread was not granted all options: ";
  std::array<char, service::event_text_bytes_max> buffer;
  const std::size_t begin_bytes = begin.copy(buffer.data(), buffer.size());
  const std::size_t rest_bytes = granted.text(std::span{buffer}.subspan(begin_bytes)).size();
  event warning;
  warning.what_kind = event::kind::warning;
  warning.what = std::string_view{buffer.data(), begin_bytes + rest_bytes};
  warning.remedy = "`rowe doctor` says what this machine permits";
  shared_->post(warning);
}

// ---- queue pairs

// Waits until the queue pairs of handles that were just destroyed are free again, so a program that replaces
// handles finds the memory it had. If a peer does not take the last values of a queue pair, this waits no
// longer than for the peer itself, and only once, because the peer may never come. It does not wait for a
// queue pair that still has views: perhaps only this thread can release them.
void endpoint_state::release_pairs() noexcept {
  const auto deadline = rt::deadline_after(rt::monotonic_clock::now(), service::closing_time_max);
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    queue_pair& one = pairs_[i];
    given_up_[i] = given_up_[i] || !one.lifecycle.wait_while_closing(one.arrival, deadline);
  }
}

// The first gap of so many bytes between queue pairs in use; empty if there is none.
std::span<std::byte> endpoint_state::find_pair_memory(std::size_t bytes) const noexcept {
  std::byte* at = pair_bytes_.data();
  for (;;) {
    const queue_pair* next = nullptr; // the queue pair in use that comes next in memory
    for (const queue_pair& one : pairs_) {
      if (one.lifecycle.is_free() || one.memory.data() < at) continue;
      if (next == nullptr || one.memory.data() < next->memory.data()) next = &one;
    }
    std::byte* const end = next != nullptr ? next->memory.data() : pair_bytes_.data() + pair_bytes_.size();
    if (static_cast<std::size_t>(end - at) >= bytes) return {at, bytes};
    if (next == nullptr) return {};
    at = end + next->memory.size();
  }
}

result<queue_pair*> endpoint_state::find_pair(std::size_t bytes) noexcept {
  const auto free = std::find_if(pairs_.begin(), pairs_.end(),
                                 [](const queue_pair& one) { return one.lifecycle.is_free(); });
  if (free == pairs_.end()) {
    return error{errc::too_many_handles, static_cast<std::int64_t>(pairs_.size()),
                 options_.limits.handles_max};
  }
  const auto memory = find_pair_memory(bytes);
  if (memory.empty()) {
    std::size_t left = pair_bytes_.size();
    for (const queue_pair& one : pairs_) left -= one.lifecycle.is_free() ? 0 : one.memory.size();
    return error{errc::handle_memory, static_cast<std::int64_t>(bytes), static_cast<std::int64_t>(left),
                 argument::handle_bytes, static_cast<std::uint32_t>(pair_bytes_.size())};
  }
  free->memory = memory;
  return &*free;
}

// What is not locked is counted, and nothing fails for that: the memory is there.
status endpoint_state::prepare_pair(std::size_t index) noexcept {
  const auto size = static_cast<std::int64_t>(pairs_[index].memory.size());
  const auto prepared = rt::arena::prepare_part(pairs_[index].memory);
  if (prepared.populate_errno != 0) return error{errc::no_memory, size, prepared.populate_errno};
  pair_locked_[index] = prepared.locked;
  std::size_t unlocked = pair_locked_[index] ? 0 : pairs_[index].memory.size();
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    if (i != index && !pairs_[i].lifecycle.is_free() && !pair_locked_[i]) unlocked += pairs_[i].memory.size();
  pairs_unlocked_bytes_.store(unlocked);
  return {};
}

result<queue_pair*> endpoint_state::open_pair(const pair_request& asked) {
  if (const status ok = check_request(asked, options_); !ok) return ok.error();
  pair_request cut = asked;
  cut.type = cut.type.substr(0, options_.limits.topic_bytes_max);
  auto codecs = pair_codecs::compile(asked, options_.limits);
  if (!codecs) return codecs.error();

  const std::lock_guard set_up{set_up_};
  if (closed_) return errc::closed;
  release_pairs();
  const auto found = find_pair(pair_bytes(cut));
  if (!found) return found.error();
  queue_pair& built = **found;
  const auto index = static_cast<std::size_t>(&built - pairs_.data());
  given_up_[index] = false;
  if (const status done = prepare_pair(index); !done) return done.error();
  build_pair(built, cut, shared_->generations());
  built.peers_taking = shared_->takers();
  pair_codecs& kept = codecs_[index];
  kept = std::move(codecs).value();
  built.encoder = kept.encoder ? &*kept.encoder : nullptr;
  built.other_encoders = kept.others();
  built.decoder = kept.decoder ? &*kept.decoder : nullptr;
  built.waker = handles_wake() ? waker_ : nullptr;
  built.granted = &shared_->permit;
  shared_->use_pair(static_cast<std::uint32_t>(index));
  built.lifecycle.offer();
  transport_->wake();
  if (const status done = built.lifecycle.wait_answer(built.arrival); !done) return done.error();
  if (is_latch(built.kind)) stops_->begin();
  return &built;
}

void endpoint_state::close_pair(queue_pair& gone) noexcept {
  if (forked_) return;
  gone.lifecycle.close();
  transport_->wake();
}

// ---- rights

status endpoint_state::set_access(const access_options& access, std::string& wrong) {
  const std::lock_guard set_up{set_up_};
  if (closed_) return errc::closed;
  if (ours_ == service::side::client) return errc::misuse;
  if (access_->in_use() && access.identities.empty()) {
    wrong = "no identity is left, so everyone might do everything: keep one, or close the endpoint";
    return errc::bad_access;
  }
  auto next = std::make_unique<const access::policy>(access, *access_);
  rights_.offer(*next);
  transport_->wake();
  rights_.wait_taken();
  access_ = std::move(next); // nobody looks at the old one any more
  return {};
}

// ---- closing

status endpoint_state::close(duration drain) noexcept {
  if (forked_) return errc::forked;
  const std::lock_guard set_up{set_up_};
  if (closed_) return {};
  closed_ = true;
  if (!thread_.joinable()) return {};
  submissions_->close();
  inbox_->close();
  shared_->peers_changed.notify(); // wait_peer() looks whether submissions are closed
  loop_->stop(rt::deadline_after(rt::monotonic_clock::now(), std::max(drain, duration::zero())));
  thread_.join();
  stops_->end();
  submissions_->finish();
  shared_->parameters.end();
  for (endpoint_recorder* const one : recorders_) one->finish(endpoint_recorder::closing_time_max);
  for (queue_pair& one : pairs_) {
    one.audience.close();
    count_left(one);
    one.arrival.notify();
  }
  if (loop_->drained()) return {};
  return error{errc::timed_out, 0, drain.count()};
}

// ---- forking

namespace {

// What has come for a handle before the fork is the parent's to take.
void drop_arrivals(queue_pair& on) noexcept {
  queue_pair::user_side& mine = on.user;
  while (mine.in.ring != nullptr && mine.in.ring->try_pop()) continue;
  if (mine.in.newest != nullptr) (void)mine.in.newest->begin_read();
  while (mine.completions.ring != nullptr && take_completion(on)) continue;
}

} // namespace

// Handles look at their queue pairs without asking whose process this is. So the child gets queue pairs of
// its own in the place of the shared ones, and finds them closed. What their threads were just doing in the
// parent does not matter: each word is one that these threads have written.
void endpoint_state::enter_child() noexcept {
  if (std::exchange(forked_, true)) return; // a child of a child
  const bool separate = memory_.separate_in_child();
  if (!pair_memory_.separate_in_child() || !separate) return; // it may be read, and no more
  for (queue_pair& one : pairs_) {
    one.audience.close();
    one.closed_as = errc::forked;
    one.waker = nullptr;
    if (!one.lifecycle.is_free()) drop_arrivals(one);
  }
  shared_->permit.withdraw(permit::number_of(shared_->permit.read()));
  shared_->parameters.end_in_child();
}

// ---- counting

// Counts what was published and nobody will take now. The service thread is gone, so this thread may use its
// ends.
void endpoint_state::count_left(const queue_pair& in) noexcept {
  if (in.lifecycle.is_detached()) return;
  const consumer_end& end = in.service.out;
  std::size_t left = 0;
  if (end.ring != nullptr) left = end.ring->pending_at_least();
  if (end.newest != nullptr && end.newest->begin_read().state == rt::freshness::fresh) left = 1;
  shared_->counts.add(counter::lost_at_close, left);
}

// ---- queries

status endpoint_state::wait_peer(duration timeout) noexcept {
  const std::lock_guard one_waiter{peer_waiter_};
  const auto deadline = rt::deadline_after(rt::monotonic_clock::now(), timeout);
  const auto over = [&] { return submissions_->is_closed() || shared_->peers() > 0; };
  if (shared_->peers_changed.wait_until(deadline, over)) {
    return submissions_->is_closed() ? status{errc::closed} : status{};
  }
  return error{errc::timed_out, 0, timeout.count()};
}

std::optional<event> endpoint_state::try_event() noexcept {
  const std::lock_guard one_reader{events_};
  return shared_->try_event();
}

std::vector<count> endpoint_state::counts() const {
  constexpr std::string_view groups[] = {"loss", "chosen", "flow", "refusal", "own"};
  std::vector<count> all;
  all.reserve(service::counter_descriptions.size());
  for (std::size_t i = 0; i < service::counter_descriptions.size(); ++i) {
    const auto& what = service::counter_descriptions[i];
    all.push_back({what.name, groups[static_cast<std::size_t>(what.group)], what.meaning,
                   service::read_count(*shared_, pairs_, static_cast<counter>(i))});
  }
  return all;
}

bool endpoint_state::gone(peer_ref whom) const noexcept {
  if (whom.generation == 0) return false;
  const auto generations = shared_->generations();
  if (whom.index >= generations.size()) return true; // of another endpoint
  // relaxed: pairs with the stores in shared_state::set_connection(); advice, which the service thread checks
  // again
  return generations[whom.index].load(std::memory_order_relaxed) != whom.generation;
}

bool endpoint_state::takes(peer_ref whom) const noexcept {
  if (whom.generation == 0) return true;
  // relaxed: pairs with the stores in shared_state::set_taking(); advice, which the service thread checks
  // again
  return shared_->takers()[whom.index].load(std::memory_order_relaxed) == whom.generation;
}

void close_pair(endpoint_state& of, queue_pair& gone) noexcept { of.close_pair(gone); }
void wake_service(endpoint_state& of) noexcept { of.wake_service(); }

} // namespace rowe::detail
