// SPDX-License-Identifier: Apache-2.0
// Services in rosbridge's words: read, refused, written, and written to be read again.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "wire/decoded.hpp"
#include "wire/rosbridge/rosbridge.hpp"
#include "wire/written.hpp"
#include "json/writing/writer.hpp"

namespace rowe::wire::rosbridge {
namespace rosbridge_services_test {
namespace {

// Reading

TEST(rosbridge_services, reads_roslibs_calls) {
  const decoded plain{R"({"op":"call_service","id":"call_service:/probe/estop:0c28d7ab",)"
                      R"("service":"/probe/estop","args":{"data":true}})"};
  EXPECT_EQ(plain->what, verb::call);
  EXPECT_EQ(plain->id_raw, R"("call_service:/probe/estop:0c28d7ab")");
  EXPECT_EQ(plain->service, "/probe/estop");
  EXPECT_EQ(plain->body_raw, R"({"data":true})");
  EXPECT_EQ(plain->ttl_ns, unlimited);
  const decoded timed{
      R"({"op":"call_service","id":"call_service:/fail:f1ffc776","service":"/fail","args":{},)"
      R"("timeout":0.5})"};
  EXPECT_EQ(timed->ttl_ns, 500'000'000);
  const decoded topics{R"({"op":"call_service","id":"c","service":"rosapi/topics","args":{}})"};
  EXPECT_EQ(topics->service, "rosapi/topics"); // no slash: the name is passed on as it is
}

TEST(rosbridge_services, reads_roslib_as_a_provider) {
  const decoded advertise{R"({"op":"advertise_service","type":"std_srvs/srv/SetBool","service":"/p/estop"})"};
  EXPECT_EQ(advertise->what, verb::advertise_service);
  EXPECT_EQ(advertise->service, "/p/estop");
  EXPECT_EQ(advertise->type, "std_srvs/srv/SetBool");
  const decoded unadvertise{R"({"op":"unadvertise_service","service":"/p/estop"})"};
  EXPECT_EQ(unadvertise->what, verb::unadvertise_service);
  EXPECT_EQ(unadvertise->service, "/p/estop");
  const decoded response{R"({"op":"service_response","service":"/p/estop",)"
                         R"("values":{"success":true,"message":"stopped"},"result":true,"id":"srv-1"})"};
  EXPECT_EQ(response->what, verb::reply);
  EXPECT_EQ(response->service, "/p/estop");
  EXPECT_EQ(response->id_raw, R"("srv-1")");
  EXPECT_FALSE(response->failed);
  EXPECT_EQ(response->body_raw, R"({"success":true,"message":"stopped"})");
}

TEST(rosbridge_services, reads_what_a_rosbridge_server_says) {
  const decoded failed{R"({"op": "service_response", "service": "\/nope", "values": )"
                       R"("Service \/nope does not exist \u2013 no", "result": false, "id": 7})"};
  EXPECT_EQ(failed->service, "/nope");
  EXPECT_EQ(failed->id_raw, "7");
  EXPECT_TRUE(failed->failed);
  EXPECT_EQ(failed->body_raw, R"("Service \/nope does not exist \u2013 no")");
  const decoded call{R"({"op": "call_service", "id": "service_request:\/mine:1", "service": "\/mine", )"
                     R"("args": {"data": true}})"};
  EXPECT_EQ(call->what, verb::call);
  EXPECT_EQ(call->service, "/mine");
  EXPECT_EQ(call->id_raw, R"("service_request:\/mine:1")");
  const decoded letters{R"({"op":"call_service","service":"\/caf\u00e9","args":[1,"a"]})"};
  EXPECT_EQ(letters->service, "/caf\xc3\xa9");
  EXPECT_EQ(letters->body_raw, R"([1,"a"])");
}

TEST(rosbridge_services, has_defaults_for_what_a_text_leaves_out) {
  const decoded call{R"({"op":"call_service","service":"/s"})"};
  EXPECT_EQ(call->id_raw, "");
  EXPECT_EQ(call->body_raw, "");
  EXPECT_EQ(call->ttl_ns, unlimited);
  const decoded response{R"({"op":"service_response","service":"/s"})"};
  EXPECT_FALSE(response->failed);
  EXPECT_EQ(response->body_raw, "");
  EXPECT_EQ(read(R"({"op":"advertise_service","service":"/s"})")->type, "");
}

TEST(rosbridge_services, takes_answers_of_every_kind) {
  for (const std::string values : {"{}", "[1]", R"("why")", "7", "true", "null"}) {
    EXPECT_EQ(
        read(R"({"op":"service_response","service":"/s","result":false,"values":)" + values + "}")->body_raw,
        values);
  }
}

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
}

TEST(rosbridge_services, leaves_a_mark_in_the_name_where_no_old_client_puts_an_id) {
  EXPECT_EQ(read(R"({"op":"service_response","service":"/s#33"})")->service, "/s#33");
  EXPECT_EQ(read(R"({"op":"advertise_service","service":"/s#33"})")->service, "/s#33");
  EXPECT_EQ(read(R"({"op":"call_service","service":"/s\u002333"})")->service, "/s#33");
}

TEST(rosbridge_services, keeps_operation_and_id_for_the_answer_to_a_refusal) {
  const decoded d{R"({"op":"call_service","service":"/s#33","args":7})"};
  EXPECT_EQ(d.as_far_as_read().what, verb::call);
  EXPECT_EQ(d.as_far_as_read().id_raw, R"("33")");
  EXPECT_EQ(d.as_far_as_read().service, "/s");
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

// Writing

class rosbridge_services_written : public testing::Test {
 protected:
  std::string call(std::string_view service, std::string_view id) {
    json::writer text{buffer_};
    write_call_service_head(text, service, id);
    text.raw(R"({"a":[1,"}"]})");
    text.end_object();
    EXPECT_FALSE(text.overflowed());
    return std::string{text.text()};
  }
  std::string response(std::string_view service, std::string_view id_raw, bool result) {
    json::writer text{buffer_};
    write_service_response_head(text, service, id_raw, result);
    text.string("va\"lues");
    text.end_object();
    EXPECT_FALSE(text.overflowed());
    return std::string{text.text()};
  }

  std::array<char, 2048> buffer_{};
};

TEST_F(rosbridge_services_written, writes_advertisements_without_an_id) {
  EXPECT_EQ(written(buffer_, write_advertise_service, "/add", "a/Add"),
            R"({"op":"advertise_service","type":"a/Add","service":"/add"})");
  EXPECT_EQ(written(buffer_, write_advertise_service, "/add", ""),
            R"({"op":"advertise_service","service":"/add"})");
  EXPECT_EQ(written(buffer_, write_unadvertise_service, "/add"),
            R"({"op":"unadvertise_service","service":"/add"})");
}

TEST_F(rosbridge_services_written, writes_a_call_around_its_arguments) {
  EXPECT_EQ(call("/add", "1.2"), R"({"op":"call_service","id":"1.2","service":"/add","args":{"a":[1,"}"]}})");
}

TEST_F(rosbridge_services_written, writes_a_response_around_its_values) {
  EXPECT_EQ(response("/add", R"("c\/1")", true),
            R"({"op":"service_response","id":"c\/1","service":"/add","result":true,"values":"va\"lues"})");
  EXPECT_EQ(response("/add", "7", false),
            R"({"op":"service_response","id":7,"service":"/add","result":false,"values":"va\"lues"})");
  EXPECT_EQ(response("/add", "", false),
            R"({"op":"service_response","service":"/add","result":false,"values":"va\"lues"})");
}

TEST_F(rosbridge_services_written, can_be_read) {
  const std::string name = "/\xc3\xa9\"\\/x";
  const decoded called{call(name, "i\"d")};
  EXPECT_EQ(called->what, verb::call);
  EXPECT_EQ(called->service, name);
  EXPECT_EQ(called->id_raw, R"("i\"d")");
  EXPECT_EQ(called->body_raw, R"({"a":[1,"}"]})");
  const decoded answered{response(name, called->id_raw, false)};
  EXPECT_EQ(answered->what, verb::reply);
  EXPECT_EQ(answered->service, name);
  EXPECT_EQ(answered->id_raw, called->id_raw);
  EXPECT_TRUE(answered->failed);
  EXPECT_EQ(answered->body_raw, R"("va\"lues")");
  const decoded advertised{std::string{written(buffer_, write_advertise_service, name, "a/B")}};
  EXPECT_EQ(advertised->service, name);
  EXPECT_EQ(advertised->type, "a/B");
  EXPECT_EQ(read(std::string{written(buffer_, write_unadvertise_service, name)})->service, name);
}

TEST_F(rosbridge_services_written, writes_nothing_where_it_does_not_fit) {
  for (std::size_t bytes = 0; bytes < 40; ++bytes) {
    const std::span<char> small = std::span{buffer_}.first(bytes);
    EXPECT_TRUE(written(small, write_advertise_service, "/add", "a/Add").empty());
    EXPECT_TRUE(written(small, write_unadvertise_service, "/add").empty());
    json::writer text{small};
    write_call_service_head(text, "/add", "1");
    EXPECT_TRUE(text.overflowed());
  }
}

TEST_F(rosbridge_services_written, needs_no_more_for_advertisements_than_requests_do) {
  const std::string worst(limits.name_bytes_max, '\x01');
  std::vector<char> exact(request_bytes_max(limits));
  EXPECT_FALSE(written(exact, write_advertise_service, worst, worst).empty());
  EXPECT_FALSE(written(exact, write_unadvertise_service, worst).empty());
}

} // namespace
} // namespace rosbridge_services_test
} // namespace rowe::wire::rosbridge
