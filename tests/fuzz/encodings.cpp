// SPDX-License-Identifier: Apache-2.0
// JSON as CBOR, and as the pixels of a PNG, under arbitrary bytes. What is required: nothing is read beyond
// the text or written beyond the room, and all of it ends, for texts that are no JSON as well; of a valid
// text the CBOR, read by a decoder of the tests, says what a walk over the text says; the PNG has the text;
// and what a struct read from it is written as is CBOR that says the same as its JSON.
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "fuzz/require.hpp"
#include "wire/png_text.hpp"
#include "wire/rosbridge/png.hpp"
#include "json/cbor_text.hpp"
#include "json/decodable.hpp"
#include "json/padded.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/decoder.hpp"
#include "json/structs/encoder.hpp"
#include "json/writing/cbor.hpp"
#include "json/writing/writer.hpp"

namespace {

using rowe::fuzz::require;
using rowe::json::kind;
using rowe::json::value;
using rowe::json::writer;

constexpr std::size_t bytes_max = 16 * 1024;

void say(const value& v, writer& out) {
  std::string scratch(v.raw.size(), '\0');
  switch (v.type) {
  case kind::object: {
    out.begin_object();
    rowe::json::object_walk all{v.raw};
    for (rowe::json::member m; all.next(m);) {
      std::string name(m.name_raw.size(), '\0');
      out.key(rowe::json::unescape(m.name_raw, name).value_or("?"));
      say(m.what, out);
    }
    return out.end_object();
  }
  case kind::array: {
    out.begin_array();
    rowe::json::array_walk all{v.raw};
    for (value one; all.next(one);) say(one, out);
    return out.end_array();
  }
  case kind::string: return out.string(rowe::json::to_string(v, scratch).value_or("?"));
  case kind::boolean: return out.boolean(v.raw == "true");
  case kind::null: return out.null();
  case kind::number: break;
  }
  const bool digits_only = v.raw.find_first_of(".eE") == std::string_view::npos;
  if (digits_only && v.raw == "-0") return out.number(-0.0);
  if (const auto n = rowe::json::to_integer(v); digits_only && n) return out.number(*n);
  if (const auto n = rowe::json::to_unsigned(v); digits_only && n) return out.number(*n);
  out.number(rowe::json::to_double(v).value_or(0));
}

// Integers between the least of 64 bits and -2^64 are exact in CBOR, and doubles in the walk.
bool has_long_negative(std::string_view text) {
  for (std::size_t i = 0; (i = text.find('-', i)) != std::string_view::npos; ++i) {
    std::size_t digits = 0;
    while (i + 1 + digits < text.size() && text[i + 1 + digits] >= '0' && text[i + 1 + digits] <= '9')
      ++digits;
    if (digits >= 19) return true;
  }
  return false;
}

// What is written into a room of exactly this size; empty: it did not fit.
template <class Write>
std::string written(std::size_t room, Write write) {
  const auto exact = std::make_unique<char[]>(room);
  writer out{{exact.get(), room}};
  write(out);
  return out.overflowed() ? std::string{} : std::string{out.text()};
}

void check_struct(std::string_view text) {
  using rowe::json::encoding;
  using rowe::tests::anything;
  static const auto decoder = rowe::json::decoder::compile(rowe::describe<anything>()).value();
  static const auto cbor = rowe::json::encoder::compile(rowe::describe<anything>(), encoding::cbor).value();
  anything x;
  if (!decoder.decode(text, &x)) return;
  const auto encode = [&](writer& out) { cbor.encode(&x, out); };
  const std::string whole = written(cbor.bytes_max(), encode);
  require(!whole.empty(), "bytes_max() is enough");
  require(rowe::tests::cbor_text(whole, false).has_value(), "a struct is written as CBOR");
  require(written(whole.size(), encode) == whole, "it fits where it just fits");
  require(written(whole.size() - 1, encode).empty(), "and nowhere else");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > bytes_max) return 0;
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  const auto as_cbor = [&](writer& out) { rowe::json::cbor::write_json(text, out); };
  const auto as_png = [&](writer& out) {
    const std::string_view pieces[] = {text};
    rowe::wire::write_png(out, pieces);
  };
  const std::string cbor = written(4 * size + 64, as_cbor);
  const std::string png = written(9 * size + 400, as_png);
  require(!png.empty(), "a PNG needs no more than it says");
  (void)written(size / 2, as_cbor);
  (void)written(size / 2, as_png);

  static auto reader = rowe::json::reader::create(bytes_max).value();
  const rowe::tests::padded p{text};
  if (!reader.validate(p.text())) return 0;
  std::string buffer(8 * size + 64, '\0');
  writer said{buffer};
  say(rowe::json::root(p.text()), said);
  require(!said.overflowed(), "the fuzzer has room for the text");
  const auto back = rowe::tests::cbor_text(cbor);
  require(back.has_value(), "a valid text is written as CBOR");
  require(*back == said.text() || has_long_negative(text), "CBOR says what the text says");

  const auto from_png = rowe::tests::png_text(png);
  require(from_png.has_value(), "a text is written as PNG");
  const rowe::tests::padded drawn{*from_png};
  require(static_cast<bool>(reader.validate(drawn.text())), "what is in the PNG is JSON");
  std::string other(8 * size + 64, '\0');
  writer repeated{other};
  say(rowe::json::root(drawn.text()), repeated);
  require(repeated.text() == said.text(), "the PNG says what the text says");
  check_struct(p.text());
  return 0;
}
