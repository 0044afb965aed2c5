// SPDX-License-Identifier: Apache-2.0
#include "service/topics/broker.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "service/topics/topic_parts.hpp"

namespace broker_test {
namespace {

using namespace topic_parts;

struct broker_test : topic_parts::topic_parts {
  int encoded = 0; // how often a value was

  void publish(topic_id topic, std::string_view body) {
    values.publish(topic, cycle.now, rowe::rt::never, {}, [&](rowe::json::writer& into) {
      ++encoded;
      into.append(body);
    });
  }
  // The bodies that wait for a subscriber.
  std::vector<std::string> waiting(const connection& at, topic_id topic) {
    std::vector<std::string> all;
    const auto& of = subscriptions.at(subscriptions.find(topic, {at.id.index})).pending;
    for (auto one = of.entries.head; one; one = out.entries().after(one)) {
      const auto body = store.slots().body(out.entries().at(one).index);
      all.emplace_back(body.begin(), body.end());
    }
    return all;
  }
};

TEST_F(broker_test, encodes_nothing_that_all_who_listen_have_throttled) {
  connection& peer = join(0);
  request asked = of(peer, "/odom");
  asked.throttle_ms = 100;
  readers.subscribe(peer, asked);
  const topic_id topic = topics.find("/odom");
  subscriptions.at(subscriptions.find(topic, {0})).next_due = cycle.now + 1ms;
  publish(topic, R"({"n":1})");
  EXPECT_EQ(encoded, 0);
  EXPECT_EQ(counts.read(counter::throttled), 1U);
  cycle.now += 1ms;
  publish(topic, R"({"n":2})");
  EXPECT_EQ(waiting(peer, topic), std::vector<std::string>{R"({"n":2})"});
}

} // namespace
} // namespace broker_test
