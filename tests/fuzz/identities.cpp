// SPDX-License-Identifier: Apache-2.0
// The text of a rowe.toml under arbitrary bytes. Required: reading it ends; where an identity can be added,
// the text before it stays, and removing it leaves the text as it was; what is removed was whole.
#include <algorithm>
#include <cstdint>
#include <string>

#include "fuzz/require.hpp"
#include "tools/rowe/setup/identities.hpp"

namespace {

using namespace rowe::tools;
using rowe::fuzz::require;

std::size_t count(const identities_text& in, const std::string& name) {
  const auto all = in.all();
  return static_cast<std::size_t>(std::ranges::count(all, name, &rowe::identity::name));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string before{reinterpret_cast<const char*>(data), size};
  if (!before.empty() && !before.ends_with('\n')) before += '\n'; // adding does so, and it stays
  std::string wrong;
  auto file = identities_text::read(before, wrong);
  require(file.has_value() == wrong.empty(), "a refusal has words");
  if (!file) return 0;

  const auto there_are = file->all();
  if (file->add({"fuzz-01", "driver", std::string(64, 'f')}).empty()) {
    require(file->text().starts_with(before), "adding changes nothing above");
    require(count(*file, "fuzz-01") == 1, "what was added is there");
    require(file->remove("fuzz-01") && file->text() == before, "adding and removing leaves nothing");
  }
  for (const rowe::identity& one : there_are) {
    const std::size_t same = count(*file, one.name);
    require(file->remove(one.name), "what is there can be removed");
    require(count(*file, one.name) + 1 == same, "one is removed, and no other");
  }
  require(file->all().empty(), "all can be removed");
  return 0;
}
