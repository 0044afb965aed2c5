// SPDX-License-Identifier: Apache-2.0
// Rowe's first design, as the report on it describes it (RR-452, sections 2.2 and 3), built plainly on what
// it named: libwebsockets, json-c, a mutex and condition variables. It is what rowe is compared with, so it
// is written as a good engineer of its time would have, with nothing slow that the design does not ask for.
//
// An endpoint has one peer at a time and one service thread, which runs libwebsockets' loop. User threads put
// messages into a queue and wake that thread by lws_cancel_service(); it writes when the connection is
// writable. What arrives it parses and puts into another queue, or gives to the invocation whose message_id
// stands in `in_reply_to`. Whoever waits, waits on a condition variable. Both queues are doubly linked lists
// in the order of arrival and, through the same items, in the order of expiry. All state that threads share
// is under one mutex.
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <json-c/json.h>
#include <libwebsockets.h>

namespace rowe::baseline_v1 {

using clock = std::chrono::steady_clock;
inline constexpr clock::duration for_ever = std::chrono::hours{24 * 365};

struct put_object {
  void operator()(json_object* of) const noexcept { json_object_put(of); }
};
using object = std::unique_ptr<json_object, put_object>;

// Items that expire, oldest first. Taking one out costs the same wherever it stands. Putting one in looks for
// its place in the order of expiry from the last backwards, so equal times to live cost nothing.
template <class Item>
class expiring_queue {
 public:
  bool empty() const { return items_.empty(); }
  clock::time_point earliest_expiry() const {
    return by_expiry_.empty() ? clock::time_point::max() : by_expiry_.front()->expires;
  }
  void push(Item item, clock::time_point expires) {
    const auto at = items_.insert(items_.end(), {std::move(item), expires, {}});
    auto before = by_expiry_.end();
    while (before != by_expiry_.begin() && (*std::prev(before))->expires > expires) --before;
    at->place = by_expiry_.insert(before, at);
  }
  Item pop() {
    by_expiry_.erase(items_.front().place);
    Item item = std::move(items_.front().item);
    items_.pop_front();
    return item;
  }
  // Takes out what has expired at `now`, and shows each to `gone(Item&)`.
  template <class Gone>
  void expire(clock::time_point now, Gone&& gone) {
    while (!by_expiry_.empty() && by_expiry_.front()->expires <= now) {
      const auto at = by_expiry_.front();
      by_expiry_.pop_front();
      gone(at->item);
      items_.erase(at);
    }
  }

 private:
  struct entry;
  using place_in_time = typename std::list<entry>::iterator;
  struct entry {
    Item item;
    clock::time_point expires;
    typename std::list<place_in_time>::iterator place;
  };
  std::list<entry> items_;
  std::list<place_in_time> by_expiry_;
};

enum class outcome { sent, expired, closed };

class endpoint {
 public:
  // An HTTP server on this port of the loopback device (0: any free one), or a client of one. Null when it
  // cannot be opened.
  static std::unique_ptr<endpoint> open_local(int port);
  static std::unique_ptr<endpoint> open_remote(const std::string& host, int port);
  ~endpoint(); // nobody may wait in it any more
  endpoint(const endpoint&) = delete;
  endpoint& operator=(const endpoint&) = delete;

  int port() const { return port_; }
  bool wait_peer(clock::duration timeout);

  // Any thread. A message that found no peer within `ttl` is discarded. send() and reply() wait for one or
  // the other; the others return at once.
  outcome send(const object& message, clock::duration ttl);
  void async_send(const object& message, clock::duration ttl);
  outcome reply(const object& invocation, const object& with, clock::duration ttl);
  void async_reply(const object& invocation, const object& with, clock::duration ttl);

  // The next message that is no reply; null after `timeout`.
  object receive(clock::duration timeout);

  // Adds a message_id, sends, and waits for the reply that names it; null after `timeout`.
  object invoke(const object& what, clock::duration timeout);

 private:
  // What a thread waits for that sends: lives on that thread's stack.
  struct notification {
    std::condition_variable happened;
    std::optional<outcome> what;
  };
  // An invocation whose reply has not come; on the stack of the thread that invokes.
  struct waiting_call {
    std::string_view id;
    std::condition_variable replied;
    object reply;
  };
  struct outgoing {
    std::vector<unsigned char> frame; // behind the room that libwebsockets wants in front
    notification* sender = nullptr;
  };

  endpoint() = default;
  bool open(int port);
  bool connect(const std::string& host, int port);
  void serve();
  void queue(const object& message, clock::time_point expires, notification* sender);
  outcome queue_and_wait(const object& message, clock::duration ttl);

  // Service thread.
  static void tell(notification* sender, outcome what);
  static int callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t bytes);
  static void expiry_is_due(lws_sorted_usec_list_t* timer);
  int on_event(lws* wsi, lws_callback_reasons reason, std::string_view in);
  int join(lws* wsi);
  void leave(lws* wsi);
  void take_piece(lws* wsi, std::string_view piece);
  void take(object message);
  int write_next(lws* wsi);
  void expire(clock::time_point now);
  void arm_expiry();

  struct timer {
    lws_sorted_usec_list_t list{}; // first: libwebsockets gives back a pointer to it
    endpoint* of = nullptr;
  };
  static const lws_protocols protocols[];

  lws_context* context_ = nullptr;
  int port_ = 0;
  std::atomic<bool> ends_{false};
  std::thread service_;

  // Service thread.
  lws* peer_ = nullptr;
  std::string coming_; // pieces of a message that is not complete
  json_tokener* tokener_ = nullptr;
  timer expiry_;
  clock::time_point expiry_armed_ = clock::time_point::max();

  std::mutex mutex_; // of everything below
  bool has_peer_ = false;
  std::condition_variable peer_came_;
  expiring_queue<outgoing> outbox_;
  expiring_queue<object> inbox_;
  std::condition_variable arrived_;
  std::list<waiting_call*> calls_;
  std::uint64_t invoked_ = 0;
};

} // namespace rowe::baseline_v1
