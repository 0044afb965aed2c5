// SPDX-License-Identifier: Apache-2.0
// Worlds of clients that speak Foxglove's protocol, beside one that speaks rosbridge and a handle that comes
// and goes: what they say is drawn from a seed, right and wrong, and some of them do not read. Whatever they
// do, the core is consistent, lists are too, a call is answered once at most, and who reads is never silent
// to a call.
#include "core_fixtures.hpp"

#include <rowe/parameter.hpp>

#include <map>
#include <memory>
#include <random>
#include <set>

#include "json/reading/reader.hpp"

namespace core_foxglove_world_test {
namespace {

using namespace harness;
namespace json = rowe::json;
using rowe::service::side;
using rowe::wire::opcode;

// One list of numbers that were told, and are never told again.
struct announced_list {
  std::map<std::uint32_t, std::string> now;
  std::set<std::uint32_t> ever;

  void add(std::uint32_t number, const std::string& name) {
    EXPECT_TRUE(ever.insert(number).second) << number << " is given again";
    for (const auto& [known, its] : now) EXPECT_NE(its, name) << "listed twice";
    now[number] = name;
  }
  void remove(std::uint32_t number) { EXPECT_EQ(now.erase(number), 1U) << number; }
  std::uint32_t any(std::mt19937& from) const {
    if (now.empty() || from() % 8 == 0) return from() % 64;
    auto at = now.begin();
    std::advance(at, from() % now.size());
    return at->first;
  }
};

class client {
 public:
  client(core_harness& on, std::mt19937& random, std::set<std::string>& seen)
      : random_{random},
        seen_{seen},
        peer_{on, side::server, "127.0.0.1:50000", "/",
              random() % 2 == 0 ? "foxglove.sdk.v1" : "foxglove.websocket.v1"} {}

  bool gone() { return peer_.cut(); }
  std::size_t open_calls() const { return calls_.size(); }
  bool greeted() const { return greeted_; }
  peer& link() { return peer_; }

  void say_something() {
    const auto number = [&] { return std::to_string(random_() % 4); };
    switch (random_() % 11) {
    case 0:
    case 1:
      return peer_.say(R"({"op":"subscribe","subscriptions":[{"id":)" + number() + R"(,"channelId":)" +
                       std::to_string(topics_.any(random_)) + "}]}");
    case 2: return peer_.say(R"({"op":"unsubscribe","subscriptionIds":[)" + number() + "," + number() + "]}");
    case 3:
      return peer_.say(R"({"op":"advertise","channels":[{"id":)" + number() + R"(,"topic":"/t)" + number() +
                       R"(","encoding":"json","schemaName":"a/T)" + number() + R"("}]})");
    case 4: return peer_.say(R"({"op":"unadvertise","channelIds":[)" + number() + "]}");
    case 5: return peer_.send(opcode::binary, "\x01" + four(random_() % 4) + R"({"v":1})");
    case 6: return say_something_wrong();
    case 7: return ask_about_parameters(number());
    default: return call();
    }
  }

  void listen() {
    for (const std::string& text : peer_.hear()) hear(text);
  }

 private:
  void call() {
    const std::uint32_t service = services_.any(random_);
    if (service == 0) return;
    const std::string id = four(service) + four(next_call_++);
    calls_.insert(id);
    static constexpr std::string_view bodies[] = {"{}", R"({"topic":"/t1"})", "[1]", "{", ""};
    peer_.send(opcode::binary, "\x02" + id + four(4) + "json" + std::string{bodies[random_() % 5]});
  }
  // Some of them are there, some read only, and some names are none.
  void ask_about_parameters(const std::string& number) {
    static constexpr std::string_view lists[] = {"", R"("/p0","p1","/p7")",
                                                 R"("/rowe/limits/topics_max","")"};
    static constexpr std::string_view ops[] = {"getParameters", "subscribeParameterUpdates",
                                               "unsubscribeParameterUpdates"};
    if (random_() % 2 == 0) {
      return peer_.say(R"({"op":")" + std::string{ops[random_() % 3]} + R"(","parameterNames":[)" +
                       std::string{lists[random_() % 3]} + "]}");
    }
    static constexpr std::string_view values[] = {"7", "\"x\"", "[1,2]", "1e300", "null"};
    peer_.say(R"({"op":"setParameters","id":"s","parameters":[{"name":"/p)" + number + R"(","value":)" +
              std::string{values[random_() % 5]} + R"(},{"name":"/rowe/x","value":1}]})");
  }
  void say_something_wrong() {
    static constexpr std::string_view texts[] = {"{", "[]", "{}", R"({"op":"getParameters"})",
                                                 R"({"op":"subscribe","subscriptions":[{"id":-1}]})"};
    if (random_() % 2 == 0) return peer_.say(texts[random_() % 5]);
    std::string bytes(random_() % 8, '\0'); // no call, which would want an answer
    for (char& one : bytes) one = static_cast<char>(random_());
    peer_.send(opcode::binary, "\x07" + bytes);
  }

  void hear(const std::string& text) {
    if (text.starts_with('\x01')) {
      seen_.insert("message");
      EXPECT_GE(text.size(), 15U);
      return;
    }
    if (text.starts_with('\x03')) {
      seen_.insert("reply");
      EXPECT_EQ(calls_.erase(text.substr(1, 8)), 1U) << "an answer that was not asked for";
      return;
    }
    const json::value all = json::root(text);
    std::array<char, 64> buffer;
    const auto op = json::to_string(json::find(all.raw, "op").value_or(json::value{}), buffer);
    ASSERT_TRUE(op) << text;
    seen_.insert(std::string{*op});
    if (*op == "serverInfo") {
      EXPECT_FALSE(greeted_);
      greeted_ = true;
    } else if (*op == "serviceCallFailure") {
      const auto of = [&](std::string_view name) {
        return static_cast<std::uint32_t>(json::to_unsigned(*json::find(all.raw, name)).value());
      };
      EXPECT_EQ(calls_.erase(four(of("serviceId")) + four(of("callId"))), 1U) << text;
    } else if (*op == "advertise") {
      each(all, "channels", [&](const json::value& one) { add(topics_, one, "topic"); });
    } else if (*op == "advertiseServices") {
      each(all, "services", [&](const json::value& one) { add(services_, one, "name"); });
    } else if (*op == "unadvertise") {
      each(all, "channelIds", [&](const json::value& one) { remove(topics_, one); });
    } else if (*op == "unadvertiseServices") {
      each(all, "serviceIds", [&](const json::value& one) { remove(services_, one); });
    } else if (*op == "parameterValues") {
      each(all, "parameters", [](const json::value& one) { EXPECT_TRUE(json::find(one.raw, "name")); });
    } else {
      EXPECT_EQ(*op, "status") << text;
    }
    EXPECT_TRUE(greeted_) << "before the greeting";
  }
  template <class Take>
  static void each(const json::value& all, std::string_view list, const Take& take) {
    const auto found = json::find(all.raw, list);
    ASSERT_TRUE(found);
    json::array_walk walk{found->raw};
    int count = 0;
    for (json::value one; walk.next(one); ++count) take(one);
    EXPECT_TRUE(count > 0 || list == "parameters");
  }
  static void add(announced_list& to, const json::value& one, std::string_view name) {
    std::array<char, 256> buffer;
    to.add(static_cast<std::uint32_t>(json::to_unsigned(*json::find(one.raw, "id")).value()),
           std::string{json::to_string(*json::find(one.raw, name), buffer).value()});
  }
  static void remove(announced_list& from, const json::value& one) {
    from.remove(static_cast<std::uint32_t>(json::to_unsigned(one).value()));
  }

  std::mt19937& random_;
  std::set<std::string>& seen_;
  peer peer_;
  announced_list topics_{};
  announced_list services_{};
  std::set<std::string> calls_{}; // that are not answered
  std::uint32_t next_call_ = 0;
  bool greeted_ = false;
};

void play(unsigned seed, std::set<std::string>& seen) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random{seed};
  // Each refusal is said.
  core_harness on{with_limits(unguarded_hub_options(), &limits::refusals_per_second_max, 0,
                              &limits::messages_per_second_max, 0)};
  on.offer(rowe::detail::latch_request({.name = "loop"}));
  on.cycles(2);
  peer other{on};
  other.say(R"({"op":"subscribe","topic":"/t1"})");
  client reads{on, random, seen};
  auto lazy = std::make_unique<client>(on, random, seen);
  const auto open = [&](std::string_view name) {
    auto* const cell =
        on.shared.parameters.open(rowe::detail::parameter_request_of<std::int64_t>(name, 1, {0, 9}), -1);
    return rowe::parameter<std::int64_t>{rowe::detail::parameter_handle{nullptr, *cell}, 1, {0, 9}};
  };
  auto first = open("/p0");
  auto second = open("p1");
  rowe::detail::queue_pair* handle = nullptr;
  for (int step = 0; step < 400; ++step) {
    switch (random() % 12) {
    case 0:
      if (handle == nullptr)
        handle = &advertise_pose(on);
      else
        std::exchange(handle, nullptr)->lifecycle.close();
      break;
    case 1: on.net.link_of(lazy->link().id()).capacity_bytes = random() % 2 == 0 ? 0 : 4096; break;
    case 2:
      other.say(R"({"op":"publish","topic":"/t)" + std::to_string(random() % 4) + R"(","msg":{"a":2}})");
      break;
    case 3:
      if (random() % 8 == 0) {
        lazy->link().leave();
        on.cycle();
        lazy = std::make_unique<client>(on, random, seen);
      }
      break;
    case 4:
    case 5: lazy->say_something(); break;
    default: reads.say_something();
    }
    if (handle != nullptr) (void)publish(on, *handle, {1, 2});
    if (random() % 4 == 0) {
      EXPECT_TRUE(second.set(static_cast<std::int64_t>(random() % 10)));
    }
    EXPECT_TRUE(first.refresh() ? first.get() == 7 : true) << "what a client set was out of range";
    on.cycle(5ms);
    reads.listen();
    lazy->listen();
    (void)other.hear();
    if (lazy->gone()) lazy = std::make_unique<client>(on, random, seen);
    ASSERT_TRUE(on.core.check());
    ASSERT_FALSE(reads.gone());
    ASSERT_FALSE(other.cut());
  }
  on.cycles(400); // a stop is answered when its time to be seen is over
  reads.listen();
  EXPECT_TRUE(reads.greeted());
  EXPECT_EQ(reads.open_calls(), 0U) << "it was not answered";
}

TEST(core_foxglove_world, is_consistent_whatever_its_clients_do) {
  std::set<std::string> seen;
  for (unsigned seed = 1; seed <= 60; ++seed) play(seed, seen);
  for (const char* kind : {"message", "reply", "serverInfo", "status", "serviceCallFailure", "advertise",
                           "unadvertise", "advertiseServices", "parameterValues"})
    EXPECT_TRUE(seen.contains(kind)) << kind << " was never heard";
}

} // namespace
} // namespace core_foxglove_world_test
