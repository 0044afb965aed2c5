// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gtest/gtest.h>

#include <rowe/types.hpp>

#include "describe/robot.hpp"

namespace typescript_test {
namespace {

struct first {
  int a = 0;
};
struct second {
  int b = 0;
};
struct both {
  first f;
  second s;
};

enum class odd { value };
struct odd_names {
  odd o{};
};

} // namespace
} // namespace typescript_test

// clang-format off
template <> inline constexpr auto rowe::schema<typescript_test::first> =
    rowe::fields<&typescript_test::first::a>{}.type("test/Same");
template <> inline constexpr auto rowe::schema<typescript_test::second> =
    rowe::fields<&typescript_test::second::b>{}.type("test/Same");
template <> inline constexpr auto rowe::schema<typescript_test::both> =
    rowe::fields<&typescript_test::both::f, &typescript_test::both::s>{}.type("Both");
template <> inline constexpr auto rowe::names<typescript_test::odd> =
    rowe::enumerators<rowe::enumerator<typescript_test::odd::value, "*/ evil()">>{};
template <> inline constexpr auto rowe::schema<typescript_test::odd_names> =
    rowe::fields<rowe::field<&typescript_test::odd_names::o, "a-b\"">>{}.type("1/de-fault/default");
// clang-format on

namespace rowe {
namespace typescript_test {
using namespace ::typescript_test;
namespace {

TEST(typescript, maps_names_to_types) {
  const schema_description& same = describe<first>();
  const schema_description& again = describe<second>(); // its name is taken
  const typed_topic topics[] = {{"/a", &same}, {"/\"b", nullptr}};
  const typed_service services[] = {{"/add", &same, &again}};
  const named_type types[] = {{&same, ""}, {&again, ""}};
  EXPECT_EQ(typescript(types, topics, services), R"(export namespace test {
  export interface Same {
    a: number;
  }
}

export interface topics {
  "/a": test.Same;
  "/\"b": unknown;
}

export interface services {
  "/add": { request: test.Same; response: {
    b: number;
  } };
}
)");
}

TEST(typescript, keeps_the_names_of_its_maps) {
  schema_description taken = describe<first>();
  taken.type_name = "topics";
  const typed_topic topics[] = {{"/a", &taken}};
  const named_type types[] = {{&taken, ""}};
  EXPECT_EQ(typescript(types, topics, {}), R"(export interface topics {
  "/a": {
    a: number;
  };
}

export interface services {
}
)");
}

TEST(typescript, declares_each_type_once_in_the_namespace_of_its_name) {
  EXPECT_EQ((typescript<ros::twist, ros::pose>()), R"(export namespace geometry_msgs {
  export interface Twist {
    linear: geometry_msgs.Vector3;
    angular: geometry_msgs.Vector3;
  }

  export interface Vector3 {
    x: number;
    y: number;
    z: number;
  }

  export interface Pose {
    position: geometry_msgs.Point;
    orientation: geometry_msgs.Quaternion;
  }

  export interface Point {
    x: number;
    y: number;
    z: number;
  }

  export interface Quaternion {
    x: number;
    y: number;
    z: number;
    w: number;
  }
}
)");
}

TEST(typescript, has_the_form_that_each_member_is_given) {
  EXPECT_EQ(typescript<robot::state>(), R"(export namespace geometry_msgs {
  export interface Vector3 {
    x: number;
    y: number;
    z: number;
  }
}

export namespace robot {
  export interface state {
    /** seconds since 1970 */
    stamp: number;
    /** milliseconds */
    uptime: number;
    mode: "off" | "manual" | "auto";
    /** 0: off, 1: manual, 7: auto */
    wanted: number;
    /** an integer */
    serial: string;
    load: number;
    moving: boolean;
    /** at most 12 bytes */
    "a \"name\"": string;
    where: {
      x: number;
      y: number;
    };
    /** 3 elements */
    axes: number[];
    /** at most 4 elements */
    path: ({
      x: number;
      y: number;
    })[];
    /** base64 of at most 8 bytes */
    cells: string;
    goal?: {
      x: number;
      y: number;
    };
    /** 2 elements */
    hits: (number | null)[];
    /** units of 1/30 seconds */
    frames?: number;
    speed: geometry_msgs.Vector3;
  }
}
)");
}

TEST(typescript, writes_out_a_type_whose_name_is_taken) {
  EXPECT_EQ(typescript<both>(), R"(export interface Both {
  f: test.Same;
  s: {
    b: number;
  };
}

export namespace test {
  export interface Same {
    a: number;
  }
}
)");
}

// What a name holds cannot end a comment or become code.
TEST(typescript, makes_identifiers_of_any_names) {
  EXPECT_EQ(typescript<odd_names>(), R"(export namespace _1.de_fault {
  export interface default_ {
    "a-b\"": number;
  }
}
)");
}

} // namespace
} // namespace typescript_test
} // namespace rowe
