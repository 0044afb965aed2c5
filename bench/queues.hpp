// SPDX-License-Identifier: Apache-2.0
// Ways to hand 64-bit items from one thread to one other, behind one face: push() and pop() return at once
// and say whether they succeeded. All have room for the same number of items, all their memory is there
// before measuring, and each is used in the fastest way its documentation offers for one producer and one
// consumer.
#pragma once
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include <boost/lockfree/spsc_queue.hpp>
#include <concurrentqueue/concurrentqueue.h>
#include <readerwriterqueue/readerwriterqueue.h>

#include <rowe/rt/home_ring.hpp>
#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/window.hpp>

namespace rowe::bench {

inline constexpr std::size_t places = 1024;

class rowe_ring {
 public:
  static constexpr const char* name = "rowe_ring";
  bool push(std::uint64_t item) { return in_.try_push(item); }
  bool pop(std::uint64_t& item) {
    const auto popped = out_.try_pop();
    if (popped) item = *popped;
    return popped.has_value();
  }

 private:
  using ring = rt::spsc_ring<std::uint64_t>;
  std::vector<ring::entry> entries_ = std::vector<ring::entry>(places);
  ring shared_{entries_};
  ring::producer& in_ = *shared_.take_producer();
  ring::consumer& out_ = *shared_.take_consumer();
};

// The same ring, its places given back once a batch: how the service thread empties lanes.
class rowe_ring_drained {
 public:
  static constexpr const char* name = "rowe_ring_drained";
  bool push(std::uint64_t item) { return in_.try_push(item); }
  bool pop(std::uint64_t& item) {
    return out_.drain([&](std::uint64_t each) { item = each; }, 64) !=
           0; // the last one is what the echo waits for
  }

 private:
  using ring = rt::spsc_ring<std::uint64_t>;
  std::vector<ring::entry> entries_ = std::vector<ring::entry>(places);
  ring shared_{entries_};
  ring::producer& in_ = *shared_.take_producer();
  ring::consumer& out_ = *shared_.take_consumer();
};

// Not a queue: only the newest item arrives.
class rowe_window {
 public:
  static constexpr const char* name = "rowe_window";
  bool push(std::uint64_t item) {
    in_.write(item);
    return true;
  }
  bool pop(std::uint64_t& item) { return out_.read(item) == rt::freshness::fresh; }

 private:
  using window = rt::window<std::uint64_t>;
  window shared_;
  window::writer& in_ = *shared_.take_writer();
  window::reader& out_ = *shared_.take_reader();
};

class boost_spsc {
 public:
  static constexpr const char* name = "boost_spsc_queue";
  bool push(std::uint64_t item) { return queue_.push(item); }
  bool pop(std::uint64_t& item) { return queue_.pop(item); }

 private:
  boost::lockfree::spsc_queue<std::uint64_t, boost::lockfree::capacity<places>> queue_;
};

class moodycamel_readerwriter {
 public:
  static constexpr const char* name = "moodycamel_ReaderWriterQueue";
  bool push(std::uint64_t item) { return queue_.try_enqueue(item); }
  bool pop(std::uint64_t& item) { return queue_.try_dequeue(item); }

 private:
  moodycamel::ReaderWriterQueue<std::uint64_t> queue_{places};
};

class moodycamel_concurrent {
 public:
  static constexpr const char* name = "moodycamel_ConcurrentQueue";
  bool push(std::uint64_t item) { return queue_.try_enqueue(in_, item); }
  bool pop(std::uint64_t& item) { return queue_.try_dequeue_from_producer(in_, item); }

 private:
  moodycamel::ConcurrentQueue<std::uint64_t> queue_{places, 1, 0};
  moodycamel::ProducerToken in_{queue_};
};

// The naive way, and the paper's: the receiver sleeps. Its pop() waits.
class mutex_condvar {
 public:
  static constexpr const char* name = "mutex_condvar_deque";
  bool push(std::uint64_t item) {
    {
      const std::lock_guard lock{mutex_};
      if (items_.size() == places) return false;
      items_.push_back(item);
    }
    arrived_.notify_one();
    return true;
  }
  bool pop(std::uint64_t& item) {
    std::unique_lock lock{mutex_};
    arrived_.wait(lock, [this] { return !items_.empty(); });
    item = items_.front();
    items_.pop_front();
    return true;
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<std::uint64_t> items_;
};

} // namespace rowe::bench
