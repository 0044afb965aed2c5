// SPDX-License-Identifier: Apache-2.0
// Random definitions and values: to bytes and back in every encoding, and what becomes of bytes that are cut
// off or changed.
#include "random_types.hpp"
#include "rt/seed.hpp"
#include "types.hpp"

namespace round_trip_test {
namespace {

using namespace rosmsg_tests;

constexpr ros_encoding encodings[] = {ros_encoding::ros1, ros_encoding::cdr, ros_encoding::cdr_big_endian};

TEST(round_trip, keeps_random_values_of_random_types) {
  rowe::tests::seeded random;
  std::string message, again, json, why;
  for (int i = 0; i < 2000; ++i) {
    const ros_version version = i % 2 == 0 ? ros_version::ros1 : ros_version::ros2;
    random_types made{random, version};
    const std::string definition = made.definition();
    const ros_type type = type_of(definition, version);
    for (int n = 0; n < 3; ++n) {
      const auto [straight, shuffled] = made.value();
      for (const ros_encoding encoding : encodings) {
        ASSERT_TRUE(type.from_json(encoding, straight, message, plenty, &why))
            << why << definition << straight;
        ASSERT_TRUE(type.from_json(encoding, shuffled, again, plenty, &why)) << why << definition << shuffled;
        ASSERT_EQ(message, again) << definition << shuffled;
        ASSERT_TRUE(type.to_json(encoding, message, json, plenty, &why)) << why << definition << straight;
        ASSERT_EQ(json, straight) << definition;
      }
    }
  }
}

TEST(round_trip, writes_any_bytes_as_a_string_and_asks_for_no_more_room_than_that) {
  rowe::tests::seeded random;
  const ros_type type = ros1("string x");
  for (int i = 0; i < 3000; ++i) {
    std::string text(random() % 100, 'x');
    for (char& c : text)
      if (random() % 4 < static_cast<unsigned>(i % 5)) c = static_cast<char>(random());
    std::string buffer(6 * text.size() + 100, '\0');
    rowe::json::writer to{buffer};
    to.begin_object();
    to.member("x", text);
    to.end_object();
    const std::string wanted{to.text()};
    const auto bytes = static_cast<std::uint32_t>(text.size());
    const std::string message = std::string{reinterpret_cast<const char*>(&bytes), sizeof bytes} + text;
    ASSERT_EQ(json_of(type, ros_encoding::ros1, message, wanted.size()), wanted);
    ASSERT_TRUE(json_of(type, ros_encoding::ros1, message, wanted.size() - 1).starts_with("too_big: "));
    std::string json;
    json.reserve(wanted.size() + 64);
    const char* const place = json.data();
    ASSERT_TRUE(type.to_json(ros_encoding::ros1, message, json, plenty));
    ASSERT_EQ(json.data(), place);
  }
}

// Whatever is read can be written, and is then read as the same.
TEST(round_trip, reads_again_what_was_made_of_changed_bytes) {
  rowe::tests::seeded random;
  std::string message, json, again, why;
  int read = 0;
  for (int i = 0; i < 2000; ++i) {
    const ros_version version = i % 2 == 0 ? ros_version::ros1 : ros_version::ros2;
    random_types made{random, version};
    const std::string definition = made.definition();
    const ros_type type = type_of(definition, version);
    for (const ros_encoding encoding : encodings) {
      ASSERT_TRUE(type.from_json(encoding, made.value().straight, message, plenty, &why));
      for (int n = 0; n < 4 && !message.empty(); ++n) {
        std::string changed = message.substr(0, n == 0 ? random() % message.size() : message.size());
        if (!changed.empty()) changed[random() % changed.size()] = static_cast<char>(random());
        if (!type.to_json(encoding, changed, json, plenty, &why)) continue;
        if (json.find("\xef\xbf\xbd") != json.npos) continue; // it may be longer than a string may be
        ++read;
        ASSERT_TRUE(type.from_json(encoding, json, changed, plenty, &why)) << why << definition << json;
        ASSERT_TRUE(type.to_json(encoding, changed, again, plenty, &why)) << why << definition << json;
        ASSERT_EQ(again, json) << definition;
      }
    }
  }
  EXPECT_GT(read, 1000);
}

} // namespace
} // namespace round_trip_test
