// SPDX-License-Identifier: Apache-2.0
#include "json/structs/encoder_pieces.hpp"

#include <algorithm>
#include <utility>

#include "json/structs/encoder_run.hpp"
#include "json/text/utf8.hpp"

namespace rowe::json {

void encoder_pieces::begin(const encoder& program, const void* object) noexcept {
  program_ = &program;
  const encoder::step* const first = program.program_.get();
  frames_[0] = {.first = first,
                .last = first + program.step_count_,
                .next = first,
                .base = static_cast<const char*>(object),
                .left = 0,
                .stride = 0};
  depth_ = 1;
  literal_written_ = false;
  leaf_ = leaf::none;
  pending_ = {};
  last_ = 0;
  nonfinite_ = 0;
}

bool encoder_pieces::write(writer& into) noexcept {
  nonfinite_ = 0;
  bool ends = false;
  while (!ends && flush(into)) {
    if (leaf_ != leaf::none) {
      go_on_with_leaf();
      continue;
    }
    frame& now = frames_[depth_ - 1];
    if (now.next == now.last) {
      if (now.left == 0) {
        ends = --depth_ == 0;
        continue;
      }
      --now.left;
      now.base += now.stride;
      now.next = now.first;
      pending_ = ",";
      continue;
    }
    const encoder::step& s = *now.next;
    if (!std::exchange(literal_written_, true)) {
      pending_ = {program_->literals_.get() + s.literal, s.literal_bytes};
      continue;
    }
    literal_written_ = false;
    now.next += 1 + s.body;
    begin_value(s, now.base);
  }
  into.nonfinite_ += nonfinite_;
  return ends;
}

// False: not all of what is pending has found room.
inline bool encoder_pieces::flush(writer& into) noexcept {
  if (pending_.empty()) return true;
  const auto room = static_cast<std::size_t>(into.end_ - into.at_);
  const std::string_view now = pending_.substr(0, room);
  into.append(now);
  if (!now.empty()) last_ = now.back();
  pending_.remove_prefix(now.size());
  return pending_.empty();
}

inline void encoder_pieces::push(const encoder::step& s, const char* base, std::size_t count,
                                 std::uint32_t stride) noexcept {
  if (count == 0) return;
  frames_[depth_++] = {.first = &s + 1,
                       .last = &s + 1 + s.body,
                       .next = &s + 1,
                       .base = base,
                       .left = count - 1,
                       .stride = stride};
}

void encoder_pieces::begin_value(const encoder::step& s, const char* base) noexcept {
  const auto begin_leaf = [&](leaf which, const char* from, std::size_t count) {
    leaf_ = which;
    of_ = &s;
    from_ = from;
    left_ = count;
    begun_ = false;
  };
  writer to{scratch_};
  encoder::run leafs{*program_, to};
  const auto keep = [&](const char* end) {
    pending_ = {scratch_.data(), static_cast<std::size_t>(end - scratch_.data())};
  };
  switch (s.what) {
  case operation::nothing: break;
  case operation::comma:
    if (last_ != '{') pending_ = ",";
    break;
  case operation::text:
  case operation::c_text: {
    const std::string_view text =
        s.what == operation::text ? s.text_of(base + s.argument) : c_text(base + s.argument, s.count);
    pending_ = "\"";
    begin_leaf(leaf::text, text.data(), text.size());
    break;
  }
  case operation::named:
    pending_ = leafs.name_of(s, base + s.offset);
    if (pending_.empty()) keep(leafs.scalar(s, s.plain, base + s.offset, scratch_.data()));
    break;
  case operation::scalars: begin_leaf(leaf::scalars, base + s.offset, encoder::run::count(s, base)); break;
  case operation::base64: begin_leaf(leaf::base64, base + s.offset, encoder::run::count(s, base)); break;
  case operation::repeat: push(s, base + s.offset, encoder::run::count(s, base), s.stride); break;
  case operation::perhaps: {
    const void* const inside = s.engaged(base + s.argument);
    if (inside != nullptr) {
      push(s, static_cast<const char*>(inside), 1, 0);
    } else if (s.else_null) {
      pending_ = "null";
    }
    break;
  }
  default: keep(leafs.scalar(s, s.what, base + s.offset, scratch_.data()));
  }
  nonfinite_ += to.nonfinite();
}

// Puts the next part of a value into `pending_`.
void encoder_pieces::go_on_with_leaf() noexcept {
  constexpr std::size_t text_part = 64;       // bytes, each of which takes six at most
  constexpr std::size_t base64_part = 3 * 96; // four of each three
  static_assert(6 * text_part + 2 <= sizeof scratch_ && base64_part / 3 * 4 <= sizeof scratch_);
  static_assert(scalar_buffer_bytes + 1 <= sizeof scratch_);
  writer to{scratch_};
  if (leaf_ == leaf::text) {
    if (left_ == 0) {
      pending_ = "\"";
      leaf_ = leaf::none;
      return;
    }
    std::string_view part = utf8_prefix({from_, left_}, text_part);
    if (part.empty()) part = {from_, std::min(left_, text_part)}; // no UTF-8
    to.string(part);
    pending_ = to.text().substr(1, to.bytes() - 2);
    from_ += part.size();
    left_ -= part.size();
    return;
  }
  if (left_ == 0) {
    leaf_ = leaf::none;
    return;
  }
  char* at = scratch_.data();
  if (leaf_ == leaf::base64) {
    const std::size_t part = std::min(left_, base64_part);
    at = write_base64(at, from_, part);
    from_ += part;
    left_ -= part;
  } else {
    encoder::run leafs{*program_, to};
    *at = ',';
    at += std::exchange(begun_, true) ? 1 : 0;
    at = leafs.scalar(*of_, of_->element, from_, at);
    from_ += of_->stride;
    --left_;
  }
  pending_ = {scratch_.data(), static_cast<std::size_t>(at - scratch_.data())};
  nonfinite_ += to.nonfinite();
}

} // namespace rowe::json
