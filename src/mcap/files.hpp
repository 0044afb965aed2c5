// SPDX-License-Identifier: Apache-2.0
// Files as sinks and sources of recordings. Their calls wait for the disk.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "mcap/sink.hpp"

namespace rowe::mcap {

class descriptor {
 public:
  explicit descriptor(int number = -1) noexcept : number_{number} {}
  descriptor(descriptor&& from) noexcept : number_{std::exchange(from.number_, -1)} {}
  descriptor& operator=(descriptor&& from) noexcept {
    std::swap(number_, from.number_);
    return *this;
  }
  ~descriptor();
  int number() const noexcept { return number_; }
  explicit operator bool() const noexcept { return number_ >= 0; }

 private:
  int number_;
};

class file_sink final : public sink {
 public:
  enum class access : std::uint8_t { create, replace, extend }; // a new file; an old or new one; an old one
  // False: error() says why, as errno.
  bool open(const std::string& path, access how);
  bool write(std::string_view bytes) override;
  // Waits until what was written lies on the disk.
  bool sync();
  // Cuts it off there; what is written from now on stands behind.
  bool truncate(std::uint64_t bytes);
  // `waits`: until it lies on the disk.
  bool close(bool waits = true);
  int error() const noexcept { return error_; } // the first one; 0: none
  std::string why() const;                      // in words

 private:
  bool check(bool done);

  descriptor file_;
  int error_ = 0;
};

class file_source final : public source {
 public:
  bool open(const std::string& path);
  std::uint64_t bytes() const override { return bytes_; }
  bool read(std::uint64_t at, std::span<char> into) override;
  std::string why() const;

 private:
  descriptor file_;
  std::uint64_t bytes_ = 0;
  int error_ = 0;
};

} // namespace rowe::mcap
