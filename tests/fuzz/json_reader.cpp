// SPDX-License-Identifier: Apache-2.0
// The JSON reader under arbitrary bytes. The input is the text. What is required: the walkers stay inside any
// text, validated or not; the reader's result is that of the scanner, and of simdjson's two parsers
// wherever these can decide; the byte that it reports lies in the text; in a valid text the walkers find,
// value by value, what those parsers find, and the reader has indexed the same members; the scanner says the
// same of the whole text and of its pieces, wherever these end; and a string or number of it, written by the
// writer, reads back the same.
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "fuzz/require.hpp"
#include "json/equivalence.hpp"
#include "json/padded.hpp"
#include "json/reading/reader.hpp"
#include "json/scanned.hpp"
#include "json/writing/writer.hpp"

namespace {

using namespace rowe::json;
using rowe::fuzz::require;
using rowe::tests::padded;

constexpr std::size_t bytes_max = 64 * 1024;
constexpr std::size_t depth_max = 16; // low, so that it is reached
constexpr std::size_t compared_depth_max = 128;

// Visits every value.
void visit(const value& v, std::size_t& steps, std::size_t steps_max) {
  require(++steps <= steps_max, "a walk ends");
  std::array<char, 32> scratch;
  (void)to_string(v, scratch);
  (void)to_double(v);
  (void)to_integer(v);
  (void)to_unsigned(v);
  (void)to_boolean(v);
  (void)text_is(v, "publish");
  array_walk elements{v.raw};
  for (value e; elements.next(e);) visit(e, steps, steps_max);
  object_walk members{v.raw};
  for (member m; members.next(m);) {
    (void)name_is(m, "op");
    visit(m.what, steps, steps_max);
  }
}

// On exactly so many bytes of the heap, for the address sanitizer to watch. Nesting is what recursion here,
// and only here, depends on.
void walk_unvalidated(std::string_view text) {
  const auto exact = std::make_unique<char[]>(text.size());
  text.copy(exact.get(), text.size());
  const std::string_view copy{exact.get(), text.size()};
  std::size_t steps = 0;
  visit(root(copy), steps, text.size() + 1);
  visit({kind::string, copy}, steps, 3 * text.size() + 3);
  (void)find(copy, "op");
}

void compare_indexed(const document& last, std::string_view text) {
  require(last.text.data() == text.data() && last.text.size() == text.size(), "the reader indexed this text");
  object_walk indexed{last}, walked{text};
  member a, b;
  bool more = true;
  while (more) {
    more = walked.next(a);
    require(indexed.next(b) == more, "as many members are indexed as are there");
    require(!more || (a.name_raw.data() == b.name_raw.data() && a.name_raw.size() == b.name_raw.size()),
            "their names are where they are");
    require(!more || (a.what.type == b.what.type && a.what.raw.data() == b.what.raw.data() &&
                      a.what.raw.size() == b.what.raw.size()),
            "and their values");
  }
}

// In pieces whose lengths follow from the text, and in pieces of one byte where that is quick.
void compare_scanned(std::string_view text, const fault& found) {
  std::uint64_t random =
      text.size() * 0x9e37'79b9'7f4a'7c15 + (text.empty() ? 0U : static_cast<unsigned char>(text.back()));
  const auto some = [&random] {
    random = random * 6364136223846793005 + 1442695040888963407;
    return 1 + (random >> 33) % (random >> 63 != 0 ? 7 : 1000);
  };
  for (const bool by_bytes : {false, true}) {
    if (by_bytes && text.size() > 2000) break;
    const scanner s =
        rowe::tests::scanned(text, depth_max, [&] { return by_bytes ? std::uint64_t{1} : some(); });
    require(s.found() == found, "the scanner says of pieces what it says of the whole, and where");
    require(found.what != fault_kind::none || rowe::tests::notes_what_is_walked(s, text),
            "the scanner notes the members where they are");
  }
}

// What is read can be written, and reads back the same.
void write_again(reader& r, const value& v) {
  std::string buffer(v.raw.size() * 6 + 64, '\0');
  std::string scratch(v.raw.size(), '\0');
  writer w{buffer};
  if (v.type == kind::string) {
    const auto text = to_string(v, scratch);
    require(text.has_value(), "scratch of the text's size suffices");
    w.string(*text);
    require(!w.overflowed(), "escaping makes six bytes of one at most");
    require(text_is(root(w.text()), *text), "a string reads back the same");
  } else if (v.type == kind::number) {
    const auto x = to_double(v);
    require(x.has_value(), "a number of a valid text is a double");
    w.number(*x);
    const auto y = to_double(root(w.text()));
    require(y && std::bit_cast<std::uint64_t>(*x) == std::bit_cast<std::uint64_t>(*y),
            "a number reads back the same");
  } else {
    array_walk elements{v.raw};
    for (value e; elements.next(e);) write_again(r, e);
    object_walk members{v.raw};
    for (member m; members.next(m);) write_again(r, m.what);
    return;
  }
  const padded written{w.text()};
  require(r.validate(written.text()).has_value() || written.text().size() > bytes_max,
          "what is written is valid");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > bytes_max) return 0;
  static reader r = reader::create(bytes_max, depth_max).value();
  static simdjson::dom::parser dom;
  const std::string_view raw{reinterpret_cast<const char*>(data), size};
  if (size < 2000) walk_unvalidated(raw);

  const padded p{raw};
  const std::string_view text = p.text();
  const bool by_tokens = r.validate_tokens(text);
  const rowe::status status = r.validate(text);
  require(!by_tokens || status, "what the tokens accept is valid");
  const fault found = find_fault(text, depth_max);
  require(status.has_value() == (found.what == fault_kind::none), "the scanner agrees with the reader");
  require(found.at <= text.size(), "the fault lies in the text");
  compare_scanned(text, found);
  if (status) {
    compare_indexed(r.last(), text);
  } else {
    require(status.code() ==
                (found.what == fault_kind::too_deep ? rowe::errc::too_deep : rowe::errc::malformed),
            "the reader says what the scanner says");
    require(status.error().value == static_cast<std::int64_t>(found.at), "and where");
  }

  // simdjson without our limit of depth; but the comparison calls itself for each level.
  const fault deeper = find_fault(text, compared_depth_max);
  if (deeper.what == fault_kind::too_deep) return 0;
  const bool valid = deeper.what == fault_kind::none;
  require(!status || valid, "a higher limit accepts no less");
  simdjson::dom::element element;
  const simdjson::error_code error = dom.parse(text.data(), text.size(), false).get(element);
  if (error == simdjson::SUCCESS) {
    require(valid, "the DOM accepts nothing that we refuse");
    require(rowe::tests::same(root(text), element), "the walkers find what the DOM finds");
  } else if (valid) {
    require(error == simdjson::NUMBER_ERROR || error == simdjson::DEPTH_ERROR,
            "what the DOM refuses and we accept is a large integer");
  }

  using rowe::tests::verdict;
  const verdict walked =
      rowe::tests::compare_on_demand(text, text.size() + reader::tailroom_bytes, 2 * compared_depth_max);
  if (walked != verdict::unknown && error != simdjson::DEPTH_ERROR) {
    require(valid == (walked != verdict::invalid), "a full on-demand walk agrees");
    require(!valid || walked == verdict::same, "and finds what the walkers find");
  }
  if (status) write_again(r, root(text));
  return 0;
}
