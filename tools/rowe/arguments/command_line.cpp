// SPDX-License-Identifier: Apache-2.0
#include "command_line.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "../console.hpp"
#include "../output.hpp"
#include "../status_line.hpp"
#include "../text/colour.hpp"
#include "../text/page.hpp"
#include "values.hpp"

namespace rowe::tools {
namespace {

// What is wrong, as a sentence; empty when nothing is.
using diagnostic = std::string;

constexpr std::int64_t hours_max = std::chrono::duration_cast<std::chrono::hours>(rt::for_ever).count();

// Reads one value for each kind of target.
struct store {
  std::string_view name;
  std::string_view text;
  double number; // that the name ends in

  diagnostic operator()(bool* into) const {
    *into = true;
    return {};
  }
  diagnostic operator()(const any_text& to) const {
    to.into->emplace_back(text);
    return {};
  }
  diagnostic operator()(const switch_text& to) const {
    to.into->emplace_back(text);
    return {};
  }
  diagnostic operator()(std::string* into) const {
    if (text.empty()) return joined(name, " needs a value that is not empty");
    *into = text;
    return {};
  }
  diagnostic operator()(std::vector<std::string>* into) const {
    into->emplace_back();
    return (*this)(&into->back());
  }
  diagnostic operator()(const integer& to) const {
    const auto value = integer_of(text);
    const std::string range = joined(to.min, " to ", to.max);
    if (!value) return joined(name, " needs a whole number of ", range, ", not ", quoted(text));
    if (*value < to.min || *value > to.max) return joined(name, " ", *value, " is out of range: ", range);
    *to.into = *value;
    return {};
  }
  diagnostic operator()(const choice& to) const {
    const auto found = std::find(to.names.begin(), to.names.end(), text);
    if (found != to.names.end()) {
      *to.into = static_cast<std::size_t>(found - to.names.begin());
      return {};
    }
    std::string known;
    for (const std::string_view one : to.names) known.append(known.empty() ? "" : " or ").append(one);
    return joined(name, " is ", known, ", not ", quoted(text));
  }
  diagnostic operator()(const time_span& to) const {
    const auto value = duration_of(text);
    if (!value) return joined(name, " needs a time such as 50ms, 2s or 10m, not ", quoted(text));
    if (*value <= rt::duration{0} || *value == rt::for_ever)
      return joined(name, " ", printable(text), " is out of range: 1ns to ", hours_max, "h");
    *to.into = value;
    return {};
  }
  diagnostic operator()(const numbered_times& to) const {
    std::optional<rt::duration> time;
    if (diagnostic wrong = (*this)(time_span{&time}); !wrong.empty()) return wrong;
    to.into->push_back({number, *time});
    return {};
  }
  diagnostic operator()(const rate& to) const {
    const auto value = rate_of(text);
    if (!value) return joined(name, " needs a rate above 0 such as 50Hz or 1kHz, not ", quoted(text));
    if (*value > to.max) {
      const auto limit = static_cast<std::int64_t>(to.max);
      return joined(name, " ", printable(text), " is out of range: at most ", limit, " Hz");
    }
    *to.into = value;
    return {};
  }
};

// The number at the end of an option's name; nothing where `o` is not called so.
std::optional<double> number_in(std::string_view name, const option& o) noexcept {
  const auto* const kind = std::get_if<numbered_times>(&o.into);
  if (kind == nullptr || !name.starts_with(o.name)) return std::nullopt;
  const auto number = rate_of(name.substr(o.name.size()));
  const bool plain = name.find_first_not_of("0123456789.", o.name.size()) == name.npos;
  return plain && number && *number <= kind->number_max ? number : std::nullopt;
}

// The option that `name` is the name of.
bool is_called(const option& o, std::string_view name) noexcept {
  if (std::holds_alternative<numbered_times>(o.into)) return number_in(name, o).has_value();
  return o.name == name || o.letter == name;
}

bool is_switch(const option& o) noexcept { return std::holds_alternative<switch_text>(o.into); }
bool takes_value(const option& o) noexcept { return !std::holds_alternative<bool*>(o.into) && !is_switch(o); }

std::size_t colour_chosen = 0;

const option* find_option(const command& table, std::string_view name) noexcept {
  for (const std::span<const option> some : {std::span<const option>{table.options}, common_options()}) {
    const auto found =
        std::find_if(some.begin(), some.end(), [&](const option& o) { return is_called(o, name); });
    if (found != some.end()) return &*found;
  }
  return nullptr;
}

diagnostic unknown_option(const command& table, std::string_view name) {
  std::vector<std::string_view> names{"--help"};
  for (const option& o : common_options()) names.push_back(o.name);
  for (const option& o : table.options) names.push_back(o.name);
  const auto begins = [&](std::string_view one) { return one.starts_with(joined(name, "-")); };
  const bool begins_one = name.size() > 2 && std::count_if(names.begin(), names.end(), begins) == 1;
  const std::string_view meant =
      begins_one ? *std::find_if(names.begin(), names.end(), begins) : nearest(name, names);
  if (name.size() > 1 && (name[1] == '.' || (name[1] >= '0' && name[1] <= '9')))
    return joined("unknown option ", quoted(name), "; a number below 0 is written behind --: -- ", name);
  return joined("unknown option ", quoted(name), did_you_mean(meant));
}

// Reads the option at arguments[at] and moves `at` past its value.
diagnostic read_option(const command& table, argument_list arguments, std::size_t& at) {
  std::string_view name = arguments[at];
  std::optional<std::string_view> value;
  if (const auto equals = name.find('='); name.starts_with("--") && equals != std::string_view::npos) {
    value = name.substr(equals + 1);
    name = name.substr(0, equals);
  }
  const option* const found = find_option(table, name);
  if (found == nullptr) return unknown_option(table, name);
  if (is_switch(*found) && !value) value = "true";
  if (!takes_value(*found) && !is_switch(*found) && value) return joined(name, " takes no value");
  if (takes_value(*found) && !value) {
    if (++at == arguments.size()) {
      return joined(name, " needs a value: ", name, " ", found->value);
    }
    value = arguments[at];
  }
  return std::visit(store{name, value.value_or(""), number_in(name, *found).value_or(0)}, found->into);
}

const char* from_environment(const operand& o) noexcept {
  if (o.variable == nullptr) return nullptr;
  const char* const value = std::getenv(o.variable);
  return value != nullptr && *value != '\0' ? value : nullptr;
}

bool is_left_out(const operand& o) noexcept {
  return (o.left_out != nullptr && *o.left_out) || (o.instead != nullptr && !o.instead->empty());
}

// The environment's value for `o`, if it is to be used: when there are fewer words than arguments that must
// be given, or the next word is none of its kind.
const char* instead_of_word(const operand& o, std::span<const std::string_view> words, std::size_t needed) {
  const char* const known = from_environment(o);
  if (known == nullptr || words.size() < needed) return known;
  const bool other_kind = !words.empty() && o.reads_like_it != nullptr && !o.reads_like_it(words.front());
  return other_kind ? known : nullptr;
}

// `o` has a word, or one in the environment.
void place(const operand& o, std::span<const std::string_view>& words, std::size_t needed) {
  const bool repeated = std::holds_alternative<std::vector<std::string>*>(o.into);
  if (const char* const known = instead_of_word(o, words, needed); known != nullptr) {
    *std::get<std::string*>(o.into) = known;
  } else if (repeated) {
    std::get<std::vector<std::string>*>(o.into)->assign(words.begin(), words.end());
    words = {};
  } else {
    *std::get<std::string*>(o.into) = words.front();
    words = words.subspan(1);
  }
}

// Where `missing` has no word, but an earlier operand has one that reads like it, the earlier one is missing.
diagnostic name_missing(const command& table, std::span<const std::string_view> words,
                        const operand& missing) {
  std::size_t at = 0;
  for (const operand& o : table.operands) {
    if (&o == &missing || at == words.size() || missing.reads_like_it == nullptr) break;
    if (is_left_out(o)) continue;
    if (o.reads_like_it == nullptr && missing.reads_like_it(words[at]))
      return joined("the argument ", o.name, " is missing before ", quoted(words[at]));
    ++at;
  }
  return joined("the argument ", missing.name, " is missing");
}

// Gives each operand its word.
diagnostic place_operands(const command& table, std::span<const std::string_view> words) {
  const std::span<const std::string_view> all = words;
  std::size_t needed = 0;
  for (const operand& o : table.operands) needed += o.optional || is_left_out(o) ? 0U : 1U;
  for (const operand& o : table.operands) {
    if (is_left_out(o)) continue;
    if (words.empty() && instead_of_word(o, words, needed) == nullptr) {
      if (!o.optional) return name_missing(table, all, o);
    } else {
      place(o, words, needed);
    }
    needed -= o.optional ? 0U : 1U;
  }
  return words.empty() ? diagnostic{} : joined("one argument too many: ", quoted(words.front()));
}

diagnostic read_all(const command& table, argument_list arguments) {
  std::vector<std::string_view> words;
  bool options_end = false;
  for (std::size_t at = 0; at < arguments.size(); ++at) {
    const std::string_view word = arguments[at];
    if (options_end || word == "-" || !word.starts_with('-')) {
      words.push_back(word);
    } else if (word == "--") {
      options_end = true;
    } else if (diagnostic wrong = read_option(table, arguments, at); !wrong.empty()) {
      return wrong;
    }
  }
  return place_operands(table, words);
}

bool asks_for_help(argument_list arguments) noexcept {
  for (const std::string_view word : arguments) {
    if (word == "--") return false;
    if (word == "--help" || word == "-h") return true;
  }
  return false;
}

// Lines of a paragraph are joined and wrapped; those that begin with a blank stand as they are.
std::string paragraphs(std::string_view text, std::size_t columns) {
  if (columns == 0) return std::string{text};
  std::string all;
  std::string words;
  const auto end_paragraph = [&] {
    if (!words.empty()) all += wrapped("", words, 0, columns);
    words.clear();
  };
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.starts_with(' ')) {
      end_paragraph();
      all.append(line).append("\n");
    } else {
      words.append(words.empty() ? "" : " ").append(line);
    }
  }
  end_paragraph();
  return all;
}

const std::function<void(const command&)>* looks_at_table = nullptr; // in place of reading

} // namespace

std::span<const option> common_options() {
  static const std::array<option, 1> all{
      {{"--color", "", "auto|always|never", "colours (default auto: on a terminal, without $NO_COLOR)",
        choice{&colour_chosen, colour::words}}}};
  return all;
}

std::optional<exit_code> read(const command& table, argument_list arguments) {
  if (looks_at_table != nullptr) {
    (*looks_at_table)(table);
    return exit_code::done;
  }
  if (asks_for_help(arguments)) {
    emit(help_of(table, columns_of_stdout()));
    return exit_code::done;
  }
  const diagnostic wrong = read_all(table, arguments);
  if (!wrong.empty()) return usage_error(table.verb, wrong);
  colour::choose(static_cast<colour::when>(colour_chosen));
  return std::nullopt;
}

void look_at_table(exit_code (*run)(argument_list), const std::function<void(const command&)>& look) {
  looks_at_table = &look;
  (void)run({}); // it reads its arguments before all else
  looks_at_table = nullptr;
}

const verb* find_verb(std::span<const verb> all, std::string_view name) noexcept {
  const auto found = std::ranges::find(all, name, &verb::name);
  return found == all.end() ? nullptr : &*found;
}

std::string meant_instead(std::string_view name, std::span<const verb> all) {
  std::vector<std::string_view> names;
  for (const verb& one : all) names.push_back(one.name);
  return did_you_mean(nearest(name, names));
}

std::string did_you_mean(std::string_view meant) {
  return meant.empty() ? std::string{} : joined("; did you mean ", printable(meant), "?");
}

std::string spelling_of(const option& one) {
  const std::string_view number = std::holds_alternative<numbered_times>(one.into) ? "N" : "";
  return joined(one.letter, one.letter.empty() ? "" : ", ", one.name, number, one.value.empty() ? "" : " ",
                one.value);
}

std::string spelling_of(const operand& one) {
  const bool repeated = std::holds_alternative<std::vector<std::string>*>(one.into);
  const bool brackets = one.optional || one.left_out != nullptr || one.instead != nullptr;
  return joined(brackets ? "[" : "", one.name, repeated ? "..." : "", brackets ? "]" : "");
}

std::string help_of(const command& table, std::size_t columns) {
  const auto heading = [](std::string_view text) { return colour::heading(text) + "\n"; };
  std::string text = heading("examples:");
  term_list examples;
  for (const example& e : table.examples) examples.add(std::string{e.line}, e.meaning);
  text += examples.text(columns);

  std::string usage = joined(typed(table.verb), " [options]");
  for (const operand& o : table.operands) usage.append(" ").append(spelling_of(o));
  text += "\n" + wrapped(colour::heading("usage:") + " ", usage, 4, columns) + "\n";
  text += paragraphs(table.description, columns);

  if (!table.operands.empty()) {
    text += "\n" + heading("arguments:");
    term_list operands;
    for (const operand& o : table.operands) operands.add(std::string{o.name}, o.meaning);
    text += operands.text(columns);
  }
  text += "\n" + heading("options:");
  term_list options;
  for (const option& o : table.options) options.add(spelling_of(o), o.meaning);
  for (const option& o : common_options()) options.add(spelling_of(o), o.meaning);
  options.add("-h, --help", "this text");
  return text + options.text(columns);
}

exit_code usage_error(std::string_view verb, std::string_view text) {
  const console to{verb};
  to.error(text);
  to.error("`", typed(verb), " --help` says what it takes");
  return exit_code::usage;
}

std::string_view nearest(std::string_view word, std::span<const std::string_view> known) noexcept {
  std::string_view best;
  const std::size_t letters = word.size() - std::min(word.find_first_not_of('-'), word.size());
  std::size_t fewest = letters / 3 + 2; // a word with so many slips is another word
  for (const std::string_view candidate : known) {
    const std::size_t slips = slips_between(word, candidate);
    if (slips < fewest) {
      fewest = slips;
      best = candidate;
    }
  }
  return best;
}

} // namespace rowe::tools
