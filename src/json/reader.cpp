// SPDX-License-Identifier: Apache-2.0
#include "reader.hpp"

#include <new>
#include <utility>

#include <simdjson.h>

#include "fault.hpp"

namespace rowe::json {

static_assert(reader::tailroom_bytes >= simdjson::SIMDJSON_PADDING);
static_assert(fault_depth_limit >= reader::depth_max_default);

struct reader::parser {
  simdjson::dom::parser dom;
};

reader::reader(std::unique_ptr<parser> p, std::size_t bytes_max, std::size_t depth_max) noexcept
    : parser_{std::move(p)}, bytes_max_{bytes_max}, depth_max_{depth_max} {}
reader::reader(reader&&) noexcept = default;
reader& reader::operator=(reader&&) noexcept = default;
reader::~reader() = default;

result<reader> reader::create(std::size_t bytes_max, std::size_t depth_max) {
  constexpr std::size_t bytes_limit = simdjson::SIMDJSON_MAXSIZE_BYTES;
  const auto signed_of = [](std::size_t x) { return static_cast<std::int64_t>(x); };
  if (bytes_max == 0 || bytes_max > bytes_limit) {
    return error{errc::bad_argument, signed_of(bytes_max), signed_of(bytes_limit)};
  }
  if (depth_max == 0 || depth_max > fault_depth_limit) {
    return error{errc::bad_argument, signed_of(depth_max), signed_of(fault_depth_limit)};
  }
  std::unique_ptr<parser> p{new (std::nothrow) parser};
  // Both are needed: the parser's own buffers and the document's. simdjson would allocate whichever is
  // missing, or too small, inside parse(). (set_max_capacity() does the opposite of its name in 3.0.1 and is
  // not called.)
  if (p == nullptr || p->dom.allocate(bytes_max, depth_max) != simdjson::SUCCESS ||
      p->dom.doc.allocate(bytes_max) != simdjson::SUCCESS) {
    return error{errc::no_memory, signed_of(bytes_max), signed_of(bytes_limit)};
  }
  return reader{std::move(p), bytes_max, depth_max};
}

status reader::validate(std::string_view text) noexcept {
  if (text.size() > bytes_max_) {
    return error{errc::too_big, static_cast<std::int64_t>(text.size()),
                 static_cast<std::int64_t>(bytes_max_)};
  }
  constexpr bool copy_if_no_tailroom = false;
  const simdjson::error_code verdict =
      parser_->dom.parse(text.data(), text.size(), copy_if_no_tailroom).error();
  if (verdict == simdjson::SUCCESS) return {};

  // Two of the DOM's verdicts are not ours: it has no integers beyond 64 bits, and it lets a level more pass
  // when that is empty. On those the scan decides; on all others it says where.
  const fault found = find_fault(text, depth_max_);
  const bool scan_decides = verdict == simdjson::NUMBER_ERROR || verdict == simdjson::DEPTH_ERROR;
  if (found.what == fault_kind::none && scan_decides) return {};
  if (found.what == fault_kind::too_deep) {
    return error{errc::too_deep, static_cast<std::int64_t>(found.at), static_cast<std::int64_t>(depth_max_)};
  }
  return error{errc::malformed, static_cast<std::int64_t>(found.at)};
}

} // namespace rowe::json
