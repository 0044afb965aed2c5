// SPDX-License-Identifier: Apache-2.0
// Structs to JSON text, to CBOR, or to the messages of ROS 1. A schema (rowe/schema.hpp) is flattened once,
// at set-up, into a program: literals such as `,"pose":{"position":{"x":` glued together, and one step for
// each number with its offset in the struct. Encoding then copies literals and writes numbers; it does not
// look at names, nesting or accessors. Compiled when a topic or service is set up, used on the service
// thread.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include <rowe/result.hpp>
#include <rowe/schema.hpp>

#include "json/writing/writer.hpp"

namespace rowe::json {

// What an encoder writes. The program and its steps are the same; literals differ, and what writes a value.
enum class encoding : std::uint8_t {
  json,
  sec_nsec, // JSON with times as Foxglove reads them (times.hpp)
  cbor,     // as rosbridge: arrays of numbers are typed arrays (RFC 8746), those of bytes byte strings
  ros1,     // little-endian, without names; only types that ROS has: no optionals, no arrays within arrays
};

class encoder {
 public:
  // How deep objects, arrays and optionals may nest in a schema.
  static constexpr std::size_t depth_max = 32;
  static constexpr std::size_t bytes_limit = std::size_t{1} << 31;

  // Flattens `schema`; the encoder keeps only its functions. Allocates; for set-up. Errors: bad_argument if
  // it nests deeper than depth_max, the struct or its text can be longer than bytes_limit, or the encoding
  // has no such type; no_memory.
  [[nodiscard]] static result<encoder> compile(const schema_description& schema,
                                               encoding into = encoding::json);

  encoder(encoder&&) noexcept;
  encoder& operator=(encoder&&) noexcept;
  ~encoder();

  // Writes `*object`, an object of the type that the schema describes, as one JSON value (the writer places
  // the comma). Never waits, never allocates; the steps are bounded by the schema. If it does not fit,
  // into.overflowed() is true. Numbers that are not finite are written as null, and counted in
  // into.nonfinite(); CBOR and ROS have them. A value of an enum that has no name is written as its number
  // where names are asked for, in ROS as the text of it. What is not JSON is appended, and no comma placed.
  ROWE_RT void encode(const void* object, writer& into) const noexcept;

  // No object's text is longer.
  std::size_t bytes_max() const noexcept { return bytes_max_; }

 private:
  friend class encoder_pieces;
  struct step;
  struct name;
  class compiler;
  class run;
  template <encoding Into>
  class binary_run;

  encoder() noexcept;
  void encode_binary(const void* object, writer& into) const noexcept;

  std::unique_ptr<step[]> program_;
  std::size_t step_count_ = 0;
  std::unique_ptr<name[]> names_;
  std::unique_ptr<char[]> literals_;
  std::size_t bytes_max_ = 0;
  encoding into_ = encoding::json;
};

constexpr bool is_text(encoding of) noexcept { return of <= encoding::sec_nsec; }

// The encoders of a type for other encodings than its JSON. Each may be missing: ROS 1 has not every type,
// and not every type holds a time.
struct other_encoders {
  std::optional<encoder> sec_nsec;
  std::optional<encoder> cbor;
  std::optional<encoder> ros1;
  const encoder* json = nullptr;
};

} // namespace rowe::json
