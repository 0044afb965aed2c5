// SPDX-License-Identifier: Apache-2.0
// Question: what does JSON cost the service thread, next to other ways of writing and reading the same text?
//
// Measured, nanoseconds of this thread's processor time a message, the median over the rounds, each way once
// in every round:
//   write/…       an odometry message of 13 random doubles (about 500 bytes, each double reads back equal)
//     rowe        the encoder, as publishers use it
//     straight    the same text by straight-line code: literals of known length, the same digits
//     to_chars    the same straight-line code on std::to_chars: what `of_to_chars` is a ratio to
//     copied      the same with every double replaced by a constant: the floor of all that is not digits
//     json-c, nlohmann   a tree is built and printed, as their users do
//   write_sparse, write_dense   rowe, with two covariances of 36: 12 of 85 doubles not 0, or none 0
//   write_unchanged             the sparse covariances, the same in each message, with the encoder's memory
//   write_call, read_call   a small invocation: rowe's writer, or validation and three look-ups, and json-c
//   receive/…     a rosbridge publish of about 300 bytes
//     dom         simdjson's DOM parse, nothing read
//     validate    the reader's verdict
//     rowe        the verdict, then a walk over the envelope's members: what the service thread does
//                 (`of_dom` is the DOM's time as a share of it)
//     on_demand   simdjson's on-demand parser, three look-ups, nothing validated
//   walk/…        all 13 doubles of an odometry text: rowe (lazily, no validation), dom, on_demand
//
// 256 different messages in turn, all in cache.
//
// Excluded: sockets, frames, cold caches.
//
// What would make it lie: another compiler's idea of -O3 (build the release preset); text that is always the
// same (branches learn it).
//
// Run: bench_json [--rounds=11] [Google Benchmark's options]
#include <array>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>
#include <json-c/json.h>
#include <nlohmann/json.hpp>
#define SIMDJSON_EXCEPTIONS 0
#include <simdjson.h>

#include <rowe/ros.hpp>
#include <rowe/rt/thread.hpp>

#include "rounds.hpp"
#include "json/digits.hpp"
#include "json/encoder.hpp"
#include "json/reader.hpp"
#include "json/writer.hpp"

namespace rowe::bench {

struct odometry {
  ros::header header;
  ros::frame_name child_frame_id;
  ros::pose pose;
  ros::twist twist;
};

} // namespace rowe::bench

template <>
inline constexpr auto rowe::schema<rowe::bench::odometry> =
    rowe::fields<&rowe::bench::odometry::header, &rowe::bench::odometry::child_frame_id,
                 &rowe::bench::odometry::pose, &rowe::bench::odometry::twist>{};

namespace rowe::bench {
namespace {

constexpr std::size_t messages = 256;
constexpr int passes = 20; // over all messages, in a round

// ---- the messages ----

std::mt19937_64 random_bits{20'240'229};

double number() {
  static std::normal_distribution<double> metres;
  return metres(random_bits);
}

ros::pose random_pose() { return {{number(), number(), number()}, {number(), number(), number(), number()}}; }
ros::twist random_twist() { return {{number(), number(), number()}, {number(), number(), number()}}; }
ros::header header_of(std::size_t i) {
  return {.seq = static_cast<std::uint32_t>(100'000 + i),
          .stamp = {1'700'000'000, 123'456'789},
          .frame_id = "odom"};
}

std::vector<odometry> plain_messages() {
  std::vector<odometry> all;
  for (std::size_t i = 0; i < messages; ++i)
    all.push_back({header_of(i), "base_link", random_pose(), random_twist()});
  return all;
}

std::vector<ros::odometry> covariance_messages(bool dense) {
  std::vector<ros::odometry> all;
  for (std::size_t i = 0; i < messages; ++i) {
    ros::odometry o{header_of(i), "base_link", {random_pose(), {}}, {random_twist(), {}}};
    for (std::size_t k = 0; k < 36; ++k) {
      if (!dense && k % 7 != 0) continue; // the diagonal
      o.pose.covariance[k] = number();
      o.twist.covariance[k] = number();
    }
    all.push_back(o);
  }
  return all;
}

// ---- straight-line writing ----

// Literals as text, doubles by `Digits`: char* (char* at, double).
template <class Digits>
class straight_line {
 public:
  straight_line(char* at, Digits digits) : at_{at}, digits_{digits} {}

  template <std::size_t N>
  void literal(const char (&text)[N]) {
    std::memcpy(at_, text, N - 1);
    at_ += N - 1;
  }
  void text(std::string_view t) {
    std::memcpy(at_, t.data(), t.size());
    at_ += t.size();
  }
  void integer(std::uint32_t x) { at_ = std::to_chars(at_, at_ + 10, x).ptr; }
  void real(double x) { at_ = digits_(at_, x); }
  char* at() const { return at_; }

 private:
  char* at_;
  Digits digits_;
};

template <class Digits>
std::size_t write_straight(char* room, const odometry& o, Digits digits) {
  straight_line w{room, digits};
  w.literal(R"({"header":{"seq":)");
  w.integer(o.header.seq);
  w.literal(R"(,"stamp":{"secs":)");
  w.integer(o.header.stamp.secs);
  w.literal(R"(,"nsecs":)");
  w.integer(o.header.stamp.nsecs);
  w.literal(R"(},"frame_id":")");
  w.text(o.header.frame_id); // known to need no escapes
  w.literal(R"("},"child_frame_id":")");
  w.text(o.child_frame_id);
  w.literal(R"(","pose":{"position":{"x":)");
  w.real(o.pose.position.x);
  w.literal(R"(,"y":)");
  w.real(o.pose.position.y);
  w.literal(R"(,"z":)");
  w.real(o.pose.position.z);
  w.literal(R"(},"orientation":{"x":)");
  w.real(o.pose.orientation.x);
  w.literal(R"(,"y":)");
  w.real(o.pose.orientation.y);
  w.literal(R"(,"z":)");
  w.real(o.pose.orientation.z);
  w.literal(R"(,"w":)");
  w.real(o.pose.orientation.w);
  w.literal(R"(}},"twist":{"linear":{"x":)");
  w.real(o.twist.linear.x);
  w.literal(R"(,"y":)");
  w.real(o.twist.linear.y);
  w.literal(R"(,"z":)");
  w.real(o.twist.linear.z);
  w.literal(R"(},"angular":{"x":)");
  w.real(o.twist.angular.x);
  w.literal(R"(,"y":)");
  w.real(o.twist.angular.y);
  w.literal(R"(,"z":)");
  w.real(o.twist.angular.z);
  w.literal("}}}");
  return static_cast<std::size_t>(w.at() - room);
}

char* standard_digits(char* at, double x) { return std::to_chars(at, at + 32, x).ptr; }
char* copied_digits(char* at, double) {
  std::memcpy(at, "-0.1234567890123456", 19);
  return at + 19;
}

// ---- trees ----

json_object* tree_of(const ros::vector3& v) {
  json_object* const o = json_object_new_object();
  json_object_object_add(o, "x", json_object_new_double(v.x));
  json_object_object_add(o, "y", json_object_new_double(v.y));
  json_object_object_add(o, "z", json_object_new_double(v.z));
  return o;
}

std::size_t write_json_c(const odometry& o) {
  const auto text = [](const ros::frame_name& t) {
    return json_object_new_string_len(t.view().data(), static_cast<int>(t.size()));
  };
  json_object* const all = json_object_new_object();
  json_object* const header = json_object_new_object();
  json_object* const stamp = json_object_new_object();
  json_object* const pose = json_object_new_object();
  json_object* const twist = json_object_new_object();
  json_object_object_add(stamp, "secs", json_object_new_int64(o.header.stamp.secs));
  json_object_object_add(stamp, "nsecs", json_object_new_int64(o.header.stamp.nsecs));
  json_object_object_add(header, "seq", json_object_new_int64(o.header.seq));
  json_object_object_add(header, "stamp", stamp);
  json_object_object_add(header, "frame_id", text(o.header.frame_id));
  json_object_object_add(all, "header", header);
  json_object_object_add(all, "child_frame_id", text(o.child_frame_id));
  json_object_object_add(pose, "position",
                         tree_of({o.pose.position.x, o.pose.position.y, o.pose.position.z}));
  json_object* const orientation =
      tree_of({o.pose.orientation.x, o.pose.orientation.y, o.pose.orientation.z});
  json_object_object_add(orientation, "w", json_object_new_double(o.pose.orientation.w));
  json_object_object_add(pose, "orientation", orientation);
  json_object_object_add(twist, "linear", tree_of(o.twist.linear));
  json_object_object_add(twist, "angular", tree_of(o.twist.angular));
  json_object_object_add(all, "pose", pose);
  json_object_object_add(all, "twist", twist);
  std::size_t bytes = 0;
  benchmark::DoNotOptimize(json_object_to_json_string_length(all, JSON_C_TO_STRING_PLAIN, &bytes));
  json_object_put(all);
  return bytes;
}

std::size_t write_nlohmann(const odometry& o) {
  using nlohmann::json;
  const auto vector = [](const auto& v) { return json{{"x", v.x}, {"y", v.y}, {"z", v.z}}; };
  const auto text = [](const ros::frame_name& t) { return std::string{t.view()}; };
  json orientation = vector(o.pose.orientation);
  orientation["w"] = o.pose.orientation.w;
  const json all{{"header",
                  {{"seq", o.header.seq},
                   {"stamp", {{"secs", o.header.stamp.secs}, {"nsecs", o.header.stamp.nsecs}}},
                   {"frame_id", text(o.header.frame_id)}}},
                 {"child_frame_id", text(o.child_frame_id)},
                 {"pose", {{"position", vector(o.pose.position)}, {"orientation", orientation}}},
                 {"twist", {{"linear", vector(o.twist.linear)}, {"angular", vector(o.twist.angular)}}}};
  return all.dump().size();
}

// ---- texts to read ----

// Texts with room behind them for parsers to look at.
class text_list {
 public:
  void add(std::string_view text) {
    bytes_.push_back(text.size());
    store_.emplace_back(text);
    store_.back().append(json::reader::tailroom_bytes, ' ');
  }
  std::string_view operator[](std::size_t i) const { return {store_[i].data(), bytes_[i]}; }

 private:
  std::vector<std::size_t> bytes_;
  std::vector<std::string> store_;
};

text_list publish_texts() {
  text_list all;
  std::array<char, 1024> room;
  for (std::size_t i = 0; i < messages; ++i) {
    json::writer w{room};
    w.append(R"({"op":"publish","id":"publish:/cmd_vel:)");
    w.number(i);
    w.append(R"(","topic":"/cmd_vel","msg":{"header":{"stamp":{"secs":1700000000,"nsecs":123456789},)"
             R"("frame_id":"base_link"},"twist":{"linear":{"x":)");
    for (const char* const name :
         {"", R"(,"y":)", R"(,"z":)", R"(},"angular":{"x":)", R"(,"y":)", R"(,"z":)"}) {
      w.append(name);
      std::array<char, json::number_room_bytes> digits;
      const double x = number();
      w.append(
          {digits.data(), static_cast<std::size_t>(json::write_double(digits.data(), x) - digits.data())});
    }
    w.append(R"(}}},"latch":false})");
    all.add(w.text());
  }
  return all;
}

// ---- the rounds ----

struct way {
  std::string name;
  std::function<std::size_t(std::size_t)>
      run; // the i-th message; returns bytes, or whatever must not be left out
  std::string ratio_to = {};
  std::string ratio_name = {};
  bool inverted = false; // the other's time as a share of ours
  std::vector<double> times = {};
  std::vector<double> ratios = {};
  std::size_t bytes = 0;
};

double cpu_time() {
  timespec t;
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e9 + static_cast<double>(t.tv_nsec);
}

double measure(way& w) {
  const double begin = cpu_time();
  std::size_t sum = 0;
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t i = 0; i < messages; ++i) {
      const std::size_t bytes = w.run(i);
      benchmark::DoNotOptimize(bytes);
      sum += bytes;
    }
  }
  const double elapsed = cpu_time() - begin;
  w.bytes = sum / (passes * messages);
  return elapsed / (passes * messages);
}

void run_round(std::vector<way>& ways) {
  std::map<std::string, double> of;
  for (way& w : ways) {
    of[w.name] = measure(w);
    w.times.push_back(of[w.name]);
  }
  for (way& w : ways) {
    if (w.ratio_to.empty()) continue;
    const double ratio = of[w.name] / of[w.ratio_to];
    w.ratios.push_back(w.inverted ? 1 / ratio : ratio);
  }
}

void report(const way& w) {
  benchmark::RegisterBenchmark(w.name.c_str(),
                               [&w](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(median(w.times) * 1e-9);
                                 state.counters["bytes"] = static_cast<double>(w.bytes);
                                 if (!w.ratios.empty()) state.counters[w.ratio_name] = median(w.ratios);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kNanosecond);
}

constexpr std::string_view call_text =
    R"({"service":"add-two-numbers","a":38,"b":4,"message_id":"5c1f2e.1.2.3"})";

} // namespace

int run(int rounds) {
  static std::array<char, 16 * 1024> room;
  const std::vector<odometry> plain = plain_messages();
  const std::vector<ros::odometry> sparse = covariance_messages(false), dense = covariance_messages(true);
  const json::encoder plain_encoder = json::encoder::compile(describe<odometry>()).value();
  const json::encoder full_encoder = json::encoder::compile(describe<ros::odometry>()).value();
  json::encoder::memory memory = full_encoder.remember().value();
  std::vector<ros::odometry> unchanged = sparse; // other poses, the same covariances
  for (ros::odometry& o : unchanged) {
    o.pose.covariance = sparse[0].pose.covariance;
    o.twist.covariance = sparse[0].twist.covariance;
  }
  const text_list publishes = publish_texts();
  text_list odometries, calls;
  calls.add(call_text);
  for (const odometry& o : plain)
    odometries.add({room.data(), write_straight(room.data(), o, json::write_double)});
  json::reader reader = json::reader::create(64 * 1024).value();
  simdjson::dom::parser dom;
  simdjson::ondemand::parser on_demand;
  json_tokener* const tokener = json_tokener_new();

  const auto encode = [](const json::encoder& e, const void* object) {
    json::writer w{room};
    e.encode(object, w);
    return w.bytes();
  };
  const auto padded_bytes = [](std::string_view text) { return text.size() + json::reader::tailroom_bytes; };

  static std::vector<way> ways;
  ways = {
      {"write/rowe", [&](std::size_t i) { return encode(plain_encoder, &plain[i]); }, "write/to_chars",
       "of_to_chars"},
      {"write/straight",
       [&](std::size_t i) { return write_straight(room.data(), plain[i], json::write_double); },
       "write/to_chars", "of_to_chars"},
      {"write/to_chars",
       [&](std::size_t i) { return write_straight(room.data(), plain[i], standard_digits); }},
      {"write/copied", [&](std::size_t i) { return write_straight(room.data(), plain[i], copied_digits); }},
      {"write/json-c", [&](std::size_t i) { return write_json_c(plain[i]); }, "write/rowe", "of_rowe"},
      {"write/nlohmann", [&](std::size_t i) { return write_nlohmann(plain[i]); }, "write/rowe", "of_rowe"},
      {"write_sparse/rowe", [&](std::size_t i) { return encode(full_encoder, &sparse[i]); }, "write/rowe",
       "of_plain"},
      {"write_dense/rowe", [&](std::size_t i) { return encode(full_encoder, &dense[i]); }, "write/rowe",
       "of_plain"},
      {"write_unchanged/rowe",
       [&](std::size_t i) {
         json::writer w{room};
         full_encoder.encode(&unchanged[i], w, memory);
         return w.bytes();
       },
       "write/rowe", "of_plain"},
      {"write_call/rowe",
       [&](std::size_t i) {
         json::writer w{room};
         w.append(R"({"service":)");
         w.string("add-two-numbers");
         w.append(R"(,"a":)");
         w.number(i);
         w.key("b");
         w.number(4);
         w.key("message_id");
         w.string("5c1f2e.1.2.3");
         w.end_object();
         return w.bytes();
       }},
      {"write_call/json-c",
       [&](std::size_t i) {
         json_object* const o = json_object_new_object();
         json_object_object_add(o, "service", json_object_new_string("add-two-numbers"));
         json_object_object_add(o, "a", json_object_new_int64(static_cast<std::int64_t>(i)));
         json_object_object_add(o, "b", json_object_new_int64(4));
         json_object_object_add(o, "message_id", json_object_new_string("5c1f2e.1.2.3"));
         std::size_t bytes = 0;
         benchmark::DoNotOptimize(json_object_to_json_string_length(o, JSON_C_TO_STRING_PLAIN, &bytes));
         json_object_put(o);
         return bytes;
       },
       "write_call/rowe", "of_rowe"},
      {"read_call/rowe",
       [&](std::size_t) {
         const std::string_view text = calls[0];
         if (!reader.validate(text)) return std::size_t{0};
         json::object_walk members{text};
         std::int64_t sum = 0;
         bool named = false;
         for (json::member m; members.next(m);) {
           if (json::name_is(m, "a") || json::name_is(m, "b")) sum += json::to_integer(m.what).value_or(0);
           if (json::name_is(m, "service")) named = json::text_is(m.what, "add-two-numbers");
         }
         return static_cast<std::size_t>(sum) + named;
       }},
      {"read_call/json-c",
       [&](std::size_t) {
         const std::string_view text = calls[0];
         json_tokener_reset(tokener);
         json_object* const o = json_tokener_parse_ex(tokener, text.data(), static_cast<int>(text.size()));
         json_object *service = nullptr, *a = nullptr, *b = nullptr;
         json_object_object_get_ex(o, "service", &service);
         json_object_object_get_ex(o, "a", &a);
         json_object_object_get_ex(o, "b", &b);
         const std::int64_t sum = json_object_get_int64(a) + json_object_get_int64(b);
         const bool named = std::strcmp(json_object_get_string(service), "add-two-numbers") == 0;
         json_object_put(o);
         return static_cast<std::size_t>(sum) + named;
       },
       "read_call/rowe", "of_rowe"},
      {"receive/dom",
       [&](std::size_t i) {
         const std::string_view text = publishes[i];
         return dom.parse(text.data(), text.size(), false).error() == simdjson::SUCCESS ? text.size() : 0;
       }},
      {"receive/validate",
       [&](std::size_t i) {
         const std::string_view text = publishes[i];
         return reader.validate(text) ? text.size() : 0;
       },
       "receive/dom", "of_dom", true},
      {"receive/rowe",
       [&](std::size_t i) {
         const std::string_view text = publishes[i];
         if (!reader.validate(text)) return std::size_t{0};
         json::object_walk members{text};
         std::size_t found = 0;
         for (json::member m; members.next(m);) {
           if (json::name_is(m, "op")) found += json::text_is(m.what, "publish");
           if (json::name_is(m, "topic")) found += json::text_is(m.what, "/cmd_vel");
           if (json::name_is(m, "msg")) found += m.what.raw.size();
         }
         return found;
       },
       "receive/dom", "of_dom", true},
      {"receive/on_demand",
       [&](std::size_t i) {
         const std::string_view text = publishes[i];
         simdjson::ondemand::document document;
         if (on_demand.iterate(text.data(), text.size(), padded_bytes(text)).get(document) !=
             simdjson::SUCCESS) {
           return std::size_t{0};
         }
         std::string_view op, topic, raw;
         if (document["op"].get_string().get(op) != simdjson::SUCCESS) return std::size_t{0};
         if (document["topic"].get_string().get(topic) != simdjson::SUCCESS) return std::size_t{0};
         simdjson::ondemand::object msg;
         if (document["msg"].get_object().get(msg) != simdjson::SUCCESS) return std::size_t{0};
         if (msg.raw_json().get(raw) != simdjson::SUCCESS) return std::size_t{0};
         return (op == "publish") + (topic == "/cmd_vel") + raw.size();
       },
       "receive/dom", "of_dom", true},
      {"walk/rowe",
       [&](std::size_t i) {
         double sum = 0;
         const auto add = [&sum](std::string_view of) {
           json::object_walk components{of};
           for (json::member m; components.next(m);) sum += json::to_double(m.what).value_or(0);
         };
         json::object_walk members{odometries[i]};
         for (json::member m; members.next(m);) {
           if (!json::name_is(m, "pose") && !json::name_is(m, "twist")) continue;
           json::object_walk parts{m.what.raw};
           for (json::member part; parts.next(part);) add(part.what.raw);
         }
         return static_cast<std::size_t>(sum > 0);
       },
       "walk/dom", "of_dom_time"},
      {"walk/dom",
       [&](std::size_t i) {
         const std::string_view text = odometries[i];
         double sum = 0;
         simdjson::dom::object all;
         if (dom.parse(text.data(), text.size(), false).get(all) != simdjson::SUCCESS) return std::size_t{0};
         for (const char* const name : {"pose", "twist"}) {
           simdjson::dom::object parts;
           if (all[name].get(parts) != simdjson::SUCCESS) return std::size_t{0};
           for (const auto part : parts) {
             simdjson::dom::object components;
             if (part.value.get(components) != simdjson::SUCCESS) return std::size_t{0};
             for (const auto component : components) {
               double x = 0;
               if (component.value.get(x) == simdjson::SUCCESS) sum += x;
             }
           }
         }
         return static_cast<std::size_t>(sum > 0);
       }},
      {"walk/on_demand",
       [&](std::size_t i) {
         const std::string_view text = odometries[i];
         double sum = 0;
         simdjson::ondemand::document all;
         if (on_demand.iterate(text.data(), text.size(), padded_bytes(text)).get(all) != simdjson::SUCCESS) {
           return std::size_t{0};
         }
         for (const char* const name : {"pose", "twist"}) {
           simdjson::ondemand::object parts;
           if (all[name].get(parts) != simdjson::SUCCESS) return std::size_t{0};
           for (auto part : parts) {
             simdjson::ondemand::object components;
             if (part.value().get(components) != simdjson::SUCCESS) return std::size_t{0};
             for (auto component : components) {
               double x = 0;
               if (component.value().get(x) == simdjson::SUCCESS) sum += x;
             }
           }
         }
         return static_cast<std::size_t>(sum > 0);
       },
       "walk/dom", "of_dom_time"},
  };
  for (int round = 0; round < rounds; ++round) run_round(ways);
  for (const way& w : ways) report(w);
  json_tokener_free(tokener);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  const int rounds = number_option(count, arguments, "rounds", 11);
  benchmark::Initialize(&count, arguments);
  if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 1;
  benchmark::AddCustomContext("rounds", std::to_string(rounds));
  benchmark::AddCustomContext("kernel", line_of("/proc/sys/kernel/osrelease"));
  benchmark::AddCustomContext("simdjson", simdjson::get_active_implementation()->name());
  const int code = run(rounds);
  benchmark::Shutdown();
  return code;
}
