// SPDX-License-Identifier: Apache-2.0
// Ways to hand items from one thread to one other, behind one face: push() and pop() return at once and say
// whether they succeeded. All have room for the same number of items, a power of two; all their memory is
// there before measuring, and each is used in the fastest way its documentation offers for one producer and
// one consumer.
#pragma once
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <vector>

#include <boost/lockfree/spsc_queue.hpp>
#include <concurrentqueue/concurrentqueue.h>
#include <readerwriterqueue/readerwriterqueue.h>

#include <rowe/rt/free_ring.hpp>
#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/window.hpp>

namespace rowe::bench {

template <class Item, std::size_t Places>
class rowe_ring {
 public:
  static constexpr const char* name = "rowe_ring";
  bool push(const Item& item) { return in_.try_push(item); }
  bool pop(Item& item) {
    const auto popped = out_.try_pop();
    if (popped) item = *popped;
    return popped.has_value();
  }

 private:
  using ring = rt::spsc_ring<Item>;
  std::vector<typename ring::entry> entries_ = std::vector<typename ring::entry>(Places);
  ring shared_{entries_};
  typename ring::producer& in_ = *shared_.take_producer();
  typename ring::consumer& out_ = *shared_.take_consumer();
};

// The same ring, its places given back once a batch: how the service thread empties queue pairs.
template <class Item, std::size_t Places>
class rowe_ring_drained {
 public:
  static constexpr const char* name = "rowe_ring_drained";
  bool push(const Item& item) { return in_.try_push(item); }
  bool pop(Item& item) {
    return out_.drain([&](const Item& each) { item = each; }, 64) !=
           0; // the last one is what the echo waits for
  }

 private:
  using ring = rt::spsc_ring<Item>;
  std::vector<typename ring::entry> entries_ = std::vector<typename ring::entry>(Places);
  ring shared_{entries_};
  typename ring::producer& in_ = *shared_.take_producer();
  typename ring::consumer& out_ = *shared_.take_consumer();
};

// Not a queue: only the newest item arrives.
template <class Item, std::size_t>
class rowe_window {
 public:
  static constexpr const char* name = "rowe_window";
  bool push(const Item& item) {
    in_.write(item);
    return true;
  }
  bool pop(Item& item) { return out_.read(item) == rt::freshness::fresh; }

 private:
  using window = rt::window<Item>;
  window shared_;
  typename window::writer& in_ = *shared_.take_writer();
  typename window::reader& out_ = *shared_.take_reader();
};

template <class Item, std::size_t Places>
class boost_spsc {
 public:
  static constexpr const char* name = "boost_spsc_queue";
  bool push(const Item& item) { return queue_.push(item); }
  bool pop(Item& item) { return queue_.pop(item); }

 private:
  boost::lockfree::spsc_queue<Item, boost::lockfree::capacity<Places>> queue_;
};

template <class Item, std::size_t Places>
class moodycamel_readerwriter {
 public:
  static constexpr const char* name = "moodycamel_ReaderWriterQueue";
  bool push(const Item& item) { return queue_.try_enqueue(item); }
  bool pop(Item& item) { return queue_.try_dequeue(item); }

 private:
  moodycamel::ReaderWriterQueue<Item> queue_{Places};
};

template <class Item, std::size_t Places>
class moodycamel_concurrent {
 public:
  static constexpr const char* name = "moodycamel_ConcurrentQueue";
  bool push(const Item& item) { return queue_.try_enqueue(in_, item); }
  bool pop(Item& item) { return queue_.try_dequeue_from_producer(in_, item); }

 private:
  moodycamel::ConcurrentQueue<Item> queue_{Places, 1, 0};
  moodycamel::ProducerToken in_{queue_};
};

// The naive way, and the paper's: the receiver sleeps. Its pop() waits.
template <class Item, std::size_t Places>
class mutex_condvar {
 public:
  static constexpr const char* name = "mutex_condvar_deque";
  bool push(const Item& item) {
    {
      const std::lock_guard lock{mutex_};
      if (items_.size() == Places) return false;
      items_.push_back(item);
    }
    arrived_.notify_one();
    return true;
  }
  bool pop(Item& item) {
    std::unique_lock lock{mutex_};
    arrived_.wait(lock, [this] { return !items_.empty(); });
    item = items_.front();
    items_.pop_front();
    return true;
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<Item> items_;
};

} // namespace rowe::bench
