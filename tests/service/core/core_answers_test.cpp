// SPDX-License-Identifier: Apache-2.0
// Who asks with a number to answer to is answered to that number, whatever is wrong; what a message says of
// its topic holds, though it was not advertised; and what belongs to the endpoint or to its program no peer
// takes.
#include "access_fixture.hpp"

#include <initializer_list>
#include <string>
#include <tuple>
#include <vector>

#include "service/topics/own_types.hpp"

namespace core_answers_test {
namespace {

using namespace access_fixture;
using rowe::detail::pair_kind;

std::string text(std::initializer_list<std::string_view> parts) {
  std::string all;
  for (const std::string_view one : parts) all += one;
  return all;
}

struct answers : access {
  using access::access;
  std::string asks(peer& by, std::string_view what) { return answer_to(by, what); }
};

// ---- numbers

TEST_F(answers, have_the_number_of_a_call_or_a_goal_whose_members_are_wrong) {
  peer& page = comes("driver");
  const std::vector<std::string_view> wrong{R"("args":"x")",          R"("args":5)",
                                            R"("args":true)",         R"("fragment_size":-1)",
                                            R"("fragment_size":"x")", R"("fragment_size":1)",
                                            R"("timeout":-1)",        R"("timeout":"1")",
                                            R"("timeout":null)",      R"("compression":"zip")",
                                            R"("compression":1)",     R"("args":{},"args":{})"};
  for (const auto& [op, name, answer] : {std::tuple{"call_service", "service", "service_response"},
                                         std::tuple{"send_action_goal", "action", "action_result"}}) {
    std::vector<std::string> all;
    for (const std::string_view member : wrong)
      all.push_back(text({R"({"op":")", op, R"(","id":"n1",")", name, R"(":"/x",)", member, "}"}));
    for (const std::string_view named :
         {R"("service":"","action":"")", R"("service":7,"action":7)", R"("x":1)"})
      all.push_back(text({R"({"op":")", op, R"(","id":"n1",)", named, "}"}));
    for (const std::string& one : all) {
      const std::string heard = asks(page, one);
      EXPECT_TRUE(has(heard, text({R"("op":")", answer, "\""})) && has(heard, R"("id":"n1")") &&
                  has(heard, R"("result":false)"))
          << one << " was answered " << heard;
    }
  }
}

TEST_F(answers, have_the_number_of_an_invocation_whose_members_are_wrong) {
  peer& program = comes("driver");
  for (const std::string_view one :
       {R"({"message_id":"n1","service":""})", R"({"message_id":"n1","ttl_ms":-1})",
        R"({"message_id":"n1","service":"a","service":"b"})", R"({"message_id":"n1","op":5})"}) {
    const std::string heard = asks(program, one);
    EXPECT_TRUE(has(heard, R"("error")") && has(heard, R"("in_reply_to":"n1")"))
        << one << " was answered " << heard;
  }
}

TEST_F(answers, take_args_and_a_fragment_size_that_are_null_for_none) {
  peer& page = comes("driver");
  const std::string_view plain = R"({"op":"call_service","id":"a","service":"/rosapi/get_ros_version")";
  const std::string expected = asks(page, text({plain, "}"}));
  ASSERT_TRUE(has(expected, R"("result":true,"values":{"version":1,"distro":"rowe"})"));
  EXPECT_EQ(asks(page, text({plain, R"(,"args":null,"fragment_size":null})"})), expected);
}

struct low_rate : answers {
  low_rate() : answers{with_limits(with_roles(), &limits::messages_per_second_max, 100)} {}
};

TEST_F(low_rate, answers_each_call_and_goal_beyond_it) {
  peer& page = comes("driver");
  std::string heard;
  for (int i = 0; i < 150; ++i) {
    const std::string id = R"("id":"n)" + std::to_string(i) + R"(.")";
    page.say(text({R"({"op":"call_service",)", id, R"(,"service":"/rosapi/get_time"})"}));
    page.say(text({R"({"op":"send_action_goal",)", id, R"(,"action":"/dock"})"}));
    on.cycle(1us);
    heard += page.hear_as_one();
  }
  on.cycles(3);
  heard += page.hear_as_one();
  for (int i = 0; i < 150; ++i)
    for (const std::string_view op : {"service_response", "action_result"})
      EXPECT_TRUE(has(heard, text({R"("op":")", op, R"(","id":"n)", std::to_string(i), ".\""}))) << op << i;
  EXPECT_TRUE(has(heard, "more than 100 messages a second (limit messages_per_second_max)"));
  EXPECT_EQ(on.count(counter::over_rate), 200U);
}

// ---- what a message says of its topic

TEST_F(answers, to_a_latched_message_reach_late_subscribers_without_an_advertisement) {
  peer& page = comes("driver");
  EXPECT_EQ(asks(page, R"({"op":"publish","topic":"/map","type":"a/Map","latch":true,"msg":{"n":1}})"), "");
  peer& late = comes("observer");
  EXPECT_TRUE(has(asks(late, R"({"op":"subscribe","topic":"/map"})"), R"("msg":{"n":1})"));
  EXPECT_TRUE(
      has(asks(late, R"({"op":"call_service","service":"/rosapi/topic_type","args":{"topic":"map"}})"),
          R"("type":"a/Map")"));
  EXPECT_EQ(asks(page, R"({"op":"publish","topic":"/map","type":"a/Map","latch":true,"msg":{"n":2}})"), "");
  (void)late.hear();
  const std::string other = asks(page, R"({"op":"publish","id":"p","topic":"/map","type":"b/Map","msg":{}})");
  EXPECT_TRUE(has(other, "publish: the topic exists with the type a/Map") && has(other, R"("id":"p")"));
  EXPECT_EQ(asks(page, R"({"op":"unadvertise","topic":"/map"})"), "");
}

TEST_F(answers, go_on_where_a_role_may_publish_and_not_advertise) {
  peer& arm = comes("arm"); // publishes "/*", advertises "/arm/*"
  peer& page = comes("driver");
  (void)asks(page, R"({"op":"subscribe","topic":"/x"})");
  EXPECT_EQ(asks(arm, R"({"op":"publish","topic":"/x","type":"a/B","latch":true,"msg":{"n":1}})"), "");
  EXPECT_TRUE(has(page.hear().front(), R"("msg":{"n":1})"));
}

// ---- what no peer takes

TEST_F(answers, of_the_endpoint_itself_no_peer_gives_instead) {
  peer& other = comes("peer"); // may provide everything
  peer& boss = comes("supervisor");
  for (const rowe::service::own_service_type& own : rowe::service::own_service_types()) {
    for (const std::string_view name : {own.name, own.name.substr(1)}) {
      on.cycle(std::chrono::milliseconds{100}); // so that each refusal is told
      const std::string heard = asks(
          other, text({R"({"op":"advertise_service","id":"a","type":"x/Y","service":")", name, R"("})"}));
      EXPECT_TRUE(has(heard, "is the endpoint's own") && has(heard, R"("id":"a")")) << name << ": " << heard;
      for (const std::string_view how : {R"("advertise_action","action":")", R"("advertise","topic":")",
                                         R"("publish","msg":{},"topic":")"}) {
        if (how.starts_with("\"publish") && name.find("rosapi/") == name.npos) continue; // it may be a stop
        on.cycle(std::chrono::milliseconds{100});
        const std::string told = asks(other, text({R"({"id":"a","type":"x/Y","op":)", how, name, R"("})"}));
        EXPECT_TRUE(has(told, "the endpoint's own") && has(told, R"("id":"a")")) << how << name << told;
      }
    }
    (void)asks(boss, text({R"({"op":"call_service","id":"b","service":")", own.name, R"(","args":{}})"}));
    EXPECT_EQ(other.hear().size(), 0U) << own.name << " went to a peer";
  }
  EXPECT_EQ(asks(other, R"({"op":"advertise_service","type":"x/Y","service":"/rosapi/of_its_own"})"), "");
}

TEST_F(answers, and_topics_of_the_program_belong_to_it) {
  peer& early = comes("driver");
  EXPECT_EQ(asks(early, R"({"op":"advertise","topic":"/odom","type":"a/B"})"), "");
  on.offer(pair_kind::publish_text, "/odom", 100);
  on.offer(pair_kind::publish_text, "/shared", 100, {.shared = true});
  on.cycles(2);
  const std::string told = early.hear_as_one();
  EXPECT_TRUE(has(told, "advertise: /odom is published by the program here"));
  peer& page = comes("observer");
  (void)asks(page, R"({"op":"subscribe","topic":"/odom"})");
  (void)asks(page, R"({"op":"subscribe","topic":"/shared"})");
  for (const std::string_view name : {"/odom", "odom"})
    for (const std::string_view op : {R"("advertise","type":"a/B")", R"("publish","msg":{"n":1})",
                                      R"("publish","latch":true,"type":"a/B","msg":{"n":1})"}) {
      const std::string heard = asks(early, text({R"({"id":"a","topic":")", name, R"(","op":)", op, "}"}));
      EXPECT_TRUE(has(heard, "is published by the program here") && has(heard, R"("id":"a")"));
    }
  EXPECT_EQ(page.hear().size(), 0U);
  EXPECT_EQ(asks(early, R"({"op":"publish","topic":"/shared","msg":{"n":1}})"), "");
  EXPECT_EQ(page.hear().size(), 1U) << "the program shares it";
}

TEST_F(answers, and_what_a_peer_latched_on_a_topic_of_the_program_is_not_kept) {
  peer& arm = comes("arm"); // publishes "/*", advertises "/arm/*"
  peer& keeps = comes("driver");
  (void)asks(keeps, R"({"op":"subscribe","topic":"/where"})"); // so the topic is there
  EXPECT_EQ(asks(arm, R"({"op":"publish","topic":"/where","latch":true,"msg":{"n":1}})"), "");
  EXPECT_TRUE(has(asks(comes("observer"), R"({"op":"subscribe","topic":"/where"})"), R"("msg":{"n":1})"));
  on.offer(pair_kind::publish_text, "/where", 100, {.latched = true});
  on.cycles(2);
  EXPECT_EQ(asks(comes("supervisor"), R"({"op":"subscribe","topic":"/where"})"), "")
      << "the program has not said yet where it is";
}

TEST_F(answers, and_topics_of_the_program_are_free_again_when_it_has_left_them) {
  peer& other = comes("driver");
  auto& first = on.offer(pair_kind::publish_text, "/odom", 100);
  auto& second = on.offer(pair_kind::publish_text, "/odom", 100);
  on.cycles(2);
  first.lifecycle.close();
  on.cycles(2);
  EXPECT_NE(asks(other, R"({"op":"advertise","topic":"/odom"})"), "");
  second.lifecycle.close();
  on.cycles(2);
  EXPECT_EQ(asks(other, R"({"op":"advertise","topic":"/odom"})"), "");
}

rowe::endpoint_options with_a_simulator() {
  rowe::endpoint_options options = with_roles();
  options.access.roles.push_back({.name = "simulator", .publish = {"/odom", "/arm/*"}, .advertise = {"/**"}});
  options.access.identities.push_back({"simulator", "simulator", rowe::hash_token(token_of("simulator"))});
  return options;
}
struct named_topics : answers {
  named_topics() : answers{with_a_simulator()} {}
};

TEST_F(named_topics, of_the_program_are_open_to_a_role_that_spells_their_name) {
  for (const std::string_view topic : {"/odom", "/arm/pose"}) on.offer(pair_kind::publish_text, topic, 100);
  on.cycles(2);
  peer& simulator = comes("simulator");
  for (const std::string_view name : {"/odom", "odom"})
    for (const std::string_view op : {R"("advertise")", R"("publish","msg":{})"})
      EXPECT_EQ(asks(simulator, text({R"({"topic":")", name, R"(","op":)", op, "}"})), "") << name << op;
  EXPECT_NE(asks(simulator, R"({"op":"publish","topic":"/arm/pose","msg":{}})"), "")
      << "a pattern is no name";
}

} // namespace
} // namespace core_answers_test
