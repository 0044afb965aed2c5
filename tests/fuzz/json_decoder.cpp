// SPDX-License-Identifier: Apache-2.0
// The typed decoder under arbitrary bytes. Input: one byte that chooses the struct and the spelling, then the
// text. What is required: the decoder stays inside any text, validated or not; on a valid one it returns what
// a plain reference returns, the error with its place included, and finds the same values; what it has read
// can be written, and reads back the same; and another spelling of the same text reads the same, too.
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include <rowe/ros.hpp>

#include "fuzz/require.hpp"
#include "json/decodable.hpp"
#include "json/padded.hpp"
#include "json/reading/reader.hpp"
#include "json/respelled.hpp"
#include "json/slow_decoder.hpp"
#include "json/structs/decoder.hpp"
#include "json/structs/encoder.hpp"
#include "json/writing/writer.hpp"

namespace {

using namespace rowe::json;
using rowe::fuzz::require;
using rowe::tests::padded;
using rowe::tests::slow_decoder;

constexpr std::size_t bytes_max = 64 * 1024;
constexpr std::size_t depth_max = 64;

template <class T>
std::string encoded(const T& object) {
  static const encoder e = encoder::compile(rowe::describe<T>()).value();
  static std::string buffer(e.bytes_max(), '\0');
  writer w{buffer};
  e.encode(&object, w);
  require(!w.overflowed(), "what was read can be written");
  return std::string{w.text()};
}

template <class T>
class subject {
 public:
  // In a block of exactly its size, as all texts here.
  static rowe::status decode(std::string_view text, T& into) {
    static const decoder d = decoder::compile(rowe::describe<T>()).value();
    const auto exact = std::make_unique<char[]>(text.size());
    text.copy(exact.get(), text.size());
    std::memset(static_cast<void*>(&into), 0x5a, sizeof into);
    return d.decode({exact.get(), text.size()}, &into);
  }

  static void check(std::string_view text, bool valid, std::uint8_t spelling) {
    static T ours, other;
    const rowe::status verdict = decode(text, ours);
    const std::string found = encoded(ours); // after an error, too: it is some valid object
    if (!valid) return;
    const rowe::status expected = slow_decoder::decode(rowe::describe<T>(), text, &other);
    require(verdict.has_value() == expected.has_value(), "the reference agrees");
    require(verdict || verdict.error() == expected.error(), "its error is the reference's");
    if (!verdict) return;
    require(found == encoded(other), "it reads what the reference reads");

    require(decode(found, other).has_value(), "what was written is read");
    require(encoded(other) == found, "and reads the same");
    std::mt19937_64 random{spelling};
    const std::string respelt = rowe::tests::respelling{random, 0}.text(root(text));
    require(decode(respelt, other).has_value(), "another spelling is read");
    require(encoded(other) == found, "and reads the same");
  }
};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0 || size > bytes_max) return 0;
  static reader r = reader::create(bytes_max, depth_max).value();
  const padded p{{reinterpret_cast<const char*>(data + 1), size - 1}};
  const bool valid = r.validate(p.text()).has_value();
  const auto spelling = static_cast<std::uint8_t>(data[0] >> 2);
  switch (data[0] & 3) {
  case 0: subject<rowe::tests::everything>::check(p.text(), valid, spelling); break;
  case 1: subject<rowe::tests::anything>::check(p.text(), valid, spelling); break;
  case 2: subject<rowe::tests::numbers>::check(p.text(), valid, spelling); break;
  default: subject<rowe::ros::odometry>::check(p.text(), valid, spelling); break;
  }
  return 0;
}
