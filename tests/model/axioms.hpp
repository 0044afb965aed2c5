// SPDX-License-Identifier: Apache-2.0
// The outcomes of a litmus program by the axioms of C++20 ([intro.races], [atomics.order]), with no machine
// and no schedule: every way to order the stores of each word and to give each load a store is written down,
// and kept if coherence, atomicity and a total order of the seq_cst operations allow it. Too slow for more
// than some eight instructions; it shares no idea with memory.hpp, so that each can find the other's
// mistakes.
#pragma once
#include <algorithm>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "model/program.hpp"

namespace rowe::model {

class axiomatic {
 public:
  explicit axiomatic(const program& p) {
    for (std::size_t w = 0; w != program_words_max; ++w) events_.push_back({0, store(w, 0, order::relaxed)});
    for (std::size_t t = 0; t != p.size(); ++t) {
      for (const instruction& i : p[t]) events_.push_back({t + 1, i});
    }
    source_.assign(events_.size(), none);
    for (std::size_t w = 0; w != program_words_max; ++w) modification_.push_back({w});
    for (std::size_t e = program_words_max; e != events_.size(); ++e) {
      if (writes(e)) modification_[events_[e].is.word].push_back(e);
    }
  }

  std::set<outcome> outcomes() {
    order_word(0);
    return found_;
  }

 private:
  static constexpr std::size_t events_max = 16;
  static constexpr std::size_t none = events_max;
  using relation = std::vector<std::bitset<events_max>>; // [a][b]: a is related to b
  struct event {
    std::size_t thread; // 0: the initial values, before everything
    instruction is;
  };

  bool reads(std::size_t e) const { return events_[e].is.what != operation::store; }
  bool writes(std::size_t e) const { return events_[e].is.what != operation::load; }
  bool total(std::size_t e) const { return events_[e].is.asks == order::seq_cst; }
  bool same_word(std::size_t a, std::size_t b) const { return events_[a].is.word == events_[b].is.word; }
  relation empty() const { return relation(events_.size()); }
  std::size_t place(std::size_t e) const {
    const auto& row = modification_[events_[e].is.word];
    return static_cast<std::size_t>(std::find(row.begin(), row.end(), e) - row.begin());
  }

  static void close(relation& r) {
    for (std::size_t via = 0; via != r.size(); ++via) {
      for (auto& row : r) {
        if (row.test(via)) row |= r[via];
      }
    }
  }
  static bool cyclic(relation r) {
    close(r);
    for (std::size_t e = 0; e != r.size(); ++e) {
      if (r[e].test(e)) return true;
    }
    return false;
  }
  static relation after(const relation& first, const relation& then) {
    relation r(first.size());
    for (std::size_t a = 0; a != first.size(); ++a) {
      for (std::size_t b = 0; b != first.size(); ++b) {
        if (first[a].test(b)) r[a] |= then[b];
      }
    }
    return r;
  }
  static relation united(relation a, const relation& b) {
    for (std::size_t e = 0; e != a.size(); ++e) a[e] |= b[e];
    return a;
  }

  void order_word(std::size_t w) {
    if (w == modification_.size()) return give_source(0);
    auto& row = modification_[w];
    std::sort(row.begin() + 1, row.end()); // the initial value stays first
    do order_word(w + 1);
    while (std::next_permutation(row.begin() + 1, row.end()));
  }

  void give_source(std::size_t e) {
    if (e == events_.size()) return judge();
    if (!reads(e)) return give_source(e + 1);
    for (const std::size_t s : modification_[events_[e].is.word]) {
      if (s == e || (writes(e) && place(s) + 1 != place(e)))
        continue; // a read-modify-write reads its neighbour
      source_[e] = s;
      give_source(e + 1);
    }
  }

  relation sequenced_before() const {
    relation r = empty();
    for (std::size_t a = 0; a != events_.size(); ++a) {
      for (std::size_t b = 0; b != events_.size(); ++b) {
        const bool initial = a < program_words_max && b >= program_words_max;
        if (initial || (a < b && a >= program_words_max && events_[a].thread == events_[b].thread))
          r[a].set(b);
      }
    }
    return r;
  }

  relation synchronizes_with() const {
    relation r = empty();
    for (std::size_t e = 0; e != events_.size(); ++e) {
      if (!reads(e) || !acquires(events_[e].is.asks)) continue;
      for (std::size_t s = source_[e];; s = source_[s]) { // back along the read-modify-writes
        if (releases(events_[s].is.asks)) r[s].set(e);
        if (!reads(s)) break;
      }
    }
    return r;
  }

  // [intro.races]: a before b in modification order; reads from; from-read; and what these make together.
  relation coherence_order() const {
    relation r = empty();
    for (std::size_t a = 0; a != events_.size(); ++a) {
      for (std::size_t b = 0; b != events_.size(); ++b) {
        if (a == b || !same_word(a, b)) continue;
        if (writes(a) && writes(b) && place(a) < place(b)) r[a].set(b);
        if (writes(a) && reads(b) && source_[b] == a) r[a].set(b);
        if (reads(a) && writes(b) && place(source_[a]) < place(b)) r[a].set(b);
      }
    }
    close(r);
    return r;
  }

  bool has_total_order(const relation& sequenced, const relation& happens, const relation& synchronizes,
                       const relation& coherence) const {
    relation strongly = united(sequenced, after(after(sequenced, happens), sequenced));
    for (std::size_t a = 0; a != events_.size(); ++a) {
      for (std::size_t b = 0; b != events_.size(); ++b) {
        if (total(a) && total(b) && synchronizes[a].test(b)) strongly[a].set(b);
      }
    }
    close(strongly);
    relation must = empty();
    for (std::size_t a = 0; a != events_.size(); ++a) {
      for (std::size_t b = 0; b != events_.size(); ++b) {
        must[a].set(b, total(a) && total(b) && (strongly[a].test(b) || coherence[a].test(b)));
      }
    }
    return !cyclic(must);
  }

  void judge() {
    const relation sequenced = sequenced_before();
    const relation synchronizes = synchronizes_with();
    relation happens = united(sequenced, synchronizes);
    close(happens);
    const relation coherence = coherence_order();
    relation executed = sequenced; // no load reads a store that depends on it: what the explorer leaves out
    for (std::size_t e = 0; e != events_.size(); ++e) {
      if (happens[e].test(e) || coherence[e].test(e)) return;
      // The four rules of coherence are one: happens-before never runs against the coherence order.
      for (std::size_t f = 0; f != events_.size(); ++f) {
        if (happens[e].test(f) && coherence[f].test(e)) return;
      }
      if (reads(e)) executed[source_[e]].set(e);
    }
    if (cyclic(executed) || !has_total_order(sequenced, happens, synchronizes, coherence)) return;
    outcome o;
    for (std::size_t e = 0; e != events_.size(); ++e) {
      if (reads(e)) o.reads.push_back(events_[source_[e]].is.value);
    }
    for (std::size_t w = 0; w != program_words_max; ++w)
      o.last[w] = events_[modification_[w].back()].is.value;
    found_.insert(o);
  }

  std::vector<event> events_;
  std::vector<std::size_t> source_;                    // of each read, the store
  std::vector<std::vector<std::size_t>> modification_; // of each word
  std::set<outcome> found_;
};

} // namespace rowe::model
