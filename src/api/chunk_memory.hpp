// SPDX-License-Identifier: Apache-2.0
// The memory of the chunks for long messages. All of it is mapped when the endpoint is opened, but a page
// takes no memory before it is used: also in a process that locks all its memory, before or behind that. For
// what has not been opened cannot be read or written, so mlockall() finds nothing there to bring in; and what
// is opened in such a process is locked page by page, as it is touched.
#pragma once
#include <cstddef>
#include <span>
#include <utility>

#include "service/base/chunk_store.hpp"

namespace rowe::detail {

class chunk_memory final : public service::pool_opener {
 public:
  chunk_memory() noexcept = default;
  // Maps so many bytes. Set-up. On failure it is empty, and map_errno() says why.
  explicit chunk_memory(std::size_t bytes) noexcept;
  chunk_memory(chunk_memory&& other) noexcept
      : bytes_{std::exchange(other.bytes_, {})}, open_{other.open_}, map_errno_{other.map_errno_} {}
  chunk_memory& operator=(chunk_memory&&) = delete;
  ~chunk_memory();

  std::span<std::byte> bytes() const noexcept { return bytes_; }
  int map_errno() const noexcept { return map_errno_; }

  // Service thread.
  bool open(std::size_t bytes) noexcept override;

 private:
  std::span<std::byte> bytes_{};
  std::size_t open_ = 0;
  int map_errno_ = 0;
};

} // namespace rowe::detail
