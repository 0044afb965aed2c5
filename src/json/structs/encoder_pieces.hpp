// SPDX-License-Identifier: Apache-2.0
// Encodes one object in pieces: the text that encoder::encode() writes, some of it at a time, so that a long
// one costs no thread a long piece of work. It keeps its place in the program and in the object, which must
// not change meanwhile. Slower than encode() by what it takes to keep that place.
//
// Service thread only. Nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "json/structs/encoder.hpp"
#include "json/writing/writer.hpp"

namespace rowe::json {

class encoder_pieces {
 public:
  // Begins with an object of the type of this encoder, which writes JSON. Both must outlive the last write().
  void begin(const encoder& program, const void* object) noexcept;
  // Writes the next bytes of the text, as many as fit. True: the text ends here. NaN and infinities are
  // written as null, and counted in into.nonfinite(). A text that is no UTF-8 may get more of the characters
  // U+FFFD than by encode().
  bool write(writer& into) noexcept;

 private:
  // The steps of the program, or of the body of an array's elements.
  struct frame {
    const encoder::step* first;
    const encoder::step* last;
    const encoder::step* next;
    const char* base;
    std::size_t left;     // elements behind this one
    std::uint32_t stride; // from one to the next
  };
  enum class leaf : std::uint8_t { none, text, scalars, base64 };

  bool flush(writer& into) noexcept;
  void go_on_with_leaf() noexcept;
  void begin_value(const encoder::step& s, const char* base) noexcept;
  void push(const encoder::step& s, const char* base, std::size_t count, std::uint32_t stride) noexcept;

  const encoder* program_ = nullptr;
  std::array<frame, encoder::depth_max + 1> frames_;
  std::size_t depth_ = 0;
  bool literal_written_ = false; // of the next step
  leaf leaf_ = leaf::none;       // a value that takes several pieces:
  const encoder::step* of_ = nullptr;
  const char* from_ = nullptr; // its rest,
  std::size_t left_ = 0;       // so many bytes, or elements
  bool begun_ = false;         // some of it was written
  std::string_view pending_;   // what is written next: a literal, or in scratch_
  std::array<char, 512> scratch_;
  char last_ = 0; // the last character so far
  std::uint64_t nonfinite_ = 0;
};

} // namespace rowe::json
