// SPDX-License-Identifier: Apache-2.0
// Reading by paths under arbitrary bytes. The input: a path, a line feed, a text. What is required: nothing
// is read beyond the text or the path, and all of it ends; a text is accepted as the reader accepts it; a
// path leads where a walk over members and elements leads, or is said to be wrong, in every text; a type is
// read, or an error says why in words that fit; and the path made of a walk leads back to each value.
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/json_value.hpp>

#include "fuzz/require.hpp"
#include "json/decodable.hpp"
#include "json/padded.hpp"
#include "json/reading/reader.hpp"

namespace {

using rowe::errc;
using rowe::json_kind;
using rowe::json_value;
using rowe::fuzz::require;

constexpr std::size_t bytes_max = 16 * 1024;

void check_error(const rowe::json_error& e, std::string_view path) {
  char buffer[rowe::json_error::message_bytes_max];
  const std::string_view all = e.message(buffer);
  require(!all.empty() && all.size() < sizeof buffer, "an error has words, and they fit");
  require(!e.wanted.empty(), "it says what was wanted");
  require(all.find('\n') == all.npos || path.find('\n') != path.npos, "it is one line");
  char few[40];
  require(all.starts_with(e.message(few)), "cut, it is the beginning of the same");
  if (e.code() == errc::bad_argument) {
    require(e.reason.value >= 0 && e.reason.value <= static_cast<std::int64_t>(path.size()),
            "the path goes wrong within");
  }
}

template <class T>
void get(json_value v, std::string_view path) {
  const auto read = v.get<T>(path);
  const auto maybe = v.get<std::optional<T>>(path);
  const auto there = v.find(path);
  if (!read) check_error(read.error(), path);
  if (read) {
    require(there.has_value(), "what is read is there");
    require(maybe && maybe->has_value(), "an optional of it is read too");
  } else if (there && there->kind() != json_kind::null) {
    require(!maybe && maybe.code() == read.code(), "an optional is refused for the same reason");
  }
}

void get_all(json_value v, std::string_view path) {
  get<bool>(v, path);
  get<std::int8_t>(v, path);
  get<std::uint64_t>(v, path);
  get<float>(v, path);
  get<std::string_view>(v, path);
  get<rowe::fixed_string<5>>(v, path);
  get<rowe::tests::gear>(v, path);
  const auto whole = v.get<std::int64_t>(path);
  const auto real = v.get<double>(path);
  require(!whole || (real && std::fabs(*real - static_cast<double>(*whole)) <= std::fabs(*real) * 1e-15),
          "an integer is a double, too");
  const auto text = v.get<std::string>(path);
  const auto there = v.find(path);
  require(text.has_value() == (there && there->kind() == json_kind::string), "each string can be copied");
  require(!text || there->says(*text), "and says what its copy says");
  const auto object = v.as<rowe::tests::anything>(path);
  if (!object) check_error(object.error(), path);
  const auto numbers = v.as<rowe::tests::everything>(path);
  if (!numbers) check_error(numbers.error(), path);
}

// Each value is found by the path that a walk makes, unless a member of that name stands before it, or the
// name has both quotes.
void walk(json_value whole, json_value at, const std::string& path, std::size_t& left) {
  if (left == 0) return;
  --left;
  const auto found = whole.find(path);
  require(found && found->text() == at.text(), "its own path leads to each value");
  std::size_t index = 0;
  for (const json_value one : at.elements())
    walk(whole, one, path + '[' + std::to_string(index++) + ']', left);
  require(at.kind() == json_kind::array || index == 0, "only arrays have elements");
  require(!at.find('[' + std::to_string(index) + ']'), "and no more than those");
  for (const auto [name, value] : at.members()) {
    const std::string said = name.get<std::string>().value();
    const char quote = said.find('\'') == said.npos ? '\'' : '"';
    if (said.find(quote) != said.npos) continue;
    const std::string below = path + '[' + quote + said + quote + ']';
    const auto first = whole.find(below);
    require(first.has_value(), "each name is found");
    if (first->text().data() == value.text().data()) walk(whole, value, below, left);
  }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > bytes_max) return 0;
  const std::string_view all{reinterpret_cast<const char*>(data), size};
  const std::size_t line = std::min(all.find('\n'), size);
  const std::string_view given = all.substr(std::min(line + 1, size));
  // In blocks of exactly their size.
  const auto path_block = std::make_unique<char[]>(line);
  all.copy(path_block.get(), line);
  const std::string_view path{path_block.get(), line};
  const auto block = std::make_unique<char[]>(given.size());
  given.copy(block.get(), given.size());
  const std::string_view text{block.get(), given.size()};

  static rowe::json::reader r = rowe::json::reader::create(bytes_max).value();
  const auto parsed = json_value::parse(text);
  require(parsed.has_value() == r.validate(rowe::tests::padded{text}.text()).has_value(),
          "a text is accepted as the reader accepts it");
  if (!parsed) return 0;
  const auto anywhere = json_value{}.get<json_value>(path);
  const bool is_wrong = !anywhere && anywhere.code() == errc::bad_argument;
  const auto here = parsed->get<json_value>(path);
  require(is_wrong == (!here && here.code() == errc::bad_argument), "a path is wrong in every text, or none");
  require(here.has_value() == parsed->find(path).has_value(), "what is found is read");
  get_all(*parsed, path);
  if (here) get_all(*here, "");
  std::size_t left = 200;
  walk(*parsed, *parsed, "", left);
  return 0;
}
