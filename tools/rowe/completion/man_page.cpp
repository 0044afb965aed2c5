// SPDX-License-Identifier: Apache-2.0
#include "man_page.hpp"

#include <algorithm>
#include <string_view>

#include "../console.hpp"
#include "../verbs/verb_list.hpp"

namespace rowe::tools {
namespace {

// Text for roff: a backslash, a hyphen that is to stay one, quotes, which macros take for their own, and what
// would be a request are escaped.
std::string roff(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const bool begins = out.empty() || out.back() == '\n';
    if (begins && c == '.') out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if (c == '"')
      out += "\\(dq";
    else if (c == '\'')
      out += "\\(aq";
    else if (c == '`')
      out += "\\(ga";
    else if (c == '~')
      out += "\\(ti";
    else if (c == '^')
      out += "\\(ha";
    else
      out += c;
  }
  return out;
}

std::string head_of(std::string_view name, std::string_view meaning) {
  std::string upper{name};
  std::ranges::transform(upper, upper.begin(),
                         [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
  return joined(".TH ", upper, " 1 \"\" \"rowe " ROWE_VERSION "\" \"rowe\"\n.SH NAME\n", roff(name), " \\- ",
                roff(meaning), "\n");
}

std::string term(std::string_view what, std::string_view meaning) {
  return joined(".TP\n.B ", roff(what), "\n", roff(meaning), "\n");
}

// Blank lines begin a paragraph; lines that begin with a blank stand as they are.
std::string paragraphs_of(std::string_view text) {
  std::string all;
  bool as_it_is = false;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const bool indented = line.starts_with(' ');
    if (indented != as_it_is) all += indented ? ".nf\n" : ".fi\n";
    as_it_is = indented;
    all += line.empty() ? ".PP\n" : roff(line) + "\n";
  }
  return as_it_is ? all + ".fi\n" : all;
}

std::string examples_of(const command& table) {
  std::string text = ".SH EXAMPLES\n";
  for (const example& one : table.examples)
    if (!one.line.empty()) text += term(one.line, one.meaning);
  return text;
}

std::string exit_status() {
  std::string text = ".SH EXIT STATUS\n";
  for (const meant_exit_code& one : exit_code_meanings()) text += term(one.code, one.meaning);
  return text;
}

constexpr std::string_view files_and_variables = R"(.SH ENVIRONMENT
.TP
.B ROWE_URL
the robot, where no URL is given
.TP
.B ROWE_TOKEN, ROWE_CA, ROWE_PIN, ROWE_CERT, ROWE_KEY
see the options of each verb that connects
.TP
.B NO_COLOR
set and not empty: no colours
)";

} // namespace

std::string man_page() {
  std::string text = head_of("rowe", "messaging for robots: JSON over WebSockets, beside a real-time loop");
  text += ".SH SYNOPSIS\n.B rowe\nVERB [arguments]\n.SH DESCRIPTION\n"
          "Each verb has a page of its own, such as\n.BR rowe\\-echo (1).\n";
  for (const verb_group& group : verb_groups()) {
    text += joined(".SS ", roff(group.heading), "\n");
    for (const verb& one : group.verbs) text += term(joined("rowe ", one.name), one.meaning);
  }
  return text + exit_status() + std::string{files_and_variables};
}

std::string man_page(const verb& of, const command& table) {
  std::string name = joined("rowe-", table.verb);
  std::ranges::replace(name, ' ', '-');
  std::string text = head_of(name, of.meaning);
  text += joined(".SH SYNOPSIS\n.B rowe ", roff(table.verb), "\n[options]");
  for (const operand& one : table.operands) text += joined(" ", roff(spelling_of(one)));
  text += "\n.SH DESCRIPTION\n" + paragraphs_of(table.description);
  if (!table.operands.empty()) {
    text += ".SH ARGUMENTS\n";
    for (const operand& one : table.operands) text += term(one.name, one.meaning);
  }
  text += ".SH OPTIONS\n";
  for (const option& one : table.options) text += term(spelling_of(one), one.meaning);
  for (const option& one : common_options()) text += term(spelling_of(one), one.meaning);
  text += term("-h, --help", "the same as text");
  return text + examples_of(table) + exit_status() + std::string{files_and_variables} +
         ".SH SEE ALSO\n.BR rowe (1)\n";
}

} // namespace rowe::tools
