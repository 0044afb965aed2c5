// SPDX-License-Identifier: Apache-2.0
// The stream that one peer is sent, split into frames as it is written. It knows of each frame when its first
// byte was handed to the network, and where in the stream it ends. So from how many bytes a peer has read
// follows which frames it has read.
#pragma once
#include <algorithm>
#include <cstdint>
#include <deque>
#include <span>
#include <string>

#include <rowe/rt/clock.hpp>

#include "wire/websocket/websocket.hpp"

namespace sim {

struct written_frame {
  rowe::rt::time_point begun{};
  std::uint64_t end = 0; // of the stream
  unsigned first_byte = 0;
  std::string payload;

  bool whole_text() const { return first_byte == 0x81; }
  bool ping() const { return first_byte == 0x89; }
  bool close() const { return first_byte == 0x88; }
};

class stream {
 public:
  // What was written since the last call.
  void take(std::span<const std::byte> bytes, rowe::rt::time_point now) {
    while (!bytes.empty()) {
      if (header_bytes_ == 0) now_.begun = now;
      if (header_bytes_ < header_need_) {
        header_[header_bytes_++] = std::to_integer<unsigned char>(bytes[0]);
        bytes = bytes.subspan(1);
        ++end_;
        if (header_bytes_ == 2) header_need_ = 2 + length_bytes() + mask_bytes();
        if (header_bytes_ == header_need_) begin_payload();
      } else {
        const std::size_t part = std::min(bytes.size(), want_ - now_.payload.size());
        now_.payload.append(reinterpret_cast<const char*>(bytes.data()), part);
        bytes = bytes.subspan(part);
        end_ += part;
      }
      if (header_bytes_ == header_need_ && now_.payload.size() == want_) finish();
    }
  }

  std::uint64_t end() const { return end_; } // of what was taken
  bool mid_frame() const { return header_bytes_ != 0; }
  bool broken() const { return broken_; } // a frame that no peer may be sent

  std::deque<written_frame> complete;

 private:
  std::size_t length_bytes() const {
    const unsigned length = header_[1] & 127U;
    return length == 126 ? 2 : length == 127 ? 8 : 0;
  }
  std::size_t mask_bytes() const { return (header_[1] & 128U) != 0 ? 4 : 0; }

  void begin_payload() {
    want_ = header_[1] & 127U;
    if (const std::size_t bytes = length_bytes(); bytes != 0) {
      want_ = 0;
      for (std::size_t i = 2; i < 2 + bytes; ++i) want_ = want_ * 256 + header_[i];
    }
    now_.first_byte = header_[0];
    now_.payload.reserve(want_);
  }

  void finish() {
    const unsigned what = now_.first_byte;
    broken_ = broken_ || closed_ || (what != 0x81 && what != 0x88 && what != 0x89 && what != 0x8a);
    closed_ = closed_ || what == 0x88;
    if (mask_bytes() != 0) {
      const unsigned char* const key = header_ + header_need_ - 4;
      for (std::size_t i = 0; i < now_.payload.size(); ++i)
        now_.payload[i] = static_cast<char>(now_.payload[i] ^ key[i % 4]);
    }
    now_.end = end_;
    complete.push_back(std::move(now_));
    now_ = {};
    header_bytes_ = 0;
    header_need_ = 2;
    want_ = 0;
  }

  written_frame now_;
  unsigned char header_[14] = {};
  std::size_t header_bytes_ = 0;
  std::size_t header_need_ = 2;
  std::size_t want_ = 0;
  std::uint64_t end_ = 0;
  bool closed_ = false;
  bool broken_ = false;
};

} // namespace sim
