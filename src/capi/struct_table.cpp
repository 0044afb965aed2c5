// SPDX-License-Identifier: Apache-2.0
// A table is not trusted: each of its numbers is checked before anything is reckoned with it. What a decoder
// would write by a wrong table lies outside of the struct.
#include "capi/struct_table.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <set>
#include <span>
#include <string_view>

#include "capi/struct_scalars.hpp"
#include "wire/text/utf8.hpp"
#include "json/structs/encoder.hpp"
#include "json/text/words.hpp"

namespace rowe::capi {
namespace {

constexpr int type_bits = 0xff;
constexpr int decimals_bits = 0xf000;
constexpr int known_bits = 0xff | rowe_member_as_string | rowe_member_as_seconds | rowe_member_as_numbers |
                           rowe_member_or_default | rowe_member_by_name | decimals_bits;
static_assert(rowe_struct_depth_max == json::encoder::depth_max);

bool is_name(std::string_view text) noexcept {
  return text.size() <= rowe_struct_name_bytes_max && wire::is_utf8(std::as_bytes(std::span{text}));
}
// At most one byte more than a name may have is read.
std::string_view text_of(const char* name) noexcept {
  return {name, ::strnlen(name, rowe_struct_name_bytes_max + 1)};
}

// The bytes of a struct that a member takes.
struct place {
  std::size_t begin;
  std::size_t end;
  std::size_t row;
};

} // namespace

class struct_descriptions::reading {
 public:
  reading(struct_descriptions& into, std::string& why) : into_{into}, why_{why} {}

  result<kept*> read(const rowe_struct& table) {
    if (const auto known = read_.find(&table); known != read_.end()) return known->second;
    table_ = &table;
    row_ = nullptr;
    if (const status fine = check_table(table); !fine) return fine.error();
    open_.insert(&table);
    kept made;
    if (const status fine = read_rows(table, made); !fine) return fine.error();
    open_.erase(&table);
    kept& one = keep(table, std::move(made));
    read_.emplace(&table, &one);
    return &one;
  }

 private:
  // ---- what is wrong

  // `row_` and `table_` are where.
  error fail(std::size_t value, std::size_t limit, std::string_view what) {
    constexpr std::size_t shown = 48;
    std::array<char, 400> buffer;
    json::words text{buffer};
    if (row_ != nullptr) {
      text.add("member ").add(row_ - table_->members);
      if (row_->name != nullptr && is_name(text_of(row_->name)))
        text.add(" \"").add_shortened(row_->name, shown).add("\"");
      text.add(" of ");
    }
    const bool named = table_->name != nullptr && is_name(text_of(table_->name));
    text.add(named ? "the struct \"" : "a struct").add_shortened(named ? table_->name : "", shown);
    text.add(named ? "\": " : ": ").add(what);
    why_ = text.text();
    const auto number = [](std::size_t n) {
      return static_cast<std::int64_t>(std::min<std::size_t>(n, std::numeric_limits<std::int64_t>::max()));
    };
    return {errc::bad_argument, number(value), number(limit)};
  }
  error too_deep(std::size_t levels) {
    return fail(levels, rowe_struct_depth_max, "it nests deeper than the limit of 32 levels");
  }

  // ---- a table

  status check_table(const rowe_struct& table) {
    if (table.name != nullptr && !is_name(text_of(table.name)))
      return fail(text_of(table.name).size(), rowe_struct_name_bytes_max,
                  "its name is no UTF-8, or longer than 128 bytes");
    if (table.bytes == 0 || table.bytes > json::encoder::bytes_limit)
      return fail(table.bytes, json::encoder::bytes_limit, "its size is 0, or beyond 2 GiB");
    if (table.count > rowe_struct_members_max)
      return fail(table.count, rowe_struct_members_max, "it has more than 1024 members");
    if (table.members == nullptr && table.count != 0) return fail(table.count, 0, "its rows are NULL");
    return {};
  }

  status read_rows(const rowe_struct& table, kept& into) {
    std::vector<place> places;
    std::vector<std::string_view> names;
    into.itself.alignment = 1;
    into.members.reserve(table.count);
    for (std::size_t i = 0; i < table.count; ++i) {
      const rowe_member& row = table.members[i];
      row_ = &row;
      member_description m;
      if (const status fine = check_names(row, names); !fine) return fine;
      const auto alignment = value(row, into, m);
      if (!alignment) return alignment.error();
      row_ = &row; // of this table again
      table_ = &table;
      const std::size_t elements = std::max<std::size_t>(row.count, 1);
      if (row.offset % *alignment != 0) return fail(row.offset, *alignment, "its offset is misaligned");
      if (row.offset > table.bytes || elements > (table.bytes - row.offset) / row.bytes)
        return fail(row.offset, table.bytes, "it lies beyond the end of the struct");
      if (const status fine = check_count(row, table); !fine) return fine;
      into.itself.alignment = std::max(into.itself.alignment, *alignment);
      places.push_back({row.offset, row.offset + elements * row.bytes, i});
      into.members.push_back(m);
      if (++into.members_all > rowe_struct_members_all_max)
        return fail(into.members_all, rowe_struct_members_all_max,
                    "there are more than 16384 members with everything inside");
    }
    row_ = nullptr;
    if (table.bytes % into.itself.alignment != 0)
      return fail(table.bytes, into.itself.alignment, "its size is no multiple of its members' alignment");
    return check_places(places, table);
  }

  status check_names(const rowe_member& row, std::vector<std::string_view>& before) {
    if (row.name == nullptr) return fail(0, 0, "its name is NULL");
    for (const char* const one : {row.name, row.other_name}) {
      if (one == nullptr) continue;
      const std::string_view name = text_of(one);
      if (name.empty()) return fail(0, rowe_struct_name_bytes_max, "its name is empty");
      if (!is_name(name))
        return fail(name.size(), rowe_struct_name_bytes_max,
                    "its name is no UTF-8, or longer than 128 bytes");
      if (std::ranges::find(before, name) != before.end())
        return fail(before.size(), 0, "another member has the same name");
      before.push_back(name);
    }
    return {};
  }

  // Two members may not share a byte, except a counting member and the row of its own.
  status check_places(std::vector<place>& places, const rowe_struct& table) {
    std::ranges::sort(places, {}, &place::begin);
    for (std::size_t i = 1; i < places.size(); ++i) {
      if (places[i].begin >= places[i - 1].end) continue;
      row_ = &table.members[places[i].row];
      return fail(places[i].begin, places[i - 1].end, "it lies on another member");
    }
    for (std::size_t i = 0; i < table.count; ++i) {
      const rowe_member& row = table.members[i];
      if (row.count_type == 0) continue;
      const std::size_t begin = row.count_offset;
      const std::size_t end = begin + scalar_of(row.count_type)->bytes;
      for (const place& p : places) {
        if (p.begin >= end || p.end <= begin) continue;
        const rowe_member& other = table.members[p.row];
        if (p.begin == begin && other.count == 0 && (other.type & type_bits) == row.count_type) continue;
        row_ = &row;
        return fail(begin, p.begin, "its counting member lies on a member of another type");
      }
      for (std::size_t k = 0; k < i; ++k) { // two that count are one and the same, or apart
        const rowe_member& other = table.members[k];
        if (other.count_type == 0 || (other.count_offset == begin && other.count_type == row.count_type))
          continue;
        const std::size_t other_end = other.count_offset + scalar_of(other.count_type)->bytes;
        if (other.count_offset >= end || other_end <= begin) continue;
        row_ = &row;
        return fail(begin, other.count_offset, "its counting member lies on another one");
      }
    }
    return {};
  }

  // ---- a member

  status check_count(const rowe_member& row, const rowe_struct& table) {
    if (row.count_type == 0) return {};
    if (!is_integer(row.count_type))
      return fail(static_cast<std::size_t>(std::max(row.count_type, 0)), rowe_member_uint64,
                  "its counting member is of no type of integer");
    if (row.count == 0) return fail(0, 1, "it is counted, and no array");
    const std::size_t bytes = scalar_of(row.count_type)->bytes;
    if (row.count_offset % bytes != 0)
      return fail(row.count_offset, bytes, "its counting member is misaligned");
    if (row.count_offset > table.bytes || table.bytes - row.count_offset < bytes)
      return fail(row.count_offset, table.bytes, "its counting member lies beyond the end of the struct");
    return {};
  }

  status check_form(const rowe_member& row) {
    const int type = row.type & type_bits;
    const int decimals = (row.type & decimals_bits) / rowe_member_decimals_0;
    const auto has = [&](int form) { return (row.type & form) != 0; };
    if (has(~known_bits) || decimals > 10)
      return fail(static_cast<unsigned>(row.type), known_bits, "its form is none");
    if ((has(rowe_member_as_string) && !is_integer(type) && !is_time(type)) ||
        (has(rowe_member_as_seconds) && !is_time(type)) || (decimals != 0 && !is_real(type)) ||
        (has(rowe_member_as_numbers) && (type != rowe_member_uint8 || row.count == 0)) ||
        ((row.name_count != 0 || has(rowe_member_by_name)) && !is_integer(type)))
      return fail(static_cast<unsigned>(row.type), 0, "its type has no such form");
    if (has(rowe_member_as_string) + has(rowe_member_as_seconds) + has(rowe_member_as_numbers) +
            has(rowe_member_by_name) >
        1)
      return fail(static_cast<unsigned>(row.type), 0, "it has two forms");
    return {};
  }

  // Describes the member; returns its alignment.
  result<std::size_t> value(const rowe_member& row, kept& into, member_description& m) {
    if (const status fine = check_form(row); !fine) return fine.error();
    const int type = row.type & type_bits;
    value_description d;
    std::size_t levels = 0;
    std::size_t alignment = 1;
    if (const scalar* const one = scalar_of(type)) {
      d = {.kind = one->kind, .bytes = one->bytes};
      if (is_time(type)) d.unit = {1, 1'000'000'000, type == rowe_member_time};
      alignment = one->bytes;
      if (row.bytes != d.bytes) return fail(row.bytes, d.bytes, "its size is not that of its type");
      if (const status fine = name_values(row, *one, into, d); !fine) return fine.error();
    } else if (type == rowe_member_text) {
      if (row.bytes < 2 || row.bytes > json::encoder::bytes_limit)
        return fail(row.bytes, json::encoder::bytes_limit, "a text needs 2 bytes at least");
      d = {.kind = value_kind::text, .bytes = row.bytes, .count_max = row.bytes - 1};
    } else if (type == rowe_member_struct) {
      if (row.inside == nullptr) return fail(0, 0, "the table of its struct is NULL");
      if (open_.contains(row.inside)) return fail(open_.size(), 0, "its table contains itself");
      if (open_.size() == rowe_struct_depth_max) return too_deep(open_.size() + 1);
      const auto inside = read(*row.inside);
      if (!inside) return inside.error();
      const kept& its = **inside;
      if (row.bytes != its.itself.bytes)
        return fail(row.bytes, its.itself.bytes, "its size is not that of its struct");
      d = {.kind = value_kind::object, .bytes = row.bytes, .object = &its.itself};
      alignment = its.itself.alignment;
      levels = its.levels;
      into.members_all += its.members_all;
    } else {
      return fail(static_cast<std::size_t>(type), rowe_member_duration, "its type is none");
    }
    if (row.count != 0) {
      ++levels;
      if (row.count > std::numeric_limits<std::uint32_t>::max())
        return fail(row.count, std::numeric_limits<std::uint32_t>::max(), "it has too many elements");
      const value_description& element = into.values.emplace_back(d);
      d = {.kind = value_kind::array,
           .bytes = row.count * row.bytes, // where that overflows, the member lies beyond the struct
           .count_max = row.count,
           .is_bytes = type == rowe_member_uint8,
           .element = &element,
           .elements = &itself};
    }
    into.levels = std::max(into.levels, levels + 1);
    if (into.levels > rowe_struct_depth_max) return too_deep(into.levels);
    describe_member(row, into, into.values.emplace_back(d), m);
    return alignment;
  }

  // The names of an integer's values.
  status name_values(const rowe_member& row, const scalar& of, kept& into, value_description& d) {
    const bool by_name = (row.type & rowe_member_by_name) != 0;
    if (by_name && row.name_count == 0) return fail(0, 1, "it is written by name, and has no names");
    if (row.name_count == 0) return {};
    if (row.names == nullptr) return fail(row.name_count, 0, "its names are NULL");
    if (row.name_count > rowe_struct_members_max)
      return fail(row.name_count, rowe_struct_members_max, "it has more than 1024 names");
    std::vector<enumerator_description> all;
    for (std::size_t i = 0; i < row.name_count; ++i) {
      const rowe_name& one = row.names[i];
      if (one.name == nullptr || *one.name == '\0' || !is_name(text_of(one.name)))
        return fail(i, rowe_struct_name_bytes_max, "one of its names is missing, no UTF-8, or too long");
      if (one.value < of.least || one.value > of.greatest)
        return fail(i, of.most, "its type does not have the value of one of its names");
      const auto same = [&](const enumerator_description& e) {
        return e.name == one.name || e.value == one.value;
      };
      if (std::ranges::any_of(all, same))
        return fail(i, 0, "two of its names, or their values, are the same");
      all.push_back({.name = into.texts.emplace_back(one.name), .value = one.value});
    }
    d.enumerators = into.enums.emplace_back(std::move(all));
    return {};
  }

  static void describe_member(const rowe_member& row, kept& into, const value_description& type,
                              member_description& m) {
    m.name = into.texts.emplace_back(row.name);
    if (row.other_name != nullptr) m.other_name = into.texts.emplace_back(row.other_name);
    m.type = &type;
    m.address = &itself;
    m.offset = row.offset;
    m.as_string = (row.type & rowe_member_as_string) != 0;
    m.as_seconds = (row.type & rowe_member_as_seconds) != 0;
    m.as_numbers = (row.type & rowe_member_as_numbers) != 0;
    m.or_default = (row.type & rowe_member_or_default) != 0;
    m.by_name = (row.type & rowe_member_by_name) != 0;
    m.decimals = (row.type & decimals_bits) / rowe_member_decimals_0 - 1;
    if (!is_integer(row.count_type)) return; // checked later
    const scalar& counting = *scalar_of(row.count_type);
    m.count = counting.count;
    m.set_count = counting.set_count;
    m.count_address = &itself;
    m.count_offset = row.count_offset;
    m.count_limit = std::min(row.count, counting.most);
  }

  // ---- what tables say

  // One text for all tables that say the same: numbers and texts, each with its length. Tables inside are the
  // descriptions that were made of them.
  static std::string key_of(const rowe_struct& table, const kept& made) {
    std::string key;
    const auto add = [&key](const auto& part) {
      if constexpr (std::is_convertible_v<decltype(part), std::string_view>) {
        key += std::to_string(std::string_view{part}.size());
        (key += ':') += part;
      } else {
        key += std::to_string(part);
      }
      key += ',';
    };
    add(text_of(table.name != nullptr ? table.name : ""));
    add(table.bytes);
    for (std::size_t i = 0; i < table.count; ++i) {
      const rowe_member& row = table.members[i];
      const value_description& d = *made.members[i].type;
      add(std::string_view{row.name});
      add(std::string_view{row.other_name != nullptr ? row.other_name : ""});
      for (const std::size_t n : {row.offset, row.bytes, row.count, row.count_offset}) add(n);
      add(row.type);
      for (const enumerator_description& e : (d.kind == value_kind::array ? *d.element : d).enumerators) {
        add(e.name);
        add(e.value);
      }
      add(std::string_view{});
      add(row.count_type);
      const schema_description* const inside = d.kind == value_kind::array ? d.element->object : d.object;
      add(reinterpret_cast<std::uintptr_t>(inside));
    }
    return key;
  }

  kept& keep(const rowe_struct& table, kept&& made) {
    const auto [at, is_new] = into_.all_.try_emplace(key_of(table, made), std::move(made));
    kept& one = at->second;
    if (!is_new) return one;
    one.name = table.name != nullptr ? table.name : "";
    one.itself.type_name = one.name;
    one.itself.bytes = table.bytes;
    one.itself.members = one.members;
    one.itself.decodable = true; // set_default stays null: all zeroes
    return one;
  }

  struct_descriptions& into_;
  std::string& why_;
  const rowe_struct* table_ = nullptr;
  const rowe_member* row_ = nullptr;
  std::set<const rowe_struct*> open_; // that are being read, each inside of another one
  std::map<const rowe_struct*, kept*> read_;
};

result<const schema_description*> struct_descriptions::describe(const rowe_struct& table, std::string& why) {
  const std::lock_guard lock{mutex_};
  const auto made = reading{*this, why}.read(table);
  if (!made) return made.error();
  return &(*made)->itself;
}

} // namespace rowe::capi
