// SPDX-License-Identifier: Apache-2.0
#include "wire/websocket/frame_parser.hpp"

#include <cassert>
#include <cstdio>
#include <cstring>

#include "wire/websocket/frame_header.hpp"

namespace rowe::wire {
namespace {

// The bytes that snprintf() wrote of a close reason, which is cut at the end of a close frame.
constexpr std::size_t written(int wanted) noexcept {
  return std::min(static_cast<std::size_t>(wanted), close_reason_bytes_max - 1);
}

} // namespace

// ---- header

auto frame_parser::check_first_byte(std::byte first) const noexcept -> std::optional<protocol_error> {
  const std::uint8_t bits = number_of(first);
  const std::uint8_t code = bits & opcode_bits;
  if ((bits & reserved_bits) != 0) return protocol_error{close_code::protocol_error, "a reserved bit is set"};
  if ((code & ~control_bit) > 2) return protocol_error{close_code::protocol_error, "the opcode is reserved"};
  if ((code & control_bit) != 0) {
    if ((bits & final_bit) == 0)
      return protocol_error{close_code::protocol_error, "a control frame is fragmented"};
    return std::nullopt;
  }
  const bool continues = code == static_cast<std::uint8_t>(opcode::continuation);
  if (continues && !in_message_) {
    return protocol_error{close_code::protocol_error, "a continuation frame continues nothing"};
  }
  if (!continues && in_message_) {
    return protocol_error{close_code::protocol_error, "a message begins inside a fragmented one"};
  }
  return std::nullopt;
}

auto frame_parser::check_second_byte(std::byte first, std::byte second) const noexcept
    -> std::optional<protocol_error> {
  const bool masked = (number_of(second) & mask_bit) != 0;
  if (ours_ == role::server && !masked && !limits_.unmasked_accepted) {
    return protocol_error{close_code::protocol_error, "a client's frame is not masked"};
  }
  if (ours_ == role::client && masked) {
    return protocol_error{close_code::protocol_error, "a server's frame is masked"};
  }
  if ((number_of(first) & control_bit) != 0 && (number_of(second) & length_bits) > control_bytes_max) {
    return protocol_error{close_code::protocol_error, "a control frame is longer than 125 bytes"};
  }
  return std::nullopt;
}

auto frame_parser::read_length(const std::byte* bytes) noexcept -> std::optional<protocol_error> {
  const std::size_t count = length_bytes(bytes[1]);
  if (count == 0) {
    frame_.payload_bytes = number_of(bytes[1]) & length_bits;
    return std::nullopt;
  }
  const std::uint64_t length = read_big_endian(bytes + 2, count);
  if (length >> 63 != 0) return protocol_error{close_code::protocol_error, "the top bit of a length is set"};
  if (length <= (count == 2 ? 125U : 0xffffU)) {
    return protocol_error{close_code::protocol_error, "a length is not written in its shortest form"};
  }
  frame_.payload_bytes = length;
  return std::nullopt;
}

// Takes a header, or a part of it, from the front of `bytes`. in_frame_ says that it is complete.
auto frame_parser::take_header(std::span<const std::byte> bytes, std::size_t& consumed) noexcept
    -> std::optional<protocol_error> {
  const std::byte* from = bytes.data();
  std::size_t have = bytes.size();
  if (header_have_ > 0) { // some of it came earlier; what is copied beyond the header does no harm
    const std::size_t added = std::min(bytes.size(), header_.size() - header_have_);
    if (added > 0) std::memcpy(header_.data() + header_have_, bytes.data(), added);
    from = header_.data();
    have = header_have_ + added;
  }
  if (have >= 1) {
    if (const auto wrong = check_first_byte(from[0])) return wrong;
  }
  if (have >= 2) {
    if (const auto wrong = check_second_byte(from[0], from[1])) return wrong;
  }
  const std::size_t size = have < 2 ? 2 : header_bytes(from[1]);
  if (have < size) {
    if (header_have_ == 0 && have > 0) std::memcpy(header_.data(), bytes.data(), have);
    header_have_ = static_cast<std::uint8_t>(have);
    consumed = bytes.size();
    return std::nullopt;
  }
  if (const auto wrong = read_length(from)) return wrong;
  frame_.what = static_cast<opcode>(number_of(from[0]) & opcode_bits);
  frame_.final = (number_of(from[0]) & final_bit) != 0;
  frame_.key = {};
  if ((number_of(from[1]) & mask_bit) != 0) {
    std::memcpy(frame_.key.data(), from + size - sizeof(mask_key), sizeof(mask_key));
  }
  consumed = size - header_have_;
  header_have_ = 0;
  return begin_frame();
}

auto frame_parser::begin_frame() noexcept -> std::optional<protocol_error> {
  in_frame_ = true;
  payload_done_ = 0;
  if (is_control(frame_.what)) return std::nullopt;
  if (frame_.what == opcode::continuation) {
    if (fragments_ >= fragments_max()) return too_many_frames();
    ++fragments_;
  } else {
    message_ = frame_.what;
    message_bytes_ = 0;
    in_pieces_ = false;
    gathered_ = handed_ = 0;
    fragments_ = 1;
  }
  const std::uint64_t most = std::max(limits_.message_bytes_max, limits_.long_bytes_max);
  if (frame_.payload_bytes > most - message_bytes_) return too_big();
  if (!in_pieces_ && frame_.payload_bytes > limits_.message_bytes_max - message_bytes_) {
    in_pieces_ = true;
    gathered_ = static_cast<std::size_t>(message_bytes_);
  }
  return std::nullopt;
}

// A long message may have as many frames for each message_bytes_max of its bytes.
std::uint32_t frame_parser::fragments_max() const noexcept {
  const std::uint64_t times = in_pieces_ ? 1 + message_bytes_ / limits_.message_bytes_max : 1;
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(times * limits_.fragments_max, UINT32_MAX));
}

auto frame_parser::too_big() noexcept -> protocol_error {
  char* const text = reinterpret_cast<char*>(control_.data());
  const int bytes = std::snprintf(
      text, close_reason_bytes_max,
      "a message of %llu bytes%s exceeds the limit %s of %zu: send less, or raise it",
      static_cast<unsigned long long>(message_bytes_ + frame_.payload_bytes), frame_.final ? "" : " or more",
      limits_.long_bytes_max > limits_.message_bytes_max ? "long_message_bytes_max" : "message_bytes_max",
      std::max(limits_.message_bytes_max, limits_.long_bytes_max));
  return {close_code::too_big, {text, written(bytes)}};
}

auto frame_parser::too_many_frames() noexcept -> protocol_error {
  char* const text = reinterpret_cast<char*>(control_.data());
  const int bytes = std::snprintf(
      text, close_reason_bytes_max,
      "a message in %u frames or more exceeds the limit fragments_max of %u: send fewer, or raise it",
      fragments_ + 1, fragments_max());
  return {close_code::policy, {text, written(bytes)}};
}

// Takes a message that is one complete frame, the usual case, without the states of other cases. False if it
// is another case, or wrong; then nothing has happened.
bool frame_parser::take_whole_message(std::span<std::byte> bytes, frame_step& step) noexcept {
  if (in_message_ || header_have_ > 0) return false;
  const auto frame = extent_of(bytes);
  if (!frame || frame->payload > limits_.message_bytes_max) return false;
  const std::uint8_t first = number_of(bytes[0]);
  constexpr auto text = final_bit | static_cast<std::uint8_t>(opcode::text);
  constexpr auto binary = final_bit | static_cast<std::uint8_t>(opcode::binary);
  if (first != text && first != binary) return false;
  if (((number_of(bytes[1]) & mask_bit) != 0) != (ours_ == role::server)) return false;
  const std::size_t length = length_bytes(bytes[1]);
  if (length > 2 || (length == 2 && frame->payload <= 125)) return false;
  mask_key key{};
  if (ours_ == role::server)
    std::memcpy(key.data(), bytes.data() + frame->header - sizeof(mask_key), sizeof(mask_key));
  const std::span<std::byte> payload = bytes.subspan(frame->header, frame->payload);
  const bool ascii = mask(payload, key);
  step.consumed = frame->header + frame->payload;
  step.payload = payload;
  step.event = first == text ? frame_event::text : frame_event::binary;
  if (first == text && !ascii && !(text_.feed(payload) && text_.complete())) {
    step = violate(not_utf8);
    step.consumed = bytes.size();
  }
  return true;
}

// ---- payload

// Both functions take the payload, or the part of it that is there, from the front of `rest`. in_frame_ says
// that more of it must come.

frame_step frame_parser::take_control(std::span<std::byte> rest) noexcept {
  const auto size = static_cast<std::size_t>(frame_.payload_bytes);
  const auto done = static_cast<std::size_t>(payload_done_);
  const std::size_t taken = std::min(size - done, rest.size());
  std::span<std::byte> payload;
  if (taken == size) {
    payload = rest.first(size);
  } else {
    if (taken > 0) std::memcpy(control_.data() + done, rest.data(), taken);
    payload_done_ += taken;
    if (payload_done_ < size) return {.consumed = taken};
    payload = std::span{control_}.first(size);
  }
  (void)mask(payload, frame_.key);
  in_frame_ = false;
  frame_step step =
      frame_.what == opcode::close
          ? read_close(payload)
          : frame_step{.event = frame_.what == opcode::ping ? frame_event::ping : frame_event::pong,
                       .payload = payload};
  step.consumed = taken;
  return step;
}

frame_step frame_parser::take_data(std::span<std::byte> rest) noexcept {
  if (in_pieces_) [[unlikely]]
    return take_piece(rest);
  if (payload_done_ == 0 && !in_message_ && frame_.final && rest.size() >= frame_.payload_bytes) {
    const std::span<std::byte> payload = rest.first(static_cast<std::size_t>(frame_.payload_bytes));
    const bool ascii = mask(payload, frame_.key);
    if (message_ == opcode::text && !ascii && !text_.feed(payload)) return violate(not_utf8);
    return end_message(payload, payload.size());
  }
  const auto taken =
      static_cast<std::size_t>(std::min<std::uint64_t>(frame_.payload_bytes - payload_done_, rest.size()));
  const std::span<std::byte> piece = assembly_.subspan(static_cast<std::size_t>(message_bytes_), taken);
  (void)mask_copy(piece, rest.first(taken), frame_.key, static_cast<std::size_t>(payload_done_));
  if (message_ == opcode::text && !text_.feed(piece)) return violate(not_utf8);
  message_bytes_ += taken;
  payload_done_ += taken;
  if (payload_done_ < frame_.payload_bytes) return {.consumed = taken};
  if (frame_.final) return end_message(assembly_.first(static_cast<std::size_t>(message_bytes_)), taken);
  in_frame_ = false;
  in_message_ = true;
  return {.consumed = taken};
}

// Of a long message: what was gathered of it so far, or what is there of its frame, unmasked where it is.
frame_step frame_parser::take_piece(std::span<std::byte> rest) noexcept {
  frame_step step{.event = frame_event::piece, .in_pieces = true, .message = message_};
  step.known_bytes = message_bytes_ + frame_.payload_bytes - payload_done_;
  if (handed_ != gathered_) {
    step.payload = assembly_.subspan(handed_, std::min(gathered_ - handed_, piece_bytes_max));
    handed_ += step.payload.size();
    return step;
  }
  const std::uint64_t left = frame_.payload_bytes - payload_done_;
  step.consumed =
      static_cast<std::size_t>(std::min<std::uint64_t>(left, std::min(rest.size(), piece_bytes_max)));
  step.payload = rest.first(step.consumed);
  const bool ascii = mask(step.payload, frame_.key, static_cast<std::size_t>(payload_done_));
  const bool in_character = !text_.complete();
  if (message_ == opcode::text && (!ascii || in_character) && !text_.feed(step.payload))
    return violate(not_utf8);
  count_piece(step.payload);
  payload_done_ += step.consumed;
  if (step.consumed < left) {
    if (step.consumed == 0) step.event = frame_event::need_more;
    return step;
  }
  if (frame_.final) {
    const std::uint64_t known = step.known_bytes;
    step = end_message(step.payload, step.consumed);
    step.in_pieces = true;
    step.known_bytes = known;
    return step;
  }
  in_frame_ = false;
  in_message_ = true;
  return step;
}

frame_step frame_parser::end_message(std::span<std::byte> message, std::size_t consumed) noexcept {
  if (message_ == opcode::text && !text_.complete()) return violate(not_utf8);
  in_frame_ = false;
  in_message_ = false;
  return {.event = message_ == opcode::text ? frame_event::text : frame_event::binary,
          .consumed = consumed,
          .payload = message};
}

frame_step frame_parser::read_close(std::span<std::byte> body) noexcept {
  std::uint16_t code = close_code::none_given;
  std::span<std::byte> reason;
  if (body.size() == 1) return violate({close_code::protocol_error, "a close frame has half a code"});
  if (body.size() >= 2) {
    code = static_cast<std::uint16_t>(read_big_endian(body.data(), 2));
    reason = body.subspan(2);
    if (!close_code_is_valid(code))
      return violate({close_code::protocol_error, "the close code is not valid"});
    if (!is_utf8(reason)) return violate({close_code::invalid_text, "the close reason is not UTF-8"});
  }
  ended_ = true;
  return {.event = frame_event::close,
          .payload = body,
          .close_code = code,
          .reason = {reinterpret_cast<const char*>(reason.data()), reason.size()}};
}

frame_step frame_parser::violate(protocol_error what) noexcept {
  ended_ = true;
  return {.event = frame_event::violation, .close_code = what.code, .reason = what.diagnostic};
}

// ---- connection

void frame_parser::reset(role ours, frame_limits limits, std::span<std::byte> assembly) noexcept {
  assert(assembly.size() >= limits.message_bytes_max);
  *this = frame_parser{};
  ours_ = ours;
  limits_ = limits;
  limits_.message_bytes_max = std::min(limits.message_bytes_max, assembly.size());
  assembly_ = assembly;
  ended_ = false;
}

frame_step frame_parser::next(std::span<std::byte> bytes) noexcept {
  frame_step whole;
  if (!ended_ && !in_frame_ && take_whole_message(bytes, whole)) return whole;
  return take_pieces(bytes);
}

// Everything but a message that is one frame and all there.
[[gnu::noinline]] frame_step frame_parser::take_pieces(std::span<std::byte> bytes) noexcept {
  std::size_t consumed = 0;
  std::size_t frames = 0;
  while (!ended_) { // one turn a frame; a frame without an event is a fragment, and takes at least a header
    ++frames;
    if (!in_frame_) {
      std::size_t taken = 0;
      const auto wrong = take_header(bytes.subspan(consumed), taken);
      consumed += taken;
      if (wrong) {
        frame_step step = violate(*wrong);
        step.consumed = bytes.size();
        step.frames = frames;
        return step;
      }
      if (!in_frame_) return {.consumed = consumed, .frames = frames};
    }
    const std::span<std::byte> rest = bytes.subspan(consumed);
    frame_step step = is_control(frame_.what) ? take_control(rest) : take_data(rest);
    consumed += step.consumed;
    step.consumed = ended_ ? bytes.size() : consumed;
    step.frames = frames;
    if (step.event != frame_event::need_more || in_frame_ || frames == frames_in_step_max) return step;
  }
  return {.consumed = bytes.size()};
}

bool frame_parser::mid_message() const noexcept {
  return !ended_ && (in_frame_ || in_message_ || header_have_ > 0);
}

auto frame_parser::look_ahead(std::span<const std::byte> bytes) const noexcept -> std::optional<outlook> {
  if (ended_) return std::nullopt;
  const auto open_after = [this](opcode what, bool final) { return is_control(what) ? in_message_ : !final; };
  if (in_frame_) {
    return outlook{static_cast<std::size_t>(frame_.payload_bytes - payload_done_),
                   open_after(frame_.what, frame_.final)};
  }
  if (header_have_ == 0) return outlook{0, in_message_};
  std::array<std::byte, frame_header_bytes_max> whole = header_;
  const std::size_t added = std::min(bytes.size(), whole.size() - header_have_);
  if (added > 0) std::memcpy(whole.data() + header_have_, bytes.data(), added);
  const std::size_t have = header_have_ + added;
  if (have < 2 || have < header_bytes(whole[1])) return std::nullopt;
  const std::size_t count = length_bytes(whole[1]);
  const std::uint64_t payload =
      count == 0 ? number_of(whole[1]) & length_bits : read_big_endian(whole.data() + 2, count);
  return outlook{static_cast<std::size_t>(header_bytes(whole[1]) - header_have_ + payload),
                 open_after(opcode_of(whole[0]), is_final(whole[0]))};
}

frame_parser frame_parser::anew() const noexcept {
  frame_parser other;
  other.reset(ours_, limits_, assembly_);
  return other;
}

bool frame_parser::check() const noexcept {
  if (handed_ > gathered_ || gathered_ > limits_.message_bytes_max) return false;
  if (ended_) return true;
  if (header_have_ >= header_.size() || (in_frame_ && header_have_ > 0)) return false;
  const std::uint64_t most = std::max(limits_.message_bytes_max, limits_.long_bytes_max);
  if (limits_.message_bytes_max > assembly_.size() ||
      message_bytes_ > (in_pieces_ ? most : limits_.message_bytes_max))
    return false;
  if (in_message_ && (fragments_ == 0 || fragments_ > std::max(fragments_max(), 1U))) return false;
  const bool in_text = message_ == opcode::text && (in_message_ || (in_frame_ && !is_control(frame_.what)));
  if (!in_text && !text_.complete()) return false; // or the next text would begin inside a character
  if (!in_frame_) return true;
  if (is_control(frame_.what))
    return frame_.payload_bytes <= control_bytes_max && payload_done_ < frame_.payload_bytes;
  return payload_done_ < frame_.payload_bytes &&
         frame_.payload_bytes - payload_done_ <=
             (in_pieces_ ? most : limits_.message_bytes_max) - message_bytes_;
}

} // namespace rowe::wire
