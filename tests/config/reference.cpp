// SPDX-License-Identifier: Apache-2.0
// The keys as docs/config.md lists them: what follows its heading "Keys" is compared with the table of keys,
// or written from it.
//
//   config_reference docs/config.md [--write]
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include <rowe/settings.hpp>

#include "config/keys.hpp"

namespace {

std::string code(std::string_view text) {
  std::string escaped;
  for (const char c : text) escaped.append(c == '|' ? "\\" : "").append(1, c);
  return text.empty() ? "" : "`" + escaped + "`";
}

void add_section(std::string& to, std::string_view name) {
  to.append("\n### [").append(name).append("]\n\n");
  if (name == "limits") {
    to += "What each is for, and what happens beyond it: [limits](limits.md). On the command line: "
          "`--limit NAME=VALUE`.\n\n| key | default | may be |\n|---|---|---|\n";
  } else if (name == "serve") {
    to += "Of the program `rowe serve` only.\n\n| key | option | default | may be | meaning |\n"
          "|---|---|---|---|---|\n";
  } else if (name == "record" || name == "black_box") {
    to += "Of `rowe serve`, and of programs that ask `recordings_of()` ([recording](record.md)).\n\n"
          "| key | option | default | may be | meaning |\n|---|---|---|---|---|\n";
  } else if (name == "client") {
    to += "Of endpoints that connect, `endpoint::connect`; `rowe serve` listens, so it has no options for "
          "them. The certificate that a client shows is that of `[tls]`.\n\n"
          "| key | default | may be | meaning |\n|---|---|---|---|\n";
  } else {
    to += "| key | option | default | may be | meaning |\n|---|---|---|---|---|\n";
  }
}

template <class Owner>
void add_entries(std::string& to, std::span<const rowe::config::key<Owner>> keys) {
  to.append("\n### [[").append(keys.front().section).append("]]\n\n");
  to += "| key | may be | meaning |\n|---|---|---|\n";
  for (const auto& one : keys) {
    to.append("| ").append(code(one.name)).append(" | ").append(rowe::config::allowed(one.what));
    to.append(" | ").append(one.meaning).append(" |\n");
  }
}

std::string reference() {
  std::string text = "\n";
  std::string_view section;
  const auto keys = rowe::settings::keys();
  for (const rowe::setting_key& one : keys) {
    if (one.section != section) add_section(text, section = one.section);
    text.append("| ").append(code(one.name)).append(" | ");
    if (section != "limits" && section != "client") text.append(code(one.option)).append(" | ");
    text.append(code(one.fallback)).append(" | ").append(one.allowed).append(" |");
    if (section != "limits") text.append(" ").append(one.meaning).append(" |");
    text += "\n";
  }
  add_entries(text, rowe::config::role_keys());
  add_entries(text, rowe::config::identity_keys());
  return text;
}

} // namespace

int main(int count, char** words) {
  if (count < 2) return std::fputs("usage: config_reference FILE [--write]\n", stderr), 2;
  std::ifstream in{words[1]};
  const std::string page{std::istreambuf_iterator<char>{in}, {}};
  constexpr std::string_view heading = "\n## Keys\n";
  const auto begin = page.find(heading);
  if (begin == page.npos) return std::fprintf(stderr, "%s has no heading \"Keys\"\n", words[1]), 1;
  const std::string right = page.substr(0, begin) + std::string{heading} + reference();
  if (count > 2) {
    std::ofstream{words[1]} << right;
  } else if (page != right) {
    std::fprintf(stderr, "the keys are others than %s lists: config_reference FILE --write\n", words[1]);
    return 1;
  }
  return 0;
}
