// SPDX-License-Identifier: Apache-2.0
// rowe man: the manual pages, which are written from the same tables as the help.
#include <string>
#include <string_view>
#include <system_error>

#include "../arguments/command_line.hpp"
#include "../completion/man_page.hpp"
#include "../console.hpp"
#include "../output.hpp"
#include "verb_list.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

std::string page_of(const verb& of) {
  std::string text;
  look_at_table(of.run, [&](const command& table) { text = man_page(of, table); });
  return text;
}

// Whether the page could be written.
bool write_page(const std::string& folder, std::string_view name, std::string_view text, const console& to) {
  const std::string path = joined(folder, folder.ends_with('/') ? "" : "/", name, ".1");
  const int failure = write_file(path, text);
  if (failure != 0) to.error("cannot write ", quoted(path), ": ", std::generic_category().message(failure));
  return failure == 0;
}

exit_code write_all_pages(const std::string& folder, const console& to) {
  bool good = write_page(folder, "rowe", man_page(), to);
  for (const verb_group& group : verb_groups()) {
    for (const verb& one : group.verbs) {
      if (one.name == "bench") continue;
      good = good && write_page(folder, joined("rowe-", one.name), page_of(one), to);
    }
  }
  for (const verb& one : bench::modes())
    good = good && write_page(folder, joined("rowe-bench-", one.name), page_of(one), to);
  return good ? exit_code::done : exit_code::failed;
}

} // namespace

exit_code man(argument_list arguments) {
  std::string name;
  std::string folder;
  const command table{
      .verb = "man",
      .examples = {{{"rowe man echo | man -l -", "the page of a verb"},
                    {"rowe man --output ~/.local/share/man/man1", "all pages, for man(1) to find"}}},
      .description = "Prints a manual page as man(1) reads it: that of a verb, or without one that of the\n"
                     "program. Packages of rowe install them: `man rowe-echo`.\n",
      .operands = {{.name = "VERB", .meaning = "such as echo", .into = &name, .optional = true}},
      .options = {{"--output", "-o", "DIR", "write all pages into this folder, which exists", &folder}}};
  if (const auto end = read(table, arguments)) return *end;
  const console to{"man"};
  if (!folder.empty() && !name.empty())
    return usage_error("man", "--output writes all pages, not that of a VERB");
  if (!folder.empty()) return write_all_pages(folder, to);
  if (name.empty()) {
    emit(man_page());
    return exit_code::done;
  }
  const verb* const found = find_verb(name);
  if (found == nullptr) return usage_error("man", no_such_verb(name));
  if (found->name == "bench") {
    for (const verb& one : bench::modes()) emit(page_of(one));
    return exit_code::done;
  }
  emit(page_of(*found));
  return exit_code::done;
}

} // namespace rowe::tools
