// SPDX-License-Identifier: Apache-2.0
// What the world of long messages is made of: texts that can be told apart, peers that say them in frames and
// pieces of all sizes, and a look at the frames that come back.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "flow.hpp"
#include "service/core/fragments.hpp"
#include "swarm_numbers.hpp"

namespace flow {

using rowe::wire::opcode;

// A message's body: an object of about so many bytes, with all that JSON has. "n" is its number.
inline std::string long_body(std::uint32_t n, std::size_t bytes, swarm::choices& random) {
  constexpr std::string_view items[] = {
      "0",       "-12.5e-7", R"("é\u00e9\n\"𝄞")", R"({"k":[true,null],"n":1})",
      "  [ ]\n", R"("op")",  "99999999",          R"({})"};
  std::string made = R"({"n":)" + std::to_string(n) + R"(,"x":[7)";
  const std::string_view usual = random.one_of(items);
  while (made.size() + 40 < bytes) {
    made += ',';
    made += random.one_in(3) ? random.one_of(items) : usual;
  }
  return made + "]}";
}

// What a peer is about to say: frames, of which its connection is given some bytes at a time.
class speech {
 public:
  void add(opcode what, std::string_view payload, bool last = true) {
    frames_.push_back(frame_of(what, payload, last));
    left_ += frames_.back().size();
  }
  // In one frame, or in fragments of random sizes, with pings between them.
  void add_message(opcode what, std::string_view text, swarm::choices& random) {
    const std::size_t most = random.one_in(2) ? text.size() : 1 + text.size() / (1 + random.below(60));
    for (bool first = true;; first = false) {
      const std::size_t here = most >= text.size() ? text.size() : random.below(2 * most);
      const bool last = here >= text.size();
      add(first ? what : opcode::continuation, text.substr(0, here), last);
      if (last) return;
      text.remove_prefix(here);
      if (random.one_in(4)) add(opcode::ping, "between");
    }
  }
  // In rosbridge's fragments, with other messages between them. `all_but`: these are left out.
  void add_in_fragments(std::string_view text, swarm::choices& random, std::size_t all_but = SIZE_MAX) {
    const std::size_t most = 1 + text.size() / 50;
    const bool as_reference = random.one_in(3);
    std::size_t number = 0;
    for (const std::string& one : fragments::cut(text, std::min<std::size_t>(most + random.below(3500), 3600),
                                                 as_reference ? "0" : R"("f")", as_reference)) {
      if (number++ != all_but) add_message(opcode::text, one, random);
      if (random.one_in(6)) add(opcode::text, R"({"op":"set_level","level":"warning"})");
    }
  }
  // Goes next, where a frame ends.
  void answer_ping(std::string_view payload) {
    if (never_ends_) return;
    auto pong = frame_of(opcode::pong, payload, true);
    left_ += pong.size();
    frames_.insert(frames_.begin() + (said_ != 0 ? 1 : 0), std::move(pong));
  }
  // The last bytes are never said.
  void cut_off(std::size_t bytes) {
    never_ends_ = true;
    while (!frames_.empty() && bytes >= frames_.back().size()) {
      bytes -= frames_.back().size();
      frames_.pop_back();
    }
    if (!frames_.empty()) frames_.back().resize(frames_.back().size() - bytes);
    left_ = 0;
    for (const auto& one : frames_) left_ += one.size();
  }

  std::size_t left() const { return left_; }
  // As much as the kernel keeps, and no more.
  void feed(harness::core_harness& on, connection_id to, std::size_t most) {
    if (on.net.unread(to) > 64 * 1024) return;
    while (most != 0 && !frames_.empty()) {
      const std::vector<std::byte>& frame = frames_.front();
      const std::size_t now = std::min(most, frame.size() - said_);
      on.net.arrive(to, std::span{frame}.subspan(said_, now));
      most -= now;
      left_ -= now;
      said_ += now;
      if (said_ != frame.size()) return;
      frames_.pop_front();
      said_ = 0;
    }
  }

 private:
  std::deque<std::vector<std::byte>> frames_;
  std::size_t said_ = 0; // of the first
  std::size_t left_ = 0;
  bool never_ends_ = false;
};

// Sees control frames, and whether they come between the fragments of a message.
class fragment_watch {
 public:
  // Calls `control(what, payload, between)`.
  template <class Control>
  void take(std::span<const std::byte> bytes, Control&& control) {
    for (;;) {
      if (payload_ != 0) {
        const std::size_t here = std::min(payload_, bytes.size());
        if (is_control_) text_.append(reinterpret_cast<const char*>(bytes.data()), here);
        payload_ -= here;
        bytes = bytes.subspan(here);
        if (payload_ != 0) return;
        if (is_control_) control(what_, std::string_view{text_}, in_message_);
      }
      if (bytes.empty()) return;
      header_.push_back(bytes.front());
      bytes = bytes.subspan(1);
      if (header_.size() < 2) continue;
      const auto said = std::to_integer<std::size_t>(header_[1]) & 127U;
      const std::size_t more = said == 127 ? 8 : said == 126 ? 2 : 0;
      if (header_.size() < 2 + more) continue;
      payload_ = more == 0 ? said : 0;
      for (std::size_t i = 2; i < header_.size(); ++i)
        payload_ = payload_ << 8U | std::to_integer<std::size_t>(header_[i]);
      what_ = rowe::wire::opcode_of(header_[0]);
      is_control_ = !rowe::wire::is_data(what_);
      if (!is_control_) in_message_ = !rowe::wire::is_final(header_[0]);
      header_.clear();
      text_.clear();
      if (is_control_ && payload_ == 0) control(what_, std::string_view{text_}, in_message_);
    }
  }

 private:
  std::vector<std::byte> header_;
  std::string text_;
  opcode what_ = opcode::text;
  std::size_t payload_ = 0;
  bool is_control_ = false;
  bool in_message_ = false;
};

// How a peer of this world speaks.
enum class tongue : std::uint8_t { slashed, unslashed, numbers };
inline constexpr tongue tongues[] = {tongue::slashed, tongue::unslashed, tongue::numbers};

inline std::string named(tongue by, std::string_view topic) {
  return std::string{by == tongue::unslashed ? topic.substr(1) : topic};
}
// A rosbridge message.
inline std::string publish_text(std::string_view topic, std::string_view body) {
  return R"({"op":"publish","topic":")" + std::string{topic} + R"(","msg":)" + std::string{body} + "}";
}

// A connection of this world.
struct long_link {
  long_link(harness::core_harness& in, tongue how, std::string_view address, std::string_view path = "/")
      : on{in},
        speaks{how},
        peer{in, rowe::service::side::server, address, path,
             how == tongue::numbers ? numbers::subprotocol : std::string_view{}} {
    peer.answers_pings = false; // where a frame ends only
  }

  harness::core_harness& on;
  tongue speaks;
  swarm::far_end peer;
  speech says;
  fragment_watch frames;
  swarm::number_lists knows;
  std::uint64_t lost_own = 0;  // that a message of its own was dropped, since the last settlement
  std::uint64_t told = 0;      // anything else but messages
  fragments::reassembly whole; // of messages in fragments

  connection_id id() const { return peer.id(); }
  // All that it has said so far was carried out.
  bool all_read() const {
    return says.left() == 0 && on.net.unread(id()) == 0 && on.core.wanted_bytes(id()) != 0;
  }
  // Reads so many bytes. Returns messages of topics, and what is neither that nor a list.
  std::vector<std::string> hear(std::size_t most, swarm::coverage& seen) {
    const auto sent = on.net.sent(id());
    frames.take(sent.first(std::min(most, sent.size())),
                [&](opcode what, std::string_view payload, bool between) {
                  if (what == opcode::ping) says.answer_ping(payload);
                  if (!between) return;
                  seen.add(what == opcode::ping   ? flow_event::long_ping_between
                           : what == opcode::pong ? flow_event::long_pong_between
                                                  : flow_event::long_close_between);
                });
    std::vector<std::string> texts;
    for (std::string& one : peer.hear(most)) {
      if (one.starts_with(R"({"op":"fragment")")) seen.add(flow_event::fragments_heard);
      if (auto text = speaks == tongue::numbers ? std::optional{std::move(one)} : whole.take(one))
        texts.push_back(std::move(*text));
    }
    if (!whole.between.empty()) seen.add(flow_event::fragments_let_pass);
    whole.between.clear();
    std::erase_if(texts, [&](const std::string& text) {
      if (speaks == tongue::numbers && swarm::number_lists::is_list(text)) {
        (void)knows.take(text);
        return true;
      }
      const bool full = text.find("was dropped: others use the room") != std::string::npos;
      lost_own += full;
      return full && !text.starts_with(R"({"op":"service_response")"); // which says whose call has failed
    });
    return texts;
  }
  static bool is_message(std::string_view text) {
    return text.starts_with(R"({"op":"publish")") || text.starts_with('m');
  }
};

} // namespace flow
