// SPDX-License-Identifier: Apache-2.0
// get<T>() of enums by name, of durations and of times.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>

#include <rowe/json_value.hpp>

namespace read_forms_test {
enum class gait : std::int8_t { back = -1, stand, walk };
}
template <>
inline constexpr auto rowe::names<read_forms_test::gait> =
    rowe::enumerators<read_forms_test::gait::back, read_forms_test::gait::stand,
                      rowe::enumerator<read_forms_test::gait::walk, "w\u00e4lk">>{};

namespace read_forms_test {
namespace {

using rowe::errc;
using rowe::json_value;
using namespace std::chrono;

template <class T>
rowe::json_result<T> read(std::string_view text, std::string_view path = {}) {
  return json_value::parse(text).value().get<T>(path);
}

TEST(read_forms, reads_enums_by_name) {
  EXPECT_EQ(read<gait>(R"("back")").value(), gait::back);
  EXPECT_EQ(read<gait>("\"w\\u00e4lk\"").value(), gait::walk); // escaped
  EXPECT_EQ(read<gait>("-1.0").value(), gait::back);
  EXPECT_EQ(read<std::optional<gait>>("null").value(), std::nullopt);
}

TEST(read_forms, refuses_what_is_no_name_and_no_number_of_one) {
  EXPECT_EQ(read<gait>("2").code(), errc::out_of_range);
  EXPECT_EQ(read<gait>("200").code(), errc::out_of_range);
  EXPECT_EQ(read<gait>("true").code(), errc::wrong_type);
  EXPECT_EQ(read<gait>("0.5").code(), errc::wrong_type);
  EXPECT_EQ(read<gait>(R"("")").code(), errc::out_of_range);
  EXPECT_EQ(read<gait>(R"({"gait":"trot"})", "gait").error().message(),
            "the member \"gait\" must be \"back\", \"stand\" or \"w\u00e4lk\"; it is \"trot\"");
}

TEST(read_forms, reads_durations_and_times_as_their_count) {
  EXPECT_EQ(read<milliseconds>("1500").value(), 1500ms);
  EXPECT_EQ((read<duration<double>>("0.25").value()), 250ms);
  EXPECT_EQ(read<sys_time<seconds>>("-3").value().time_since_epoch(), -3s);
  EXPECT_EQ(read<nanoseconds>("1e19").code(), errc::out_of_range);
  EXPECT_EQ(read<seconds>("1.5").code(), errc::wrong_type);
  EXPECT_EQ(read<seconds>(R"("1")").code(), errc::wrong_type);
}

} // namespace
} // namespace read_forms_test
