// SPDX-License-Identifier: Apache-2.0
#include "candidates.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "../console.hpp"
#include "../verbs/verb_list.hpp"

namespace rowe::tools {
namespace {

void add_verbs(std::vector<candidate>& to, std::span<const verb> from) {
  for (const verb& one : from) to.push_back({std::string{one.name}, std::string{one.meaning}});
}

// What the name of a value, or of an operand, says that it is: "standard|hop", "FILE", "TOPIC".
void add_values(completion_answer& to, std::string_view name) {
  const auto has = [&](std::string_view part) { return name.find(part) != name.npos; };
  const bool choices = has("|") && std::ranges::none_of(name, [](char c) { return c >= 'A' && c <= 'Z'; });
  if (choices) {
    while (!name.empty()) {
      const std::size_t end = std::min(name.find('|'), name.size());
      to.words.push_back({std::string{name.substr(0, end)}});
      name.remove_prefix(std::min(end + 1, name.size()));
    }
    return;
  }
  if (has("FILE") || has("DIR") || name == "PATH") to.files = true;
  if (has("TOPIC") && has("SERVICE"))
    to.names = asked_names::topics_and_services;
  else if (has("TOPIC"))
    to.names = asked_names::topics;
  else if (has("SERVICE"))
    to.names = asked_names::services;
}

bool needs_value(const option& one) noexcept {
  return !std::holds_alternative<bool*>(one.into) && !std::holds_alternative<switch_text>(one.into);
}

// One verb's words.
class verb_words {
 public:
  verb_words(const command& table, std::span<const std::string> words) : table_{table} {
    const std::string& last = words.back();
    const option* open = nullptr; // its value is to come
    bool options_end = false;
    for (const std::string& word : words.first(words.size() - 1)) {
      if (open != nullptr) {
        note_place(open->name, word);
        open = nullptr;
      } else if (!options_end && word == "--") {
        options_end = true;
      } else if (!options_end && word.starts_with('-') && word != "-") {
        const option* const found = find(word);
        const std::size_t equals = word.find('=');
        if (found != nullptr && equals != word.npos) note_place(found->name, word.substr(equals + 1));
        if (found != nullptr && needs_value(*found) && equals == word.npos) open = found;
        given_.push_back(word);
      } else {
        operands_.push_back(word);
      }
    }
    for (const std::string& word : operands_)
      if (answer_.at.url.empty() && reads_like_url(word)) answer_.at.url = word;
    // Where the environment has none, the first word is one, whatever it reads like.
    const bool begins_with_url =
        !table_.operands.empty() && table_.operands[0].name == "URL" && std::getenv("ROWE_URL") == nullptr;
    if (answer_.at.url.empty() && begins_with_url && !operands_.empty()) answer_.at.url = operands_[0];
    const std::size_t equals = last.find('=');
    if (open != nullptr)
      add_values_of(*open);
    else if (!options_end && last.starts_with("--") && equals != last.npos)
      add_after_equals(last.substr(0, equals));
    else if (!options_end && last.starts_with('-'))
      add_options();
    else
      add_operand();
  }
  completion_answer answer() && { return std::move(answer_); }

 private:
  void note_place(std::string_view name, std::string_view value) {
    remote_place& at = answer_.at;
    for (const auto& [option, into] :
         {std::pair{"--ca", &at.ca}, std::pair{"--pin", &at.pin}, std::pair{"--cert", &at.cert},
          std::pair{"--key", &at.key}, std::pair{"--token-file", &at.token_file}})
      if (name == option) *into = value;
  }

  const option* find(std::string_view word) const {
    const std::string_view name = word.substr(0, word.find('='));
    const auto is_it = [&](const option& one) { return one.name == name || one.letter == name; };
    for (const std::span<const option> some : {std::span<const option>{table_.options}, common_options()})
      if (const auto found = std::ranges::find_if(some, is_it); found != some.end()) return &*found;
    return nullptr;
  }

  // A path into a message is none of a file.
  void add_values_of(const option& one) {
    if (const choice* const some = std::get_if<choice>(&one.into)) {
      for (const std::string_view name : some->names) answer_.words.push_back({std::string{name}});
      return;
    }
    if (one.name != "--field" || one.value != "PATH") add_values(answer_, one.value);
  }

  void add_after_equals(const std::string& name) {
    const option* const found = find(name);
    if (found == nullptr) return;
    add_values_of(*found);
    for (candidate& one : answer_.words) one.word.insert(0, name + "=");
  }

  void add_options() {
    for (const std::span<const option> some : {std::span<const option>{table_.options}, common_options()})
      for (const option& one : some)
        if (std::ranges::find(given_, one.name) == given_.end() || is_repeated(one))
          answer_.words.push_back({std::string{one.name}, std::string{one.meaning}});
    answer_.words.push_back({"--help", "what it takes"});
  }
  static bool is_repeated(const option& one) noexcept {
    return std::holds_alternative<std::vector<std::string>*>(one.into) ||
           std::holds_alternative<any_text>(one.into) || std::holds_alternative<numbered_times>(one.into);
  }

  // The operand that comes next; those that the environment has may be left out.
  void add_operand() {
    const bool url_is_given = !answer_.at.url.empty();
    std::size_t left = operands_.size();
    for (const operand& one : table_.operands) {
      const bool repeated = std::holds_alternative<std::vector<std::string>*>(one.into);
      const bool is_url = one.variable != nullptr;
      if (is_url && !url_is_given) { // a host, which nobody knows, a file perhaps, or what comes after it
        answer_.files = answer_.files || one.name.find("FILE") != one.name.npos;
        continue;
      }
      if (left != 0 && !repeated) {
        --left;
        continue;
      }
      if (table_.verb == "param" && one.name == "NAME")
        answer_.names = asked_names::parameters;
      else
        add_values(answer_, one.name);
      return;
    }
  }

  const command& table_;
  std::vector<std::string> given_;
  std::vector<std::string> operands_;
  completion_answer answer_;
};

} // namespace

completion_answer candidates_for(std::span<const std::string> words) {
  completion_answer answer;
  if (words.empty()) return answer;
  if (words.size() == 1) {
    for (const verb_group& group : verb_groups()) add_verbs(answer.words, group.verbs);
    answer.words.push_back({"help", "what there is"});
    return answer;
  }
  const bool explains = words[0] == "help" && words.size() == 2;
  if (explains) return candidates_for(words.last(1));
  const verb* its = find_verb(words[0]);
  std::span<const std::string> rest = words.subspan(1);
  if (its != nullptr && its->name == "bench") {
    if (rest.size() == 1) {
      add_verbs(answer.words, bench::modes());
      return answer;
    }
    its = find_verb(bench::modes(), rest[0]);
    rest = rest.subspan(1);
  }
  if (its == nullptr) return answer;
  look_at_table(its->run, [&](const command& table) { answer = verb_words{table, rest}.answer(); });
  return answer;
}

} // namespace rowe::tools
