// SPDX-License-Identifier: Apache-2.0
// Structs to JSON text. A schema (rowe/schema.hpp) is flattened once, at set-up, into a program: literals
// such as
// `,"pose":{"position":{"x":` glued together, and one step for each number with its offset in the struct.
// Encoding then is copying literals and writing numbers, with no look at names, nesting or accessors.
// Compiled where a topic or service is set up, used on the service thread.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include <rowe/result.hpp>
#include <rowe/schema.hpp>

#include "writer.hpp"

namespace rowe::json {

class encoder {
 public:
  // Schemas within schemas, arrays within arrays: how deep they may nest. Also the depth of the text.
  static constexpr std::size_t depth_max = 32;

  // Out of line (encoder.cpp): only there `step` is complete.
  encoder(encoder&&) noexcept;
  encoder& operator=(encoder&&) noexcept;
  ~encoder();

  // Flattens `schema`, which must outlive nothing: the encoder keeps no pointer to it but to its functions,
  // which are static. Allocates; for set-up. bad_argument when the schema nests deeper than depth_max or its
  // text could exceed 4 GiB; no_memory.
  [[nodiscard]] static result<encoder> compile(const schema_description& schema);

  // Writes `*object`, an object of the type that the schema describes, as one JSON value (the writer places
  // the comma). Never waits, never allocates; the steps are bounded by the schema. When it does not fit,
  // into.overflowed().
  ROWE_RT void encode(const void* object, writer& into) const noexcept;

  // No object's text is longer.
  std::size_t bytes_max() const noexcept { return bytes_max_; }

 private:
  struct step;
  class compiler;
  class run;

  encoder() noexcept;

  std::vector<step> program_;
  std::vector<char> literals_;
  std::size_t bytes_max_ = 0;
};

} // namespace rowe::json
