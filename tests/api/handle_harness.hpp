// SPDX-License-Identifier: Apache-2.0
// One queue pair with its handle, built as set-up builds it, and this thread in the service thread's place:
// so every state of a handle can be brought about at will, without a core.
#pragma once
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <rowe/detail/pair_request.hpp>
#include <rowe/schema.hpp>

#include "api/pair_memory.hpp"

struct question {
  double a, b;
};
struct sum {
  double value;
};
template <>
inline constexpr auto rowe::schema<question> = rowe::fields<&question::a, &question::b>{};
template <>
inline constexpr auto rowe::schema<sum> = rowe::fields<&sum::value>{};

namespace handle_harness {

using namespace std::chrono_literals;
using namespace rowe;

inline constexpr time_point now{1000s};

class pair_harness {
 public:
  explicit pair_harness(const detail::pair_request& asked)
      : bytes_{detail::pair_bytes(asked)}, pair_{std::make_unique<detail::queue_pair>()} {
    pair_->memory = {static_cast<std::byte*>(::operator new(bytes_, alignment)), bytes_};
    detail::build_pair(*pair_, asked, generations);
  }
  pair_harness(const pair_harness&) = delete;
  pair_harness& operator=(const pair_harness&) = delete;
  ~pair_harness() { ::operator delete(pair_->memory.data(), alignment); }

  detail::queue_pair& operator*() { return *pair_; }
  detail::queue_pair* operator->() { return pair_.get(); }
  detail::pair_handle handle() { return {nullptr, *pair_}; }
  void close() { pair_->audience.close(); }

  // What the handle sent, oldest first, as the service thread takes it.
  struct sent_message {
    detail::value_header header;
    std::string text;
  };
  std::optional<sent_message> take() {
    auto& end = pair_->service.out;
    const auto slot = end.ring->try_pop();
    if (!slot) return std::nullopt;
    const auto& header = *end.memory.header(*slot);
    sent_message taken{header, {reinterpret_cast<const char*>(end.memory.value(*slot)), header.bytes}};
    end.free_ring->release(*slot);
    return taken;
  }

  // What the service thread puts there. False: no slot is free.
  template <class T>
  bool arrive_value(detail::value_header header, const T& value) {
    return fill(pair_->service.in, header, &value, sizeof value);
  }
  bool arrive(detail::value_header header, std::string_view text) {
    return fill(pair_->service.in, header, text.data(), text.size());
  }
  template <class T>
  bool end_with(detail::call_ref own, const T& value) {
    return fill(pair_->service.completions, ok(own), &value, sizeof value);
  }
  bool end(detail::call_ref own, std::string_view text) {
    return fill(pair_->service.completions, ok(own), text.data(), text.size());
  }
  bool fail(detail::call_ref own, const error& why, std::string_view diagnostic = {}) {
    detail::value_header header = ok(own);
    header.failed = true;
    header.outcome = why.code;
    header.outcome_value = why.value;
    header.outcome_limit = why.limit;
    return fill(pair_->service.completions, header, diagnostic.data(), diagnostic.size());
  }

  std::vector<rt::std_atomics::variable<std::uint32_t>> generations =
      std::vector<rt::std_atomics::variable<std::uint32_t>>(4);

 private:
  static constexpr std::align_val_t alignment{rt::line_bytes};

  static detail::value_header ok(detail::call_ref own) {
    detail::value_header header;
    header.stamped_ns = rt::nanoseconds_of(now);
    header.what = detail::entry::completion;
    header.own = own;
    return header;
  }
  static bool fill(detail::producer_end& end, detail::value_header header, const void* value,
                   std::size_t bytes) {
    const auto slot = end.free_ring->try_take();
    if (!slot) return false;
    header.bytes = static_cast<std::uint32_t>(bytes);
    *end.memory.header(*slot) = header;
    if (bytes != 0) std::memcpy(end.memory.value(*slot), value, bytes);
    EXPECT_TRUE(end.ring->try_push(*slot));
    return true;
  }

  std::size_t bytes_;
  std::unique_ptr<detail::queue_pair> pair_;
};

// A service thread that takes one thing and answers it: `answer(sent)`, of which whoever waits is told.
template <class Answer>
std::thread serve_one(pair_harness& on, Answer answer) {
  return std::thread{[&on, answer] {
    auto sent = on.take();
    while (!sent) sent = on.take();
    answer(*sent);
    on->arrival.notify();
  }};
}

// Headers of what arrives.
inline detail::value_header message_from(detail::peer_ref from, time_point expires = rt::never) {
  detail::value_header header;
  header.stamped_ns = rt::nanoseconds_of(now);
  header.expires_ns = rt::nanoseconds_of(expires);
  header.peer = from;
  return header;
}
inline detail::value_header call_from(detail::peer_ref from, detail::call_ref call,
                                      time_point expires = rt::never) {
  detail::value_header header = message_from(from, expires);
  header.what = detail::entry::invocation;
  header.call = call;
  return header;
}

} // namespace handle_harness
