// SPDX-License-Identifier: Apache-2.0
// JSON values of C programs: trees on the heap, built by the program or from text that was validated. Numbers
// are stored as they are written, so that no digit is lost. One thread at a time, or many that read.
#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/result.hpp>
#include <rowe/rowe.h>

#include "json/reading/reader.hpp"

namespace rowe::capi {

// What a received object carries besides its JSON: from whom it is, and the call that it may be.
struct origin;
struct origin_delete {
  void operator()(origin* gone) const noexcept;
};

inline constexpr std::size_t object_depth_max = json::reader::depth_max_default;

} // namespace rowe::capi

struct rowe_object {
  using kind = rowe::json::kind;

  kind type = kind::null;
  bool truth = false;              // of a boolean
  std::size_t depth = 0;           // objects and arrays that are open in its innermost place
  std::string text;                // of a string: its bytes; of a number: its token
  std::vector<std::string> names;  // of an object's members, beside their values
  std::vector<rowe_object> values; // of an object or array
  std::unique_ptr<rowe::capi::origin, rowe::capi::origin_delete> from; // received objects only

  rowe_object() = default;
  explicit rowe_object(kind of) noexcept
      : type{of}, depth{of == kind::object || of == kind::array ? std::size_t{1} : std::size_t{0}} {}
  rowe_object(rowe_object&&) noexcept = default;
  rowe_object& operator=(rowe_object&&) noexcept = default;

  // The JSON alone.
  rowe_object copy() const;

  // The first member with this name; names.size() without one.
  std::size_t find(std::string_view name) const noexcept;

  // Puts a value last, as a member or, with an empty name, as an element. Errors: too_deep.
  rowe::status add(std::string_view name, rowe_object value);

  // Gives the member of this name the value, or adds it. Errors: too_deep.
  rowe::status set(std::string_view name, rowe_object value);
};

namespace rowe::capi {

// The tree of a text that was validated.
rowe_object tree_of(std::string_view validated);

// The text of a tree, without white space.
std::string text_of(const rowe_object& value);

} // namespace rowe::capi
