// SPDX-License-Identifier: Apache-2.0
// Keys for a client's frames (RFC 6455 5.3), which must be unpredictable. They are fetched a thousand at a
// time, by one system call. Service thread only.
#pragma once
#include <cstddef>
#include <cstring>
#include <span>

#include <rowe/rt/arena.hpp>

#include "service/base/service_limits.hpp"
#include "service/threads/core_options.hpp"

namespace rowe::service {

class mask_keys {
 public:
  static std::size_t footprint_bytes() noexcept { return rt::arena::bytes_for(mask_buffer_bytes); }
  mask_keys(rt::arena& memory, entropy& random) noexcept
      : random_{random}, keys_{memory.carve_bytes(mask_buffer_bytes)}, used_{mask_buffer_bytes} {}

  wire::mask_key next() noexcept {
    wire::mask_key key;
    if (used_ + key.size() > keys_.size()) {
      random_.fill(keys_);
      used_ = 0;
    }
    std::memcpy(key.data(), keys_.data() + used_, key.size());
    used_ += key.size();
    return key;
  }

 private:
  entropy& random_;
  std::span<std::byte> keys_;
  std::size_t used_;
};

} // namespace rowe::service
