// SPDX-License-Identifier: Apache-2.0
// Everything behind an endpoint, put together: memory, transport, core, service thread. Set-up calls come
// from any thread and take a mutex; the service thread takes none.
#pragma once
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <rowe/detail/pair_request.hpp>
#include <rowe/endpoint.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/thread.hpp>

#include "api/chunk_memory.hpp"
#include "api/local_stops.hpp"
#include "api/pair_memory.hpp"
#include "page/site.hpp"
#include "service/base/transport.hpp"
#include "service/core/core.hpp"
#include "service/core/service_loop.hpp"
#include "service/threads/policy_handover.hpp"
#include "service/threads/shared_inbox.hpp"
#include "service/threads/shared_state.hpp"
#include "service/threads/submission_queue.hpp"
#include "json/reading/reader.hpp"

namespace rowe::detail {

// The kernel's random bytes. A failure cannot happen after start-up (getrandom(2)); if it does, masks are
// zero.
class kernel_entropy final : public service::entropy {
 public:
  void fill(std::span<std::byte> bytes) noexcept override;
};

class endpoint_recorder;

class endpoint_state {
 public:
  // Takes all memory and starts the service thread. Errors: no_memory, no_thread, bad_argument.
  // Errors: those of check_options(), bad_web, no_memory, no_thread.
  static result<std::shared_ptr<endpoint_state>> open(const endpoint_options& options, service::side ours,
                                                      std::unique_ptr<service::transport> sockets,
                                                      std::uint16_t port);

  endpoint_state(const endpoint_options& options, std::unique_ptr<service::transport> sockets,
                 std::uint16_t port);
  ~endpoint_state();
  endpoint_state(const endpoint_state&) = delete;
  endpoint_state& operator=(const endpoint_state&) = delete;

  result<queue_pair*> open_pair(const pair_request& asked);
  void close_pair(queue_pair& gone) noexcept;
  // From then on the recorder hears what is published, until end_recording() returns: it waits for the
  // service thread. Errors: too_many_recordings, too_many_handles, closed.
  result<queue_pair*> begin_recording(endpoint_recorder& by);
  void end_recording(queue_pair& gone, endpoint_recorder& by) noexcept;
  std::size_t topics_max() const noexcept { return options_.limits.topics_max; }
  const std::string& name() const noexcept { return name_; }
  result<parameter_cell*> open_parameter(const parameter_request& asked);
  void close_parameter(parameter_cell& gone) noexcept;
  // Has the service thread look at queue pairs and submissions now. Any thread.
  void wake_service() noexcept {
    if (!forked_) transport_->wake();
  }

  // In a child of fork(), before it does anything else: from now on nothing here is shared with the parent.
  void enter_child() noexcept;
  // Whether this process is such a child, which has no service thread and must not touch the sockets.
  bool forked() const noexcept { return forked_; }

  // The options are right: check_access(). `wrong` is assigned why they cannot replace those before.
  status set_access(const access_options& access, std::string& wrong);
  status close(duration drain) noexcept;
  status wait_peer(duration timeout) noexcept;
  std::optional<event> try_event() noexcept;
  std::vector<count> counts() const;
  std::uint32_t peers() const noexcept { return shared_->peers(); }
  std::vector<peer> connections() const { return shared_->connections(); }
  identity_name identity_of(const connection& of) const noexcept { return shared_->identity_of(of); }
  // Whether a connection has ended since it was named. Any thread.
  bool gone(peer_ref whom) const noexcept;
  // Whether a connection that is there takes messages: it does not while its share of parked messages is used
  // up. Any thread.
  bool takes(peer_ref whom) const noexcept;
  service::submission_queue& submissions() noexcept { return *submissions_; }
  service::shared_inbox& inbox() noexcept { return *inbox_; }
  local_stops& stops() noexcept { return *stops_; }
  std::uint16_t port() const noexcept { return port_; }
  int wake_descriptor() const noexcept { return handles_wake() ? transport_->wake_descriptor() : -1; }
  // Of a latch with this option, opened by a thread with or without a real-time priority.
  stop_times stop_times_of(duration loop_timeout, bool real_time) const noexcept;
  const rt::grants& service_grants() const noexcept { return granted_; }
  bool memory_locked() const noexcept { return memory_.locked() && memory_unlocked_bytes() == 0; }
  std::size_t memory_unlocked_bytes() const noexcept {
    return (memory_.locked() ? 0 : memory_.bytes_total()) + pairs_unlocked_bytes_.load();
  }

 private:
  bool handles_wake() const noexcept { return options_.idle_policy == idle::wake; }
  status start(service::side ours);
  void report_refused(const rt::grants& granted) noexcept;
  void release_pairs() noexcept;
  void count_left(const queue_pair& in) noexcept;
  result<queue_pair*> find_pair(std::size_t bytes) noexcept;
  status prepare_pair(std::size_t index) noexcept;
  std::span<std::byte> find_pair_memory(std::size_t bytes) const noexcept;

  const endpoint_options options_;
  std::unique_ptr<const access::policy> access_; // the newest
  service::policy_handover<> rights_{*access_};
  const std::uint16_t port_;
  std::string name_;
  page::site site_;
  rt::arena memory_;
  rt::arena pair_memory_; // of the queue pairs, locked as each is opened: what comes first is locked
  std::atomic<std::size_t> pairs_unlocked_bytes_{0};
  std::optional<chunk_memory> chunk_pool_; // for long messages
  kernel_entropy random_;
  std::unique_ptr<service::transport> transport_;
  std::optional<json::reader> validator_;
  service::shared_state* shared_ = nullptr;
  std::span<queue_pair> pairs_;
  std::span<std::byte> pair_bytes_; // all of pair_memory_
  std::vector<bool> pair_locked_;   // of the queue pair with the same index
  std::vector<pair_codecs> codecs_; // of the queue pair with the same index
  std::vector<bool> given_up_;      // likewise: release_pairs() has waited for it in vain
  std::vector<endpoint_recorder*> recorders_;
  service::submission_queue* submissions_ = nullptr;
  service::shared_inbox* inbox_ = nullptr;
  std::optional<local_stops> stops_;
  rt::waker<>* waker_ = nullptr;
  service::core* core_ = nullptr;
  std::optional<service::service_loop> loop_;
  rt::thread thread_;
  rt::grants granted_;

  std::mutex set_up_;      // queue pairs, rights, closing
  std::mutex events_;      // the consumer end of the ring of events
  std::mutex peer_waiter_; // peers_changed has one waiter
  bool closed_ = false;
  bool forked_ = false; // written by enter_child() alone, when the process has one thread
  service::side ours_ = service::side::server;
};

} // namespace rowe::detail
