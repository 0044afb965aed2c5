// SPDX-License-Identifier: Apache-2.0
// Compiles a schema into what the decoder runs, at set-up. As the encoder's compiler, it walks the schema
// twice with the same code: once to count, once to write into memory of exactly that size.
#include <algorithm>
#include <bit>
#include <cstring>
#include <new>

#include "decoder_program.hpp"
#include "sample.hpp"

namespace rowe::json {
namespace {

// Does JSON write the name unchanged? UTF-8 is unchanged. A name that a writer escapes without need is found
// by its escapes.
bool is_plain(std::string_view name) noexcept {
  return std::none_of(name.begin(), name.end(),
                      [](char c) { return static_cast<std::uint8_t>(c) < ' ' || c == '"' || c == '\\'; });
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

    const auto others = std::count_if(schema.members.begin(), schema.members.end(),
                                      [](const auto& one) { return !one.other_name.empty(); });
    const std::size_t names = count + static_cast<std::size_t>(others);
    const std::size_t slots = std::bit_ceil(2 * names + 1);
    shape* const s = take(shapes(), shape_count_, 1);
    member* const members = take(this->members(), member_count_, names);
    std::uint16_t* const table = take(this->slots(), slot_count_, slots);
    if (s != nullptr) {
      s->members = members;
      s->count = static_cast<std::uint32_t>(count);
      s->names = static_cast<std::uint32_t>(names);
      s->slots = table;
      s->slot_mask = static_cast<std::uint32_t>(slots - 1);
    }
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
        return &another != &d && another.count != nullptr && another.count == d.count;
      });
      member same = m;
      if (!d.other_name.empty()) name(same, d.other_name);
      if (s == nullptr) continue;
      members[i] = m;
      if (m.plain) enter(*s, table, i);
      if (!d.other_name.empty()) {
        members[other] = same;
        if (same.plain) enter(*s, table, other);
        ++other;
      }
      const bool may_miss = m.keeps_default || d.type->kind == value_kind::optional;
      if (!may_miss) s->required[i / 64] |= std::uint64_t{1} << i % 64;
    }
    return s;
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
    const void* const where = m.address(at);
    step s = value(*m.type, where, at, m.as_string, depth);
    if (m.count != nullptr) {
      s.all_of_it = false;
      s.count = m.count_limit;
      s.set_count = m.set_count;
      s.count_of = m.count;
    }
    const auto counts_with_this = [&](const member_description& other) {
      return other.count_address != nullptr && other.count_address(at) == where;
    };
    if (std::any_of(owner.members.begin(), owner.members.end(), counts_with_this)) {
      s.unused = true;
      s.offset = 0;
    }
    return s;
  }

  // `where` is the value, `from` what its offset is counted from.
  step value(const value_description& d, const void* where, const char* from, bool as_string,
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
      s.resize = d.resize;
      s.count = d.count_max;
      s.elements_offset = offset_of(d.elements(where), from);
      s.stride = static_cast<std::uint32_t>(d.element->bytes);
      s.element = element(*d.element, as_string, depth + 1);
      break;
    case value_kind::optional:
      if (!may_nest(depth + 1)) break;
      s.emplace = d.emplace;
      s.reset = d.reset;
      s.element = element(*d.element, as_string, depth + 1);
      break;
    case value_kind::text:
      s.count = d.count_max;
      s.resize_text = d.resize_text;
      break;
    default: s.as_string = as_string;
    }
    return s;
  }

  const step* element(const value_description& d, bool as_string, std::size_t depth) noexcept {
    step* const buffer = take(elements(), element_count_, 1);
    const step s = value(d, base_, base_, as_string, depth);
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
