// SPDX-License-Identifier: Apache-2.0
// An object whose members come from two hands: an envelope's own, and those of an object that somebody else
// writes, a codec or a user who knows nothing of the envelope. The other's object is written into the same
// room at once and then taken apart where it lies; most of it never moves.
#pragma once
#include <cstddef>
#include <string_view>

#include "json/writer.hpp"

namespace rowe::json {

// One value inside an object. Construct where a member could be written: behind begin_object() or behind a
// member. Then let one whole value be written into the same writer, as if nothing stood there yet, and end():
// the object is still open then, and more members may follow. Between the two the writer must not be reset
// and nothing else may be written.
//
// The room must hold the value as it is written, brackets and white space included, even where less is kept.
// Belongs to the thread of its writer; never waits, never allocates. Time is linear in the value only where
// it is not an object and must move.
class splice {
 public:
  ROWE_RT explicit splice(writer& into) noexcept;

  // The members of the value, when it is an object, become members of the object around it; there may be
  // none. Another value becomes one member with this name (plain characters that need no escape). White space
  // in and around the value, which may be a user's text, is tolerated. Nothing, when nothing was written.
  ROWE_RT void end(std::string_view name) noexcept;

 private:
  void merge(char* first, char* last) noexcept;
  void wrap(std::string_view name) noexcept;

  writer& into_;
  std::size_t from_;     // where the value begins, as bytes()
  bool members_precede_; // else the value stands in place of the bracket that opened the object
};

} // namespace rowe::json
