// SPDX-License-Identifier: Apache-2.0
// An object whose members come from two sources: the envelope's own members, and those of an object that
// somebody else writes, a codec or a user that does not know the envelope. That object is written into the
// same span, and then merged in place; most of it never moves.
#pragma once
#include <cstddef>
#include <string_view>

#include "json/writing/writer.hpp"

namespace rowe::json {

// One value inside an object. Construct it where a member could be written: behind begin_object() or behind a
// member. Then write one complete value into the same writer, as if it were empty, and call end(). The object
// is still open then, and more members may follow. In between, the writer must not be reset and nothing else
// may be written.
//
// The span must have space for the value as it is written, with brackets and white space, even if less
// remains. Belongs to the thread of its writer; never waits, never allocates. Time is linear in the value
// only where it is not an object and must move.
class splice {
 public:
  ROWE_RT explicit splice(writer& into) noexcept;

  // If the value is an object, its members become members of the outer object; there may be none. Another
  // value becomes one member with this name (plain characters that need no escape). White space in and around
  // the value, which may be a user's text, is allowed. If nothing was written, nothing is added.
  ROWE_RT void end(std::string_view name) noexcept;
  // Likewise, but an object, too, becomes one member with this name.
  ROWE_RT void end_apart(std::string_view name) noexcept;
  // What was written so far, of which nothing is known if it did not fit.
  ROWE_RT std::string_view value() const noexcept;

 private:
  void end(std::string_view name, bool merges) noexcept;
  void merge(char* first, char* last) noexcept;
  void wrap(std::string_view name) noexcept;

  writer& into_;
  std::size_t from_;     // where the value begins, as bytes()
  bool members_precede_; // else the value stands in place of the bracket that opened the object
};

} // namespace rowe::json
