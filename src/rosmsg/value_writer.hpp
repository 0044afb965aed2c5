// SPDX-License-Identifier: Apache-2.0
// Writes single values of JSON, and arrays of bytes, into a message: what has no members inside. It steps
// through text that is known to be JSON (json/reading/cursor.hpp).
#pragma once
#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

#include "rosmsg/definition.hpp"
#include "rosmsg/failure.hpp"
#include "rosmsg/wanted.hpp"
#include "rosmsg/wire_writer.hpp"
#include "json/reading/cursor.hpp"

namespace rowe::rosmsg {

class value_writer {
 protected:
  value_writer(ros_version version, ros_encoding in, std::string_view text, output& to, failure& why) noexcept
      : wire_{in, to}, end_{text.data() + text.size()}, why_{why}, version_{version} {}

  // Each writes the value at `at`, which becomes what is behind it.
  bool value(const member& m, const char*& at); // of any kind but an object
  bool base64(const member& m, const char*& at);
  // What the JSON leaves out: zeros, or `count` of them.
  bool zero(const member& m, std::uint32_t count);

  // ---- errors

  bool wrong(errc code, const std::string& wanted, const char* at) {
    return why_.set({code}, "must be " + wanted + "; it is " + found_at(at, end_));
  }
  bool wrong(errc code, const member& m, const char* at) { return wrong(code, wanted_one(m), at); }
  bool too_long(const std::string& wanted, std::size_t count, std::size_t limit) {
    const error code{errc::too_long, static_cast<std::int64_t>(count), static_cast<std::int64_t>(limit)};
    return why_.set(code, "must be " + wanted + "; it has " + std::to_string(count));
  }
  bool twice(std::string_view name) {
    (void)why_.set({errc::duplicate_member}, "occurs twice");
    return why_.in(name);
  }
  bool fits(bool written) { return written || too_big(); }

  // ---- steps in the text

  // Takes the name at `at`, a quote, and moves `at` to its value; `end_` if there is none.
  std::string_view take_name(const char*& at) const noexcept {
    const char* const begin = at + 1;
    const char* const quote = json::find_quote(begin, end_);
    at = quote == end_ ? end_ : json::skip_space(quote + 1, end_);
    if (at != end_ && *at == ':') at = json::skip_space(at + 1, end_);
    return json::between(begin, quote);
  }
  // From behind a value to the next name or element. False: there is none, and `at` is the bracket.
  bool next(const char*& at) const noexcept {
    at = json::skip_space(at, end_);
    if (at == end_ || *at != ',') return false;
    at = json::skip_space(at + 1, end_);
    return at != end_;
  }
  const char* behind(const char* at, std::ptrdiff_t bytes) const noexcept {
    return at + std::min(bytes, end_ - at);
  }

  wire_writer wire_;
  const char* end_; // of the text, or of the default that is written
  failure& why_;
  bool is_default_ = false;

 private:
  bool too_big();
  bool boolean(const member& m, const char*& at);
  template <class T>
  bool whole(const member& m, const char*& at);
  template <class T>
  bool real(const member& m, const char*& at);
  bool take_string(const member& m, const char*& at, std::string_view& into);
  bool text(const member& m, const char*& at);
  bool wide_text(const member& m, const char*& at);
  bool time(const member& m, const char*& at);
  bool part_of_time(std::string_view name, kind what, const char* at);

  const ros_version version_;
};

} // namespace rowe::rosmsg
