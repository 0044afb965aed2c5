// SPDX-License-Identifier: Apache-2.0
// JSON text to structs. At set-up a schema (rowe/schema.hpp) is flattened once, into a tree of steps with a
// table of names for each object. Decoding is then one walk over the text, which reads every value in place
// and writes it into the struct. Texts usually have their members in the schema's order, so the next member
// is compared first, and looked up only if that fails. Compiled when a topic or service is set up, used on
// the service thread.
//
// What is read, and as what:
//   bool                  true, false
//   integers, enums       a number that is whole, however it is written (3, 3.0, 3e0: browsers write 1e21),
//                         exact to the last digit; with as_string also its decimal digits in quotes; by_name
//                         a name of the enum, or the number of one
//   durations, times      as_seconds a number, rounded to the unit (half a unit away from 0); else as
//                         integers
//   double, float         any number, rounded once; -0 keeps its sign; null is NaN. A number beyond the
//                         largest float does not fit one
//   fixed_string          a string
//   struct                an object. Its members may come in any order; those that the schema does not know
//                         are passed over, those that it knows must come once; optionals, and those that are
//                         or_default(), at most once
//   std::array, C array   an array of exactly as many elements
//   bounded_array         an array of at most as many elements as it holds
//   counted array         the same; the counting member is set to the length of the text's array, whatever
//                         the text says of it where it is a member of the schema, too. Arrays with the same
//                         counting member must be equally long
//   std::optional         null or, as a member, nothing at all: empty; else the value
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include <rowe/result.hpp>
#include <rowe/schema.hpp>

#include "json/structs/encoder.hpp"

namespace rowe::json {

class decoder {
 public:
  // How deep objects, arrays and optionals may nest in a schema, and how large a struct may be.
  static constexpr std::size_t depth_max = encoder::depth_max;
  static constexpr std::size_t bytes_limit = encoder::bytes_limit;
  // How many members an object, and how many names an enum may have.
  static constexpr std::size_t members_max = 1024;

  // What members are that a text leaves out. Refused: an error, except those that the schema marks
  // or_default(). Filled: all of them are as in T{}.
  enum class missing : std::uint8_t { refused, filled };

  // Flattens `schema`; the decoder keeps only its functions. Allocates; for set-up. Errors: bad_argument if
  // it nests deeper than depth_max, an object has more than members_max members or an enum as many names, the
  // struct is larger than bytes_limit, or it is not decodable (value 0; see schema_description); no_memory.
  [[nodiscard]] static result<decoder> compile(const schema_description& schema,
                                               missing what = missing::refused);

  decoder(decoder&&) noexcept;
  decoder& operator=(decoder&&) noexcept;
  ~decoder();

  // Reads `validated_object`, a text that reader::validate() accepted or an object inside of one, into
  // `*object`, room for an object of the type that the schema describes, which is first set to what T{} is.
  // Never waits, never allocates; the steps are bounded by the text and the schema. Bytes are counted from
  // the beginning of `validated_object`. After an error *object is some valid object of its type. (As with
  // the walkers, text that was not validated is never read beyond its end, and what is then found means
  // nothing.) Errors:
  //   not_an_object     the text is another value
  //   missing_member    value: its number, from 1, counted as the schema is read: a member, then what is
  //                     inside of it, then the next
  //   duplicate_member  also where one of the two has escapes in its name; value: the byte of the second
  //   wrong_type        also of a number with a fraction for an integer; value: the byte where it begins
  //   out_of_range      the integer or float cannot hold the number, or the enum has no such name or value;
  //                     value: the byte where it begins
  //   too_long          value: the string's bytes or the array's elements; limit: what its member holds.
  //                     Of an array of fixed size, which it should be exactly, value may be less than limit;
  //                     of one that is counted together with another, limit may be that one's length
  ROWE_RT status decode(std::string_view validated_object, void* object) const noexcept {
    return decode(validated_object, object, nullptr);
  }

 private:
  struct step;
  struct member;
  struct shape;

 public:
  // Why a text could not be decoded: the member, what was wanted there, and what was found. Points into the
  // decoder and into the text.
  class diagnosis {
   public:
    static constexpr std::size_t text_bytes_max = 512; // always enough for text()

    // E.g. `the member "linear.y" is missing; a number is wanted`, `the member "path[2].x" must be a number;
    // it is "far"`. Long names and values are shortened. Cut where `buffer` ends, never within a character.
    std::string_view text(std::span<char> buffer) const noexcept { return write(buffer, piece::all); }
    // Its pieces, written in the same way. Found: the value, if one is there that is wrong.
    std::string_view path(std::span<char> buffer) const noexcept { return write(buffer, piece::path); }
    std::string_view wanted(std::span<char> buffer) const noexcept { return write(buffer, piece::wanted); }
    std::string_view found(std::span<char> buffer) const noexcept { return write(buffer, piece::found); }

   private:
    friend class decoder;
    enum class piece : std::uint8_t { all, path, wanted, found };
    std::string_view write(std::span<char> buffer, piece asked) const noexcept;
    struct part {
      const member* named; // null: an element
      std::size_t element;
    };
    error why_{errc::misuse};
    const step* wanted_ = nullptr;
    const char* found_ = nullptr;
    const char* end_ = nullptr; // of the text
    std::size_t parts_ = 0;
    std::array<part, 2 * depth_max> path_; // the innermost first; `parts_` of them are there
  };

  // From now on a float must be a number: null, which is NaN otherwise, is refused as wrong_type. For set-up.
  void refuse_null_numbers() noexcept { null_is_nan_ = false; }

  // As decode(); `*why` says how it failed.
  status decode(std::string_view validated_object, void* object, diagnosis* why) const noexcept;

 private:
  class compiler;
  class run;

  decoder() noexcept;

  void (*set_default_)(void* object) noexcept = nullptr; // null: `bytes_` zeroes
  std::size_t bytes_ = 0;
  bool null_is_nan_ = true;
  std::unique_ptr<shape[]> shapes_; // of each object in the schema; the first is the whole
  std::unique_ptr<member[]> members_;
  std::unique_ptr<step[]> elements_;       // of arrays and optionals
  std::unique_ptr<std::uint16_t[]> slots_; // of the tables of names
  std::unique_ptr<char[]> names_;
};

} // namespace rowe::json
