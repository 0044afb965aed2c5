// SPDX-License-Identifier: Apache-2.0
// What is said of a value that could not be read, and the reading by a schema, which says it in the same way.
#include <rowe/json_value.hpp>

#include <new>

#include "json/reading/cursor.hpp"
#include "json/structs/decoder.hpp"
#include "json/text/words.hpp"

namespace rowe {
namespace {

using detail::json_bounds;
using detail::json_form;
using detail::json_outcome;
using detail::json_place;

template <std::size_t N>
void assign(fixed_string<N>& to, std::string_view text) noexcept {
  (void)to.assign(json::utf8_prefix(text, N)); // fits: it was cut
}

constexpr std::size_t found_bytes_max = 48;

void add_wanted(json::words& to, const json_bounds& wanted) noexcept {
  switch (wanted.what) {
  case json_form::anything: to.add("a value"); break;
  case json_form::object: to.add("an object"); break;
  case json_form::array: to.add("an array"); break;
  case json_form::boolean: to.add("true or false"); break;
  case json_form::whole: to.add("a whole number from ").add(wanted.least).add(" to ").add(wanted.most); break;
  case json_form::number: to.add("a number"); break;
  case json_form::text:
    to.add("a string");
    if (wanted.most != 0) to.add(" of at most ").add(wanted.most).add(" bytes");
    break;
  case json_form::name:
    json::add_names(to, wanted.names.size(), found_bytes_max,
                    [&](std::size_t i) { return wanted.names[i].name; });
    break;
  case json_form::bytes:
    to.add("base64 of ").add(wanted.exact ? "" : "at most ").add(wanted.most);
    to.add(wanted.most == 1 ? " byte" : " bytes");
    break;
  case json_form::plain_text: to.add("a string without escapes"); break;
  }
}

// Shortened, and on one line: only between tokens JSON has line breaks.
void assign_found(json_error& e, std::string_view value) noexcept {
  std::array<char, found_bytes_max + 3> buffer;
  json::words found{buffer};
  const std::size_t bytes = found.add_shortened(value, found_bytes_max).text().size();
  std::replace_if(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(bytes), json::is_space, ' ');
  assign(e.found, {buffer.data(), bytes});
}

error reason_of(const json_place& at, std::string_view path, const json_bounds& wanted) noexcept {
  const auto count = static_cast<std::int64_t>(at.count);
  switch (at.is) {
  case json_outcome::missing: return {errc::missing_member, count};
  case json_outcome::out_of_range: return errc::out_of_range;
  case json_outcome::too_long: return {errc::too_long, count, static_cast<std::int64_t>(wanted.most)};
  case json_outcome::bad_path:
    return {errc::bad_argument, static_cast<std::int64_t>(at.path_bytes),
            static_cast<std::int64_t>(path.size())};
  case json_outcome::there:
  case json_outcome::wrong_type: break;
  }
  return errc::wrong_type;
}

bool ends_in_index(std::string_view path) noexcept {
  return path.size() > 2 && path.back() == ']' && path[path.size() - 2] != '\'' &&
         path[path.size() - 2] != '"';
}

} // namespace

namespace detail {

json_error json_access::failure(const json_place& at, std::string_view path,
                                const json_bounds& wanted) noexcept {
  json_error e;
  e.reason = reason_of(at, path, wanted);
  const bool is_bad_path = at.is == json_outcome::bad_path;
  const std::string_view led = is_bad_path ? path : path.substr(0, at.path_bytes);
  std::array<char, decltype(e.path)::capacity()> buffer;
  assign(e.path, json::words{buffer}.add_shortened(led, buffer.size() - 3).text());
  json::words words{buffer};
  if (is_bad_path) {
    words.add("NAME, .NAME, [INDEX] or ['NAME']");
  } else if (at.is == json_outcome::missing && at.path_bytes < path.size()) {
    add_wanted(words, {.what = path[at.path_bytes] == '[' ? json_form::array : json_form::object});
  } else {
    add_wanted(words, at.path_bytes < path.size() ? json_bounds{.what = at.next} : wanted);
  }
  assign(e.wanted, words.text());
  if (at.is != json_outcome::missing && !is_bad_path) assign_found(e, at.value);
  return e;
}

schema_decoder::schema_decoder(const schema_description& schema) noexcept
    : compiled_{nullptr}, why_{errc::misuse} {
  auto compiled = json::decoder::compile(schema);
  if (!compiled) {
    why_ = compiled.error();
    return;
  }
  compiled_ = new (std::nothrow) json::decoder{*std::move(compiled)};
  if (compiled_ == nullptr) why_ = {errc::no_memory, sizeof(json::decoder)};
}

std::optional<json_error> schema_decoder::decode(std::string_view validated, std::string_view path,
                                                 void* into) const noexcept {
  json_error e;
  if (compiled_ == nullptr) {
    if (why_.code != errc{}) e.reason = why_; // else it is all zeros: the constructor is still to run
    return e;
  }
  json::decoder::diagnosis why;
  const status read = static_cast<const json::decoder*>(compiled_)->decode(validated, into, &why);
  if (read) return std::nullopt;
  e.reason = read.error();
  if (read.code() == errc::not_an_object) e.reason = errc::wrong_type;

  std::array<char, decltype(e.path)::capacity()> inner, buffer;
  const std::string_view below = why.path(inner);
  json::words whole{buffer};
  whole.add_shortened(path, buffer.size() - 3);
  if (!path.empty() && !below.empty() && below.front() != '[') whole.add(".");
  assign(e.path, whole.add(below).text());
  assign(e.wanted, why.wanted(buffer));
  assign_found(e, why.found(buffer));
  return e;
}

} // namespace detail

std::string_view json_error::message(std::span<char> buffer) const noexcept {
  if (wanted.empty()) return reason.message(buffer);
  json::words to{buffer};
  if (reason.code == errc::bad_argument) {
    return to.add("the path \"")
        .add(path)
        .add("\" is wrong at byte ")
        .add(reason.value)
        .add(": ")
        .add(wanted)
        .add(" is wanted")
        .text();
  }
  const bool is_element = ends_in_index(path);
  if (path.empty()) {
    to.add(wanted).add(" is wanted");
  } else {
    to.add(is_element ? "the element \"" : "the member \"").add(path).add("\" ");
    if (reason.code == errc::missing_member) {
      to.add("is missing; ").add(wanted).add(" is wanted");
      if (is_element) to.add(", and the array has ").add(reason.value);
      return to.text();
    }
    if (reason.code == errc::duplicate_member) return to.add("occurs twice").text();
    to.add("must be ").add(wanted);
  }
  if (reason.code == errc::too_long) return to.add("; it has ").add(reason.value).text();
  return to.add("; it is ").add(found).text();
}

std::string json_error::message() const {
  std::array<char, message_bytes_max> buffer;
  return std::string{message(buffer)};
}

} // namespace rowe
