// SPDX-License-Identifier: Apache-2.0
// What the handshake filter lets pass when it is told to be lenient, and what it does not even then.
#include "wire/http/http_request.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <string>
#include <string_view>

#include "wire/requests.hpp"

namespace rowe::wire::test {
namespace http_lenient_test {
namespace {

constexpr handshake_policy lenient{.port = 8080, .subprotocols = known_subprotocols, .lenient = true};

TEST(lenient_handshake, takes_keys_that_are_not_16_bytes) {
  const std::string longest(lenient_key_bytes_max, 'k');
  for (const std::string_view key : std::initializer_list<std::string_view>{
           "d3M3", "d3MxODA0Mjg5Mzgz", "d3M=", "d3M0Mg==", "dGhlIHNhbXBsZSBub25jZQ==", longest}) {
    const std::string request = upgrade({{"Key", "Sec-WebSocket-Key: " + std::string{key}}});
    EXPECT_TRUE(accepted(request, lenient)) << key;
    EXPECT_EQ(judge_request(request, lenient).key, key);
  }
  EXPECT_TRUE(refused(upgrade({{"Key", "Sec-WebSocket-Key: d3M3"}}), 400, "16 bytes"));
}

TEST(lenient_handshake, refuses_keys_that_are_no_base64) {
  const std::string too_long(lenient_key_bytes_max + 1, 'k');
  for (const std::string_view key : std::initializer_list<std::string_view>{
           "=", "==", "d3M===", "d3 M3", "d3M-", "d=M3", "d3M3,d3M3", too_long}) {
    EXPECT_TRUE(refused(upgrade({{"Key", "Sec-WebSocket-Key: " + std::string{key}}}), 400, "64 characters",
                        "base64", lenient))
        << key;
  }
  EXPECT_TRUE(refused(upgrade({{"Key", ""}}), 400, "missing", "base64", lenient));
  EXPECT_TRUE(refused(upgrade({{"Key", "Sec-WebSocket-Key:"}}), 400, "64 characters", "base64", lenient));
}

TEST(lenient_handshake, chooses_no_subprotocol_where_none_offered_is_spoken) {
  const std::string unknown = upgrade({{"Protocol", "Sec-WebSocket-Protocol: foo, bar"}});
  EXPECT_TRUE(accepted(unknown, lenient));
  EXPECT_EQ(judge_request(unknown, lenient).subprotocol, "");
  const std::string known = upgrade({{"Protocol", "Sec-WebSocket-Protocol: foo, rowe.v1"}});
  EXPECT_EQ(judge_request(known, lenient).subprotocol, "rowe.v1");
  EXPECT_TRUE(refused(unknown, 400, "no subprotocol offered is spoken here"));
}

TEST(lenient_handshake, is_as_strict_in_everything_else) {
  EXPECT_TRUE(refused(upgrade({{"Origin", "Origin: http://evil.example"}}), 403, "evil", {}, lenient));
  EXPECT_TRUE(refused(upgrade({{"Host", "Host: evil.example"}}), 403, "evil", {}, lenient));
  EXPECT_TRUE(refused(upgrade({{"Version", "Sec-WebSocket-Version: 8"}}), 426, "8", {}, lenient));
  EXPECT_TRUE(refused(upgrade({{"Upgrade", "Upgrade: h2c"}}), 400, "h2c", {}, lenient));
}

} // namespace
} // namespace http_lenient_test
} // namespace rowe::wire::test
