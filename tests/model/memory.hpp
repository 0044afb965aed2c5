// SPDX-License-Identifier: Apache-2.0
// The memory of C++20, operationally: every store of a word is kept, in modification order, and a load may
// return any of them that coherence allows. The operations of a run are executed one after another in an
// order that extends "sequenced before" and "reads from"; a load picks its store among those executed, a
// store picks its place in the modification order. Happens-before is kept by vector clocks, and so is C++20's
// "strongly happens before" for the total order of seq_cst operations, which is kept as a partial order: a
// choice is offered if and only if what is known can still be completed to a total order. explorer.hpp says
// what this model leaves out.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/choices.hpp"
#include "model/scenario.hpp"
#include "model/site.hpp"

namespace rowe::model {

constexpr bool acquires(order o) noexcept {
  return o == order::acquire || o == order::acq_rel || o == order::seq_cst;
}
constexpr bool releases(order o) noexcept {
  return o == order::release || o == order::acq_rel || o == order::seq_cst;
}

inline constexpr std::size_t threads_max = 5; // four actors, and the thread that sets up and looks afterwards
inline constexpr std::size_t steps_max = 256; // atomic operations a run, half the actors', half afterwards'

// A moment in a thread: its tick-th atomic operation, or plain accesses just before it.
struct moment {
  std::size_t thread;
  std::uint32_t tick;
};

// A vector clock: of each thread, the last moment that is known.
class knowledge {
 public:
  std::uint32_t& operator[](std::size_t thread) noexcept { return ticks_[thread]; }
  std::uint32_t operator[](std::size_t thread) const noexcept { return ticks_[thread]; }
  bool has(const moment& m) const noexcept { return ticks_[m.thread] >= m.tick; }
  void join(const knowledge& other) noexcept {
    for (std::size_t i = 0; i != threads_max; ++i) ticks_[i] = std::max(ticks_[i], other.ticks_[i]);
  }

 private:
  std::array<std::uint32_t, threads_max> ticks_{};
};

// An access to plain data, kept to tell what raced with what.
struct access {
  moment when;
  site where;
  bool writes;
};

class memory {
 public:
  explicit memory(choices& by) noexcept : choices_{by} {}

  // Forgets everything: the next run begins, in thread 0.
  void clear() noexcept;
  // `child` begins and knows all that `parent` has done; `parent` learns all that `child` has done.
  void fork(std::size_t parent, std::size_t child) noexcept;
  void join(std::size_t parent, std::size_t child) noexcept;

  // A word or a datum is made, with the number by which it is known in this run.
  std::size_t make_word(std::size_t thread, std::uint64_t value);
  std::size_t make_plain(std::size_t thread, const site& where);
  // Whether `thread` may touch the word at all: its construction must happen before.
  bool knows_word(std::size_t thread, std::size_t word) const noexcept {
    return seen(thread, words_[word].stores.front().when);
  }

  std::uint64_t load(std::size_t thread, std::size_t word, order o);
  void store(std::size_t thread, std::size_t word, std::uint64_t value, order o);
  std::uint64_t exchange(std::size_t thread, std::size_t word, std::uint64_t value, order o);
  // How many stores in modification order lie behind the one just read or written: 0 is the newest.
  std::size_t newer_stores() const noexcept { return newer_stores_; }

  // A plain access; returns the earlier one that it races with, or nullptr.
  const access* read_plain(std::size_t thread, std::size_t datum, const site& where);
  const access* write_plain(std::size_t thread, std::size_t datum, const site& where);

  // Blocking primitives of the operating system order memory like a release and an acquire of one word.
  void release_into(std::size_t thread, knowledge& carried) noexcept;
  void acquire_from(std::size_t thread, const knowledge& carried) noexcept;

 private:
  // What a reader of a store learns, if it acquires. A store that releases gives its own; a read-modify-write
  // also passes on what it read (C++20's release sequence: read-modify-writes only, no plain stores of the
  // same thread).
  struct message {
    knowledge happened; // happens before the acquiring load
    knowledge strongly; // strongly happens before what is sequenced after the acquiring load
    knowledge total;    // strongly happens before the load itself, if that is seq_cst: the head was seq_cst
    void join(const message& other) noexcept {
      happened.join(other.happened);
      strongly.join(other.strongly);
      total.join(other.total);
    }
  };
  struct written {
    std::uint64_t value;
    moment when;
    std::size_t position; // in the modification order
    bool modifies;        // written by a read-modify-write, which keeps its place next to the store it read
    message carried;
  };
  struct read {
    moment when;
    std::size_t store;
  };
  struct history {
    std::vector<written> stores;           // in the order of execution
    std::vector<std::size_t> modification; // the same in modification order
    std::vector<read> loads;
  };
  struct datum {
    access last_write;
    std::vector<access> reads; // since the last write, the last one of each thread
  };
  struct view {
    knowledge happened; // what happens before the thread's next operation
    knowledge strongly; // what strongly happens before it
  };

  // A seq_cst operation. Its place among the operations on its word is that of the store it wrote or read.
  using set = std::bitset<steps_max>;
  struct total_operation {
    moment when;
    std::size_t word;
    std::size_t store;
    bool writes;
    set before; // those that precede it in every total order
  };

  // Places on a word's line: a store at position p stands at 4p, its readers at 4p+2, and a store about to be
  // put in between p-1 and p at 4p-1, behind the readers of p-1.
  std::size_t place_of(const total_operation& t) const noexcept {
    return 4 * words_[t.word].stores[t.store].position + (t.writes ? 0 : 2);
  }
  static std::size_t place_of_new(std::size_t position) noexcept { return 4 * position - 1; }

  bool seen(std::size_t thread, const moment& m) const noexcept {
    return m.thread == thread || views_[thread].happened.has(m);
  }
  moment begin_operation(std::size_t thread) noexcept;
  moment plain_moment(std::size_t thread) const noexcept {
    return {thread, views_[thread].happened[thread] + 1};
  }
  std::size_t oldest_allowed(std::size_t thread, const history& w) const noexcept;
  // Collects in `candidates_` what of [from, to] fits, the highest first, and lets the choices pick one.
  template <class Fits>
  std::size_t pick_position(std::size_t from, std::size_t to, Fits fits);
  bool fits_total_order(const moment& when, std::size_t word, std::size_t place, const knowledge& strongly,
                        set* before = nullptr) const noexcept;
  void enter_total_order(const moment& when, std::size_t word, std::size_t store, bool writes,
                         const knowledge& strongly);
  // What strongly happens before a seq_cst operation of `thread` that synchronises with `carried`.
  knowledge strongly_with(std::size_t thread, const message& carried) const noexcept;
  void learn(std::size_t thread, const message& carried) noexcept;
  std::size_t put(history& w, std::size_t position, const written& s);

  choices& choices_;
  std::array<view, threads_max> views_{};
  std::vector<history> words_;
  std::vector<datum> data_;
  std::vector<total_operation> total_;
  std::vector<std::size_t> candidates_;
  std::size_t words_made_ = 0;
  std::size_t newer_stores_ = 0;
};

inline void memory::clear() noexcept {
  views_ = {};
  words_made_ = 0; // the words themselves are used again, so that a run allocates next to nothing
  data_.clear();
  total_.clear();
}

inline void memory::fork(std::size_t parent, std::size_t child) noexcept {
  const moment m = begin_operation(parent);
  views_[child].happened.join(views_[parent].happened);
  views_[child].strongly.join(views_[parent].strongly);
  views_[child].strongly[parent] = m.tick;
}

inline void memory::join(std::size_t parent, std::size_t child) noexcept {
  const moment m = begin_operation(child);
  views_[parent].happened.join(views_[child].happened);
  views_[parent].strongly.join(views_[child].strongly);
  views_[parent].strongly[child] = m.tick;
}

inline std::size_t memory::make_word(std::size_t thread, std::uint64_t value) {
  if (words_made_ == words_.size()) words_.emplace_back();
  history& w = words_[words_made_];
  w.stores.clear();
  w.modification.clear();
  w.loads.clear();
  w.stores.push_back({value, plain_moment(thread), 0, false, {}});
  w.modification.push_back(0);
  return words_made_++;
}

inline std::size_t memory::make_plain(std::size_t thread, const site& where) {
  data_.push_back({{plain_moment(thread), where, true}, {}});
  return data_.size() - 1;
}

inline moment memory::begin_operation(std::size_t thread) noexcept {
  view& v = views_[thread];
  v.strongly[thread] = v.happened[thread];
  return {thread, ++v.happened[thread]};
}

// Coherence: nothing older than a store, or than the store read by a load, that happens before.
inline std::size_t memory::oldest_allowed(std::size_t thread, const history& w) const noexcept {
  std::size_t oldest = 0;
  for (const written& s : w.stores) {
    if (s.position > oldest && seen(thread, s.when)) oldest = s.position;
  }
  for (const read& r : w.loads) {
    const std::size_t position = w.stores[r.store].position;
    if (position > oldest && seen(thread, r.when)) oldest = position;
  }
  return oldest;
}

template <class Fits>
std::size_t memory::pick_position(std::size_t from, std::size_t to, Fits fits) {
  candidates_.clear();
  for (std::size_t position = to + 1; position-- > from;) {
    if (fits(position)) candidates_.push_back(position);
  }
  return candidates_[choices_.pick(candidates_.size())]; // the newest always fits: nothing follows it
}

inline std::uint64_t memory::load(std::size_t thread, std::size_t number, order o) {
  const moment now = begin_operation(thread);
  history& w = words_[number];
  const auto store_at = [&w](std::size_t position) -> const written& {
    return w.stores[w.modification[position]];
  };
  const std::size_t newest = w.modification.size() - 1;
  const std::size_t position = pick_position(oldest_allowed(thread, w), newest, [&](std::size_t p) {
    return o != order::seq_cst ||
           fits_total_order(now, number, 4 * p + 2, strongly_with(thread, store_at(p).carried));
  });
  const std::size_t store = w.modification[position];
  const written& s = w.stores[store];
  w.loads.push_back({now, store});
  newer_stores_ = newest - position;
  if (o == order::seq_cst) {
    views_[thread].strongly = strongly_with(thread, s.carried);
    enter_total_order(now, number, store, false, views_[thread].strongly);
  }
  if (acquires(o)) learn(thread, s.carried);
  return s.value;
}

inline void memory::store(std::size_t thread, std::size_t number, std::uint64_t value, order o) {
  const moment now = begin_operation(thread);
  history& w = words_[number];
  const view& v = views_[thread];
  const std::size_t end = w.modification.size();
  const std::size_t position = pick_position(oldest_allowed(thread, w) + 1, end, [&](std::size_t p) {
    const bool splits = p != end && w.stores[w.modification[p]].modifies;
    return !splits && (o != order::seq_cst || fits_total_order(now, number, place_of_new(p), v.strongly));
  });
  written s{value, now, position, false, {}};
  if (releases(o)) s.carried = {v.happened, v.strongly, {}};
  if (o == order::seq_cst) {
    s.carried.total = v.strongly;
    s.carried.total[thread] = now.tick;
  }
  newer_stores_ = end - position;
  const std::size_t store = put(w, position, s);
  if (o == order::seq_cst) enter_total_order(now, number, store, true, v.strongly);
}

inline std::uint64_t memory::exchange(std::size_t thread, std::size_t number, std::uint64_t value, order o) {
  const moment now = begin_operation(thread);
  history& w = words_[number];
  const auto store_at = [&w](std::size_t position) -> const written& {
    return w.stores[w.modification[position]];
  };
  const std::size_t end = w.modification.size();
  // It reads the store just before it in modification order, wherever the two stand.
  const std::size_t position = pick_position(oldest_allowed(thread, w) + 1, end, [&](std::size_t p) {
    const bool splits = p != end && store_at(p).modifies;
    return !splits &&
           (o != order::seq_cst ||
            fits_total_order(now, number, place_of_new(p), strongly_with(thread, store_at(p - 1).carried)));
  });
  const std::uint64_t before = store_at(position - 1).value;
  const message passed_on = store_at(position - 1).carried;
  if (o == order::seq_cst) views_[thread].strongly = strongly_with(thread, passed_on);
  const knowledge strongly = views_[thread].strongly;
  if (acquires(o)) learn(thread, passed_on);
  written s{value, now, position, true, passed_on};
  if (releases(o)) s.carried.join({views_[thread].happened, strongly, {}});
  if (o == order::seq_cst) {
    s.carried.total.join(strongly);
    s.carried.total[thread] = now.tick;
  }
  newer_stores_ = end - position;
  const std::size_t store = put(w, position, s);
  if (o == order::seq_cst) enter_total_order(now, number, store, true, strongly);
  return before;
}

inline std::size_t memory::put(history& w, std::size_t position, const written& s) {
  const std::size_t store = w.stores.size();
  w.stores.push_back(s);
  w.modification.insert(w.modification.begin() + static_cast<std::ptrdiff_t>(position), store);
  for (std::size_t p = position + 1; p != w.modification.size(); ++p)
    w.stores[w.modification[p]].position = p;
  return store;
}

inline knowledge memory::strongly_with(std::size_t thread, const message& carried) const noexcept {
  knowledge k = views_[thread].strongly;
  k.join(carried.total);
  return k;
}

// An acquiring operation has read `carried`. What is sequenced before anything that happens before it
// strongly happens before the thread's later operations: of every other thread, all but the last operation
// known.
inline void memory::learn(std::size_t thread, const message& carried) noexcept {
  view& v = views_[thread];
  v.happened.join(carried.happened);
  v.strongly.join(carried.strongly);
  for (std::size_t other = 0; other != threads_max; ++other) {
    if (other != thread && v.happened[other] != 0) {
      v.strongly[other] = std::max(v.strongly[other], v.happened[other] - 1);
    }
  }
}

// Whether a seq_cst operation at `place` of its word's line closes no cycle: those that must come before it
// are what strongly happens before it and what stands before it on the line; none that stands behind it may
// be among them.
inline bool memory::fits_total_order(const moment& when, std::size_t word, std::size_t place,
                                     const knowledge& strongly, set* before) const noexcept {
  set first;
  for (std::size_t i = 0; i != total_.size(); ++i) {
    const total_operation& t = total_[i];
    if (t.when.thread == when.thread || strongly.has(t.when) || (t.word == word && place_of(t) < place)) {
      first |= t.before;
      first.set(i);
    }
  }
  if (before != nullptr) *before = first;
  for (std::size_t i = 0; i != total_.size(); ++i) {
    if (total_[i].word == word && place_of(total_[i]) > place && first.test(i)) return false;
  }
  return true;
}

inline void memory::enter_total_order(const moment& when, std::size_t word, std::size_t store, bool writes,
                                      const knowledge& strongly) {
  total_operation entering{when, word, store, writes, {}};
  const std::size_t place = place_of(entering);
  (void)fits_total_order(when, word, place, strongly,
                         &entering.before); // asked before the choice was offered
  const std::size_t self = total_.size();
  set behind;
  for (std::size_t i = 0; i != self; ++i)
    behind.set(i, total_[i].word == word && place_of(total_[i]) > place);
  set with_self = entering.before;
  with_self.set(self);
  for (std::size_t i = 0; i != self; ++i) {
    if (behind.test(i) || (total_[i].before & behind).any()) total_[i].before |= with_self;
  }
  total_.push_back(entering);
}

inline const access* memory::read_plain(std::size_t thread, std::size_t number, const site& where) {
  datum& d = data_[number];
  if (!seen(thread, d.last_write.when)) return &d.last_write;
  std::erase_if(d.reads, [thread](const access& a) { return a.when.thread == thread; });
  d.reads.push_back({plain_moment(thread), where, false});
  return nullptr;
}

inline const access* memory::write_plain(std::size_t thread, std::size_t number, const site& where) {
  datum& d = data_[number];
  if (!seen(thread, d.last_write.when)) return &d.last_write;
  for (const access& a : d.reads) {
    if (!seen(thread, a.when)) return &a;
  }
  d.last_write = {plain_moment(thread), where, true};
  d.reads.clear();
  return nullptr;
}

inline void memory::release_into(std::size_t thread, knowledge& carried) noexcept {
  (void)begin_operation(thread);
  carried.join(views_[thread].happened);
}

inline void memory::acquire_from(std::size_t thread, const knowledge& carried) noexcept {
  (void)begin_operation(thread);
  learn(thread, {carried, {}, {}});
}

} // namespace rowe::model
