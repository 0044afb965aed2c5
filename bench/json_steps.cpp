// SPDX-License-Identifier: Apache-2.0
// What the service thread does with JSON, one message a step, each of a thousand with other numbers. For
// instructions.cpp, which says how they are counted.
#include "json_steps.hpp"

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "json_messages.hpp"
#include "json/encoder.hpp"
#include "json/reader.hpp"
#include "json/writer.hpp"

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
#undef COUNTED

} // namespace steps

namespace rowe::bench {

void json_steps() {
  message_source source;
  const auto plain = source.odometries();
  const auto calls = source.calls();
  const json::encoder plain_encoder = json::encoder::compile(describe<odometry>()).value();
  json::reader reader = json::reader::create(64 * 1024).value();
  static std::array<char, 16 * 1024> buffer;
  const auto padded = [](std::string_view text) {
    return std::string{text} + std::string(json::reader::tailroom_bytes, ' ');
  };
  for (std::size_t i = 0; i < 1000; ++i) {
    const std::size_t k = i % messages;
    steps::encode_odometry(plain_encoder, plain[k], buffer);
    steps::write_small_call(calls[k], buffer);
    const std::string call = padded({buffer.data(), write_call(buffer, calls[k])});
    steps::read_small_call(reader, {call.data(), call.size() - json::reader::tailroom_bytes});
    const std::string publish = padded(source.publish(i));
    steps::read_publish_envelope(reader, {publish.data(), publish.size() - json::reader::tailroom_bytes});
  }
}

} // namespace rowe::bench
