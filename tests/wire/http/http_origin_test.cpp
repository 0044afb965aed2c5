// SPDX-License-Identifier: Apache-2.0
// Who may connect: the Host and Origin of a request against the policy.
#include "wire/http/http_request.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "wire/requests.hpp"

namespace rowe::wire::test {
namespace http_origin_test {
namespace {

TEST(judge_request, refuses_foreign_hosts) {
  EXPECT_TRUE(refused(upgrade({{"Host", "Host: evil.example"}}), 403,
                      "Host evil.example is not a name of this endpoint",
                      "start rowe serve with --allow-host evil.example"));
  EXPECT_TRUE(refused(upgrade({{"Host", "Host: evil.example:8080"}}), 403, "evil.example:8080",
                      "--allow-host evil.example"));
  EXPECT_TRUE(refused(upgrade({{"Host", "Host: localhost:9000"}}), 403, "localhost:9000",
                      "--allow-host localhost:9000"));
  for (const std::string_view host : {"localhost.evil.example", "127.0.0.1.evil.example", "127.0.0.2",
                                      "localhost.", "[::2]:8080", "2130706433"}) {
    EXPECT_TRUE(refused(upgrade({{"Host", "Host: " + std::string{host}}}), 403, host)) << host;
  }
  EXPECT_TRUE(refused(header({"GET / HTTP/1.1", "Host: evil.example"}), 403, "evil.example")); // pages, too
}

TEST(judge_request, refuses_a_host_that_is_missing_or_malformed) {
  EXPECT_TRUE(refused(upgrade({{"Host", ""}}), 400, "Host header is missing"));
  for (const std::string_view host :
       {"", ":8080", "localhost:", "localhost:x", "localhost:0", "localhost:65536", "localhost:8080:1",
        "localhost, evil", "user@localhost", "localhost/", "[::1", "[::1]x", "localhost 1"}) {
    EXPECT_TRUE(refused(upgrade({{"Host", "Host: " + std::string{host}}}), 400, "malformed")) << host;
  }
}

TEST(judge_request, takes_hosts_by_option) {
  constexpr std::string_view hosts[] = {"robot.local", "localhost:9000", "[fe80::1]", "lab.local:9000"};
  handshake_policy policy{.port = 8080, .hosts = hosts};
  for (const std::string_view host :
       {"robot.local", "Robot.Local:8080", "localhost:9000", "[fe80::1]:8080", "localhost"}) {
    EXPECT_TRUE(accepted(upgrade({{"Host", "Host: " + std::string{host}}}), policy)) << host;
  }
  EXPECT_TRUE(refused(upgrade({{"Host", "Host: robot.local:9000"}}), 403, "robot.local:9000", "", policy));
  EXPECT_TRUE(refused(upgrade({{"Host", "Host: localhost:9001"}}), 403, "localhost:9001", "", policy));
  EXPECT_TRUE(refused(upgrade({{"Host", "Host: lab.local"}}), 403, "lab.local", "", policy));
  EXPECT_TRUE(refused(upgrade({{"Host", "Host: lab.local:8080"}}), 403, "lab.local:8080", "", policy));
  policy.any_host = true;
  EXPECT_TRUE(accepted(upgrade({{"Host", "Host: anything.example:1"}}), policy));
  EXPECT_TRUE(refused(upgrade({{"Host", "Host: a b"}}), 400, "malformed", "", policy));
}

// Origin

TEST(judge_request, takes_its_own_origins) {
  for (const std::string_view origin : {"http://localhost:8080", "http://127.0.0.1:8080", "http://[::1]:8080",
                                        "https://localhost:8080", "HTTP://LOCALHOST:8080"}) {
    EXPECT_TRUE(accepted(upgrade({{"Origin", "Origin: " + std::string{origin}}}))) << origin;
  }
  const auto at_default_port = [](std::uint16_t port, std::string_view origin) {
    return accepted(upgrade({{"Host", "Host: 127.0.0.1"}, {"Origin", origin}}), policy_at(port));
  };
  EXPECT_TRUE(at_default_port(80, "Origin: http://localhost"));
  EXPECT_TRUE(at_default_port(443, "Origin: https://localhost"));
  EXPECT_FALSE(at_default_port(80, "Origin: https://localhost"));
}

TEST(judge_request, takes_the_origin_by_whose_name_it_was_called) {
  // A page served through a forwarded port or a proxy calls us by the name under which it was loaded.
  constexpr std::string_view hosts[] = {"robot.local"};
  const handshake_policy policy{.port = 8080, .hosts = hosts};
  EXPECT_TRUE(
      accepted(upgrade({{"Host", "Host: robot.local"}, {"Origin", "Origin: https://robot.local"}}), policy));
  EXPECT_TRUE(
      refused(upgrade({{"Host", "Host: robot.local"}, {"Origin", "Origin: https://robot.local:9999"}}), 403,
              "9999", "", policy));
  const handshake_policy any{.port = 8080, .any_host = true};
  EXPECT_TRUE(
      accepted(upgrade({{"Host", "Host: a.example:99"}, {"Origin", "Origin: http://a.example:99"}}), any));
  EXPECT_TRUE(refused(upgrade({{"Host", "Host: a.example:99"}, {"Origin", "Origin: http://b.example:8080"}}),
                      403, "b.example", "", any));
}

TEST(judge_request, refuses_foreign_origins_and_names_the_remedy) {
  EXPECT_TRUE(refused(upgrade({{"Origin", "Origin: http://evil.example"}}), 403,
                      "Origin http://evil.example is not allowed here",
                      "start rowe serve with --allow-origin http://evil.example"));
  for (const std::string_view origin :
       {"http://localhost", "http://localhost:8081", "https://localhost",
        "http://localhost.evil.example:8080", "http://evil.example:8080", "ftp://localhost:8080",
        "localhost:8080", "file://", "", "http://localhost:8080.evil.example",
        "http://localhost:8080@evil.example", "http://evil.example/localhost:8080",
        "http://localhost:8080 http://evil.example"}) {
    EXPECT_TRUE(refused(upgrade({{"Origin", "Origin: " + std::string{origin}}}), 403, "Origin")) << origin;
  }
  EXPECT_TRUE(refused(header({"GET / HTTP/1.1", "Host: localhost", "Origin: http://evil.example"}), 403,
                      "evil.example"));
}

TEST(judge_request, takes_origins_by_option) {
  constexpr std::string_view origins[] = {"http://lab.example:8000", "https://app.example/", "null"};
  const handshake_policy policy{.port = 8080, .origins = origins};
  EXPECT_TRUE(accepted(upgrade({{"Origin", "Origin: http://lab.example:8000"}}), policy));
  EXPECT_TRUE(accepted(upgrade({{"Origin", "Origin: https://app.example"}}), policy));
  EXPECT_TRUE(refused(upgrade({{"Origin", "Origin: http://lab.example"}}), 403, "lab.example", "", policy));
  EXPECT_TRUE(refused(upgrade({{"Origin", "Origin: http://app.example"}}), 403, "app.example", "", policy));
  EXPECT_TRUE(refused(upgrade({{"Origin", "Origin: null"}}), 403, "Origin null", "http://", policy));
}

} // namespace
} // namespace http_origin_test
} // namespace rowe::wire::test
