// SPDX-License-Identifier: Apache-2.0
// The buffer of the stop for one connection. It has complete frames, which are written after control frames
// and before messages. A full endpoint cannot fill it; only a peer that does not read can. If several states
// wait, only the newest stays. Service thread only.
#pragma once
#include <array>
#include <cstddef>
#include <cstring>
#include <span>

#include "service/base/service_limits.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::service {

class stop_frames {
 public:
  static constexpr std::size_t capacity_bytes = stop_buffer_bytes;

  // The bytes that are left to write, oldest first.
  std::span<const std::byte> rest() const noexcept { return {bytes_.data() + written_, size_ - written_}; }
  // Whether a socket may have the beginning of the first frame: then nothing may come before rest().
  bool begun() const noexcept { return begun_; }
  void advance(std::size_t taken) noexcept {
    written_ += taken;
    begun_ = taken > 0 || begun_;
    if (written_ == size_) clear();
  }
  void clear() noexcept {
    written_ = size_ = state_bytes_ = 0;
    begun_ = false;
  }

  // Adds the frame of an answer, masked if there is a key. False: there is no space for it.
  bool add_answer(std::span<const char> text, const wire::mask_key* key,
                  wire::opcode what = wire::opcode::text) noexcept {
    if (frame_bytes(text, key) > bytes_.size() - (size_ - written_)) drop_state(); // the answer matters more
    return place(text, key, what);
  }
  // Adds the state. It replaces an older one of which nothing was written.
  bool add_state(std::span<const char> text, const wire::mask_key* key,
                 wire::opcode what = wire::opcode::text) noexcept {
    drop_state();
    if (!place(text, key, what)) return false;
    state_bytes_ = frame_bytes(text, key);
    state_at_ = size_ - state_bytes_;
    return true;
  }

 private:
  static std::size_t frame_bytes(std::span<const char> text, const wire::mask_key* key) noexcept {
    return wire::frame_header_bytes(text.size(), key != nullptr ? wire::role::client : wire::role::server) +
           text.size();
  }

  void drop_state() noexcept {
    if (state_bytes_ == 0 || state_at_ < written_) return;
    const std::size_t behind = state_at_ + state_bytes_;
    std::memmove(bytes_.data() + state_at_, bytes_.data() + behind, size_ - behind);
    size_ -= state_bytes_;
    state_bytes_ = 0;
    if (written_ == size_) clear();
  }

  bool place(std::span<const char> text, const wire::mask_key* key, wire::opcode what) noexcept {
    const std::size_t needed = frame_bytes(text, key);
    if (needed > bytes_.size() - size_ && written_ != 0) {
      std::memmove(bytes_.data(), bytes_.data() + written_, size_ - written_);
      if (state_at_ < written_) state_bytes_ = 0; // it is the frame that was begun
      state_at_ -= state_at_ < written_ ? state_at_ : written_;
      size_ -= written_;
      written_ = 0;
    }
    if (needed > bytes_.size() - size_) return false;
    std::byte* const at = bytes_.data() + size_;
    const auto payload = std::as_bytes(text);
    if (key != nullptr) {
      const std::size_t header = wire::write_frame_header(at, what, payload.size(), *key);
      wire::mask_copy({at + header, payload.size()}, payload, *key);
    } else {
      const std::size_t header = wire::write_frame_header(at, what, payload.size());
      std::memcpy(at + header, payload.data(), payload.size());
    }
    size_ += needed;
    return true;
  }

  std::array<std::byte, capacity_bytes> bytes_;
  std::size_t written_ = 0;
  std::size_t size_ = 0;
  std::size_t state_at_ = 0; // the newest state, as long as no byte of it was written
  std::size_t state_bytes_ = 0;
  bool begun_ = false;
};

} // namespace rowe::service
