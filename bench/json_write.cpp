// SPDX-License-Identifier: Apache-2.0
// Question: what does writing JSON cost the service thread, next to other ways of writing the same message?
//
// Measured, nanoseconds of this thread's processor time for a message, each way once in every round:
//   odometry_write/…     13 random doubles, about 500 bytes; every double reads back equal
//     rowe        the encoder, as publishers use it
//     straight    the same text by straight-line code: literals of known length, rowe's digits
//     to_chars    the same straight-line code on std::to_chars, which `of_to_chars` is a ratio to
//     copied      the same with each double replaced by a constant: the floor of all that is no digits
//     rapidjson   its Writer, into a buffer that is kept
//     nlohmann, json_c   a tree is built and printed, as their users do
//   covariances_write/…  the same with two covariances of 36: 12 of the 85 doubles are not 0
//   dense_write/…        the same, no double 0
//   …/rowe_cbor         the same encoder's CBOR; `x_rowe` says how many times as fast as our JSON it is
//   scan_write/…         a laser scan of 360 floats: rowe and rowe_cbor
//   picture_write/…      16 KiB of bytes: rowe writes base64, rowe_cbor copies them; straight is base64 by
//               straight-line code, a byte after the other, to which `of_straight` is a ratio
//   call_write/…         a small invocation: a service, two integers, an id
// `x_json_c` says how many times as fast as json-c a contender is; `of_plain` is a ratio to rowe's
// odometry_write.
//
// Excluded: sockets, frames, cold caches. The destruction of a tree is not: it is given back in the time.
//
// What would make it lie: another compiler's idea of -O3 (build the release preset); 256 different messages
// in turn, all in cache, are few enough for branches to learn some of them.
//
// Run: bench_json_write [--rounds=11] [Google Benchmark's options]
#include <charconv>
#include <cstring>
#include <span>

#include <json-c/json.h>
#include <nlohmann/json.hpp>
#include <rapidjson/stringbuffer.h>
#include <rapidjson/writer.h>

#include "json_contest.hpp"
#include "json_messages.hpp"
#include "json/structs/encoder.hpp"
#include "json/text/digits.hpp"
#include "json/writing/writer.hpp"

namespace rowe::bench {
namespace {

// ---- straight-line writing ----

// Literals as text, doubles by `Digits`: char* (char* at, double).
template <class Digits>
class straight_line {
 public:
  straight_line(char* at, Digits digits) : at_{at}, digits_{digits} {}

  template <std::size_t N>
  straight_line& operator()(const char (&literal)[N]) {
    std::memcpy(at_, literal, N - 1);
    at_ += N - 1;
    return *this;
  }
  straight_line& operator()(std::string_view t) { // known to need no escapes
    std::memcpy(at_, t.data(), t.size());
    at_ += t.size();
    return *this;
  }
  straight_line& operator()(std::uint32_t x) {
    at_ = std::to_chars(at_, at_ + 10, x).ptr;
    return *this;
  }
  straight_line& operator()(double x) {
    at_ = digits_(at_, x);
    return *this;
  }
  char* at() const { return at_; }

 private:
  char* at_;
  Digits digits_;
};

template <class Digits>
std::size_t write_straight(char* buffer, const odometry& o, Digits digits) {
  straight_line w{buffer, digits};
  w(R"({"header":{"seq":)")(o.header.seq)(R"(,"stamp":{"secs":)")(o.header.stamp.secs);
  w(R"(,"nsecs":)")(o.header.stamp.nsecs)(R"(},"frame_id":")")(o.header.frame_id.view());
  w(R"("},"child_frame_id":")")(o.child_frame_id.view());
  w(R"(","pose":{"position":{"x":)")(o.pose.position.x)(R"(,"y":)")(o.pose.position.y);
  w(R"(,"z":)")(o.pose.position.z);
  w(R"(},"orientation":{"x":)")(o.pose.orientation.x)(R"(,"y":)")(o.pose.orientation.y);
  w(R"(,"z":)")(o.pose.orientation.z)(R"(,"w":)")(o.pose.orientation.w);
  w(R"(}},"twist":{"linear":{"x":)")(o.twist.linear.x)(R"(,"y":)")(o.twist.linear.y);
  w(R"(,"z":)")(o.twist.linear.z);
  w(R"(},"angular":{"x":)")(o.twist.angular.x)(R"(,"y":)")(o.twist.angular.y)(R"(,"z":)")(o.twist.angular.z);
  w("}}}");
  return static_cast<std::size_t>(w.at() - buffer);
}

// Each byte by itself: what a program writes that has not thought of it.
std::size_t write_base64_straight(char* buffer, std::span<const std::uint8_t> bytes) {
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  char* at = buffer;
  std::uint32_t bits = 0;
  int held = 0;
  for (const std::uint8_t byte : bytes) {
    bits = bits << 8 | byte;
    for (held += 8; held >= 6; held -= 6) *at++ = digits[bits >> (held - 6) & 63];
  }
  if (held != 0) *at++ = digits[bits << (6 - held) & 63];
  while ((at - buffer) % 4 != 0) *at++ = '=';
  return static_cast<std::size_t>(at - buffer);
}

char* standard_digits(char* at, double x) { return std::to_chars(at, at + 32, x).ptr; }
char* copied_digits(char* at, double) {
  std::memcpy(at, "-0.1234567890123456", 19);
  return at + 19;
}

// ---- the others ----
// Each writes what the rosbridge message has; the covariances where there are any.

template <class Message>
constexpr bool has_covariances = std::is_same_v<Message, ros::odometry>;

const ros::pose& pose_of(const odometry& o) { return o.pose; }
const ros::pose& pose_of(const ros::odometry& o) { return o.pose.pose; }
const ros::twist& twist_of(const odometry& o) { return o.twist; }
const ros::twist& twist_of(const ros::odometry& o) { return o.twist.twist; }

class by_rapidjson {
 public:
  template <class Message>
  std::size_t write(const Message& o) {
    begin();
    out_.StartObject();
    out_.Key("header");
    out_.StartObject();
    out_.Key("seq"), out_.Uint(o.header.seq);
    out_.Key("stamp");
    out_.StartObject();
    out_.Key("secs"), out_.Uint(o.header.stamp.secs);
    out_.Key("nsecs"), out_.Uint(o.header.stamp.nsecs);
    out_.EndObject();
    out_.Key("frame_id"), text(o.header.frame_id.view());
    out_.EndObject();
    out_.Key("child_frame_id"), text(o.child_frame_id.view());
    out_.Key("pose");
    with_covariance(o, o.pose, [&] {
      const ros::pose& pose = pose_of(o);
      out_.StartObject();
      out_.Key("position"), vector(pose.position), out_.EndObject();
      out_.Key("orientation"), vector(pose.orientation), out_.Key("w"), out_.Double(pose.orientation.w);
      out_.EndObject();
      out_.EndObject();
    });
    out_.Key("twist");
    with_covariance(o, o.twist, [&] {
      out_.StartObject();
      out_.Key("linear"), vector(twist_of(o).linear), out_.EndObject();
      out_.Key("angular"), vector(twist_of(o).angular), out_.EndObject();
      out_.EndObject();
    });
    out_.EndObject();
    return buffer_.GetSize();
  }

  std::size_t write(const call& c) {
    begin();
    out_.StartObject();
    out_.Key("service"), text(c.service);
    out_.Key("a"), out_.Int64(c.a);
    out_.Key("b"), out_.Int64(c.b);
    out_.Key("message_id"), text(c.id);
    out_.EndObject();
    return buffer_.GetSize();
  }

 private:
  void begin() {
    buffer_.Clear();
    out_.Reset(buffer_);
  }
  void text(std::string_view t) { out_.String(t.data(), static_cast<rapidjson::SizeType>(t.size())); }
  template <class Vector>
  void vector(const Vector& v) { // left open
    out_.StartObject();
    out_.Key("x"), out_.Double(v.x);
    out_.Key("y"), out_.Double(v.y);
    out_.Key("z"), out_.Double(v.z);
  }
  template <class Message, class Part, class Inside>
  void with_covariance(const Message&, const Part& part, Inside write_inside) {
    if constexpr (has_covariances<Message>) {
      out_.StartObject();
      out_.Key(std::is_same_v<Part, ros::pose_with_covariance> ? "pose" : "twist");
      write_inside();
      out_.Key("covariance");
      out_.StartArray();
      for (const double x : part.covariance) out_.Double(x);
      out_.EndArray();
      out_.EndObject();
    } else {
      write_inside();
    }
  }

  rapidjson::StringBuffer buffer_;
  rapidjson::Writer<rapidjson::StringBuffer> out_{buffer_};
};

// ---- trees ----

using members = std::initializer_list<std::pair<const char*, json_object*>>;

json_object* tree(members all) {
  json_object* const o = json_object_new_object();
  for (const auto& [name, value] : all) json_object_object_add(o, name, value);
  return o;
}
json_object* tree(std::string_view t) {
  return json_object_new_string_len(t.data(), static_cast<int>(t.size()));
}
json_object* tree(std::int64_t x) { return json_object_new_int64(x); }
json_object* tree(const ros::vector3& v) {
  return tree({{"x", json_object_new_double(v.x)},
               {"y", json_object_new_double(v.y)},
               {"z", json_object_new_double(v.z)}});
}
template <class Covariance>
json_object* tree_of_array(const Covariance& values) {
  json_object* const all = json_object_new_array_ext(static_cast<int>(values.size()));
  for (const double x : values) json_object_array_add(all, json_object_new_double(x));
  return all;
}

std::size_t print(json_object* all) {
  std::size_t bytes = 0;
  benchmark::DoNotOptimize(json_object_to_json_string_length(all, JSON_C_TO_STRING_PLAIN, &bytes));
  json_object_put(all);
  return bytes;
}

template <class Message>
std::size_t write_json_c(const Message& o) {
  const ros::pose& p = pose_of(o);
  json_object* const orientation = tree({p.orientation.x, p.orientation.y, p.orientation.z});
  json_object_object_add(orientation, "w", json_object_new_double(p.orientation.w));
  json_object* pose =
      tree({{"position", tree({p.position.x, p.position.y, p.position.z})}, {"orientation", orientation}});
  json_object* twist = tree({{"linear", tree(twist_of(o).linear)}, {"angular", tree(twist_of(o).angular)}});
  if constexpr (has_covariances<Message>) {
    pose = tree({{"pose", pose}, {"covariance", tree_of_array(o.pose.covariance)}});
    twist = tree({{"twist", twist}, {"covariance", tree_of_array(o.twist.covariance)}});
  }
  return print(tree(
      {{"header",
        tree({{"seq", tree(o.header.seq)},
              {"stamp", tree({{"secs", tree(o.header.stamp.secs)}, {"nsecs", tree(o.header.stamp.nsecs)}})},
              {"frame_id", tree(o.header.frame_id.view())}})},
       {"child_frame_id", tree(o.child_frame_id.view())},
       {"pose", pose},
       {"twist", twist}}));
}

std::size_t write_json_c(const call& c) {
  return print(tree({{"service", tree(std::string_view{c.service})},
                     {"a", tree(c.a)},
                     {"b", tree(c.b)},
                     {"message_id", tree(std::string_view{c.id})}}));
}

template <class Message>
std::size_t write_nlohmann(const Message& o) {
  using nlohmann::json;
  const auto vector = [](const auto& v) { return json{{"x", v.x}, {"y", v.y}, {"z", v.z}}; };
  json orientation = vector(pose_of(o).orientation);
  orientation["w"] = pose_of(o).orientation.w;
  json pose{{"position", vector(pose_of(o).position)}, {"orientation", std::move(orientation)}};
  json twist{{"linear", vector(twist_of(o).linear)}, {"angular", vector(twist_of(o).angular)}};
  if constexpr (has_covariances<Message>) {
    pose = {{"pose", std::move(pose)}, {"covariance", o.pose.covariance}};
    twist = {{"twist", std::move(twist)}, {"covariance", o.twist.covariance}};
  }
  const json all{{"header",
                  {{"seq", o.header.seq},
                   {"stamp", {{"secs", o.header.stamp.secs}, {"nsecs", o.header.stamp.nsecs}}},
                   {"frame_id", std::string{o.header.frame_id.view()}}}},
                 {"child_frame_id", std::string{o.child_frame_id.view()}},
                 {"pose", std::move(pose)},
                 {"twist", std::move(twist)}};
  return all.dump().size();
}

std::size_t write_nlohmann(const call& c) {
  return nlohmann::json{{"service", c.service}, {"a", c.a}, {"b", c.b}, {"message_id", c.id}}.dump().size();
}

// What all ways need.
struct field {
  message_source source;
  std::vector<odometry> plain = source.odometries();
  std::vector<ros::odometry> sparse = source.odometries_with(covariances::sparse);
  std::vector<ros::odometry> dense = source.odometries_with(covariances::dense);
  std::vector<call> calls = source.calls();
  json::encoder plain_encoder = json::encoder::compile(describe<odometry>()).value();
  json::encoder full_encoder = json::encoder::compile(describe<ros::odometry>()).value();
  json::encoder plain_cbor = json::encoder::compile(describe<odometry>(), json::encoding::cbor).value();
  std::vector<laser_scan> scans = source.scans();
  std::vector<picture> pictures = source.pictures(8);
  json::encoder scan_encoder = json::encoder::compile(describe<laser_scan>()).value();
  json::encoder scan_cbor = json::encoder::compile(describe<laser_scan>(), json::encoding::cbor).value();
  json::encoder picture_encoder = json::encoder::compile(describe<picture>()).value();
  json::encoder picture_cbor = json::encoder::compile(describe<picture>(), json::encoding::cbor).value();
  json::encoder full_cbor = json::encoder::compile(describe<ros::odometry>(), json::encoding::cbor).value();
  by_rapidjson rapidjson;
  std::array<char, 32 * 1024> buffer;

  std::size_t encode(const json::encoder& e, const void* object) {
    json::writer w{buffer};
    e.encode(object, w);
    return w.bytes();
  }
};

way::ratio times_json_c(const char* group) { return {"x_json_c", std::string{group} + "/json_c", true}; }

// The same of each group: the four libraries on the messages of one kind.
template <class Messages>
void add_libraries(std::vector<way>& to, const char* group, field& f, const Messages& all) {
  const std::string slash = std::string{group} + "/";
  const way::ratio x = times_json_c(group);
  to.push_back({slash + "rapidjson", [&](std::size_t i) { return f.rapidjson.write(all[i]); }, {x}});
  to.push_back({slash + "nlohmann", [&](std::size_t i) { return write_nlohmann(all[i]); }, {x}});
  to.push_back({slash + "json_c", [&](std::size_t i) { return write_json_c(all[i]); }, {}});
}

std::vector<way> ways() {
  static field f;
  const way::ratio of_to_chars{"of_to_chars", "odometry_write/to_chars"};
  const way::ratio of_plain{"of_plain", "odometry_write/rowe"};
  std::vector<way> all{
      {"odometry_write/rowe",
       [](std::size_t i) { return f.encode(f.plain_encoder, &f.plain[i]); },
       {of_to_chars, times_json_c("odometry_write")}},
      {"odometry_write/straight",
       [](std::size_t i) { return write_straight(f.buffer.data(), f.plain[i], json::write_double); },
       {of_to_chars, times_json_c("odometry_write")}},
      {"odometry_write/to_chars",
       [](std::size_t i) { return write_straight(f.buffer.data(), f.plain[i], standard_digits); },
       {times_json_c("odometry_write")}},
      {"odometry_write/copied",
       [](std::size_t i) { return write_straight(f.buffer.data(), f.plain[i], copied_digits); },
       {of_to_chars}}};
  all.push_back({"odometry_write/rowe_cbor",
                 [](std::size_t i) { return f.encode(f.plain_cbor, &f.plain[i]); },
                 {{"x_rowe", "odometry_write/rowe", true}}});
  add_libraries(all, "odometry_write", f, f.plain);
  all.push_back({"covariances_write/rowe",
                 [](std::size_t i) { return f.encode(f.full_encoder, &f.sparse[i]); },
                 {of_plain, times_json_c("covariances_write")}});
  all.push_back({"covariances_write/rowe_cbor",
                 [](std::size_t i) { return f.encode(f.full_cbor, &f.sparse[i]); },
                 {{"x_rowe", "covariances_write/rowe", true}}});
  add_libraries(all, "covariances_write", f, f.sparse);
  all.push_back({"dense_write/rowe",
                 [](std::size_t i) { return f.encode(f.full_encoder, &f.dense[i]); },
                 {of_plain, times_json_c("dense_write")}});
  add_libraries(all, "dense_write", f, f.dense);
  const auto add_pair = [&all](const char* group, const json::encoder& text, const json::encoder& cbor,
                               const auto& messages_of) {
    const std::string slash = std::string{group} + "/";
    const auto at = [&](const json::encoder& by) {
      return
          [&by, &messages_of](std::size_t i) { return f.encode(by, &messages_of[i % messages_of.size()]); };
    };
    all.push_back({slash + "rowe", at(text)});
    all.push_back({slash + "rowe_cbor", at(cbor), {{"x_rowe", slash + "rowe", true}}});
  };
  add_pair("scan_write", f.scan_encoder, f.scan_cbor, f.scans);
  add_pair("picture_write", f.picture_encoder, f.picture_cbor, f.pictures);
  all.push_back({"picture_write/straight", [](std::size_t i) {
                   return write_base64_straight(f.buffer.data(), f.pictures[i % f.pictures.size()].data);
                 }});
  all[all.size() - 3].ratios.push_back({"of_straight", "picture_write/straight"});
  all.push_back({"call_write/rowe",
                 [](std::size_t i) { return write_call(f.buffer, f.calls[i]); },
                 {times_json_c("call_write")}});
  add_libraries(all, "call_write", f, f.calls);
  return all;
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  return rowe::bench::run_contest(count, arguments, rowe::bench::ways);
}
