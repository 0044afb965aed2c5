// SPDX-License-Identifier: Apache-2.0
// Compiles a schema into a program, at set-up. The compiler walks the schema twice with the same code: once
// to count, once to write into memory of exactly that size. Literals grow until a value must be written. So
// brackets, names and commas of nested objects become one piece.
#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <new>

#include <rowe/detail/schema.hpp>

#include "json/reading/base64.hpp"
#include "json/structs/binary.hpp"
#include "json/structs/encoder_program.hpp"
#include "json/structs/sample.hpp"
#include "json/text/digits.hpp"
#include "json/writing/cbor.hpp"

namespace rowe::json {
namespace {

static_assert(static_cast<int>(operation::boolean) == static_cast<int>(value_kind::boolean));
static_assert(static_cast<int>(operation::int8) == static_cast<int>(value_kind::int8));
static_assert(static_cast<int>(operation::uint64) == static_cast<int>(value_kind::uint64));
static_assert(static_cast<int>(operation::float64) == static_cast<int>(value_kind::float64));
static_assert(encoder::bytes_limit <= std::numeric_limits<std::uint32_t>::max());

bool is_scalar(value_kind k) noexcept { return k <= value_kind::float64; }

std::size_t scalar_bytes_max(encoding into, operation what) noexcept {
  if (!is_text(into)) return binary_scalar_bytes_max;
  switch (what) {
  case operation::boolean: return 5;
  case operation::float32: return float_text_bytes_max;
  case operation::float64:
  case operation::rounded_float32:
  case operation::rounded_float64: return double_text_bytes_max;
  case operation::in_quotes: return integer_text_bytes_max + 2;
  case operation::seconds: return integer_text_bytes_max + 2; // with "0."
  case operation::sec_nsec: return sec_nsec_bytes_max;
  default: return integer_text_bytes_max;
  }
}

// Bytes that a byte of a text may need: escaped, \u001f; or replaced because it is no UTF-8.
constexpr std::size_t escaped_bytes_max = 6;

} // namespace

class encoder::compiler {
 public:
  // Only counts if there is nothing to write to. `base` is the sample. The offsets of every body are counted
  // from it, because an element is never larger or more aligned than the whole.
  compiler(encoding into, const char* base, step* program, name* names, char* literals) noexcept
      : into_{into}, base_{base}, program_{program}, names_{names}, literals_{literals} {}

  status compile(const schema_description& schema) noexcept {
    object(schema, base_, 0);
    flush();
    if (program_ != nullptr && is_text(into_)) count_doubles();
    return failed_;
  }

  std::size_t step_count() const noexcept { return step_count_; }
  std::size_t name_count() const noexcept { return name_count_; }
  std::size_t literal_bytes() const noexcept { return literal_end_; }
  std::size_t text_bytes_max() const noexcept { return text_bytes_max_; }

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

  std::uint32_t offset_of(const void* at) const noexcept {
    return static_cast<std::uint32_t>(static_cast<const char*>(at) - base_);
  }

  // From the last step to the first, counts how many doubles follow in a row, and the bytes that they need.
  void count_doubles() noexcept {
    const step none;
    const step* next = &none;
    for (std::size_t i = step_count_; i-- > 0;) {
      step& s = program_[i];
      if (s.what == operation::float64) {
        const std::size_t own = s.literal_bytes + literal_chunk_bytes + scalar_buffer_bytes;
        s.doubles = next->doubles + 1;
        s.ample_bytes = next->ample_bytes + static_cast<std::uint32_t>(own);
      }
      next = &s;
    }
  }

  // ---- literals and steps ----

  void add(std::string_view text) noexcept {
    if (literals_ != nullptr) std::memcpy(literals_ + literal_end_, text.data(), text.size());
    literal_end_ += text.size();
  }

  template <class Write>
  void add_bytes(std::size_t bytes_max, Write write) noexcept {
    std::array<char, cbor::head_bytes_max> unused;
    char* const to = literals_ == nullptr ? unused.data() : literals_ + literal_end_;
    literal_end_ += literals_ == nullptr ? bytes_max : static_cast<std::size_t>(write(to) - to);
  }
  void add_head(cbor::major kind, std::uint64_t n) noexcept {
    add_bytes(cbor::head_bytes_max, [&](char* at) { return cbor::write_head(at, kind, n); });
  }

  void add_text(std::string_view text) noexcept {
    if (is_text(into_)) return add_quoted(text);
    add_bytes(binary_text_bytes_max(text.size()), [&](char* at) { return write_text(into_, at, text); });
  }

  void add_quoted(std::string_view text) noexcept {
    const std::size_t bytes_max = text.size() * escaped_bytes_max + 2;
    if (literals_ == nullptr) {
      literal_end_ += bytes_max;
    } else {
      writer w{{literals_ + literal_end_, bytes_max}};
      w.string(text);
      literal_end_ += w.bytes();
    }
  }

  void add_name(std::string_view name) noexcept {
    if (into_ == encoding::ros1) return; // the order says which member it is
    add_text(name);
    if (is_text(into_)) add(":");
  }

  // Takes the literal that has grown since the last step, and leaves `bytes_max` for the value.
  step* emit(step s, std::size_t bytes_max) noexcept {
    s.literal = static_cast<std::uint32_t>(literal_begin_);
    s.literal_bytes = static_cast<std::uint32_t>(literal_end_ - literal_begin_);
    literal_begin_ = literal_end_;
    text_bytes_max_ += s.literal_bytes + bytes_max;
    if (text_bytes_max_ > bytes_limit) fail(text_bytes_max_, bytes_limit);
    const std::size_t index = step_count_++;
    if (program_ == nullptr) return nullptr;
    program_[index] = s;
    return &program_[index];
  }

  // The literal must be written before steps that may be skipped or repeated.
  void flush() noexcept {
    if (literal_end_ != literal_begin_) emit({}, 0);
  }

  // Emits a step with the body that `write_body` emits, which is run up to `count` times. Returns with the
  // text bound of all of it added.
  template <class Body>
  void emit_with_body(const step& s, std::size_t count, Body write_body) noexcept {
    step* const head = emit(s, 0);
    const std::size_t before = step_count_;
    const std::size_t text_before = text_bytes_max_;
    text_bytes_max_ = 0;
    write_body();
    flush();
    const std::size_t body_bytes = text_bytes_max_ + 1; // with a comma
    text_bytes_max_ = text_before;
    if (body_bytes > bytes_limit / count) {
      fail(body_bytes, bytes_limit / count);
    } else {
      text_bytes_max_ += body_bytes * count;
    }
    if (head != nullptr) head->body = static_cast<std::uint32_t>(step_count_ - before);
  }

  // ---- values ----

  void object(const schema_description& schema, const char* at, std::size_t depth) noexcept {
    if (!may_nest(depth)) return;
    begin_object(schema);
    const bool is_timed = into_ == encoding::sec_nsec && is_time(schema);
    bool some_written = false; // whatever the object holds
    bool first = true;
    for (const member_description& m : schema.members) {
      const auto begin_member = [&] {
        if (!is_text(into_)) return add_name(m.name);
        if (some_written) {
          add(",");
        } else if (!first) {
          step comma; // known only when it runs; the literal is empty here, behind an optional
          comma.what = operation::comma;
          emit(comma, 1);
        }
        add_name(is_timed ? sec_or_nsec(m.name) : m.name);
      };
      const void* const where = m.address(at + m.offset);
      if (m.type->kind == value_kind::optional) {
        optional(*m.type, where, m, depth, false, begin_member);
      } else {
        begin_member();
        if (m.type->kind == value_kind::array) {
          array(*m.type, where, m, depth, m.count, at + m.count_offset);
        } else {
          value(*m.type, where, m, depth);
        }
        some_written = true;
      }
      first = false;
    }
    end_object(schema);
  }

  // In CBOR, an object whose members may be missing says where it ends, not how many there are.
  static bool is_counted(const schema_description& schema) noexcept {
    return std::none_of(schema.members.begin(), schema.members.end(),
                        [](const auto& m) { return m.type->kind == value_kind::optional; });
  }
  void begin_object(const schema_description& schema) noexcept {
    if (is_text(into_)) return add("{");
    if (into_ == encoding::ros1) return;
    if (is_counted(schema)) return add_head(cbor::major::map, schema.members.size());
    add({&cbor::open_map, 1});
  }
  void end_object(const schema_description& schema) noexcept {
    if (is_text(into_)) return add("}");
    if (into_ == encoding::cbor && !is_counted(schema)) add({&cbor::close, 1});
  }

  void value(const value_description& d, const void* where, const member_description& how,
             std::size_t depth) noexcept {
    if (!failed_) return;
    switch (d.kind) {
    case value_kind::object: return object(*d.object, static_cast<const char*>(where), depth + 1);
    case value_kind::array: return array(d, where, how, depth, nullptr, nullptr);
    case value_kind::optional: return optional(d, where, how, depth, true, [] {});
    default: break;
    }
    step s;
    s.offset = offset_of(where);
    if (d.kind == value_kind::text) {
      s.what = d.text != nullptr ? operation::text : operation::c_text;
      s.argument = s.offset;
      s.text_of = d.text;
      s.count = static_cast<std::uint32_t>(d.count_max);
      emit(s, d.count_max * escaped_bytes_max + cbor::head_bytes_max);
      return;
    }
    if (how.by_name) return named(d, s);
    s.what = scalar(d, how, s);
    emit(s, scalar_bytes_max(into_, s.what));
  }

  // The operation that writes a scalar in the const member_description& asked for; what it needs to know goes
  // into the step.
  operation scalar(const value_description& d, const member_description& how, step& s) const noexcept {
    s.plain = static_cast<operation>(d.kind);
    const bool is_timed = into_ == encoding::sec_nsec && is_time(d);
    if (how.as_string && !is_timed) return operation::in_quotes;
    if (how.as_seconds || is_timed) {
      s.decimals = static_cast<std::int8_t>(rowe::detail::decimals_of(d.unit));
      return is_timed ? operation::sec_nsec : operation::seconds;
    }
    if (how.decimals < 0) return s.plain;
    s.decimals = static_cast<std::int8_t>(how.decimals);
    return d.kind == value_kind::float32 ? operation::rounded_float32 : operation::rounded_float64;
  }

  // The literals of the names stand behind that of the step, which they are no part of.
  void named(const value_description& d, step s) noexcept {
    s.what = operation::named;
    s.plain = static_cast<operation>(d.kind);
    s.argument = static_cast<std::uint32_t>(name_count_);
    s.count = static_cast<std::uint32_t>(d.enumerators.size());
    (void)emit(s, 0);
    std::size_t bytes_max = std::max(integer_text_bytes_max, binary_scalar_bytes_max);
    for (const enumerator_description& e : d.enumerators) {
      add_text(e.name);
      const std::size_t bytes = literal_end_ - literal_begin_;
      if (names_ != nullptr) {
        names_[name_count_] = {e.value, static_cast<std::uint32_t>(literal_begin_),
                               static_cast<std::uint32_t>(bytes)};
      }
      ++name_count_;
      literal_begin_ = literal_end_;
      bytes_max = std::max(bytes_max, bytes);
    }
    text_bytes_max_ += bytes_max;
    if (text_bytes_max_ > bytes_limit) fail(text_bytes_max_, bytes_limit);
    if (names_ != nullptr) {
      std::sort(names_ + s.argument, names_ + name_count_,
                [](const name& a, const name& b) { return a.value < b.value; });
    }
  }

  // `count_of`, when given, takes `owner`: the object that the array is a member of, or a part of it.
  void array(const value_description& d, const void* where, const member_description& how, std::size_t depth,
             std::size_t (*count_of)(const void*) noexcept, const char* owner) noexcept {
    if (!may_nest(depth + 1)) return;
    const value_description& element = *d.element;
    if (into_ == encoding::ros1 && element.kind == value_kind::array) return fail(depth + 1, 1);
    const bool is_base64 = is_text(into_) && rowe::detail::is_base64(d, how);
    if (is_text(into_)) add(is_base64 ? "\"" : "[");
    step s;
    s.offset = offset_of(d.elements(where));
    s.count = static_cast<std::uint32_t>(d.count_max);
    s.stride = static_cast<std::uint32_t>(element.bytes);
    s.count_of = count_of != nullptr ? count_of : d.count;
    s.argument = count_of != nullptr ? offset_of(owner) : offset_of(where);
    if (is_base64) {
      s.what = operation::base64;
      emit(s, base64_text_bytes(d.count_max));
    } else if (is_scalar(element.kind) && !how.by_name) {
      s.what = operation::scalars;
      s.element = scalar(element, how, s);
      add_count(s, s.element);
      emit(s, d.count_max * (scalar_bytes_max(into_, s.element) + 1) + cbor::array_head_bytes_max);
    } else {
      s.what = operation::repeat;
      add_count(s, operation::nothing);
      emit_with_body(s, d.count_max, [&] { value(element, base_, how, depth + 1); });
    }
    if (is_text(into_)) add(is_base64 ? "\"" : "]");
  }

  // How many elements follow. Where that is constant it belongs to the literal, and in ROS it is not said.
  void add_count(const step& s, operation element) noexcept {
    if (s.count_of != nullptr) {
      text_bytes_max_ += cbor::array_head_bytes_max; // the step writes it
    } else if (into_ == encoding::cbor) {
      add_bytes(cbor::array_head_bytes_max, [&](char* at) { return write_array_head(at, element, s.count); });
    }
  }

  // `begin` writes what stands before the value only if there is one: a member's name.
  template <class Begin>
  void optional(const value_description& d, const void* where, const member_description& how,
                std::size_t depth, bool else_null, Begin begin) noexcept {
    if (!may_nest(depth + 1)) return;
    if (into_ == encoding::ros1) return fail(1, 0);
    constexpr std::size_t null_bytes = 4;
    step s;
    s.what = operation::perhaps;
    s.argument = offset_of(where);
    s.engaged = d.engaged;
    s.else_null = else_null;
    emit_with_body(s, 1, [&] {
      begin();
      value(*d.element, base_, how, depth + 1);
    });
    text_bytes_max_ += null_bytes;
  }

  const encoding into_;
  const char* const base_;
  step* const program_;
  name* const names_;
  char* const literals_;
  std::size_t step_count_ = 0;
  std::size_t name_count_ = 0;
  std::size_t literal_begin_ = 0; // of the literal that grows
  std::size_t literal_end_ = 0;
  std::size_t text_bytes_max_ = 0;
  status failed_;
};

result<encoder> encoder::compile(const schema_description& schema, encoding into) {
  const auto no_memory = [](std::size_t bytes) {
    return error{errc::no_memory, static_cast<std::int64_t>(bytes), 0};
  };
  if (schema.bytes > bytes_limit) {
    return error{errc::bad_argument, static_cast<std::int64_t>(schema.bytes),
                 static_cast<std::int64_t>(bytes_limit)};
  }
  const sample object{schema};
  if (object.at() == nullptr) return no_memory(schema.bytes);

  compiler counter{into, object.at(), nullptr, nullptr, nullptr};
  if (const status s = counter.compile(schema); !s) return s.error();
  const std::size_t literal_bytes = counter.literal_bytes() + literal_chunk_bytes;

  encoder e;
  e.into_ = into;
  e.program_.reset(new (std::nothrow) step[counter.step_count()]);
  e.names_.reset(new (std::nothrow) name[counter.name_count()]);
  e.literals_.reset(new (std::nothrow) char[literal_bytes]{});
  if (e.program_ == nullptr || e.names_ == nullptr || e.literals_ == nullptr) {
    return no_memory(counter.step_count() * sizeof(step) + counter.name_count() * sizeof(name) +
                     literal_bytes);
  }
  compiler c{into, object.at(), e.program_.get(), e.names_.get(), e.literals_.get()};
  if (const status s = c.compile(schema); !s) return s.error();
  e.step_count_ = c.step_count();
  e.bytes_max_ = c.text_bytes_max();
  return e;
}

} // namespace rowe::json
