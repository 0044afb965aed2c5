// SPDX-License-Identifier: Apache-2.0
// /metrics and /healthz: what they say, and who may have them.
#include "service/core/core_fixtures.hpp"

#include <rowe/access.hpp>

#include <algorithm>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace own_pages_test {
namespace {

using namespace harness;
using rowe::service::counter_descriptions;
using rowe::service::http_answer;
using rowe::service::metrics_report;

struct own_pages : core_test {
  explicit own_pages(const rowe::endpoint_options& options = small_options()) : core_test{options} {
    on.cycle();
  }
  rowe::service::admit_answer may_read(const rowe::service::credentials& shown) {
    return static_cast<rowe::service::transport_sink&>(on.core).may_read(shown);
  }
  http_answer get(std::string_view path) { return on.net.get({path, {}, false}, on.core); }
  std::string text(std::string_view path) {
    const http_answer answer = get(path);
    return {reinterpret_cast<const char*>(answer.body.data()), answer.body.size()};
  }
  // Name with its labels, and value.
  std::map<std::string, std::string> samples() {
    std::map<std::string, std::string> found;
    std::istringstream lines{text("/metrics")};
    for (std::string line; std::getline(lines, line);) {
      const std::size_t end = line.rfind(' ');
      if (line.starts_with('#')) continue;
      EXPECT_TRUE(found.emplace(line.substr(0, end), line.substr(end + 1)).second) << line;
    }
    return found;
  }
};

TEST_F(own_pages, write_metrics_as_the_format_wants_them) {
  const http_answer answer = get("/metrics");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.content_type, "text/plain; version=0.0.4; charset=utf-8");
  EXPECT_EQ(answer.cache_control, "no-store");
  std::istringstream lines{text("/metrics")};
  const std::regex help{R"(# HELP (rowe_[a-z_]+) [^\\]+)"};
  const std::regex type{R"(# TYPE (rowe_[a-z_]+) (counter|gauge))"};
  std::set<std::string> families;
  const std::regex sample{R"re((rowe_[a-z_]+)(\{[a-z]+="[^"]*"\})? [0-9]+(\.[0-9]{9})?)re"};
  std::size_t count = 0;
  for (std::string first, second, third; !first.empty() || std::getline(lines, first);) {
    ASSERT_TRUE(std::getline(lines, second)) << first;
    std::smatch named, typed, sampled;
    ASSERT_TRUE(std::regex_match(first, named, help)) << first;
    ASSERT_TRUE(std::regex_match(second, typed, type)) << second;
    EXPECT_EQ(named[1], typed[1]);
    EXPECT_TRUE(families.insert(named[1]).second) << first; // all values of it stand together
    const std::size_t before = count;
    for (third.clear(); std::getline(lines, third) && !third.starts_with('#'); third.clear(), ++count) {
      ASSERT_TRUE(std::regex_match(third, sampled, sample)) << third;
      EXPECT_EQ(named[1], sampled[1]);
    }
    EXPECT_GT(count, before) << first;
    EXPECT_EQ(named[1].str().ends_with("_total"), typed[2] == "counter") << second;
    // Base units only, behind the name.
    EXPECT_FALSE(std::regex_search(named[1].str(), std::regex{"_(ns|us|ms)(_|$)"})) << first;
    first = third;
  }
  EXPECT_EQ(count, counter_descriptions.size() + 6 - 1); // without a certificate there is no end of one
}

// Each counter gets another value; the values of what is named by the usual rule stand there, and all others.
TEST_F(own_pages, have_every_counter_in_metrics) {
  for (std::size_t i = 0; i < counter_descriptions.size(); ++i)
    on.shared.counts.set(static_cast<counter>(i), 1'000'000'007 * (i + 1));
  const auto found = samples();
  for (std::size_t i = 0; i < counter_descriptions.size(); ++i) {
    const std::string name{counter_descriptions[i].name};
    const std::uint64_t value = on.count(static_cast<counter>(i));
    const std::string fraction = std::to_string(value % 1'000'000'000);
    const std::string seconds =
        std::to_string(value / 1'000'000'000) + "." + std::string(9 - fraction.size(), '0') + fraction;
    const std::string wanted = name.find("_ns") == name.npos ? std::to_string(value) : seconds;
    const bool there = std::ranges::any_of(found, [&](const auto& one) { return one.second == wanted; });
    EXPECT_TRUE(there) << name << " " << wanted;
    const auto usual = found.find("rowe_" + name + "_total");
    EXPECT_TRUE(usual == found.end() || usual->second == wanted) << name;
  }
  EXPECT_EQ(found.at("rowe_tls_handshakes_failed_total{reason=\"certificate\"}"),
            std::to_string(on.count(counter::tls_failed_certificate)));
  EXPECT_EQ(found.at("rowe_tls_certificate_expiry_timestamp_seconds"),
            std::to_string(on.count(counter::tls_certificate_end)));
  EXPECT_EQ(found.at("rowe_received_bytes_total"), std::to_string(on.count(counter::bytes_in)));
  EXPECT_EQ(found.at("rowe_sent_bytes_total"), std::to_string(on.count(counter::bytes_out)));
}

TEST_F(own_pages, have_gauges_of_peers_topics_the_stop_and_the_time) {
  auto before = samples();
  EXPECT_EQ(before.at("rowe_info{name=\"robot\"}"), "1");
  EXPECT_EQ(before.at("rowe_peers"), "0");
  EXPECT_EQ(before.at("rowe_stop_in_use"), "0");
  EXPECT_EQ(before.at("rowe_stopped"), "0");
  peer one{on};
  one.say(R"({"op":"subscribe","topic":"/a"})");
  on.cycle(10s);
  auto after = samples();
  EXPECT_EQ(after.at("rowe_peers"), "1");
  EXPECT_EQ(std::stoi(after.at("rowe_topics")), std::stoi(before.at("rowe_topics")) + 1);
  EXPECT_EQ(after.at("rowe_uptime_seconds"), "10.001000000");
}

TEST_F(own_pages, fit_into_their_buffer_with_the_largest_figures) {
  for (std::size_t i = 0; i < counter_descriptions.size(); ++i)
    on.shared.counts.set(static_cast<counter>(i), UINT64_MAX);
  const http_answer answer = get("/metrics");
  EXPECT_LE(answer.body.size(), metrics_report::bytes_max);
  EXPECT_GT(answer.body.size(), metrics_report::bytes_max * 3 / 4) << "the buffer is larger than it need be";
}

// ---- health

TEST_F(own_pages, are_ok_while_cycles_advance) {
  EXPECT_EQ(get("/healthz").status, 200);
  EXPECT_EQ(text("/healthz"), "ok");
  on.cycles(8, rowe::service::cycle_gap_max);
  EXPECT_EQ(get("/healthz").status, 200);
}

TEST_F(own_pages, say_for_a_while_that_no_cycle_began) {
  on.cycle(7s);
  EXPECT_EQ(get("/healthz").status, 503);
  EXPECT_EQ(text("/healthz"), "for 7000 ms the service thread began no cycle; it should after 1250 ms at "
                              "most. That ended 0 ms ago\n");
  on.cycles(10, 1s);
  EXPECT_EQ(get("/healthz").status, 503);
  EXPECT_TRUE(has(text("/healthz"), "10000 ms ago"));
  on.cycle();
  EXPECT_EQ(get("/healthz").status, 200);
}

TEST_F(own_pages, say_that_the_endpoint_is_closing) {
  on.core.close_all(on.now);
  EXPECT_EQ(get("/healthz").status, 503);
  EXPECT_EQ(text("/healthz"), "the endpoint is closing\n");
}

// ---- rights

rowe::endpoint_options with_roles() {
  rowe::endpoint_options options = small_options();
  options.access.roles = {{.name = "scraper", .call = {"/rowe/stats"}}, {.name = "arm", .call = {"/arm/*"}}};
  for (const std::string role : {"scraper", "arm"})
    options.access.identities.push_back({role, role, rowe::hash_token(role + "-shows-this-token")});
  return options;
}

struct own_pages_with_roles : own_pages {
  own_pages_with_roles() : own_pages{with_roles()} {}
  std::uint16_t asked_by(std::string_view token, std::string_view path) {
    return may_read({.address = "10.0.0.7:1", .path = path, .token = token}).status;
  }
};

TEST_F(own_pages_with_roles, let_those_log_in_whose_token_is_known) {
  const auto typed = [&](std::string_view token, std::string_view address = "10.0.0.7:1") {
    return may_read({.address = address, .path = "/rowe/login", .token = token, .typed_in = true}).status;
  };
  EXPECT_EQ(typed("scraper-shows-this-token"), 0);
  EXPECT_EQ(typed("arm-shows-this-token"), 0) << "it takes no right";
  EXPECT_EQ(typed("mallory-shows-this-token"), 401);
  EXPECT_EQ(typed(""), 400);
  EXPECT_EQ(asked_by("", "/rowe/login"), 0) << "the form is for everybody";
  EXPECT_EQ(asked_by("mallory-shows-this-token", "/rowe/login"), 0);
}

TEST_F(own_pages_with_roles, take_no_other_proof_for_a_log_in) {
  rowe::access_options with = with_roles().access;
  with.local_role = "scraper";
  with.anonymous_may_stop = true;
  with.identities[0].certificate = "Scraper";
  on.set_access(with);
  EXPECT_EQ(may_read({.address = "127.0.0.1:1", .path = "/rowe/login", .token = {}, .typed_in = true}).status,
            400);
  EXPECT_EQ(may_read({.address = "127.0.0.1:1",
                      .path = "/rowe/login",
                      .token = "mallory-shows-this-token",
                      .certificate = "Scraper",
                      .typed_in = true})
                .status,
            401);
}

TEST_F(own_pages_with_roles, know_who_shows_a_certificate) {
  const auto shown = [&](std::string_view certificate, std::string_view token = {}) {
    return may_read({.address = "10.0.0.7:1", .path = "/metrics", .token = token, .certificate = certificate})
        .status;
  };
  rowe::access_options with = with_roles().access;
  with.identities[0].certificate = "Scraper";
  with.identities.push_back({.name = "screen", .role = "arm", .certificate = "Screen"});
  on.set_access(with);
  EXPECT_EQ(shown("Scraper"), 0);
  EXPECT_EQ(shown("Screen"), 403);
  EXPECT_EQ(shown("somebody"), 401) << "a certificate of nobody's is none";
  EXPECT_EQ(shown("Screen", "scraper-shows-this-token"), 0) << "the token comes first";
  EXPECT_EQ(shown("Scraper", "mallory-shows-this-token"), 401) << "a wrong one, too";
  with.identities[0].certificate = {};
  on.set_access(with);
  EXPECT_EQ(shown("Scraper"), 401);
}

TEST_F(own_pages, let_nobody_log_in_where_there_are_no_identities) {
  const auto answer = may_read(
      {.address = "10.0.0.7:1", .path = "/rowe/login", .token = "a-token-of-some-length", .typed_in = true});
  EXPECT_EQ(answer.status, 409);
  EXPECT_EQ(answer.what, "no identities are configured here");
}

} // namespace
} // namespace own_pages_test
