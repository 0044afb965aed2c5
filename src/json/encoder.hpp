// SPDX-License-Identifier: Apache-2.0
// Structs to JSON text. A schema (rowe/schema.hpp) is flattened once, at set-up, into a program: literals
// such as `,"pose":{"position":{"x":` glued together, and one step for each number with its offset in the
// struct. Encoding then copies literals and writes numbers; it does not look at names, nesting or accessors.
// Compiled when a topic or service is set up, used on the service thread.
#pragma once
#include <cstddef>
#include <memory>

#include <rowe/result.hpp>
#include <rowe/schema.hpp>

#include "writer.hpp"

namespace rowe::json {

class encoder {
 public:
  // How deep objects, arrays and optionals may nest in a schema.
  static constexpr std::size_t depth_max = 32;
  static constexpr std::size_t bytes_limit = std::size_t{1} << 31;

  // Flattens `schema`; the encoder keeps only its functions. Allocates; for set-up. Errors: bad_argument if
  // it nests deeper than depth_max, or the struct or its text can be longer than bytes_limit; no_memory.
  [[nodiscard]] static result<encoder> compile(const schema_description& schema);

  encoder(encoder&&) noexcept;
  encoder& operator=(encoder&&) noexcept;
  ~encoder();

  // Writes `*object`, an object of the type that the schema describes, as one JSON value (the writer places
  // the comma). Never waits, never allocates; the steps are bounded by the schema. If it does not fit,
  // into.overflowed() is true. Numbers that are not finite are written as null, and counted in
  // into.nonfinite().
  ROWE_RT void encode(const void* object, writer& into) const noexcept;

  // No object's text is longer.
  std::size_t bytes_max() const noexcept { return bytes_max_; }

 private:
  struct step;
  class compiler;
  class run;

  encoder() noexcept;
  std::unique_ptr<step[]> program_;
  std::size_t step_count_ = 0;
  std::unique_ptr<char[]> literals_;
  std::size_t bytes_max_ = 0;
};

} // namespace rowe::json
