// SPDX-License-Identifier: Apache-2.0
// rowe completion: what a shell is told so that it completes the program's words. The scripts ask
// `rowe complete` for each word; topics and services come from the running robot.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "../completion/candidates.hpp"
#include "../console.hpp"
#include "../network/asked_robot.hpp"
#include "../network/robot_names.hpp"
#include "../output.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration completing_timeout = 700ms; // in all: somebody waits at the keyboard

constexpr std::string_view bash_script = R"(# rowe completion bash
_rowe() {
  local line=${COMP_LINE:0:COMP_POINT} words word before files=
  read -ra words <<<"$line"
  [[ $line == *[[:space:]] ]] && words+=("")
  COMPREPLY=()
  while IFS=$'\t' read -r word _; do
    if [[ $word == :files ]]; then files=1; else COMPREPLY+=("$word"); fi
  done < <("${words[0]/#\~\//$HOME/}" complete -- "${words[@]:1}" 2>/dev/null)
  # What readline takes for a word begins behind the last colon or equals sign.
  word=${words[${#words[@]} - 1]}
  before=${word%"${word##*[:=]}"}
  [[ -n $before ]] && COMPREPLY=("${COMPREPLY[@]#"$before"}")
  [[ -n $files ]] && compopt -o default
  [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == */ ]] && compopt -o nospace
  return 0
}
complete -F _rowe rowe
)";

constexpr std::string_view zsh_script = R"(#compdef rowe
# rowe completion zsh
_rowe() {
  local -a found
  local line word meaning files=
  while IFS= read -r line; do
    if [[ $line == :files ]]; then
      files=1
    else
      word=${line%%$'\t'*} meaning=${line#*$'\t'}
      found+=("${word//:/\\:}${meaning:+:$meaning}")
    fi
  done < <("${words[1]/#\~\//$HOME/}" complete -- "${(@)words[2,CURRENT]}" 2>/dev/null)
  (( $#found )) && _describe -V rowe found
  [[ -n $files ]] && _files
  return 0
}
if [[ $funcstack[1] == _rowe ]]; then _rowe "$@"; else compdef _rowe rowe; fi
)";

constexpr std::string_view fish_script = R"(# rowe completion fish
function __rowe_words
  set -l words (commandline -opc) (commandline -ct)
  $words[1] complete -- $words[2..-1] 2>/dev/null | while read -l line
    if test "$line" = ":files"
      __fish_complete_path (commandline -ct)
    else
      echo $line
    end
  end
end
complete -c rowe -f -a '(__rowe_words)'
)";

struct shell_script {
  std::string_view name;
  std::string_view text;
};
constexpr std::array shells{shell_script{"bash", bash_script}, shell_script{"zsh", zsh_script},
                            shell_script{"fish", fish_script}};

// Whether a shell reads the word as it is: bash inserts what it completes without quotes, and a robot may
// call a topic whatever it wants.
bool is_plain_word(std::string_view word) noexcept {
  constexpr std::string_view others = "_/.~:@%+,=-";
  return std::ranges::all_of(word, [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           others.find(c) != others.npos;
  });
}

// Nothing is said where the robot cannot be asked: it is a key that was pressed, not a command.
void add_names(completion_answer& to) {
  remote_place at = to.at;
  if (const char* const usual = std::getenv("ROWE_URL"); at.url.empty() && usual != nullptr) at.url = usual;
  if (at.url.empty() || to.names == asked_names::none) return;
  console silent{"complete"};
  silent.be_quiet(true);
  asked_robot robot{"complete", completing_timeout, silent};
  const rt::time_point end = rt::monotonic_clock::now() + completing_timeout;
  if (robot.connect(at)) return;
  const auto leave_time = [&] {
    robot.services().answer_within(std::max<rt::duration>(end - rt::monotonic_clock::now(), 1ms));
  };
  const auto add = [&](name_kind which) {
    leave_time();
    for (const robot_name& one : names_of(robot.services(), which).value_or(std::vector<robot_name>{}))
      to.words.push_back({one.name, one.type});
  };
  if (to.names == asked_names::topics || to.names == asked_names::topics_and_services) add(name_kind::topic);
  if (to.names == asked_names::services || to.names == asked_names::topics_and_services)
    add(name_kind::service);
  if (to.names == asked_names::parameters) add(name_kind::parameter);
}

} // namespace

exit_code completion(argument_list arguments) {
  std::string shell;
  const command table{.verb = "completion",
                      .examples = {{{"eval \"$(rowe completion bash)\"", "in ~/.bashrc"},
                                    {"rowe completion fish > ~/.config/fish/completions/rowe.fish", "once"}}},
                      .description = "Prints a script with which a shell completes verbs, options and, where "
                                     "the URL stands already or is\n"
                                     "in $ROWE_URL, the topics, services and parameters of the running "
                                     "robot. Packages of rowe install it.\n",
                      .operands = {{.name = "bash|zsh|fish", .meaning = "the shell", .into = &shell}},
                      .options = {}};
  if (const auto end = read(table, arguments)) return *end;
  const auto* const found = std::ranges::find(shells, shell, &shell_script::name);
  if (found == shells.end())
    return usage_error("completion", joined("the shell is bash, zsh or fish, not ", quoted(shell)));
  emit(found->text);
  return exit_code::done;
}

// rowe complete -- WORDS...: a candidate a line, with its meaning behind a tab; `:files` where files may
// stand.
exit_code complete(argument_list arguments) {
  std::vector<std::string> words;
  for (const std::string_view word : arguments.subspan(std::min<std::size_t>(arguments.size(), 1)))
    words.emplace_back(word);
  if (words.empty()) words.emplace_back();
  completion_answer answer = candidates_for(words);
  add_names(answer);
  std::string text;
  for (const candidate& one : answer.words)
    if (one.word.starts_with(words.back()) && is_plain_word(one.word))
      text += joined(printable(one.word), "\t", printable(one.meaning), "\n");
  if (answer.files) text += ":files\n";
  emit(text);
  return exit_code::done;
}

} // namespace rowe::tools
