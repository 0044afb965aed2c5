// SPDX-License-Identifier: Apache-2.0
// /rowe/record: black boxes are asked to write, and how many do is the answer.
#include "core_fixtures.hpp"

#include "service/base/record_sink.hpp"

namespace core_record_service_test {
namespace {

using namespace harness;

// A black box that has room, or has none, or a recorder that is none.
class box final : public rowe::service::record_sink {
 public:
  explicit box(bool writes) : writes_{writes} {}
  bool wants(std::string_view) const noexcept override { return false; }
  bool describe(std::uint32_t, std::string_view, std::string_view,
                const rowe::schema_description*) noexcept override {
    return true;
  }
  void put(std::uint32_t, std::span<const char>, rowe::time_point, rowe::time_point) noexcept override {}
  void lose(std::uint32_t, std::uint64_t) noexcept override {}
  bool begin_long(std::uint32_t, std::uint32_t, std::size_t, rowe::time_point,
                  rowe::time_point) noexcept override {
    return false;
  }
  void put_part(std::uint32_t, std::span<const std::byte>) noexcept override {}
  bool is_black_box() const noexcept override { return true; }
  bool snapshot(std::string_view cause) noexcept override {
    causes.emplace_back(cause);
    return writes_;
  }

  texts causes;

 private:
  const bool writes_;
};

struct core_record_service : core_test {
  std::string asked(std::string_view args) {
    peer p{on};
    p.tell(R"({"op":"call_service","service":"/rowe/record")" + std::string{args} + "}", 2);
    const texts heard = p.hear_after(1);
    return heard.empty() ? "" : heard.back();
  }
  void record_by(box& sink) {
    on.offer(rowe::detail::record_request(sink));
    on.cycle();
  }
};

TEST_F(core_record_service, says_that_there_is_no_black_box) {
  EXPECT_TRUE(has(asked(""), R"("result":true,"values":{"black_boxes":0})")) << asked("");
}

TEST_F(core_record_service, asks_every_black_box_and_counts_those_that_write) {
  box one{true};
  box full{false};
  box other{true};
  for (box* const sink : {&one, &full, &other}) record_by(*sink);
  EXPECT_TRUE(has(asked(R"(,"args":{"cause":"it \u0073hakes"})"), R"("black_boxes":2)"));
  for (const box* const sink : {&one, &full, &other}) EXPECT_EQ(sink->causes, texts{"it shakes"});
  EXPECT_TRUE(has(asked(R"(,"args":{})"), R"("black_boxes":2)"));
  EXPECT_EQ(one.causes.back(), "");
}

TEST_F(core_record_service, only_counts_them_for_who_wants_no_file) {
  box one{true};
  box full{false};
  for (box* const sink : {&one, &full}) record_by(*sink);
  EXPECT_TRUE(has(asked(R"(,"args":{"write":false})"), R"("black_boxes":2)"));
  EXPECT_EQ(one.causes, texts{});
  EXPECT_TRUE(has(asked(R"(,"args":{"write":true})"), R"("black_boxes":1)"));
  EXPECT_EQ(one.causes, texts{""});
}

TEST_F(core_record_service, refuses_a_cause_that_is_none) {
  box one{true};
  record_by(one);
  for (const std::string& cause : {std::string{"7"}, std::string{"{}"}, '"' + std::string(257, 'x') + '"'}) {
    const std::string said = asked(R"(,"args":{"cause":)" + cause + "}");
    EXPECT_TRUE(has(said, "the member `cause` must be a text of 256 bytes at most")) << said;
    EXPECT_TRUE(has(said, R"("result":false)")) << said;
  }
  EXPECT_EQ(one.causes, texts{});
  EXPECT_TRUE(has(asked(R"(,"args":{"cause":")" + std::string(256, 'x') + "\"}"), R"("black_boxes":1)"));
}

} // namespace
} // namespace core_record_service_test
