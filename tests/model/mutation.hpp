// SPDX-License-Identifier: Apache-2.0
// Whether every memory order in a header is needed, and whether the scenarios would notice if it were
// missing: each atomic access is weakened by one step and all scenarios of its structure are explored again.
// Some scenario must fail, or a list says why the order is stronger than needed; what survives is weakened by
// the next step. The accesses are not listed by hand. The explorer reports those it has executed, and every
// memory order written in the header must be among them, so an access that is added without a scenario fails
// the test.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/explorer.hpp"

namespace rowe::model {

struct named_scenario {
  const char* name;
  std::function<report(const options&)> explore;
};

template <class Scenario>
named_scenario scenario(const char* name) {
  return {name, [](const options& o) { return explore<Scenario>(o); }};
}

// Orders that may be weakened as far as `weakest` and nothing fails: those in `function` of the header, in
// statements that contain `code`.
struct stronger_than_needed {
  std::string_view function;
  std::string_view code;
  order weakest;
  const char* why;
};

class mutation_test {
 public:
  // `header` is the end of the header's path: "rowe/rt/window.hpp".
  mutation_test(std::string_view header, std::span<const named_scenario> scenarios,
                std::span<const stronger_than_needed> listed)
      : header_{header}, scenarios_{scenarios}, listed_{listed}, listed_used_(listed.size()) {}

  // Everything that does not hold, a line each; empty if all does. Prints what caught each mutant.
  std::string findings() {
    for (const named_scenario& s : scenarios_) {
      const report r = s.explore({});
      if (!r.passed) find(s.name + (": " + r.text()));
      for (const use& u : r.uses) {
        if (in_header(u) && std::find(uses_.begin(), uses_.end(), u) == uses_.end()) uses_.push_back(u);
      }
    }
    if (uses_.empty()) find("no scenario executes anything of " + std::string{header_});
    if (!findings_.empty()) return findings_;
    read_header();
    if (statements_.empty()) return std::string{"cannot read "} + uses_.front().where.file;
    look_for_unreached();
    for (const use& u : uses_) weaken(u, u.asks);
    for (std::size_t i = 0; i != listed_.size(); ++i) {
      if (!listed_used_[i]) find("listed without need: " + std::string{listed_[i].function});
    }
    return findings_;
  }

 private:
  struct statement_text {
    std::string text;
    std::size_t first_line;
    std::size_t last_line;
  };

  void find(const std::string& what) { (findings_ += what) += '\n'; }
  const std::string& code_of(const use& u) const {
    return statements_.at(statement_of_line_.at(u.where.line - 1)).text;
  }
  bool in_header(const use& u) const { return std::string_view{u.where.file}.ends_with(header_); }

  // Line by line without comments, and each line's statement: a call may be broken before its order.
  void read_header() {
    std::ifstream file{uses_.front().where.file};
    std::string statement;
    std::size_t first = 0;
    for (std::string line; std::getline(file, line);) {
      line.resize(std::min(line.find("//"), line.size()));
      line.resize(line.find_last_not_of(' ') + 1);
      statement += line.substr(std::min(line.find_first_not_of(' '), line.size())) + " ";
      statement_of_line_.push_back(statements_.size());
      if (line.empty() || std::string_view{";{}"}.find(line.back()) == std::string_view::npos) continue;
      statements_.push_back({statement, first + 1, statement_of_line_.size()});
      first = statement_of_line_.size();
      statement.clear();
    }
  }

  // Of each statement: as many accesses executed as it names orders.
  void look_for_unreached() {
    for (const statement_text& s : statements_) {
      std::ptrdiff_t written = 0;
      for (std::size_t at = 0; (at = s.text.find("memory_order_", at)) != std::string::npos; ++at) ++written;
      const std::ptrdiff_t executed = std::count_if(uses_.begin(), uses_.end(), [&s](const use& u) {
        return u.where.line >= s.first_line && u.where.line <= s.last_line;
      });
      if (executed >= written) continue;
      find("no scenario reaches " + std::string{header_} + ":" + std::to_string(s.first_line) + ": " +
           s.text);
    }
  }

  static std::vector<order> next_weaker(operation what, order o) {
    if (o == order::seq_cst) {
      if (what == operation::load) return {order::acquire};
      return {what == operation::store ? order::release : order::acq_rel};
    }
    if (o == order::acq_rel) return {order::acquire, order::release};
    if (o == order::relaxed) return {};
    return {order::relaxed};
  }

  void weaken(const use& u, order from) {
    for (const order to : next_weaker(u.what, from)) {
      const std::string mutant =
          text_of(u.where) + ", " + name_of(u.what) + " " + name_of(u.asks) + " -> " + name_of(to);
      if (is_caught({u, to}, mutant)) continue;
      if (is_listed(u, to)) {
        weaken(u, to);
      } else {
        find("nothing fails with " + mutant + ": " + code_of(u));
      }
    }
  }

  bool is_caught(const weakening& w, const std::string& mutant) const {
    for (const named_scenario& s : scenarios_) {
      options o;
      o.weaken = w;
      const report r = s.explore(o);
      if (r.passed) continue;
      std::printf("  %s: %s, run %llu: %s\n", mutant.c_str(), s.name, static_cast<unsigned long long>(r.runs),
                  r.failure.c_str());
      return true;
    }
    std::printf("  %s: survives\n", mutant.c_str());
    return false;
  }

  static bool as_strong(order o, order as) {
    return (acquires(o) || !acquires(as)) && (releases(o) || !releases(as)) &&
           (o == order::seq_cst || as != order::seq_cst);
  }

  bool is_listed(const use& u, order to) {
    bool listed = false;
    for (std::size_t i = 0; i != listed_.size(); ++i) {
      const stronger_than_needed& l = listed_[i];
      const bool meant = function_of(u.where) == l.function && code_of(u).find(l.code) != std::string::npos;
      if (!meant || !as_strong(to, l.weakest)) continue;
      listed = true;
      if (to == l.weakest) listed_used_[i] = true;
    }
    return listed;
  }

  std::string_view header_;
  std::span<const named_scenario> scenarios_;
  std::span<const stronger_than_needed> listed_;
  std::vector<bool> listed_used_;
  std::vector<use> uses_;
  std::vector<statement_text> statements_;
  std::vector<std::size_t> statement_of_line_;
  std::string findings_;
};

} // namespace rowe::model
