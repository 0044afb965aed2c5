// SPDX-License-Identifier: Apache-2.0
// What peers ask of /rowe/rights, in every shape that a text can have, and what they must be told. The answer
// is made of the meaning of what was asked, which is known here because the text was made from it.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "swarm_choices.hpp"
#include "swarm_grammar.hpp"
#include "swarm_text.hpp"

namespace swarm {

// Of the stream of choices about what only worlds with this service have.
inline constexpr std::uint64_t of_rights = 0xa7a7a7a7a7a7a7a7U;

inline constexpr std::string_view rights_service = "/rowe/rights";
inline constexpr std::size_t rights_answered_max = 64; // what is beyond is not answered

// A list of {right, name}, and what it means.
class rights_question {
 public:
  // The classes of the right and of the name in each of its elements.
  rights_question(choices& from, std::string_view right, std::string_view name)
      : from_{from}, right_{right}, name_{name} {}

  std::vector<asked_right> asked{}; // in the text that was made last

  // What stands as `asked`, by the class of its shape.
  std::string text(std::string_view shape) {
    asked.clear();
    if (shape == "no_list") return "7";
    if (shape == "object") return R"({"right":"call","name":"/t0"})";
    if (shape == "text") return R"("[{\"right\":\"call\"}]")";
    if (shape == "null") return "null";
    if (shape == "odd") return odd();
    std::size_t count = shape == "empty" ? 0 : shape == "few" ? 2 + from_.below(4) : 1;
    if (shape == "most") count = rights_answered_max;
    if (shape == "too_many") count = rights_answered_max + 1 + from_.below(8);
    if (shape == "every") count = std::size(all);
    std::string list;
    for (std::size_t i = 0; i < count; ++i) {
      if (i != 0) list += ',';
      const bool usual =
          i != 0 && (count > std::size(all) || is_long(name_)); // else it is too long as a whole
      const part of = name(usual ? "flat" : name_);
      list += element(shape == "every" ? said(all[i]) : right(usual ? "each" : right_), of);
    }
    return "[" + list + "]";
  }
  // The same for all of the arguments.
  std::string arguments(std::string_view shape) {
    asked.clear();
    if (shape == "no_args") return {};
    if (shape == "nothing") return "{}";
    if (shape == "array") return R"(["asked",[{"right":"call"}]])";
    if (shape == "number") return "7";
    if (shape == "no_object") return R"("asked")";
    if (shape == "other") return R"({"ask":[{"right":"call"}],"x":{"asked":[{"right":"call"}]}})";
    if (shape == "escaped") return "{\"" + escaped("asked") + "\":" + text("few") + "}";
    if (shape == "twice") { // the first one counts
      const std::string first = text("one");
      const std::vector<asked_right> meant = asked;
      const std::string second = text("few");
      asked = meant;
      return R"({"asked":)" + first + R"(,"asked":)" + second + "}";
    }
    return R"({"asked":)" + text(shape) + "}";
  }

  static constexpr std::string_view all[] = {"subscribe", "publish", "advertise", "call",     "provide",
                                             "set",       "reset",   "guard",     "take_over"};

 private:
  struct part {
    std::string json; // empty: it is left out
    std::string means;
  };
  static bool is_long(std::string_view how) { return how.starts_with("long"); }
  static part said(std::string_view text) { return {quoted(text), std::string{text}}; }

  std::string element(const part& right, const part& name) {
    asked.push_back({right.means, name.means});
    std::string members[] = {right.json.empty() ? "" : R"("right":)" + right.json,
                             name.json.empty() ? "" : R"("name":)" + name.json};
    if (from_.one_in(4)) std::swap(members[0], members[1]);
    const bool both = !members[0].empty() && !members[1].empty();
    return "{" + members[0] + (both ? "," : "") + members[1] + "}";
  }
  // What is no object asks for nothing, and gets an answer all the same.
  std::string odd() {
    asked.resize(6);
    return R"([7,null,"reset",["right","call"],{},[{"right":"call"}]])";
  }

  part right(std::string_view how) {
    const std::string_view one = from_.one_of(all);
    if (how == "unknown") return said("fly");
    if (how == "upper_case") return said("CALL");
    if (how == "blank") return said("call ");
    if (how == "empty") return said("");
    if (how == "escaped") return {quoted(escaped(one)), std::string{one}};
    if (how == "long") return said(std::string{one} + std::string(300, 'x'));
    if (how == "long_escaped") return {quoted(escaped(std::string{one} + "-subscribe")), {}};
    if (how == "no_text") return {"7", {}};
    if (how == "absent") return {};
    if (how == "twice") return {R"("call","right":)" + quoted(one), "call"};
    if (how == "of_stop") return said(all[6 + from_.below(2)]);
    return said(one);
  }

  part name(std::string_view how) {
    constexpr std::string_view of_arm[] = {"/arm/a", "/arm/b/c", "/arm/open", "/arm", "/army/a", "/x/arm/a"};
    constexpr std::string_view flat[] = {"/cmd", "/odom", "/go"};
    constexpr std::string_view endpoints[] = {"/rowe/stats",      "/rowe/types",    "/rowe/stop",
                                              "/rowe/stop/reset", "/rosapi/topics", "/rowe/stop/state",
                                              "/rowe/control",    "/rowe/rights"};
    if (how == "topic") return said(from_.one_of(shared_topics));
    if (how == "service") return said(from_.one_of(shared_services));
    if (how == "endpoints") return said(from_.one_of(endpoints));
    if (how == "flat") return said(from_.one_of(flat));
    if (how == "no_slash") return said(from_.one_of(of_arm).substr(1));
    if (how == "pattern") return said(from_.one_in(2) ? "/arm/**" : "/*");
    if (how == "long") return said("/" + std::string(600, 'l'));
    if (how == "empty") return said("");
    if (how == "no_text") return {"[7]", {}};
    if (how == "absent") return {};
    const std::string_view one = from_.one_of(of_arm);
    if (how == "escaped") return {"\"\\/" + escaped(one.substr(1)) + '"', std::string{one}};
    if (how == "long_escaped") return {quoted("/arm/" + escaped(std::string(520, 'l'))), {}}; // of nothing
    if (how == "twice") return {R"("/arm/a","name":"/cmd")", "/arm/a"};
    return said(one);
  }

  choices& from_;
  std::string_view right_;
  std::string_view name_;
};

// The members of the answer. Empty: it has no role, or comes without an identity.
template <class May>
std::string rights_answer(std::string_view role, std::string_view identity,
                          const std::vector<asked_right>& asked, May&& may) {
  const auto or_null = [](std::string_view text) {
    return text.empty() ? std::string{"null"} : quoted(text);
  };
  std::string answer =
      R"("role":)" + or_null(role) + R"(,"identity":)" + or_null(identity) + R"(,"allowed":[)";
  for (std::size_t i = 0; i < asked.size() && i < rights_answered_max; ++i)
    answer += std::string{i == 0 ? "" : ","} + (may(asked[i].right, asked[i].name) ? "true" : "false");
  return answer + "]";
}

// Where nobody has a role, all is allowed, but to let a loop go or to guard it from elsewhere.
inline std::string rights_answer_without_roles(const std::vector<asked_right>& asked, bool local) {
  return rights_answer({}, {}, asked, [local](std::string_view right, std::string_view) {
    if (right == "reset" || right == "guard") return local;
    const auto& all = rights_question::all;
    return std::find(std::begin(all), std::end(all), right) != std::end(all);
  });
}

// The members of such an answer, in a message of any codec; empty: it is none.
inline std::string rights_answer_in(std::string_view message) {
  const auto begin = message.find(R"("role":)");
  const auto allowed = message.find(R"("allowed":[)");
  if (begin == message.npos || allowed == message.npos || begin > allowed) return {};
  return std::string{message.substr(begin, message.find(']', allowed) + 1 - begin)};
}

} // namespace swarm
