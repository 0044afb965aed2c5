// SPDX-License-Identifier: Apache-2.0
// JSON text as CBOR, in one pass. The head of an object or an array is one byte, which is written last: with
// the count if it is small, else as one of a length not said, whose end is marked.
#include "json/writing/cbor.hpp"

#include <algorithm>
#include <array>

#include "json/reading/cursor.hpp"
#include "json/reading/numbers.hpp"
#include "json/writing/writer.hpp"

namespace rowe::json::cbor {
namespace {

class transcoder {
 public:
  transcoder(std::string_view text, writer& into) noexcept
      : at_{text.data()}, end_{text.data() + text.size()}, into_{into} {}

  void run() noexcept {
    for (next(); at_ != end_ && !into_.overflowed(); next()) {
      switch (*at_) {
      case '{':
      case '[': open(); continue;
      case '}':
      case ']': close_one(); break;
      case ',':
      case ':': ++at_; continue; // a name is an item of its map, as its value is
      case '"': string(); break;
      default: scalar(); break;
      }
      if (depth_ == 0) return; // the whole value
    }
    if (depth_ != 0) give_up(); // no valid text
  }

 private:
  struct container {     // without initial values: only what is open is read
    std::uint32_t head;  // where it is
    std::uint32_t items; // of an object: names and values
    bool object;
  };

  void next() noexcept { at_ = skip_space(at_, end_); }
  void give_up() noexcept { into_.fail(); }
  void put(char byte) noexcept { into_.append({&byte, 1}); }
  void count_item() noexcept {
    if (depth_ != 0) ++open_[depth_ - 1].items;
  }

  void open() noexcept {
    count_item();
    if (depth_ == depth_max) return give_up();
    open_[depth_++] = {static_cast<std::uint32_t>(into_.bytes()), 0, *at_++ == '{'};
    put(close); // until it is known
  }

  void close_one() noexcept {
    ++at_;
    if (depth_ == 0) return give_up();
    const container& done = open_[--depth_];
    const std::uint32_t count = done.object ? done.items / 2 : done.items;
    char head = 0;
    if (count <= short_count_max) {
      (void)write_head(&head, done.object ? major::map : major::array, count);
    } else {
      head = done.object ? open_map : open_array;
      put(close);
    }
    into_.replace(done.head, head);
  }

  void string() noexcept {
    count_item();
    const char* const quote = find_quote(at_ + 1, end_);
    const std::string_view escaped = between(at_ + 1, quote);
    at_ = quote == end_ ? end_ : quote + 1;
    std::array<char, head_bytes_max> head;
    const bool plain = escaped.find('\\') == std::string_view::npos;
    const std::size_t bytes = plain ? escaped.size() : unescaped_bytes(escaped);
    into_.append(between(head.data(), write_head(head.data(), major::text, bytes)));
    if (plain) return into_.append(escaped);
    const char* from = escaped.data();
    for (const char* const end = from + escaped.size(); from != end && !into_.overflowed();) {
      const auto backslash = between(from, end).substr(0, between(from, end).find('\\'));
      into_.append(backslash);
      from += backslash.size();
      if (from == end) return;
      std::array<char, 4> character;
      into_.append({character.data(), take_escape(from, end, character)});
    }
  }

  void scalar() noexcept {
    count_item();
    const char* const from = at_;
    at_ = skip_scalar(at_, end_);
    if (at_ == from) return give_up();
    switch (*from) {
    case 't': return put(yes);
    case 'f': return put(no);
    case 'n': return put(null);
    default: return number(from);
    }
  }

  // -0 is a float, which has that sign.
  void number(const char* from) noexcept {
    std::array<char, head_bytes_max> buffer;
    char* const at = buffer.data();
    char* end = nullptr;
    const decimal d = read_decimal(from, end_);
    const bool integer = std::none_of(d.begin, d.end, [](char c) { return c == '.' || (c | 0x20) == 'e'; });
    const whole_number n = integer ? to_whole(d) : whole_number{whole_number::form::fraction};
    if (n.what == whole_number::form::whole && (n.magnitude != 0 || !n.negative)) {
      end = n.negative ? write_head(at, major::negative, n.magnitude - 1)
                       : write_head(at, major::whole, n.magnitude);
    } else {
      double x = 0;
      if (!to_real(d, x)) return give_up();
      const auto rounded = static_cast<float>(x);
      end = static_cast<double>(rounded) == x ? write_float(at, rounded) : write_double(at, x);
    }
    into_.append(between(at, end));
  }

  const char* at_;
  const char* const end_;
  writer& into_;
  std::size_t depth_ = 0;
  std::array<container, depth_max> open_;
};

} // namespace

void write_json(std::string_view validated, writer& into) noexcept { transcoder{validated, into}.run(); }

} // namespace rowe::json::cbor
