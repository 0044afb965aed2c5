// SPDX-License-Identifier: Apache-2.0
// What peers with roles ask of /rowe/rights, in every shape that the grammar has, and whether the answer is
// right. Drawn from a stream of its own, so that these questions change nothing else in a world.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/limits.hpp>

#include "swarm_rights.hpp"

namespace flow {

class rights_questions {
 public:
  explicit rights_questions(std::uint64_t seed) : random_{seed ^ swarm::of_rights} {}

  std::size_t below(std::size_t count) { return random_.below(count); }

  // None: it would be too long for a message, and who says that is closed.
  std::optional<swarm::saying> ask(const rowe::limits& bounds) {
    const std::string_view operation = random_.one_in(3) ? "rights_in_plain" : "rights";
    swarm::recipe what =
        swarm::choose_recipe(random_, shapes_, swarm::operation_named(operation), random_.one_in(4) ? 2 : 0);
    const std::string_view id = swarm::value_of(what, "message_id");
    if (id == "absent" || id == "null") swarm::give_value(what, "message_id", "short"); // else it is no call
    const swarm::knowledge known{.bounds = bounds, .made_up = {}};
    swarm::saying asked = swarm::render(random_, what, known);
    if (asked.text.size() > bounds.message_bytes_max) return std::nullopt;
    return asked;
  }

  struct judgment {
    std::string wrong; // empty: nothing is
    bool answered = false;
  };
  // `heard` is all that the peer was sent since it asked; `is_told(right, name)` what it may do.
  template <class IsTold>
  static judgment judge(const swarm::saying& asked, const std::vector<std::string>& heard,
                        const std::string& role, const std::string& identity, IsTold&& is_told) {
    std::vector<std::string> answers;
    for (const std::string& text : heard)
      if (std::string told = swarm::rights_answer_in(text); !told.empty()) answers.push_back(std::move(told));
    if (answers.size() > 1 || (answers.empty() && asked.good))
      return {" gets " + std::to_string(answers.size()) + " answers to ", !answers.empty()};
    if (answers.empty()) return {};
    const std::string expected = swarm::rights_answer(role, identity, asked.rights, is_told);
    if (answers.front() == expected) return {{}, true};
    return {" is told " + answers.front() + " and not " + expected + ": ", true};
  }

 private:
  swarm::seeded_choices random_;
  swarm::weights shapes_{swarm::rows().size()};
};

} // namespace flow
