// SPDX-License-Identifier: Apache-2.0
// The memory of C++20, operationally: every store of a word is kept, in modification order, and a load may
// return any of them that coherence allows. The operations of a run are executed one after another in an
// order that extends "sequenced before" and "reads from"; a load picks its store among those executed, a
// store picks its place in the modification order. Happens-before is kept by vector clocks. The total order
// of the seq_cst operations is kept as the partial order of what must be so: a choice is offered if and only
// if that stays free of cycles, so that it can be completed to a total order. explorer.hpp says what this
// model leaves out.
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
  // Writes `value`, or adds it to what is there.
  std::uint64_t exchange(std::size_t thread, std::size_t word, std::uint64_t value, order o,
                         bool adds = false);
  // How many stores in modification order lie behind the one just read or written: 0 is the newest.
  std::size_t newer_stores() const noexcept { return newer_stores_; }

  // A plain access; returns the earlier one that it races with, or nullptr.
  const access* read_plain(std::size_t thread, std::size_t datum, const site& where);
  const access* write_plain(std::size_t thread, std::size_t datum, const site& where);

  // Blocking primitives of the operating system order memory like a release and an acquire of one word.
  void release_into(std::size_t thread, knowledge& carried) noexcept;
  void acquire_from(std::size_t thread, const knowledge& carried) noexcept;

 private:
  struct written {
    std::uint64_t value;
    moment when;
    std::size_t position; // in the modification order
    bool modifies;        // written by a read-modify-write, which keeps its place next to the store it read
    knowledge carried;    // what a load that acquires it learns
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
  // A seq_cst operation. Its place among the operations on its word is that of the store it wrote or read.
  using set = std::bitset<steps_max>;
  struct total_operation {
    moment when;
    std::size_t word;
    std::size_t store;
    bool writes;
    set before; // those that precede it in every total order
  };

  // Places on a word's line: a store at position p stands at 4p, its readers at 4p + 2, and a store about to
  // be put in before position p at 4p - 1, behind the readers of p - 1.
  std::size_t place_of(const total_operation& t) const noexcept {
    const std::size_t position = words_[t.word].stores[t.store].position;
    return t.writes ? 4 * position : place_of_reader(position);
  }
  static std::size_t place_of_reader(std::size_t position) noexcept { return 4 * position + 2; }
  static std::size_t place_of_new(std::size_t position) noexcept { return 4 * position - 1; }

  bool seen(std::size_t thread, const moment& m) const noexcept {
    return m.thread == thread || known_[thread].has(m);
  }
  moment begin_operation(std::size_t thread) noexcept;
  moment plain_moment(std::size_t thread) const noexcept { return {thread, known_[thread][thread] + 1}; }
  std::size_t oldest_allowed(std::size_t thread, const history& w) const noexcept;
  // Collects in `candidates_` what of [from, to] fits, the highest first, and lets the choices pick one.
  template <class Fits>
  std::size_t pick_position(std::size_t from, std::size_t to, Fits fits);
  bool fits_total_order(std::size_t thread, std::size_t word, std::size_t place,
                        set* before = nullptr) const noexcept;
  void enter_total_order(const moment& now, std::size_t word, std::size_t store, bool writes);
  std::size_t pick_new_position(std::size_t thread, std::size_t number, order o);
  static std::size_t put(history& w, const written& s);

  choices& choices_;
  std::array<knowledge, threads_max> known_{}; // of each thread, what happens before its next operation
  std::vector<history> words_;
  std::vector<datum> data_;
  std::vector<total_operation> total_;
  std::vector<std::size_t> candidates_;
  std::size_t words_made_ = 0;
  std::size_t newer_stores_ = 0;
};

inline void memory::clear() noexcept {
  known_ = {};
  words_made_ = 0; // the words themselves are used again, so that a run allocates next to nothing
  data_.clear();
  total_.clear();
}

inline void memory::fork(std::size_t parent, std::size_t child) noexcept {
  (void)begin_operation(parent);
  known_[child].join(known_[parent]);
}

inline void memory::join(std::size_t parent, std::size_t child) noexcept {
  (void)begin_operation(child);
  known_[parent].join(known_[child]);
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
  return {thread, ++known_[thread][thread]};
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
  const std::size_t newest = w.modification.size() - 1;
  const std::size_t position = pick_position(oldest_allowed(thread, w), newest, [&](std::size_t p) {
    return o != order::seq_cst || fits_total_order(thread, number, place_of_reader(p));
  });
  const std::size_t store = w.modification[position];
  w.loads.push_back({now, store});
  newer_stores_ = newest - position;
  if (o == order::seq_cst) enter_total_order(now, number, store, false);
  if (acquires(o)) known_[thread].join(w.stores[store].carried);
  return w.stores[store].value;
}

inline void memory::store(std::size_t thread, std::size_t number, std::uint64_t value, order o) {
  const moment now = begin_operation(thread);
  history& w = words_[number];
  const std::size_t position = pick_new_position(thread, number, o);
  written s{value, now, position, false, {}};
  if (releases(o)) s.carried = known_[thread];
  const std::size_t store = put(w, s);
  if (o == order::seq_cst) enter_total_order(now, number, store, true);
}

// It reads the store just before it in modification order, wherever the two stand, and passes on what that
// carried: C++20's release sequence, which only read-modify-writes continue.
inline std::uint64_t memory::exchange(std::size_t thread, std::size_t number, std::uint64_t value, order o,
                                      bool adds) {
  const moment now = begin_operation(thread);
  history& w = words_[number];
  const std::size_t position = pick_new_position(thread, number, o);
  const written before = w.stores[w.modification[position - 1]];
  const std::uint64_t after = adds ? before.value + value : value;
  const std::size_t store = put(w, {after, now, position, true, before.carried});
  if (o == order::seq_cst) enter_total_order(now, number, store, true);
  if (acquires(o)) known_[thread].join(before.carried);
  if (releases(o)) w.stores[store].carried.join(known_[thread]);
  return before.value;
}

// Where a store or an exchange may go: behind what coherence puts before it, but not between a
// read-modify-write and the store that it read.
inline std::size_t memory::pick_new_position(std::size_t thread, std::size_t number, order o) {
  const history& w = words_[number];
  const std::size_t end = w.modification.size();
  const std::size_t position = pick_position(oldest_allowed(thread, w) + 1, end, [&](std::size_t p) {
    const bool splits = p != end && w.stores[w.modification[p]].modifies;
    return !splits && (o != order::seq_cst || fits_total_order(thread, number, place_of_new(p)));
  });
  newer_stores_ = end - position;
  return position;
}

inline std::size_t memory::put(history& w, const written& s) {
  const std::size_t store = w.stores.size();
  w.stores.push_back(s);
  w.modification.insert(w.modification.begin() + static_cast<std::ptrdiff_t>(s.position), store);
  for (std::size_t p = s.position + 1; p != w.modification.size(); ++p)
    w.stores[w.modification[p]].position = p;
  return store;
}

// Whether a seq_cst operation at `place` of its word's line closes no cycle. What must come before it: what
// stands before it on the line (coherence order), and what strongly happens before it. That is its own
// thread's past, and of another thread all but the last operation known, A: what is sequenced before A, which
// happens before something sequenced before this. (A itself too, if both are seq_cst and this reads it; but
// then it stands before it on the line. So this one rule and the closure below are the whole of "strongly
// happens before" among seq_cst operations.)
inline bool memory::fits_total_order(std::size_t thread, std::size_t word, std::size_t place,
                                     set* before) const noexcept {
  set first;
  for (std::size_t i = 0; i != total_.size(); ++i) {
    const total_operation& t = total_[i];
    const bool strongly = t.when.thread == thread || known_[thread][t.when.thread] > t.when.tick;
    if (strongly || (t.word == word && place_of(t) < place)) {
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

// Before the operation acquires: what it learns itself does not strongly happen before it.
inline void memory::enter_total_order(const moment& now, std::size_t word, std::size_t store, bool writes) {
  total_operation entering{now, word, store, writes, {}};
  const std::size_t place = place_of(entering);
  (void)fits_total_order(now.thread, word, place, &entering.before); // it does: the choice was offered
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
  carried.join(known_[thread]);
}

inline void memory::acquire_from(std::size_t thread, const knowledge& carried) noexcept {
  (void)begin_operation(thread);
  known_[thread].join(carried);
}

} // namespace rowe::model
