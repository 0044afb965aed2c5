// SPDX-License-Identifier: Apache-2.0
// Compiles a schema into what the decoder runs, at set-up. As the encoder's compiler, it walks the schema
// twice with the same code: once to count, once to write into memory of exactly that size.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <new>

#include <rowe/detail/schema.hpp>

#include "json/structs/decoder_program.hpp"
#include "json/structs/sample.hpp"
#include "json/structs/times.hpp"

namespace rowe::json {
namespace {

// The form that a member gives to the numbers in it.
struct number_form {
  bool as_string = false;
  bool by_name = false;
  bool as_seconds = false;
};

// Does JSON write the name unchanged? UTF-8 is unchanged. A name that a writer escapes without need is found
// by its escapes.
bool is_plain(std::string_view name) noexcept {
  return std::none_of(name.begin(), name.end(),
                      [](char c) { return static_cast<std::uint8_t>(c) < ' ' || c == '"' || c == '\\'; });
}

// By what other names a member is read: the one that its schema gives it, and, in an object of a time's
// shape, the one that programs of Foxglove's protocol give it. Empty: none.
std::array<std::string_view, 2> other_names(const schema_description& of,
                                            const member_description& m) noexcept {
  const std::string_view its = is_time(of) ? sec_or_nsec(m.name) : std::string_view{};
  return {m.other_name, its == m.name || its == m.other_name ? std::string_view{} : its};
}

} // namespace

class decoder::compiler {
 public:
  // Only counts if `into` is null. `base` is the sample. The offsets of every object and element are counted
  // from it, because none is larger or more aligned than the whole.
  compiler(const char* base, missing what, decoder* into) noexcept
      : base_{base}, fills_missing_{what == missing::filled}, into_{into} {}

  status compile(const schema_description& schema) noexcept {
    object(schema, base_, 0);
    return failed_;
  }

  std::size_t shape_count() const noexcept { return shape_count_; }
  std::size_t member_count() const noexcept { return member_count_; }
  std::size_t element_count() const noexcept { return element_count_; }
  std::size_t slot_count() const noexcept { return slot_count_; }
  std::size_t name_bytes() const noexcept { return name_bytes_; }

 private:
  void fail(std::size_t value, std::size_t limit) noexcept {
    if (failed_) {
      failed_ = error{errc::bad_argument, static_cast<std::int64_t>(value), static_cast<std::int64_t>(limit)};
    }
  }
  bool may_nest(std::size_t depth) noexcept {
    if (depth >= depth_max) fail(depth + 1, depth_max);
    return bool{failed_};
  }

  std::uint32_t offset_of(const void* at, const char* base) const noexcept {
    return static_cast<std::uint32_t>(static_cast<const char*>(at) - base);
  }

  // The members of an object are side by side; what is inside of them follows. `at` is the address of the
  // object.
  const shape* object(const schema_description& schema, const char* at, std::size_t depth) noexcept {
    if (!may_nest(depth)) return nullptr;
    const std::size_t count = schema.members.size();
    if (count > members_max) fail(count, members_max);
    if (!failed_) return nullptr;

    std::size_t names = count;
    for (const member_description& d : schema.members) {
      for (const std::string_view one : other_names(schema, d)) names += one.empty() ? 0U : 1U;
    }
    const auto [s, members, table] = new_shape(count, names);
    std::size_t other = count;
    for (std::size_t i = 0; i < count; ++i) {
      const member_description& d = schema.members[i];
      member m;
      m.number = ++number_;
      m.index = static_cast<std::uint32_t>(i);
      m.keeps_default = d.or_default || fills_missing_;
      name(m, d.name);
      m.value = member_value(schema, d, at, depth);
      m.shares_count = std::any_of(schema.members.begin(), schema.members.end(), [&](const auto& another) {
        return &another != &d && another.count != nullptr && another.count == d.count &&
               another.count_offset == d.count_offset;
      });
      if (s != nullptr) {
        members[i] = m;
        if (m.plain) enter(*s, table, i);
      }
      for (const std::string_view one : other_names(schema, d)) {
        if (one.empty()) continue;
        member same = m;
        name(same, one);
        if (s == nullptr) continue;
        members[other] = same;
        if (same.plain) enter(*s, table, other);
        ++other;
      }
      if (s == nullptr) continue;
      const bool may_miss = m.keeps_default || d.type->kind == value_kind::optional;
      if (!may_miss) s->required[i / 64] |= std::uint64_t{1} << i % 64;
    }
    return s;
  }

  // The names of an enum are looked up as those of members are. They are sorted by the values, to find those,
  // too, in a few steps.
  const shape* names_of(const value_description& d) noexcept {
    const std::size_t count = d.enumerators.size();
    if (count > members_max) fail(count, members_max);
    if (!failed_) return nullptr;
    const auto [s, members, table] = new_shape(count, count);
    for (std::size_t i = 0; i < count; ++i) {
      member m;
      name(m, d.enumerators[i].name);
      m.value.count = static_cast<std::size_t>(d.enumerators[i].value);
      if (s != nullptr) members[i] = m;
    }
    if (s == nullptr) return nullptr;
    std::sort(members, members + count,
              [](const member& a, const member& b) { return a.value.count < b.value.count; });
    for (std::size_t i = 0; i < count; ++i) {
      if (members[i].plain) enter(*s, table, i);
    }
    return s;
  }

  struct shape_memory {
    shape* itself;
    member* members;
    std::uint16_t* table;
  };
  shape_memory new_shape(std::size_t count, std::size_t names) noexcept {
    const std::size_t slots = std::bit_ceil(2 * names + 1);
    const shape_memory m{take(shapes(), shape_count_, 1), take(members(), member_count_, names),
                         take(this->slots(), slot_count_, slots)};
    if (m.itself != nullptr) {
      m.itself->members = m.members;
      m.itself->count = static_cast<std::uint32_t>(count);
      m.itself->names = static_cast<std::uint32_t>(names);
      m.itself->slots = m.table;
      m.itself->slot_mask = static_cast<std::uint32_t>(slots - 1);
    }
    return m;
  }

  void name(member& m, std::string_view text) noexcept {
    char* const buffer = take(names(), name_bytes_, text.size() + 1);
    if (buffer == nullptr) return;
    text.copy(buffer, text.size());
    buffer[text.size()] = '"';
    m.name = buffer;
    m.name_bytes = static_cast<std::uint32_t>(text.size());
    m.hash = name_hash(text);
    std::memset(m.head, 0, sizeof m.head);
    std::memset(m.mask, 0, sizeof m.mask);
    m.plain = is_plain(text);
    const std::size_t head = std::min(text.size() + 1, member::head_bytes);
    std::memcpy(m.head, buffer, head);
    std::memset(m.mask, 0xff, head);
  }

  static void enter(const shape& s, std::uint16_t* table, std::size_t index) noexcept {
    std::uint32_t slot = s.members[index].hash & s.slot_mask;
    while (table[slot] != 0) slot = (slot + 1) & s.slot_mask;
    table[slot] = static_cast<std::uint16_t>(index + 1);
  }

  step member_value(const schema_description& owner, const member_description& m, const char* at,
                    std::size_t depth) noexcept {
    const void* const where = m.address(at + m.offset);
    step s = value(*m.type, where, at, {m.as_string, m.by_name, m.as_seconds}, depth);
    if (m.count != nullptr) {
      s.all_of_it = false;
      s.count = m.count_limit;
      s.set_count = m.set_count;
      s.count_of = m.count;
      s.count_offset = static_cast<std::uint32_t>(m.count_offset);
    }
    const auto counts_with_this = [&](const member_description& other) {
      return other.count_address != nullptr && other.count_address(at + other.count_offset) == where;
    };
    if (std::any_of(owner.members.begin(), owner.members.end(), counts_with_this)) {
      s.unused = true;
      s.offset = 0;
    }
    return s;
  }

  // `where` is the value, `from` what its offset is counted from.
  step value(const value_description& d, const void* where, const char* from, number_form how,
             std::size_t depth) noexcept {
    step s;
    if (!failed_) return s;
    s.what = d.kind;
    s.offset = offset_of(where, from);
    switch (d.kind) {
    case value_kind::object: s.object = object(*d.object, base_, depth + 1); break;
    case value_kind::array:
      if (!may_nest(depth + 1)) break;
      s.all_of_it = d.count == nullptr;
      s.base64 = d.is_bytes && !how.as_string && !how.by_name;
      s.resize = d.resize;
      s.count = d.count_max;
      s.elements_offset = offset_of(d.elements(where), from);
      s.stride = static_cast<std::uint32_t>(d.element->bytes);
      s.element = element(*d.element, how, depth + 1);
      break;
    case value_kind::optional:
      if (!may_nest(depth + 1)) break;
      s.emplace = d.emplace;
      s.reset = d.reset;
      s.element = element(*d.element, how, depth + 1);
      break;
    case value_kind::text:
      s.count = d.count_max;
      s.resize_text = d.resize_text;
      break;
    default:
      s.as_string = how.as_string;
      if (how.by_name) s.object = names_of(d);
      if (is_time(d)) s.time_decimals = static_cast<std::int8_t>(rowe::detail::decimals_of(d.unit));
      if (how.as_seconds) s.decimals = static_cast<std::int8_t>(rowe::detail::decimals_of(d.unit));
    }
    return s;
  }

  const step* element(const value_description& d, number_form how, std::size_t depth) noexcept {
    step* const buffer = take(elements(), element_count_, 1);
    const step s = value(d, base_, base_, how, depth);
    if (buffer != nullptr) *buffer = s;
    return buffer;
  }

  // ---- memory: null while it is counted ----

  shape* shapes() const noexcept { return into_ == nullptr ? nullptr : into_->shapes_.get(); }
  member* members() const noexcept { return into_ == nullptr ? nullptr : into_->members_.get(); }
  step* elements() const noexcept { return into_ == nullptr ? nullptr : into_->elements_.get(); }
  std::uint16_t* slots() const noexcept { return into_ == nullptr ? nullptr : into_->slots_.get(); }
  char* names() const noexcept { return into_ == nullptr ? nullptr : into_->names_.get(); }

  template <class T>
  static T* take(T* all, std::size_t& taken, std::size_t count) noexcept {
    T* const at = all == nullptr ? nullptr : all + taken;
    taken += count;
    return at;
  }

  const char* const base_;
  const bool fills_missing_;
  decoder* const into_;
  std::size_t shape_count_ = 0;
  std::size_t member_count_ = 0;
  std::size_t element_count_ = 0;
  std::size_t slot_count_ = 0;
  std::size_t name_bytes_ = 0;
  std::uint32_t number_ = 0; // of the last member
  status failed_;
};

result<decoder> decoder::compile(const schema_description& schema, missing what) {
  const auto no_memory = [](std::size_t bytes) {
    return error{errc::no_memory, static_cast<std::int64_t>(bytes), 0};
  };
  if (schema.bytes > bytes_limit) {
    return error{errc::bad_argument, static_cast<std::int64_t>(schema.bytes),
                 static_cast<std::int64_t>(bytes_limit)};
  }
  if (!schema.decodable) return error{errc::bad_argument};
  const sample object{schema};
  if (object.at() == nullptr) return no_memory(schema.bytes);

  compiler counter{object.at(), what, nullptr};
  if (const status s = counter.compile(schema); !s) return s.error();

  decoder d;
  d.set_default_ = schema.set_default;
  d.bytes_ = schema.bytes;
  d.shapes_.reset(new (std::nothrow) shape[counter.shape_count()]);
  d.members_.reset(new (std::nothrow) member[counter.member_count()]);
  d.elements_.reset(new (std::nothrow) step[counter.element_count()]);
  d.slots_.reset(new (std::nothrow) std::uint16_t[counter.slot_count()]{});
  d.names_.reset(new (std::nothrow) char[counter.name_bytes()]);
  if (d.shapes_ == nullptr || d.members_ == nullptr || d.elements_ == nullptr || d.slots_ == nullptr ||
      d.names_ == nullptr) {
    return no_memory(counter.shape_count() * sizeof(shape) + counter.member_count() * sizeof(member) +
                     counter.element_count() * sizeof(step));
  }
  compiler c{object.at(), what, &d};
  if (const status s = c.compile(schema); !s) return s.error();
  return d;
}

} // namespace rowe::json
