// SPDX-License-Identifier: Apache-2.0
#include "play_plan.hpp"

#include <algorithm>
#include <map>
#include <string_view>

#include <rowe/access.hpp>

#include "../console.hpp"
#include "own_topics.hpp"

namespace rowe::tools {
namespace {

// "x" and "/x" are the same name.
std::string_view without_slash(std::string_view name) noexcept {
  return name.starts_with('/') ? name.substr(1) : name;
}
bool is_same_topic(std::string_view one, std::string_view other) noexcept {
  return without_slash(one) == without_slash(other);
}

struct wished_pattern {
  std::string text;
  bool met = false;
};

std::vector<wished_pattern> patterns_in(const std::vector<std::string>& lists) {
  std::vector<wished_pattern> all;
  for (const std::string& list : lists) {
    std::size_t at = 0;
    while (at <= list.size()) {
      const std::size_t end = std::min(list.find(',', at), list.size());
      if (end > at) all.push_back({list.substr(at, end - at)});
      at = end + 1;
    }
  }
  return all;
}

bool is_met(std::vector<wished_pattern>& patterns, std::string_view name) {
  bool any = false;
  for (wished_pattern& one : patterns) {
    if (!pattern_matches(one.text, name)) continue;
    one.met = true;
    any = true;
  }
  return any;
}

struct remap {
  std::string from;
  std::string to;
  bool met = false;
};

// Nothing: it is none.
std::optional<remap> remap_of(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == text.npos) return std::nullopt;
  const std::size_t end = equals > 0 && text[equals - 1] == ':' ? equals - 1 : equals;
  const std::string_view from = text.substr(0, end), to = text.substr(equals + 1);
  if (without_slash(from).empty() || without_slash(to).empty()) return std::nullopt;
  return remap{std::string{from}, std::string{to}};
}

bool is_own(std::string_view name) { return without_slash(name).starts_with(without_slash(own_topics)); }

constexpr const char* own_reason = "since the endpoint has its own (--remap gives other names)";

// Who waits for a topic that is not there would wait for ever, and who leaves out one that is spelt otherwise
// would publish it: so both are said.
std::string not_met(const std::vector<wished_pattern>& patterns, std::string_view option) {
  for (const wished_pattern& one : patterns)
    if (!one.met) return joined(option, " ", quoted(one.text), ": the recording has no such topic");
  return {};
}

class planner {
 public:
  planner(const std::vector<recorded_topic>& recorded, const topic_wishes& wishes)
      : recorded_{recorded}, only_{patterns_in(wishes.only)}, without_{patterns_in(wishes.without)} {}

  std::string read_remaps(const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      auto read = remap_of(text);
      if (!read) return joined("--remap needs FROM:=TO, such as /odom:=/recorded/odom, not ", quoted(text));
      if (is_own(read->to))
        return joined("--remap ", quoted(text), ": topics below ", own_topics, " are the endpoint's own");
      remaps_.push_back(std::move(*read));
    }
    return {};
  }

  std::string plan() {
    made.to.resize(recorded_.size());
    made.decoders.resize(recorded_.size());
    for (std::size_t place = 0; place < recorded_.size(); ++place) plan(place);
    for (const remap& one : remaps_)
      if (!one.met) return joined("--remap ", quoted(one.from), ": the recording has no such topic");
    std::string wrong = not_met(only_, "--topics");
    return wrong.empty() ? not_met(without_, "--exclude") : wrong;
  }

  play_plan made;

 private:
  void plan(std::size_t place) {
    const recorded_topic& topic = recorded_[place];
    std::string name = topic.name;
    for (remap& one : remaps_) {
      if (!is_same_topic(one.from, topic.name)) continue;
      name = one.to;
      one.met = true;
    }
    const bool out = is_met(without_, topic.name);
    const bool in = only_.empty() || is_met(only_, topic.name);
    if (out || !in) return;
    if (is_own(name)) return leave_out(topic, own_reason);
    made.decoders[place] = decoder_for(topic);
    if (!made.decoders[place])
      return leave_out(topic, topic.encoding.empty() ? "in an encoding that is not said"
                                                     : joined("in the encoding ", quoted(topic.encoding),
                                                              ", which cannot be decoded"));
    made.to[place] = place_of(name, topic);
    made.selected.push_back(place);
  }

  // Topics with the same reason are named together: a robot has many of its own.
  void leave_out(const recorded_topic& topic, const std::string& reason) {
    const auto [at, is_new] = reasons_.try_emplace(reason, made.not_played.size());
    if (is_new) made.not_played.push_back(joined("not played, ", reason, ":"));
    made.not_played[at->second].append(
        joined(is_new ? " " : ", ", printable(topic.name), " (", counted(topic.messages, "message"), ")"));
  }

  // Several recorded topics may be one: those of several publishers, or by --remap.
  std::size_t place_of(const std::string& name, const recorded_topic& topic) {
    const auto says = topic.metadata.find("latched");
    const bool latched = says != topic.metadata.end() && says->second == "true";
    const auto known = std::find_if(made.topics.begin(), made.topics.end(),
                                    [&](const played_topic& one) { return is_same_topic(one.name, name); });
    if (known == made.topics.end()) {
      made.topics.push_back({name, topic.type, latched});
      return made.topics.size() - 1;
    }
    if (known->type.empty()) known->type = topic.type;
    known->latched = known->latched || latched;
    return static_cast<std::size_t>(known - made.topics.begin());
  }

  const std::vector<recorded_topic>& recorded_;
  std::vector<wished_pattern> only_;
  std::vector<wished_pattern> without_;
  std::vector<remap> remaps_;
  std::map<std::string, std::size_t> reasons_; // and the places of their sentences
};

} // namespace

std::optional<play_plan> plan_for(const std::vector<recorded_topic>& recorded, const topic_wishes& wishes,
                                  std::string& wrong) {
  planner plans{recorded, wishes};
  wrong = plans.read_remaps(wishes.remaps);
  if (wrong.empty()) wrong = plans.plan();
  if (!wrong.empty()) return std::nullopt;
  return std::move(plans.made);
}

} // namespace rowe::tools
