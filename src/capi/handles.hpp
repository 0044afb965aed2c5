// SPDX-License-Identifier: Apache-2.0
// C's names of the handles of loops: each is its C++ twin.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>

#include <rowe/caller.hpp>
#include <rowe/lane.hpp>
#include <rowe/loop.h>
#include <rowe/parameter.h>
#include <rowe/parameter.hpp>
#include <rowe/periodic.h>
#include <rowe/publisher.hpp>
#include <rowe/rt/periodic.hpp>
#include <rowe/service.h>
#include <rowe/stop_latch.hpp>
#include <rowe/struct.h>
#include <rowe/subscriber.hpp>

#include "capi/struct_payload.hpp"

struct rowe_lane {
  rowe::lane inside;
};
struct rowe_publisher {
  rowe::publisher<rowe::json_text> inside;
};
struct rowe_struct_publisher {
  rowe::publisher<rowe::capi::raw_struct> inside;
  std::size_t bytes; // of a struct
};
struct rowe_struct_subscriber {
  rowe::subscriber<rowe::capi::raw_struct> inside;
  std::size_t bytes;
};
struct rowe_responder {
  rowe::detail::pair_handle pair;
};
struct rowe_struct_responder {
  rowe::detail::pair_handle pair;
  std::size_t request_bytes;
  std::size_t answer_bytes;
};
struct rowe_caller {
  rowe::caller<rowe::json_text, rowe::json_text> inside;
  std::array<char, rowe::detail::diagnostic_bytes_max + 1> refusal{}; // as C reads it
};
struct rowe_struct_caller {
  rowe::detail::pair_handle pair;
  std::size_t request_bytes;
  std::size_t answer_bytes;
  rowe::detail::diagnostic refusal{};
  std::array<char, rowe::detail::diagnostic_bytes_max + 1> refusal_text{};
};
struct rowe_stop_latch {
  rowe::stop_latch inside;
};
struct rowe_subscriber {
  rowe::subscriber<rowe::json_text> inside;
};
struct rowe_periodic {
  rowe::rt::periodic inside;
  std::array<char, 512> granted{}; // what the thread was

  rowe_periodic(rowe::rt::duration period, const rowe::rt::periodic_options& options) noexcept
      : inside{period, options} {
    (void)inside.grants().text(std::span{granted}.first(granted.size() - 1)); // ends in the '\0' behind it
  }
};
struct rowe_parameter {
  using text = rowe::fixed_string<rowe::detail::parameter_text_bytes_max>;
  std::variant<rowe::parameter<bool>, rowe::parameter<std::int64_t>, rowe::parameter<double>,
               rowe::parameter<text>>
      inside;
  std::array<char, text::capacity() + 1> read{}; // the text that was read last
};
