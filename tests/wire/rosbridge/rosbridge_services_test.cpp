// SPDX-License-Identifier: Apache-2.0
// Services in rosbridge's words: read and refused.
#include <gtest/gtest.h>

#include <string>

#include "wire/decoded.hpp"
#include "wire/rosbridge/rosbridge.hpp"

namespace rowe::wire::rosbridge {
namespace rosbridge_services_test {
namespace {

std::int64_t timeout_of(const std::string& seconds) {
  return read(R"({"op":"call_service","service":"/s","timeout":)" + seconds + "}")->ttl_ns;
}

TEST(rosbridge_services, takes_a_timeout_in_seconds) {
  EXPECT_EQ(timeout_of("0.2"), 200'000'000);
  EXPECT_EQ(timeout_of("3"), 3'000'000'000);
  EXPECT_EQ(timeout_of("1e-12"), 1); // the shortest there is, since 0 means none
  EXPECT_EQ(timeout_of("0"), unlimited);
  EXPECT_EQ(timeout_of("0.0"), unlimited);
  EXPECT_EQ(timeout_of("-0.0"), unlimited);
  EXPECT_EQ(timeout_of("1e300"), unlimited);
}

TEST(rosbridge_services, takes_the_id_that_old_clients_write_behind_the_name) {
  const decoded old{R"({"op":"call_service","service":"\/rosbridge\/topics#33\"a"})"};
  EXPECT_EQ(old->service, "/rosbridge/topics");
  EXPECT_EQ(old->id_raw, R"("33\"a")");
  const decoded both{R"({"op":"call_service","service":"/s#33","id":4})"};
  EXPECT_EQ(both->service, "/s");
  EXPECT_EQ(both->id_raw, "4");
  EXPECT_EQ(read(R"({"op":"call_service","service":"/s#33","id":null})")->id_raw, R"("33")");
  EXPECT_EQ(read(R"({"op":"call_service","service":"/s#1#2"})")->id_raw, R"("1#2")");
  EXPECT_EQ(read(R"({"op":"call_service","service":"/s#"})")->id_raw, R"("")");
  const std::string name(32, 'n'), id(62, 'i');
  const decoded most{R"({"op":"call_service","service":")" + name + "#" + id + R"("})"};
  EXPECT_EQ(most->service, name);
  EXPECT_EQ(most->id_raw, "\"" + id + "\"");
  EXPECT_EQ(diagnostic_for(R"({"op":"call_service","service":"/s#)" + id + R"(i"})"),
            R"(call_service: the member "id" is 65 bytes long; the limit is 64)");
  EXPECT_EQ(diagnostic_for(R"({"op":"call_service","service":"#33"})"),
            R"(call_service: the member "service" must not be empty)");
  // No old client puts one here.
  EXPECT_EQ(read(R"({"op":"service_response","service":"/s#33"})")->service, "/s#33");
  EXPECT_EQ(read(R"({"op":"advertise_service","service":"/s#33"})")->service, "/s#33");
  EXPECT_EQ(read(R"({"op":"call_service","service":"/s\u002333"})")->service, "/s#33");
}

TEST(rosbridge_services, refuses_with_a_diagnostic_that_names_member_value_and_limit) {
  constexpr wrong table[] = {
      {R"({"op":"call_service"})", R"(call_service: the member "service" is missing)"},
      {R"({"op":"service_response"})", R"(service_response: the member "service" is missing)"},
      {R"({"op":"advertise_service"})", R"(advertise_service: the member "service" is missing)"},
      {R"({"op":"unadvertise_service"})", R"(unadvertise_service: the member "service" is missing)"},
      {R"({"op":"call_service","service":7})",
       R"(call_service: the member "service" must be a string; it is 7)"},
      {R"({"op":"call_service","service":["a#b"]})",
       R"(call_service: the member "service" must be a string; it is ["a#b"])"},
      {R"({"op":"call_service","service":""})", R"(call_service: the member "service" must not be empty)"},
      {R"({"op":"unadvertise_service","service":""})",
       R"(unadvertise_service: the member "service" must not be empty)"},
      {R"({"op":"advertise_service","service":"a\nb"})",
       R"(advertise_service: the member "service" must have no control characters; it is "a\nb")"},
      {R"({"op":"advertise_service","service":"012345678901234567890123456789012"})",
       R"(advertise_service: the member "service" is 33 bytes long; the limit is 32)"},
      {R"({"op":"advertise_service","service":"/s","type":3})",
       R"(advertise_service: the member "type" must be a string; it is 3)"},
      {R"({"op":"call_service","service":"/s","args":"x"})",
       R"(call_service: the member "args" must be an object or an array; it is "x")"},
      {R"({"op":"call_service","service":"/s","timeout":"1"})",
       R"(call_service: the member "timeout" must be seconds; it is "1")"},
      {R"({"op":"call_service","service":"/s","timeout":-0.5})",
       R"(call_service: the member "timeout" must not be negative; it is -0.5)"},
      {R"({"op":"call_service","service":"/s","fragment_size":-1})",
       R"(call_service: the member "fragment_size" must be at least 256; it is -1)"},
      {R"({"op":"call_service","service":"/s","compression":"lz4"})",
       R"(call_service: the member "compression" asks for "lz4", which is not offered; use "none", "png", )"
       R"("cbor", "cbor-raw" or leave it out)"},
      {R"({"op":"call_service","service":"/s","id":{}})",
       R"(call_service: the member "id" must be a string or an integer; it is {})"},
      {R"({"op":"service_response","service":"/s","result":1})",
       R"(service_response: the member "result" must be true or false; it is 1)"},
      {R"({"op":"service_response","service":"/s","result":null})",
       R"(service_response: the member "result" must be true or false; it is null)"},
      {R"({"op":"service_response","service":"/s","result":true,"re\u0073ult":false})",
       R"(service_response: the member "result" is there twice)"},
  };
  expect_refused(table);
}

} // namespace
} // namespace rosbridge_services_test
} // namespace rowe::wire::rosbridge
