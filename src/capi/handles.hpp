// SPDX-License-Identifier: Apache-2.0
// C's names of the handles of loops: each is its C++ twin.
#pragma once
#include <rowe/lane.hpp>
#include <rowe/loop.h>
#include <rowe/publisher.hpp>
#include <rowe/stop_latch.hpp>
#include <rowe/subscriber.hpp>

struct rowe_lane {
  rowe::lane inside;
};
struct rowe_publisher {
  rowe::publisher<rowe::json_text> inside;
};
struct rowe_stop_latch {
  rowe::stop_latch inside;
};
struct rowe_subscriber {
  rowe::subscriber<rowe::json_text> inside;
};
