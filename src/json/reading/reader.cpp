// SPDX-License-Identifier: Apache-2.0
#include "json/reading/reader.hpp"

#include <array>
#include <new>
#include <utility>

#include <simdjson.h>

#include "json/reading/scanner.hpp"
#include "json/reading/token_check.hpp"

namespace rowe::json {

static_assert(reader::tailroom_bytes >= simdjson::SIMDJSON_PADDING);
static_assert(fault_depth_limit >= reader::depth_max_default);

struct reader::state {
  std::unique_ptr<simdjson::internal::dom_parser_implementation> tokens; // its first stage alone is used
  std::array<member, 16> members;                                        // envelopes have fewer
  document last;
  scanner scanned; // the text that validate() took last, where its tokens did not show that it is valid
};

reader::reader(std::unique_ptr<state> s, std::size_t bytes_max, std::size_t depth_max) noexcept
    : state_{std::move(s)}, bytes_max_{bytes_max}, depth_max_{depth_max} {}
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
  std::unique_ptr<state> s{new (std::nothrow) state};
  if (s == nullptr || simdjson::get_active_implementation()->create_dom_parser_implementation(
                          bytes_max, depth_max, s->tokens) != simdjson::SUCCESS) {
    return error{errc::no_memory, signed_of(bytes_max), signed_of(bytes_limit)};
  }
  return reader{std::move(s), bytes_max, depth_max};
}

status reader::validate(std::string_view text) noexcept {
  if (validate_tokens(text)) [[likely]]
    return {};
  state& s = *state_;
  s.scanned = scanner{depth_max_};
  if (text.size() > bytes_max_)
    return error{errc::too_big, static_cast<std::int64_t>(text.size()),
                 static_cast<std::int64_t>(bytes_max_)};
  if (s.scanned.feed(text) && s.scanned.finish()) {
    s.last.text = text;
    return {};
  }
  const fault& wrong = s.scanned.found();
  if (wrong.what == fault_kind::too_deep) {
    return error{errc::too_deep, static_cast<std::int64_t>(wrong.at), static_cast<std::int64_t>(depth_max_)};
  }
  return error{errc::malformed, static_cast<std::int64_t>(wrong.at)};
}

bool reader::validate_tokens(std::string_view text) noexcept {
  state& s = *state_;
  s.last = {};
  tokens_ = 0;
  if (text.empty() || text.size() > bytes_max_ ||
      s.tokens->stage1(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(),
                       simdjson::stage1_mode::regular) != simdjson::SUCCESS)
    return false;
  tokens_ = s.tokens->n_structural_indexes;
  member_index found;
  if (!tokens_are_valid(text, {s.tokens->structural_indexes.get(), tokens_}, depth_max_, s.members, found) ||
      !escapes_are_valid(text))
    return false;
  s.last.text = text;
  s.last.indexed = {s.members.data(), found.count};
  if (found.count != 0) s.last.behind_index = found.all ? text.data() + text.size() : found.behind;
  return true;
}

std::span<const placed_member> reader::members_before_fault() const noexcept {
  return state_->scanned.members();
}

const document& reader::last() const noexcept { return state_->last; }

} // namespace rowe::json
