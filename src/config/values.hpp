// SPDX-License-Identifier: Apache-2.0
// The values of keys: read from texts and from TOML, checked against their range, and written. Strict: a text
// is wholly a value, or it is none.
//
// A function that can find something wrong returns what follows the key in a diagnostic: "is out of range: 3
// (5 to 7)"; empty if nothing is wrong.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <rowe/rt/clock.hpp>

namespace rowe::config {

// A path is a text; in a file it is relative to the folder of that.
enum class kind : std::uint8_t { boolean, integer, size, time, word, text, path, texts };

// Times are nanoseconds, sizes are bytes, words are indices.
using value = std::variant<bool, std::int64_t, std::string, std::vector<std::string>>;

// What a value may be.
struct form {
  kind is = kind::text;
  std::int64_t least = 0; // of integers, sizes and times
  std::int64_t most = 0;
  std::span<const std::string_view> words = {};
};

inline constexpr std::size_t text_bytes_max = 1024;
inline constexpr std::int64_t for_ever_ns = rt::for_ever.count();

// What a value may be, in words: "50 us to 10 ms"; "true or false".
std::string allowed(const form& what);
// In short, for help: "N", "TIME", "poll|spin".
std::string placeholder(const form& what);

// From the text of an option or a variable.
std::string read(const form& what, std::string_view text, value& into);
// A list has a text for each member; everything else has one.
std::string read(const form& what, std::span<const std::string> texts, value& into);

// Whether a text can be a value, or a member of a list: it is short and has no control characters.
std::string check_text(std::string_view text);

// Whether a number that was read in another way is in its range.
std::string check_range(const form& what, std::int64_t number);

// That it is something else, which is `found`: "needs true or false, not 5".
std::string needs(const form& what, std::string_view found);

// As it stands in a file: `"250 us"`, `8080`, `["a", "b"]`.
std::string written(const form& what, const value& of);

// "250 us", "1 h", "forever": the largest unit that leaves a whole number.
std::string written_time(std::int64_t ns);
// "64 MiB", "1500 B": likewise.
std::string written_size(std::int64_t bytes);
// A TOML string in quotes.
std::string quoted(std::string_view text);

// "250 us", "1.5s", "forever"; a time has a unit, except 0.
std::optional<std::int64_t> time_of(std::string_view text) noexcept;

// "64 MiB", "1.5GB", "0"; a size has a unit, except 0.
std::optional<std::int64_t> size_of(std::string_view text) noexcept;

} // namespace rowe::config
