// SPDX-License-Identifier: Apache-2.0
// Writes records behind one another into a buffer that grows. Numbers are little-endian; lengths are written
// when what they count has ended.
#pragma once
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "mcap/format.hpp"

namespace rowe::mcap {

class record_writer {
 public:
  explicit record_writer(std::string& into) noexcept : into_{into} {}

  void begin(opcode what) {
    number(static_cast<std::uint8_t>(what));
    begin_ = into_.size();
    number(std::uint64_t{0});
  }
  void end() { patch(begin_, into_.size() - begin_ - sizeof(std::uint64_t)); }

  template <std::unsigned_integral T>
  void number(T value) {
    char bytes[sizeof(T)];
    put(bytes, value);
    into_.append(bytes, sizeof bytes);
  }
  void text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    into_.append(value);
  }
  void bytes(std::string_view value) { into_.append(value); }
  void time(const time_span& of) {
    number(of.empty() ? std::uint64_t{0} : of.earliest_ns);
    number(of.empty() ? std::uint64_t{0} : of.latest_ns);
  }
  // A list or map: a length, and then what `write_all` writes.
  template <class Write>
  void list(Write&& write_all) {
    const std::size_t at = into_.size();
    number(std::uint32_t{0});
    write_all();
    patch(at, static_cast<std::uint32_t>(into_.size() - at - sizeof(std::uint32_t)));
  }
  void map(const text_map& values) {
    list([&] {
      for (const auto& [name, value] : values) {
        text(name);
        text(value);
      }
    });
  }
  // Writes a number over one that was written at this place of the buffer.
  template <std::unsigned_integral T>
  void patch(std::size_t at, T value) noexcept {
    put(into_.data() + at, value);
  }

 private:
  template <std::unsigned_integral T>
  static void put(char* to, T value) noexcept {
    for (std::size_t i = 0; i < sizeof(T); ++i)
      to[i] = static_cast<char>(static_cast<unsigned char>(value >> (8 * i)));
  }
  std::string& into_;
  std::size_t begin_ = 0; // of the length of the record that is written
};

// ---- the records themselves, each with its head

void write(record_writer& into, const schema& one);
void write(record_writer& into, const channel& one);
void write(record_writer& into, const message& one);
void write(record_writer& into, const chunk_index& one);
void write(record_writer& into, const attachment_index& one);
void write(record_writer& into, const metadata_index& one);
void write(record_writer& into, const statistics& one, std::size_t schemas, std::size_t channels);
void write_header(record_writer& into, std::string_view profile, std::string_view program);
void write_metadata(record_writer& into, std::string_view name, const text_map& values);
void write_data_end(record_writer& into);

// The summary, the offsets of its groups, the footer and the magic at the end. `at` is where it begins in the
// file; `into` is empty.
void write_end(std::string& into, std::uint64_t at, const summary& all);

} // namespace rowe::mcap
