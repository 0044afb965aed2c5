// SPDX-License-Identifier: Apache-2.0
// Queue pairs whose handle is gone while views or requests of it are left: their memory is nobody else's
// until the last slot is released.
#include "service/handles/pair_release.hpp"

#include "service/core/core_fixtures.hpp"

#include <rowe/caller.hpp>
#include <rowe/lane.hpp>
#include <rowe/responder.hpp>

#include <optional>

namespace pair_release_test {
namespace {

using namespace harness;
using rowe::json_text;
using rowe::detail::pair_phase;

struct outliving : core_test {
  // As the handle's destructor does.
  void close(rowe::detail::queue_pair& one) {
    one.lifecycle.close();
    on.cycle();
  }
  rowe::detail::queue_pair& subscribe() {
    rowe::detail::queue_pair& one =
        on.offer_now(rowe::detail::pair_kind::subscribe_text, "/heard", 100, {.depth = 4});
    return one;
  }
  void publish(int count) {
    for (int i = 0; i < count; ++i) other.say(R"({"op":"publish","topic":"/heard","msg":{"n":1}})");
    on.cycle();
  }

  peer other{on};
};

TEST_F(outliving, lane_that_is_held_is_counted_once) {
  rowe::detail::queue_pair& one = subscribe();
  publish(1);
  std::optional<rowe::subscriber<json_text>> handle{core_harness::handle_of(one)};
  const auto view = handle->try_take();
  one.refused_full.add(3);
  handle.reset();
  close(one);
  EXPECT_EQ(on.count(counter::full), 3U);
}

} // namespace
} // namespace pair_release_test
