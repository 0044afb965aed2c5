// SPDX-License-Identifier: Apache-2.0
// Question: what does reading JSON cost the service thread, next to other readers of the same text?
//
// Measured, nanoseconds of this thread's processor time for a message, each way once in every round:
//   odometry_read/…      about 500 bytes with 13 random doubles, every number read
//     rowe        the verdict, then the decoder into a struct, as typed subscribers use it
//     simdjson_dom, simdjson_on_demand, rapidjson, nlohmann, json_c
//                 parsed, then all numbers added up; on_demand validates no more than it visits; rapidjson
//                 in situ, from a copy of the text
//   covariances_read/…   the same with two covariances of 36, 12 of 85 doubles not 0
//   call_read/…          a small invocation: a name compared, two integers read
//   receive_300/…        a rosbridge publish of about 300 bytes
//     simdjson_dom       the DOM's parse, nothing read
//     rowe_validation    the reader's verdict
//     rowe               the verdict, then a walk over the envelope's members: what the service thread does
//     simdjson_on_demand three look-ups, nothing validated
// `x_json_c` says how many times as fast as json-c a contender is, `x_dom` how many times as fast as the
// DOM's parse alone.
//
// Excluded: sockets, frames, cold caches.
//
// What would make it lie: another compiler's idea of -O3 (build the release preset); 256 different messages
// in turn, all in cache, are few enough for branches to learn some of them. rapidjson does not round its
// doubles correctly unless it is asked to, and is not asked; nor does it check UTF-8.
//
// Run: bench_json_read [--rounds=11] [Google Benchmark's options]
#include <cstring>
#include <memory>

#include <json-c/json.h>
#include <nlohmann/json.hpp>
#include <rapidjson/document.h>
#define SIMDJSON_EXCEPTIONS 0
#include <simdjson.h>

#include "json_contest.hpp"
#include "json_messages.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/decoder.hpp"
#include "json/structs/encoder.hpp"
#include "json/writing/writer.hpp"

namespace rowe::bench {
namespace {

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

std::size_t padded_bytes(std::string_view text) { return text.size() + json::reader::tailroom_bytes; }

// ---- texts ----

template <class Message>
text_list texts_of(const std::vector<Message>& all) {
  static std::array<char, 16 * 1024> buffer;
  const json::encoder encoder = json::encoder::compile(describe<Message>()).value();
  text_list texts;
  for (const Message& o : all) {
    json::writer w{buffer};
    encoder.encode(&o, w);
    texts.add(w.text());
  }
  return texts;
}

text_list texts_of(const std::vector<call>& all) {
  std::array<char, 256> buffer;
  text_list texts;
  for (const call& c : all) texts.add({buffer.data(), write_call(buffer, c)});
  return texts;
}

text_list publishes(message_source& source) {
  text_list texts;
  for (std::size_t i = 0; i < messages; ++i) texts.add(source.publish(i));
  return texts;
}

// ---- all numbers of a text, added up ----

double sum(const simdjson::dom::element& e) {
  double total = 0;
  switch (e.type()) {
  case simdjson::dom::element_type::OBJECT:
    for (const auto member : simdjson::dom::object{e.get_object().value_unsafe()}) total += sum(member.value);
    break;
  case simdjson::dom::element_type::ARRAY:
    for (const auto element : simdjson::dom::array{e.get_array().value_unsafe()}) total += sum(element);
    break;
  case simdjson::dom::element_type::STRING: break;
  default: total = e.get_double().value_unsafe(); break;
  }
  return total;
}

double sum(simdjson::ondemand::value e) {
  double total = 0;
  switch (e.type().value_unsafe()) {
  case simdjson::ondemand::json_type::object:
    for (auto member : e.get_object()) total += sum(member.value().value_unsafe());
    break;
  case simdjson::ondemand::json_type::array:
    for (auto element : e.get_array()) total += sum(element.value_unsafe());
    break;
  case simdjson::ondemand::json_type::number: total = e.get_double().value_unsafe(); break;
  default: break;
  }
  return total;
}

double sum(const rapidjson::Value& v) {
  double total = 0;
  if (v.IsObject()) {
    for (const auto& member : v.GetObject()) total += sum(member.value);
  } else if (v.IsArray()) {
    for (const auto& element : v.GetArray()) total += sum(element);
  } else if (v.IsNumber()) {
    total = v.GetDouble();
  }
  return total;
}

double sum(const nlohmann::json& v) {
  double total = 0;
  if (v.is_structured()) {
    for (const auto& inside : v) total += sum(inside);
  } else if (v.is_number()) {
    total = v.get<double>();
  }
  return total;
}

double sum(json_object* v) {
  double total = 0;
  switch (json_object_get_type(v)) {
  case json_type_object: {
    json_object_object_foreach(v, name, inside) {
      (void)name;
      total += sum(inside);
    }
    break;
  }
  case json_type_array:
    for (std::size_t i = 0; i < json_object_array_length(v); ++i)
      total += sum(json_object_array_get_idx(v, i));
    break;
  case json_type_double:
  case json_type_int: total = json_object_get_double(v); break;
  default: break;
  }
  return total;
}

// ---- the parsers ----

constexpr std::string_view service = "add-two-numbers";

class by_rapidjson {
 public:
  const rapidjson::Value& parse(std::string_view text) {
    std::memcpy(copy_.data(), text.data(), text.size());
    copy_[text.size()] = '\0';
    document_.reset();
    values_.Clear();
    stack_allocator_.Clear();
    document_ = std::make_unique<document>(&values_, stack_.size(), &stack_allocator_);
    document_->ParseInsitu(copy_.data());
    return *document_;
  }

 private:
  using allocator = rapidjson::MemoryPoolAllocator<>;
  using document = rapidjson::GenericDocument<rapidjson::UTF8<>, allocator, allocator>;

  std::array<char, 16 * 1024> copy_{};
  std::array<char, 64 * 1024> buffer_{};
  std::array<char, 16 * 1024> stack_{};
  allocator values_{buffer_.data(), buffer_.size()};
  allocator stack_allocator_{stack_.data(), stack_.size()};
  std::unique_ptr<document> document_;
};

class by_json_c {
 public:
  by_json_c() : tokener_{json_tokener_new()} {}
  by_json_c(const by_json_c&) = delete;
  ~by_json_c() { json_tokener_free(tokener_); }

  json_object* parse(std::string_view text) {
    json_tokener_reset(tokener_);
    return json_tokener_parse_ex(tokener_, text.data(), static_cast<int>(text.size()));
  }

 private:
  json_tokener* tokener_;
};

struct field {
  message_source source;
  text_list odometries = texts_of(source.odometries());
  text_list full_odometries = texts_of(source.odometries_with(covariances::sparse));
  text_list calls = texts_of(source.calls());
  text_list received = publishes(source);
  json::reader reader = json::reader::create(64 * 1024).value();
  json::decoder plain_decoder = json::decoder::compile(describe<odometry>()).value();
  json::decoder full_decoder = json::decoder::compile(describe<ros::odometry>()).value();
  odometry plain;
  ros::odometry full;
  simdjson::dom::parser dom;
  simdjson::ondemand::parser on_demand;
  by_rapidjson rapidjson;
  by_json_c json_c;
};

// ---- reading all numbers ----

std::size_t all_read(double total) { return static_cast<std::size_t>(total != 0); }

std::size_t decode(field& f, std::string_view text, const json::decoder& into, void* object) {
  return f.reader.validate(text) && into.decode(text, object);
}

void add_readers(std::vector<way>& to, const std::string& group, field& f, const text_list& texts) {
  const way::ratio x{"x_json_c", group + "/json_c", true};
  to.push_back({group + "/simdjson_dom",
                [&](std::size_t i) {
                  const std::string_view text = texts[i];
                  simdjson::dom::element all;
                  if (f.dom.parse(text.data(), text.size(), false).get(all) != simdjson::SUCCESS)
                    return std::size_t{0};
                  return all_read(sum(all));
                },
                {x}});
  to.push_back({group + "/simdjson_on_demand",
                [&](std::size_t i) {
                  const std::string_view text = texts[i];
                  simdjson::ondemand::document all;
                  if (f.on_demand.iterate(text.data(), text.size(), padded_bytes(text)).get(all) !=
                      simdjson::SUCCESS) {
                    return std::size_t{0};
                  }
                  double total = 0;
                  for (auto member : all.get_object()) total += sum(member.value().value_unsafe());
                  return all_read(total);
                },
                {x}});
  to.push_back(
      {group + "/rapidjson", [&](std::size_t i) { return all_read(sum(f.rapidjson.parse(texts[i]))); }, {x}});
  to.push_back({group + "/nlohmann",
                [&](std::size_t i) { return all_read(sum(nlohmann::json::parse(texts[i]))); },
                {x}});
  to.push_back({group + "/json_c",
                [&](std::size_t i) {
                  json_object* const all = f.json_c.parse(texts[i]);
                  const double total = sum(all);
                  json_object_put(all);
                  return all_read(total);
                },
                {}});
}

// ---- a small invocation ----

std::size_t call_by_rowe(field& f, std::string_view text) {
  if (!f.reader.validate(text)) return 0;
  json::object_walk members{f.reader.last()};
  std::int64_t total = 0;
  bool named = false;
  for (json::member m; members.next(m);) {
    if (json::name_is(m, "a") || json::name_is(m, "b")) total += json::to_integer(m.what).value_or(0);
    if (json::name_is(m, "service")) named = json::text_is(m.what, service);
  }
  return static_cast<std::size_t>(total) + named;
}

std::size_t call_by_dom(field& f, std::string_view text) {
  simdjson::dom::object all;
  if (f.dom.parse(text.data(), text.size(), false).get(all) != simdjson::SUCCESS) return 0;
  std::string_view name;
  std::int64_t a = 0, b = 0;
  if (all["service"].get(name) != simdjson::SUCCESS || all["a"].get(a) != simdjson::SUCCESS ||
      all["b"].get(b) != simdjson::SUCCESS) {
    return 0;
  }
  return static_cast<std::size_t>(a + b) + (name == service);
}

std::size_t call_on_demand(field& f, std::string_view text) {
  simdjson::ondemand::document all;
  if (f.on_demand.iterate(text.data(), text.size(), padded_bytes(text)).get(all) != simdjson::SUCCESS)
    return 0;
  std::string_view name;
  std::int64_t a = 0, b = 0;
  if (all["service"].get(name) != simdjson::SUCCESS || all["a"].get(a) != simdjson::SUCCESS ||
      all["b"].get(b) != simdjson::SUCCESS) {
    return 0;
  }
  return static_cast<std::size_t>(a + b) + (name == service);
}

std::size_t call_by_rapidjson(field& f, std::string_view text) {
  const rapidjson::Value& all = f.rapidjson.parse(text);
  const auto& name = all["service"];
  return static_cast<std::size_t>(all["a"].GetInt64() + all["b"].GetInt64()) +
         (std::string_view{name.GetString(), name.GetStringLength()} == service);
}

std::size_t call_by_nlohmann(std::string_view text) {
  const auto all = nlohmann::json::parse(text);
  return all["a"].get<std::size_t>() + all["b"].get<std::size_t>() +
         (all["service"].get_ref<const std::string&>() == service);
}

std::size_t call_by_json_c(field& f, std::string_view text) {
  json_object* const o = f.json_c.parse(text);
  json_object *name = nullptr, *a = nullptr, *b = nullptr;
  json_object_object_get_ex(o, "service", &name);
  json_object_object_get_ex(o, "a", &a);
  json_object_object_get_ex(o, "b", &b);
  const std::int64_t total = json_object_get_int64(a) + json_object_get_int64(b);
  const bool named = json_object_get_string(name) == service;
  json_object_put(o);
  return static_cast<std::size_t>(total) + named;
}

// ---- an envelope ----

std::size_t receive_by_rowe(field& f, std::string_view text) {
  if (!f.reader.validate(text)) return 0;
  json::object_walk members{f.reader.last()};
  std::size_t found = 0;
  for (json::member m; members.next(m);) {
    if (json::name_is(m, "op")) found += json::text_is(m.what, "publish");
    if (json::name_is(m, "topic")) found += json::text_is(m.what, "/cmd_vel");
    if (json::name_is(m, "msg")) found += m.what.raw.size();
  }
  return found;
}

std::size_t receive_on_demand(field& f, std::string_view text) {
  simdjson::ondemand::document all;
  if (f.on_demand.iterate(text.data(), text.size(), padded_bytes(text)).get(all) != simdjson::SUCCESS)
    return 0;
  std::string_view op, topic, raw;
  simdjson::ondemand::object msg;
  if (all["op"].get_string().get(op) != simdjson::SUCCESS ||
      all["topic"].get_string().get(topic) != simdjson::SUCCESS ||
      all["msg"].get_object().get(msg) != simdjson::SUCCESS || msg.raw_json().get(raw) != simdjson::SUCCESS) {
    return 0;
  }
  return (op == "publish") + (topic == "/cmd_vel") + raw.size();
}

std::vector<way> ways() {
  static field f;
  const auto x_json_c = [](const char* group) {
    return way::ratio{"x_json_c", std::string{group} + "/json_c", true};
  };
  const way::ratio x_dom{"x_dom", "receive_300/simdjson_dom", true};
  std::vector<way> all;
  all.push_back({"odometry_read/rowe",
                 [](std::size_t i) { return decode(f, f.odometries[i], f.plain_decoder, &f.plain); },
                 {x_json_c("odometry_read")}});
  add_readers(all, "odometry_read", f, f.odometries);
  all.push_back({"covariances_read/rowe",
                 [](std::size_t i) { return decode(f, f.full_odometries[i], f.full_decoder, &f.full); },
                 {x_json_c("covariances_read")}});
  add_readers(all, "covariances_read", f, f.full_odometries);

  const way::ratio x_call = x_json_c("call_read");
  all.push_back({"call_read/rowe", [](std::size_t i) { return call_by_rowe(f, f.calls[i]); }, {x_call}});
  all.push_back(
      {"call_read/simdjson_dom", [](std::size_t i) { return call_by_dom(f, f.calls[i]); }, {x_call}});
  all.push_back({"call_read/simdjson_on_demand",
                 [](std::size_t i) { return call_on_demand(f, f.calls[i]); },
                 {x_call}});
  all.push_back(
      {"call_read/rapidjson", [](std::size_t i) { return call_by_rapidjson(f, f.calls[i]); }, {x_call}});
  all.push_back({"call_read/nlohmann", [](std::size_t i) { return call_by_nlohmann(f.calls[i]); }, {x_call}});
  all.push_back({"call_read/json_c", [](std::size_t i) { return call_by_json_c(f, f.calls[i]); }, {}});

  all.push_back({"receive_300/simdjson_dom",
                 [](std::size_t i) {
                   const std::string_view text = f.received[i];
                   return f.dom.parse(text.data(), text.size(), false).error() == simdjson::SUCCESS
                              ? text.size()
                              : 0;
                 },
                 {}});
  all.push_back({"receive_300/rowe_validation",
                 [](std::size_t i) { return f.reader.validate(f.received[i]) ? f.received[i].size() : 0; },
                 {x_dom}});
  all.push_back(
      {"receive_300/rowe", [](std::size_t i) { return receive_by_rowe(f, f.received[i]); }, {x_dom}});
  all.push_back({"receive_300/simdjson_on_demand",
                 [](std::size_t i) { return receive_on_demand(f, f.received[i]); },
                 {x_dom}});
  return all;
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  benchmark::AddCustomContext("simdjson", simdjson::get_active_implementation()->name());
  return rowe::bench::run_contest(count, arguments, rowe::bench::ways);
}
