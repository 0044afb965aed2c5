// SPDX-License-Identifier: Apache-2.0
// What a running endpoint answers over HTTP besides its page.
#include <unistd.h>

#include "endpoints.hpp"
#include "rt/loopback.hpp"

#include <rowe/access.hpp>

#include <atomic>
#include <thread>

namespace http_test {
namespace {

using namespace endpoints;

// The whole answer to a request of this process.
std::string ask(const rowe::endpoint& of, std::string_view line, std::string_view more = {}) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  EXPECT_TRUE(rowe::tests::connect_to(of.port(), fd));
  const std::string request =
      std::string{line} + " HTTP/1.1\r\nHost: localhost\r\n" + std::string{more} + "\r\n";
  EXPECT_EQ(::send(fd, request.data(), request.size(), MSG_NOSIGNAL), static_cast<ssize_t>(request.size()));
  std::string answer;
  char bytes[4096];
  for (ssize_t got = 0; (got = ::recv(fd, bytes, sizeof bytes, 0)) > 0;)
    answer.append(bytes, static_cast<std::size_t>(got));
  ::close(fd);
  return answer;
}

rowe::endpoint hub(rowe::endpoint_options options = quick()) {
  options.allow_hosts = {"*"};
  return rowe::endpoint::listen(0, options).value();
}

std::string body_of(const std::string& answer) { return answer.substr(answer.find("\r\n\r\n") + 4); }

TEST(http, has_all_counts_of_an_endpoint_in_metrics) {
  rowe::endpoint_options headless = quick();
  headless.page = false;
  for (const rowe::endpoint_options& options : {quick(), headless}) {
    const rowe::endpoint one = hub(options);
    const std::string answer = ask(one, "GET /metrics");
    ASSERT_TRUE(answer.starts_with("HTTP/1.1 200")) << answer;
    EXPECT_NE(answer.find("content-type: text/plain; version=0.0.4; charset=utf-8\r\n"), answer.npos);
    EXPECT_NE(answer.find("cache-control: no-store\r\n"), answer.npos);
    const std::string body = body_of(answer);
    EXPECT_TRUE(body.ends_with("\n"));
    EXPECT_NE(answer.find("content-length: " + std::to_string(body.size()) + "\r\n"), answer.npos);
    constexpr std::string_view failed = "tls_failed_"; // one metric, with a label
    for (const rowe::count& each : one.counts()) {
      std::string wanted = " " + std::string{each.group} + ": " + std::string{each.meaning} + "\n";
      if (each.name.starts_with(failed))
        wanted = "{reason=\"" + std::string{each.name.substr(failed.size())} + "\"} 0\n";
      const bool there = body.find(wanted) != body.npos;
      EXPECT_EQ(there, each.name != "tls_certificate_end") << each.name; // there is none
    }
  }
}

TEST(http, answers_head_without_a_body) {
  const rowe::endpoint one = hub();
  const std::string answer = ask(one, "HEAD /metrics");
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200")) << answer;
  EXPECT_EQ(body_of(answer), "");
  EXPECT_EQ(answer.find("content-length: 0\r\n"), answer.npos);
  EXPECT_EQ(body_of(ask(one, "HEAD /healthz")), "");
}

TEST(http, is_healthy_while_it_serves) {
  const rowe::endpoint one = hub();
  const std::string answer = ask(one, "GET /healthz");
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200")) << answer;
  EXPECT_EQ(body_of(answer), "ok");
}

TEST(http, gives_metrics_to_who_may_call_for_the_statistics_and_health_to_everyone) {
  rowe::endpoint_options options = quick();
  options.access.roles = {{.name = "scraper", .call = {"/rowe/stats"}}, {.name = "arm", .call = {"/arm/*"}}};
  for (const std::string role : {"scraper", "arm"})
    options.access.identities.push_back({role, role, rowe::hash_token(role + "-shows-this-token")});
  rowe::endpoint one = hub(options);
  const auto status = [&](std::string_view line, std::string_view more = {}) {
    return ask(one, line, more).substr(9, 3);
  };
  EXPECT_EQ(status("GET /healthz"), "200");
  EXPECT_EQ(status("GET /"), "200");
  EXPECT_EQ(status("GET /metrics"), "401");
  EXPECT_EQ(status("GET /metrics", "Authorization: Bearer arm-shows-this-token\r\n"), "403");
  EXPECT_EQ(status("GET /metrics", "Authorization: Bearer scraper-shows-this-token\r\n"), "200");
  EXPECT_EQ(status("HEAD /metrics", "Authorization: Bearer scraper-shows-this-token\r\n"), "200");
  EXPECT_EQ(count_of(one, "denied"), 1U);
  EXPECT_EQ(count_of(one, "refused_handshakes"), 2U);
  std::string events;
  while (const auto happened = one.try_event()) events += std::string{happened->what} + "\n";
  EXPECT_NE(events.find("arm, role arm, has no right to call /rowe/stats"), events.npos) << events;
}

TEST(http, gives_scripts_the_last_value_of_a_topic) {
  rowe::endpoint one = hub();
  rowe::topic_options latched;
  latched.latched = true;
  auto map = one.advertise<rowe::json_text>("/robot/map", latched).value();
  auto odom = one.advertise<rowe::json_text>("/odom").value();
  ASSERT_TRUE(map.publish(R"({"cells":[1,2]})"));
  for (const std::string_view path : {"/api/v1/topics/robot/map", "/api/v1/topics/%2Frobot%2Fmap"}) {
    std::string answer;
    const std::string line = "GET " + std::string{path};
    while (!(answer = ask(one, line)).starts_with("HTTP/1.1 200")) {
    }
    EXPECT_NE(answer.find("content-type: application/json\r\n"), answer.npos) << answer;
    EXPECT_NE(answer.find("cache-control: no-store\r\n"), answer.npos);
    EXPECT_NE(answer.find("rowe-age-ms: "), answer.npos);
    EXPECT_EQ(body_of(answer), "{\"cells\":[1,2]}\n");
  }
  EXPECT_TRUE(ask(one, "GET /api/v1/topics/nothing").starts_with("HTTP/1.1 404"));
  std::atomic<bool> done{false};
  std::thread loop{[&] { // nobody listens until the first request
    while (!done) {
      (void)odom.publish(R"({"x":1})");
      std::this_thread::yield();
    }
  }};
  const std::string first = ask(one, "GET /api/v1/topics/odom");
  const std::string head = ask(one, "HEAD /api/v1/topics/odom");
  done = true;
  loop.join();
  EXPECT_TRUE(first.starts_with("HTTP/1.1 200")) << first;
  EXPECT_EQ(body_of(first), "{\"x\":1}\n");
  EXPECT_NE(head.find("content-length: 8\r\n"), head.npos) << head;
  EXPECT_EQ(body_of(head), "");
  const std::string stats = ask(one, "GET /api/v1/stats");
  EXPECT_NE(stats.find("content-type: application/json\r\n"), stats.npos);
  EXPECT_NE(body_of(stats).find(R"("topic":"/odom")"), stats.npos);
}

TEST(http, gives_scripts_a_long_value_byte_for_byte) {
  rowe::endpoint_options options = quick();
  options.limits.long_message_bytes_max = 12 * 1024 * 1024;
  options.limits.handle_bytes = 128 * 1024 * 1024;
  rowe::endpoint one = hub(options);
  std::string map = R"({"data":[0)";
  for (std::uint32_t i = 1; map.size() < 10'000'000; ++i) map += "," + std::to_string(i * 2654435761U % 101);
  map += "]}";
  rowe::topic_options latched;
  latched.latched = true;
  latched.depth = 1;
  latched.text_bytes_max = static_cast<std::uint32_t>(map.size());
  auto topic = one.advertise<rowe::json_text>("/map", latched).value();
  ASSERT_TRUE(topic.publish(map));
  std::string head;
  while (!(head = ask(one, "HEAD /api/v1/topics/map")).starts_with("HTTP/1.1 200")) {
  }
  EXPECT_NE(head.find("content-length: " + std::to_string(map.size()) + "\r\n"), head.npos) << head;
  EXPECT_EQ(body_of(head), "");
  for (int i = 0; i < 3; ++i) {
    const std::string answer = ask(one, "GET /api/v1/topics/map");
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 200"));
    EXPECT_NE(answer.find("rowe-age-ms: "), answer.npos);
    EXPECT_TRUE(body_of(answer) == map) << body_of(answer).size();
  }
  EXPECT_EQ(count_of(one, "pages_cut"), 0U);
}

} // namespace
} // namespace http_test
