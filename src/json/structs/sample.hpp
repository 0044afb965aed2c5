// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <new>

#include <rowe/schema.hpp>

namespace rowe::json {

// Memory with the size and alignment of the described type. At set-up, accessors are called with it to learn
// offsets. They only compute addresses; nothing is ever read from it.
class sample {
 public:
  explicit sample(const schema_description& schema) noexcept
      : alignment_{schema.alignment}, at_{::operator new(schema.bytes, alignment_, std::nothrow)} {}
  ~sample() { ::operator delete(at_, alignment_); }
  sample(const sample&) = delete;
  sample& operator=(const sample&) = delete;

  const char* at() const noexcept { return static_cast<const char*>(at_); }

 private:
  std::align_val_t alignment_;
  void* at_;
};

} // namespace rowe::json
