// SPDX-License-Identifier: Apache-2.0
// Rounds of all contenders (peers.hpp): each is measured once in each round, alone, and every ratio is one of
// two figures of the same round. What waits for events is compared with what waits, what asks without waiting
// with what does: `of_raw` is the ratio to raw or raw_busy, `of_best_peer` to the peer of the best
// median, `of_NAME` to an outside one (--peer). The servers run on the core `here`; the client moves to
// `there`.
#pragma once
#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "peer_client.hpp"
#include "peers.hpp"
#include "stand.hpp"

namespace rowe::bench {

inline double median_ratio(const std::vector<double>& ours, const std::vector<double>& theirs) {
  std::vector<double> each;
  for (std::size_t i = 0; i < ours.size(); ++i) each.push_back(ours[i] / theirs[i]);
  return median(std::move(each));
}

// Returns when a server that waits has fallen asleep. A slow one would else be awake still when the next
// message comes, and look fast.
inline rt::time_point when_asleep(const contender& who) {
  rt::time_point now = monotonic_clock::now();
  for (const rt::time_point asleep = now + 40us; !who.busy() && now < asleep;) now = monotonic_clock::now();
  return now;
}

enum class better { less, more };

class peer_field {
 public:
  struct row {
    contender who;
    std::unique_ptr<server_process> server;
    std::map<std::string, std::vector<double>> figures; // by what is measured; one a round
    std::map<std::string, std::vector<double>> samples; // of all rounds together
  };

  // Starts them. Who does not come up is left out, and told.
  peer_field(const std::vector<contender>& all, std::string_view mode) {
    for (const contender& one : all) {
      rows_.push_back({one, std::make_unique<server_process>(one.command, mode, here), {}, {}});
      peer_client first;
      const bool good = first.open(rows_.back().server->port(), one.rosbridge);
      rows_.back().server->pause();
      if (good) continue;
      std::fprintf(stderr, "%s is left out: it does not serve\n", one.name.c_str());
      rows_.pop_back();
    }
    for (std::size_t turn = 0; turn < rows_.size(); ++turn) turns_.push_back(turn);
  }

  // measure(row) is called for each with its server running. A peer for which it says false is left out from
  // there on, and told; anybody else ends the bench. Each round begins with another one: who comes first
  // finds the machine colder.
  template <class Measure>
  bool round(Measure&& measure) {
    std::rotate(turns_.begin(), turns_.begin() + 1, turns_.end());
    for (const std::size_t turn : turns_) {
      row& one = rows_[turn];
      one.server->resume();
      const bool good = measure(one);
      one.server->pause();
      if (good) continue;
      std::fprintf(stderr, "%s is left out: it stopped answering\n", one.who.name.c_str());
      if (one.who.what != contender::peer) return false;
      one.server.reset();
    }
    std::erase_if(rows_, [](const row& one) { return !one.server; });
    std::erase_if(turns_, [&](std::size_t turn) { return turn >= rows_.size(); });
    return true;
  }

  std::vector<row>& rows() { return rows_; }

  // The ratios of what was measured to what it is compared with.
  std::map<std::string, double> ratios(const row& of, const std::string& what, better best) const {
    std::map<std::string, double> all;
    const std::vector<double>* best_peer = nullptr;
    for (const row& other : rows_) {
      const auto found = other.figures.find(what);
      if (found == other.figures.end() || other.who.busy() != of.who.busy()) continue;
      const std::vector<double>& theirs = found->second;
      const double ratio = median_ratio(of.figures.at(what), theirs);
      if (other.who.what == contender::limit) all["of_raw"] = ratio;
      if (other.who.what != contender::peer || of.who.what != contender::ours) continue;
      if (other.who.outside) all["of_" + other.who.name.substr(0, other.who.name.find("_busy"))] = ratio;
      if (best_peer && (median(theirs) < median(*best_peer)) != (best == better::less)) continue;
      best_peer = &theirs;
      all["of_best_peer"] = ratio;
    }
    return all;
  }

 private:
  std::vector<row> rows_;
  std::vector<std::size_t> turns_; // their order
};

} // namespace rowe::bench
