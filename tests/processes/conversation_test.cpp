// SPDX-License-Identifier: Apache-2.0
// The same conversation between two endpoints in one process and in two, whichever of them listens.
#include "sides.hpp"

#include <map>

namespace conversation_test {
namespace {

using namespace sides;

enum class where { one_process, two_processes };
enum class who_listens { here, there };

class conversation : public testing::TestWithParam<std::tuple<where, who_listens>> {
 protected:
  void SetUp() override {
    const auto [place, listener] = GetParam();
    const bool ours = listener == who_listens::here;
    if (ours) here_.emplace(endpoint::listen(0, part::quick_options()).value());
    const std::string url = ours ? url_of(here_->port()) : std::string{};
    if (place == where::two_processes) {
      there_ = std::make_unique<process_side>(ours ? "connect" : "listen", ours ? url : "0");
    } else {
      there_ = std::make_unique<thread_side>(
          (ours ? endpoint::connect(url, part::quick_options()) : endpoint::listen(0, part::quick_options()))
              .value());
    }
    if (!ours) here_.emplace(endpoint::connect(url_of(there_->port()), part::quick_options()).value());
    ASSERT_TRUE(here_->wait_peer(timeout));
  }

  endpoint& here() { return *here_; }
  side& there() { return *there_; }

 private:
  std::optional<endpoint> here_;
  std::unique_ptr<side> there_;
};

TEST_P(conversation, calls_with_types_in_both_directions) {
  auto add = here().client<part::numbers, part::total>("/actor/add").value();
  auto ours = here().serve<part::numbers, part::total>("/base/add").value();
  auto mail = here().open_lane().value();
  for (int i = 0; i < 50; ++i) {
    expect_total(call_when_there(add, {1.0 * i, 0.5}), i + 0.5);
  }
  for (std::size_t i = 1; i <= 5; ++i) be_asked(mail, ours, there(), i);
}

TEST_P(conversation, publishes_in_both_directions) {
  auto beats = here().subscribe<part::beat>("/actor/beat").value();
  auto orders = here().advertise<json_text>("/orders").value();
  std::int64_t last = 0;
  for (int i = 0; i < 50; ++i) {
    const auto beat = beats.take(timeout);
    ASSERT_TRUE(beat);
    EXPECT_EQ(beat->value().process, there().process());
    EXPECT_GT(beat->value().n, last);
    last = beat->value().n;
  }
  // Again and again, since the first may overtake the subscription.
  ASSERT_TRUE(eventually([&] {
    (void)orders.publish(R"({"go":1})");
    return !there().told("order ").empty();
  }));
  EXPECT_EQ(there().line("order "), R"(order {"go":1})");
}

TEST_P(conversation, sends_messages_in_both_directions_and_in_order) {
  auto mail = here().open_lane().value();
  for (int first = 0; first < 100; first += 20) { // fewer at a time than an inbox holds
    for (int i = first; i < first + 20; ++i) {
      ASSERT_TRUE(mail.send(message("echo", i), rowe::rt::for_ever)) << i;
    }
    for (int i = first; i < first + 20; ++i) {
      const std::string text{message("echo", i).text()};
      EXPECT_EQ(there().line("message ", static_cast<std::size_t>(i) + 1), "message " + text);
      const auto back = mail.receive(timeout);
      ASSERT_TRUE(back) << back.error().name();
      EXPECT_EQ(back->value(), text);
    }
  }
  EXPECT_EQ(there().told("message ").size(), 100U);
}

TEST_P(conversation, has_many_calls_in_flight_and_ends_each_of_them_once) {
  constexpr std::size_t calls = 16;
  auto lane = here().open_lane({.calls = calls}).value();
  // Of two services: one that is answered at once, and one that never is.
  std::map<std::pair<std::uint32_t, std::uint32_t>, bool> open;
  for (std::size_t i = 0; i < calls; ++i) {
    const bool answered = i % 2 == 0;
    const auto begun = lane.start(message("service", answered ? "/something" : "/actor/mute", "n", i),
                                  answered ? rowe::duration{timeout} : 500ms, clock_now());
    ASSERT_TRUE(begun);
    open[{begun->index, begun->generation}] = answered;
  }
  for (std::size_t i = 0; i < calls; ++i) {
    const auto ended = next_completion(lane);
    ASSERT_TRUE(ended) << ended.error().name();
    const auto found = open.find({ended->id.index, ended->id.generation});
    ASSERT_NE(found, open.end()) << "a call ended twice";
    if (found->second) {
      ASSERT_TRUE(ended->reply) << ended->reply.error().name();
      EXPECT_NE(ended->reply->value().find(std::to_string(there().process())), std::string_view::npos);
    } else {
      EXPECT_EQ(ended->reply.code(), errc::timed_out);
    }
    open.erase(found);
  }
  EXPECT_EQ(lane.try_finish().code(), errc::empty);
  EXPECT_EQ(there().told("call ").size(), calls / 2);
}

TEST_P(conversation, serves_ordinary_threads) {
  const auto reply = here().invoke(message("service", "/something", "n", 1), timeout);
  ASSERT_TRUE(reply) << reply.error().name();
  EXPECT_NE(reply->value().find(std::to_string(there().process())), std::string_view::npos);
  ASSERT_TRUE(here().send(R"({"echo":"door"})", rowe::rt::for_ever));
  const auto back = here().receive(timeout);
  ASSERT_TRUE(back) << back.error().name();
  EXPECT_EQ(back->value(), R"({"echo":"door"})");
}

std::string name_of(const testing::TestParamInfo<conversation::ParamType>& of) {
  return std::string{std::get<0>(of.param) == where::one_process ? "in_one_process" : "in_two_processes"} +
         (std::get<1>(of.param) == who_listens::here ? "_we_listen" : "_they_listen");
}

INSTANTIATE_TEST_SUITE_P(endpoints, conversation,
                         testing::Combine(testing::Values(where::one_process, where::two_processes),
                                          testing::Values(who_listens::here, who_listens::there)),
                         name_of);

} // namespace
} // namespace conversation_test
