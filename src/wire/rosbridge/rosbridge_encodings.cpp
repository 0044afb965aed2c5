// SPDX-License-Identifier: Apache-2.0
#include "wire/rosbridge/rosbridge_encodings.hpp"

#include <array>

#include "wire/rosbridge/png.hpp"
#include "wire/rosbridge/rosbridge.hpp"
#include "json/structs/encoder.hpp"
#include "json/writing/cbor.hpp"

namespace rowe::wire {
namespace {

using json::cbor::major;

void add_head(json::writer& out, major kind, std::uint64_t n) noexcept {
  std::array<char, json::cbor::head_bytes_max> head;
  const char* const end = json::cbor::write_head(head.data(), kind, n);
  out.append({head.data(), static_cast<std::size_t>(end - head.data())});
}
void add_text(json::writer& out, std::string_view utf8) noexcept {
  add_head(out, major::text, utf8.size());
  out.append(utf8);
}
void add_number(json::writer& out, std::string_view name, std::int64_t n) noexcept {
  add_text(out, name);
  std::array<char, json::cbor::head_bytes_max> head;
  const char* const end = json::cbor::write_signed(head.data(), n);
  out.append({head.data(), static_cast<std::size_t>(end - head.data())});
}

// Up to the value of `msg`.
void add_envelope(json::writer& out, std::string_view topic) noexcept {
  add_head(out, major::map, 3);
  add_text(out, "op");
  add_text(out, "publish");
  add_text(out, "topic");
  add_text(out, topic);
  add_text(out, "msg");
}

message_kind write_cbor(json::writer& out, const topic_message& what) noexcept {
  add_envelope(out, what.topic);
  if (what.value.others != nullptr && what.value.others->cbor) {
    what.value.others->cbor->encode(what.value.at, out);
  } else {
    json::cbor::write_json(what.text, out);
  }
  return message_kind::binary;
}

} // namespace

message_kind rosbridge_cbor_codec::write_message(json::writer& out,
                                                 const topic_message& what) const noexcept {
  return write_cbor(out, what);
}

message_kind rosbridge_cbor_raw_codec::write_message(json::writer& out,
                                                     const topic_message& what) const noexcept {
  if (what.value.others == nullptr || !what.value.others->ros1) return write_cbor(out, what);
  constexpr std::int64_t second = 1'000'000'000;
  add_envelope(out, what.topic);
  add_head(out, major::map, 3);
  add_number(out, "secs", what.wall_ns / second);
  add_number(out, "nsecs", what.wall_ns % second);
  add_text(out, "bytes");
  // How many there are is known behind them, so their head is as long as any.
  const std::size_t head_at = out.bytes();
  constexpr std::string_view head{"\x5a\0\0\0\0", 5};
  out.append(head);
  what.value.others->ros1->encode(what.value.at, out);
  const std::size_t bytes = out.bytes() - head_at - head.size();
  for (std::size_t i = 1; i < head.size(); ++i)
    out.replace(head_at + i, static_cast<char>(bytes >> 8 * (head.size() - 1 - i)));
  return message_kind::binary;
}

std::string_view rosbridge_cbor_raw_codec::lacks_without_type() const noexcept {
  return R"("compression":"cbor-raw" needs a struct that this endpoint publishes, of a type that ROS has; )"
         R"(its messages come as "cbor")";
}

message_kind rosbridge_png_codec::write_message(json::writer& out, const topic_message& what) const noexcept {
  std::array<char, topic_head_bytes_max(255)> buffer;
  json::writer head{buffer};
  rosbridge::write_publish_head(head, what.topic);
  if (head.overflowed()) {
    out.fail();
    return message_kind::text;
  }
  const std::array<std::string_view, 3> pieces{head.text(), what.text, rosbridge::publish_tail};
  out.append(R"({"op":"png","data":")");
  write_png(out, pieces);
  out.append(R"("})");
  return message_kind::text;
}

} // namespace rowe::wire
