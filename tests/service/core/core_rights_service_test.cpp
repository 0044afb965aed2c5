// SPDX-License-Identifier: Apache-2.0
// /rowe/rights: what a role allows, told to whoever has it, and denied to nobody.
#include "access_fixture.hpp"

#include "service/requests/rights_service.hpp"

namespace core_rights_service_test {
namespace {

using namespace access_fixture;

constexpr std::string_view asked_all =
    R"({"right":"subscribe","name":"/odom"},{"right":"publish","name":"/cmd_vel"},)"
    R"({"right":"advertise","name":"/x"},{"right":"call","name":"/x"},{"right":"provide","name":"/x"},)"
    R"({"right":"set","name":"/x"},{"right":"reset"},{"right":"guard"},{"right":"take_over"})";

struct rights_service : access {
  using access::access;

  std::string values(peer& by, std::string_view args) {
    const std::string answer =
        answer_to(by, R"({"op":"call_service","service":"/rowe/rights","args":)" + std::string{args} + "}");
    const auto found = rowe::json::find(rowe::json::root(answer).raw, "values");
    return found ? std::string{found->raw} : answer;
  }
  std::string all(peer& by) { return values(by, R"({"asked":[)" + std::string{asked_all} + "]}"); }
};

struct rights_service_without_roles : rights_service {
  rights_service_without_roles() : rights_service{small_options()} {}
};

TEST_F(rights_service, says_what_each_role_may) {
  EXPECT_EQ(all(comes("observer")), R"({"role":"observer","identity":"observer",)"
                                    R"("allowed":[true,false,false,false,false,false,false,false,false]})");
  EXPECT_EQ(all(comes("driver")), R"({"role":"driver","identity":"driver",)"
                                  R"("allowed":[true,true,true,true,false,false,false,false,true]})");
  EXPECT_EQ(all(comes("supervisor")), R"({"role":"supervisor","identity":"supervisor",)"
                                      R"("allowed":[true,true,true,true,false,true,true,true,true]})");
  EXPECT_EQ(all(comes("guard")), R"({"role":"guard","identity":"guard",)"
                                 R"("allowed":[false,false,false,false,false,false,false,true,false]})");
}

TEST_F(rights_service, follows_the_patterns_of_a_role) {
  const std::string said = values(comes("arm"), R"({"asked":[{"right":"call","name":"/arm/move"},)"
                                                R"({"right":"call","name":"/base/arm/move"},)"
                                                R"({"right":"call","name":"/rowe/rights"},)"
                                                R"({"right":"call","name":"arm/move"}]})");
  EXPECT_TRUE(has(said, R"("allowed":[true,false,true,true])")) << said;
}

TEST_F(rights_service, denies_nothing) {
  (void)all(comes("observer"));
  (void)all(comes("guard"));
  EXPECT_EQ(on.count(rowe::service::counter::denied), 0U);
}

TEST_F(rights_service, says_no_to_what_is_no_right) {
  peer& one = comes("supervisor");
  EXPECT_TRUE(has(values(one, R"({"asked":[{"right":"fly"},{"name":"/x"},{},3,null,"reset",{"right":7}]})"),
                  R"("allowed":[false,false,false,false,false,false,false])"));
  for (const std::string_view odd : {"{}", R"({"asked":null})", R"({"asked":{"right":"reset"}})", "[]"})
    EXPECT_TRUE(has(values(one, odd), R"("allowed":[])")) << odd;
}

TEST_F(rights_service, answers_a_bounded_number) {
  std::string asked;
  for (std::size_t i = 0; i < rowe::service::rights_service::asked_max + 5; ++i)
    asked += R"({"right":"guard"},)";
  asked.pop_back();
  const std::string said = values(comes("guard"), R"({"asked":[)" + asked + "]}");
  std::size_t answered = 0;
  for (std::size_t at = said.find("true"); at != said.npos; at = said.find("true", at + 1)) ++answered;
  EXPECT_EQ(answered, rowe::service::rights_service::asked_max) << said;
}

TEST_F(rights_service_without_roles, allows_everything_but_the_stops_own_rights_from_elsewhere) {
  EXPECT_EQ(all(comes("", here)), R"({"role":null,"identity":null,)"
                                  R"("allowed":[true,true,true,true,true,true,true,true,true]})");
  EXPECT_EQ(all(comes("", far)), R"({"role":null,"identity":null,)"
                                 R"("allowed":[true,true,true,true,true,true,false,false,true]})");
}

} // namespace
} // namespace core_rights_service_test
