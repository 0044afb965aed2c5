// SPDX-License-Identifier: Apache-2.0
// What the service thread does with JSON, one message a step, each of a thousand with other numbers. For
// instructions.cpp, which says how they are counted.
#include "json_steps.hpp"

#include <array>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

#include "json_messages.hpp"
#include "json/reading/reader.hpp"
#include "json/reading/scanner.hpp"
#include "json/structs/decoder.hpp"
#include "json/structs/encoder.hpp"
#include "json/writing/cbor.hpp"
#include "json/writing/writer.hpp"

namespace steps {

using namespace rowe;
using bench::call;

template <class T>
void use(const T& value) {
  asm volatile("" : : "r"(&value) : "memory");
}

#define COUNTED [[gnu::noinline]] static void
COUNTED encode_odometry(const json::encoder& by, const bench::odometry& o, std::span<char> buffer) {
  json::writer to{buffer};
  by.encode(&o, to);
  use(to.text());
}
COUNTED encode_odometry_as_cbor(const json::encoder& by, const bench::odometry& o, std::span<char> buffer) {
  json::writer to{buffer};
  by.encode(&o, to);
  use(to.text());
}
COUNTED encode_covariances(const json::encoder& by, const ros::odometry& o, std::span<char> buffer) {
  json::writer to{buffer};
  by.encode(&o, to);
  use(to.text());
}
COUNTED encode_covariances_as_cbor(const json::encoder& by, const ros::odometry& o, std::span<char> buffer) {
  json::writer to{buffer};
  by.encode(&o, to);
  use(to.text());
}
COUNTED encode_scan(const json::encoder& by, const bench::laser_scan& scan, std::span<char> buffer) {
  json::writer to{buffer};
  by.encode(&scan, to);
  use(to.text());
}
COUNTED encode_scan_as_cbor(const json::encoder& by, const bench::laser_scan& scan, std::span<char> buffer) {
  json::writer to{buffer};
  by.encode(&scan, to);
  use(to.text());
}
COUNTED encode_16k_of_bytes(const json::encoder& by, const bench::picture& of, std::span<char> buffer) {
  json::writer to{buffer};
  by.encode(&of, to);
  use(to.text());
}
COUNTED decode_16k_of_bytes(const json::decoder& by, std::string_view text, bench::picture& into) {
  use(by.decode(text, &into));
}
COUNTED write_text_as_cbor(std::string_view odometry, std::span<char> buffer) {
  json::writer to{buffer};
  json::cbor::write_json(odometry, to);
  use(to.text());
}
COUNTED write_small_call(const call& c, std::span<char> buffer) { use(bench::write_call(buffer, c)); }
COUNTED read_small_call(json::reader& by, std::string_view text) {
  if (!by.validate(text)) return;
  json::object_walk members{by.last()};
  for (json::member m; members.next(m);) {
    if (json::name_is(m, "a") || json::name_is(m, "b")) use(json::to_integer(m.what));
    if (json::name_is(m, "service")) use(json::text_is(m.what, "add-two-numbers"));
  }
}
COUNTED read_publish_envelope(json::reader& by, std::string_view text) {
  if (!by.validate(text)) return;
  json::object_walk members{by.last()};
  for (json::member m; members.next(m);) {
    if (json::name_is(m, "op")) use(json::text_is(m.what, "publish"));
    if (json::name_is(m, "topic")) use(json::text_is(m.what, "/cmd_vel"));
    if (json::name_is(m, "msg")) use(m.what.raw);
  }
}
// A piece of a long text: of many small numbers, of numbers with a fraction, of a text; and of what takes the
// most steps for its bytes.
COUNTED scan_4k_of_map(json::scanner& by, std::string_view piece) { use(by.feed(piece)); }
COUNTED scan_4k_of_points(json::scanner& by, std::string_view piece) { use(by.feed(piece)); }
COUNTED scan_4k_of_image(json::scanner& by, std::string_view piece) { use(by.feed(piece)); }
COUNTED scan_4k_of_brackets(json::scanner& by, std::string_view piece) { use(by.feed(piece)); }
COUNTED scan_4k_of_escapes(json::scanner& by, std::string_view piece) { use(by.feed(piece)); }
COUNTED scan_4k_of_short_texts(json::scanner& by, std::string_view piece) { use(by.feed(piece)); }
COUNTED scan_4k_of_exponents(json::scanner& by, std::string_view piece) { use(by.feed(piece)); }
COUNTED scan_4k_of_characters(json::scanner& by, std::string_view piece) { use(by.feed(piece)); }
#undef COUNTED

} // namespace steps

namespace rowe::bench {
namespace {

// As often as it fits, and spaces.
std::string repeated(std::string_view piece) {
  constexpr std::size_t bytes = 4096;
  std::string all;
  while (all.size() + piece.size() <= bytes) all += piece;
  all.resize(bytes, ' ');
  return all;
}

// Each piece begins where a value may, or within a string, and ends so.
void scan_pieces() {
  json::scanner map, points, image, brackets, escapes, short_texts, exponents, characters;
  for (json::scanner* const s : {&map, &points, &brackets, &short_texts, &exponents}) s->feed("[");
  for (json::scanner* const s : {&image, &escapes, &characters}) s->feed("\"");
  const std::string cells = repeated("0,100,-1,"), floats = repeated("1.25,-0.0625,");
  const std::string text = repeated("iVBORw0K"), nested = repeated("[{\"\":[]}],[],{}  ,"),
                    pairs = repeated("\\ud83d\\ude00 \\n "), names = repeated("\"a\","),
                    large = repeated("1e5,"), greek = repeated("\xce\xb1");
  for (int i = 0; i < 1000; ++i) {
    steps::scan_4k_of_map(map, cells);
    steps::scan_4k_of_points(points, floats);
    steps::scan_4k_of_image(image, text);
    steps::scan_4k_of_brackets(brackets, nested);
    steps::scan_4k_of_escapes(escapes, pairs);
    steps::scan_4k_of_short_texts(short_texts, names);
    steps::scan_4k_of_exponents(exponents, large);
    steps::scan_4k_of_characters(characters, greek);
  }
  for (json::scanner* const s :
       {&map, &points, &image, &brackets, &escapes, &short_texts, &exponents, &characters}) {
    if (s->found().what != json::fault_kind::none) std::abort();
  }
}

} // namespace

void json_steps() {
  scan_pieces();
  message_source source;
  const auto plain = source.odometries();
  const auto full = source.odometries_with(covariances::sparse);
  const auto calls = source.calls();
  const json::encoder plain_encoder = json::encoder::compile(describe<odometry>()).value();
  const json::encoder plain_cbor = json::encoder::compile(describe<odometry>(), json::encoding::cbor).value();
  const json::encoder full_encoder = json::encoder::compile(describe<ros::odometry>()).value();
  const json::encoder full_cbor =
      json::encoder::compile(describe<ros::odometry>(), json::encoding::cbor).value();
  json::reader reader = json::reader::create(64 * 1024).value();
  const auto scans = source.scans();
  const json::encoder scan_encoder = json::encoder::compile(describe<laser_scan>()).value();
  const json::encoder scan_cbor =
      json::encoder::compile(describe<laser_scan>(), json::encoding::cbor).value();
  const auto pictures = source.pictures(2);
  const json::encoder picture_encoder = json::encoder::compile(describe<picture>()).value();
  const json::decoder picture_decoder = json::decoder::compile(describe<picture>()).value();
  static picture picture_read;
  static std::array<char, 32 * 1024> buffer;
  const auto padded = [](std::string_view text) {
    return std::string{text} + std::string(json::reader::tailroom_bytes, ' ');
  };
  for (std::size_t i = 0; i < 1000; ++i) {
    const std::size_t k = i % messages;
    steps::encode_odometry(plain_encoder, plain[k], buffer);
    steps::encode_odometry_as_cbor(plain_cbor, plain[k], buffer);
    steps::encode_covariances(full_encoder, full[k], buffer);
    steps::encode_covariances_as_cbor(full_cbor, full[k], buffer);
    steps::encode_scan(scan_encoder, scans[k], buffer);
    steps::encode_scan_as_cbor(scan_cbor, scans[k], buffer);
    steps::encode_16k_of_bytes(picture_encoder, pictures[0], buffer);
    json::writer shown{buffer};
    picture_encoder.encode(&pictures[1], shown);
    steps::decode_16k_of_bytes(picture_decoder, shown.text(), picture_read);
    json::writer text{buffer};
    plain_encoder.encode(&plain[k], text);
    static std::array<char, 16 * 1024> binary;
    steps::write_text_as_cbor(text.text(), binary);
    steps::write_small_call(calls[k], buffer);
    const std::string call = padded({buffer.data(), write_call(buffer, calls[k])});
    steps::read_small_call(reader, {call.data(), call.size() - json::reader::tailroom_bytes});
    const std::string publish = padded(source.publish(i));
    steps::read_publish_envelope(reader, {publish.data(), publish.size() - json::reader::tailroom_bytes});
  }
}

} // namespace rowe::bench
