// SPDX-License-Identifier: Apache-2.0
// The length of a chunk stands in front of it, so the text is read twice: first it is measured.
#include "wire/rosbridge/png.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "json/text/digits.hpp"
#include "json/text/utf8.hpp"

namespace rowe::wire {
namespace {

constexpr std::size_t pixel_bytes = 3;
constexpr std::size_t stored_bytes_max = 65535; // of one block

// ---- check sums

constexpr auto crc_tables = [] { // for four bytes at once
  std::array<std::array<std::uint32_t, 256>, 4> all{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t crc = i;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xedb88320U : 0U);
    all[0][i] = crc;
  }
  for (std::size_t t = 1; t < all.size(); ++t) {
    for (std::size_t i = 0; i < 256; ++i) all[t][i] = (all[t - 1][i] >> 8) ^ all[0][all[t - 1][i] & 0xff];
  }
  return all;
}();

std::uint32_t crc_of(std::uint32_t crc, std::span<const std::uint8_t> bytes) noexcept {
  std::size_t i = 0;
  for (; i + 4 <= bytes.size(); i += 4) {
    crc ^= bytes[i] | std::uint32_t{bytes[i + 1]} << 8 | std::uint32_t{bytes[i + 2]} << 16 |
           std::uint32_t{bytes[i + 3]} << 24;
    crc = crc_tables[3][crc & 0xff] ^ crc_tables[2][crc >> 8 & 0xff] ^ crc_tables[1][crc >> 16 & 0xff] ^
          crc_tables[0][crc >> 24];
  }
  for (; i < bytes.size(); ++i) crc = (crc >> 8) ^ crc_tables[0][(crc ^ bytes[i]) & 0xff];
  return crc;
}

class adler {
 public:
  void add(std::span<const std::uint8_t> bytes) noexcept { // at most 5552 bytes without overflow
    for (const std::uint8_t byte : bytes) b_ += a_ += byte;
    a_ %= 65521;
    b_ %= 65521;
  }
  std::uint32_t sum() const noexcept { return b_ << 16 | a_; }

 private:
  std::uint32_t a_ = 1, b_ = 0;
};

// ---- the text

// Calls `take` with pieces of ASCII.
template <class Take>
void for_each_ascii(std::span<const std::string_view> pieces, Take take) noexcept {
  for (const std::string_view piece : pieces) {
    const char* at = piece.data();
    const char* const end = at + piece.size();
    while (at != end) {
      const char* const plain =
          std::find_if(at, end, [](char c) { return static_cast<std::uint8_t>(c) > 0x7f; });
      if (plain != at) take(std::string_view{at, static_cast<std::size_t>(plain - at)});
      at = plain;
      if (at == end) break;
      const json::utf8_piece character = json::next_utf8(at, end);
      const auto bits = [&](std::size_t i) { return static_cast<std::uint32_t>(at[i] & 0x3f); };
      std::uint32_t code = 0xfffd;
      if (character.valid) {
        const auto lead = static_cast<std::uint8_t>(*at);
        code = character.bytes == 2   ? (lead & 0x1fU) << 6 | bits(1)
               : character.bytes == 3 ? (lead & 0x0fU) << 12 | bits(1) << 6 | bits(2)
                                      : (lead & 0x07U) << 18 | bits(1) << 12 | bits(2) << 6 | bits(3);
      }
      at += character.bytes;
      const auto unit = [&](std::uint32_t x) {
        const std::array<char, 6> escape{'\\',
                                         'u',
                                         json::hex_digits[x >> 12],
                                         json::hex_digits[x >> 8 & 15],
                                         json::hex_digits[x >> 4 & 15],
                                         json::hex_digits[x & 15]};
        take(std::string_view{escape.data(), escape.size()});
      };
      if (code > 0xffff) {
        unit(0xd800 + ((code - 0x10000) >> 10));
        unit(0xdc00 + ((code - 0x10000) & 0x3ff));
      } else {
        unit(code);
      }
    }
  }
}

// ---- the stream

// Gathers bytes, and passes them on as base64.
class png_stream {
 public:
  explicit png_stream(json::writer& out) noexcept : out_{out} {}

  void raw(std::uint8_t byte) noexcept {
    if (used_ == buffer_.size()) flush();
    buffer_[used_++] = byte;
  }
  void word(std::uint32_t x) noexcept {
    for (int shift = 24; shift >= 0; shift -= 8) raw(static_cast<std::uint8_t>(x >> shift));
  }
  // What follows counts for the check sum of the chunk, up to its end.
  void begin_chunk(std::uint32_t bytes, std::string_view type) noexcept {
    word(bytes);
    settle();
    crc_ = 0xffffffffU;
    for (const char c : type) raw(static_cast<std::uint8_t>(c));
  }
  void end_chunk() noexcept {
    settle();
    word(~crc_);
    summed_ = used_;
  }
  // The data of a picture, as it is compressed: for the other check sum as well.
  void data(std::string_view bytes) noexcept {
    while (!bytes.empty()) {
      if (used_ == buffer_.size()) flush();
      const std::size_t n = std::min(bytes.size(), buffer_.size() - used_);
      std::copy_n(bytes.begin(), n, buffer_.begin() + static_cast<std::ptrdiff_t>(used_));
      adler_.add(std::span{buffer_}.subspan(used_, n));
      used_ += n;
      bytes.remove_prefix(n);
    }
  }
  std::uint32_t data_sum() const noexcept { return adler_.sum(); }

  void end() noexcept {
    flush();
    if (used_ == 0) return;
    std::array<std::uint8_t, 3> last{};
    std::copy_n(buffer_.begin(), used_, last.begin());
    std::array<char, 4> text = encoded(last.data());
    std::fill(text.begin() + static_cast<std::ptrdiff_t>(used_) + 1, text.end(), '=');
    out_.append({text.data(), text.size()});
  }

 private:
  static constexpr std::string_view alphabet =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  static std::array<char, 4> encoded(const std::uint8_t* of) noexcept {
    const std::uint32_t bits = std::uint32_t{of[0]} << 16 | std::uint32_t{of[1]} << 8 | of[2];
    return {alphabet[bits >> 18], alphabet[bits >> 12 & 63], alphabet[bits >> 6 & 63], alphabet[bits & 63]};
  }
  // Adds to the chunk's check sum what was gathered since the last time.
  void settle() noexcept {
    crc_ = crc_of(crc_, std::span{buffer_}.subspan(summed_, used_ - summed_));
    summed_ = used_;
  }
  // Whole threes go on; the rest stays.
  void flush() noexcept {
    settle();
    const std::size_t whole = used_ / 3 * 3;
    std::array<char, bytes_max / 3 * 4> text;
    char* to = text.data();
    for (std::size_t i = 0; i < whole; i += 3) {
      const auto four = encoded(&buffer_[i]);
      to = std::copy(four.begin(), four.end(), to);
    }
    out_.append({text.data(), static_cast<std::size_t>(to - text.data())});
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(whole),
              buffer_.begin() + static_cast<std::ptrdiff_t>(used_), buffer_.begin());
    used_ -= whole;
    summed_ = used_;
  }

  static constexpr std::size_t bytes_max = 1536;
  json::writer& out_;
  std::array<std::uint8_t, bytes_max> buffer_;
  std::size_t used_ = 0;
  std::size_t summed_ = 0;
  std::uint32_t crc_ = 0;
  adler adler_;
};

// Rows of a picture, cut into blocks that are stored: neither knows where the other ends.
class picture {
 public:
  picture(png_stream& to, std::size_t text_bytes) noexcept : to_{to} {
    const double pixels = static_cast<double>(text_bytes) / pixel_bytes;
    width_ = std::max<std::size_t>(1, static_cast<std::size_t>(std::sqrt(pixels)));
    height_ = std::max<std::size_t>(1, (text_bytes + width_ * pixel_bytes - 1) / (width_ * pixel_bytes));
    padding_ = width_ * height_ * pixel_bytes - text_bytes;
    left_ = height_ * (1 + width_ * pixel_bytes);
  }
  std::uint32_t width() const noexcept { return static_cast<std::uint32_t>(width_); }
  std::uint32_t height() const noexcept { return static_cast<std::uint32_t>(height_); }
  std::uint32_t compressed_bytes() const noexcept {
    const std::size_t blocks = (left_ + stored_bytes_max - 1) / stored_bytes_max;
    return static_cast<std::uint32_t>(2 + 5 * blocks + left_ + 4);
  }

  void begin() noexcept {
    to_.raw(0x78); // zlib, nothing compressed
    to_.raw(0x01);
  }
  void add(std::string_view text) noexcept {
    while (!text.empty()) {
      if (in_row_ == 0) {
        put(std::string_view{"\0", 1}); // a row that is not filtered
        in_row_ = width_ * pixel_bytes;
      }
      const std::size_t n = std::min(text.size(), in_row_);
      put(text.substr(0, n));
      in_row_ -= n;
      text.remove_prefix(n);
    }
  }
  void end() noexcept {
    for (; padding_ != 0; --padding_) add("\n");
    to_.word(to_.data_sum());
  }

 private:
  void put(std::string_view bytes) noexcept {
    while (!bytes.empty()) {
      if (in_block_ == 0) {
        in_block_ = std::min(left_, stored_bytes_max);
        left_ -= in_block_;
        const auto n = static_cast<std::uint16_t>(in_block_);
        to_.raw(left_ == 0 ? 1 : 0); // the last one
        for (const unsigned x : {unsigned{n}, ~unsigned{n}}) {
          to_.raw(static_cast<std::uint8_t>(x));
          to_.raw(static_cast<std::uint8_t>(x >> 8));
        }
      }
      const std::size_t now = std::min(bytes.size(), in_block_);
      to_.data(bytes.substr(0, now));
      in_block_ -= now;
      bytes.remove_prefix(now);
    }
  }

  png_stream& to_;
  std::size_t width_ = 0;
  std::size_t height_ = 0;
  std::size_t padding_ = 0;
  std::size_t left_ = 0;     // bytes that belong to no block yet
  std::size_t in_row_ = 0;   // that the row still has
  std::size_t in_block_ = 0; // likewise
};

} // namespace

void write_png(json::writer& out, std::span<const std::string_view> pieces) noexcept {
  std::size_t bytes = 0;
  for_each_ascii(pieces, [&](std::string_view ascii) { bytes += ascii.size(); });
  png_stream to{out};
  picture rows{to, bytes};
  to.word(0x89504e47); // the signature
  to.word(0x0d0a1a0a);
  to.begin_chunk(13, "IHDR");
  to.word(rows.width());
  to.word(rows.height());
  constexpr std::array<std::uint8_t, 5> form{8, 2, 0, 0, 0}; // 8 bits, RGB, the only methods, no interlace
  for (const std::uint8_t what : form) to.raw(what);
  to.end_chunk();
  to.begin_chunk(rows.compressed_bytes(), "IDAT");
  rows.begin();
  for_each_ascii(pieces, [&](std::string_view ascii) { rows.add(ascii); });
  rows.end();
  to.end_chunk();
  to.begin_chunk(0, "IEND");
  to.end_chunk();
  to.end();
}

} // namespace rowe::wire
