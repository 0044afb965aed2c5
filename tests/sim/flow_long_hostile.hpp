// SPDX-License-Identifier: Apache-2.0
// A peer that sends what nobody should: long messages that are wrong, never end, or take what others need.
// One message each, and what it must be told, or that it is closed.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "flow_long_peers.hpp"

namespace flow {

// In the order of flow_event::long_endless and those behind it.
enum class mischief : std::uint8_t {
  endless,
  trickle,
  wrong_end,
  two_long,
  binary,
  envelope,
  too_long,
  stop,
  call,
  no_object,
  no_text, // not UTF-8
  leaves,
  gap,         // in fragments, of which one is missing
  no_last,     // of which the last one is
  nested,      // a fragment in fragments
  interleaved, // two messages
};
inline constexpr std::uint64_t mischiefs = 16;

class long_hostile {
 public:
  // `mute`: gets maps, and reads them slowly.
  long_hostile(harness::core_harness& in, mischief what, bool mute, swarm::choices& random)
      : link{in, what == mischief::binary && random.one_in(2) ? tongue::numbers : tongue::slashed,
             "10.0.0.7:50000"},
        kind{what},
        is_mute{mute},
        stops_before{in.count(counter::stops)} {
    const auto& bounds = in.options.limits;
    if (mute && link.speaks != tongue::numbers)
      link.says.add(opcode::text, R"({"op":"subscribe","topic":"/map"})");
    const std::size_t bytes = bounds.message_bytes_max + 500 + random.below(40'000);
    const std::string body = long_body(0, bytes, random);
    opcode as = opcode::text;
    std::string text = publish_text("/hostile", body);
    switch (what) {
    case mischief::wrong_end: text.back() = ']'; break;
    case mischief::two_long:
      text = R"({"op":"publish","topic":"/hostile","other":)" + long_body(0, 6000, random) + R"(,"msg":)" +
             body + "}";
      break;
    case mischief::binary:
      as = opcode::binary;
      text = "c" + numbers::four(1) + numbers::four(9) + body;
      break;
    case mischief::envelope: {
      std::string members;
      for (int i = 0; i < 100; ++i) members += R"("m)" + std::to_string(i) + R"(":[1,{}],)";
      // Only the first 16 members are looked at.
      in_front = random.one_in(2);
      if (in_front) {
        text = "{" + members + text.substr(1);
      } else {
        members.pop_back();
        text.back() = ',';
        text += members + "}";
      }
      break;
    }
    case mischief::too_long:
      text = publish_text("/hostile", long_body(0, bounds.long_message_bytes_max + 1, random));
      break;
    case mischief::stop:
      text = R"({"op":"call_service","service":"/rowe/stop","args":{"reason":")" + std::string(bytes, 'x') +
             R"("}})";
      break;
    case mischief::call: text = R"({"op":"call_service","service":"/x","args":)" + body + "}"; break;
    case mischief::no_object: text = "[" + body + "]"; break;
    case mischief::no_text: text[text.size() - 40 - random.below(400)] = '\xff'; break;
    default: break;
    }
    switch (what) {
    case mischief::gap: link.says.add_in_fragments(text, random, 1); break;
    case mischief::no_last: {
      const auto all = fragments::cut(text, 3000);
      for (std::size_t i = 0; i + 1 != all.size(); ++i) link.says.add(opcode::text, all[i]);
      break;
    }
    case mischief::nested: link.says.add_in_fragments(fragments::fragment("1", "{", 0, "2"), random); break;
    case mischief::interleaved: {
      const auto first = fragments::cut(text, 3000, "1");
      link.says.add(opcode::text, first[0]);
      link.says.add(opcode::text, fragments::cut(text, 3000, "2")[random.below(3)]);
      for (std::size_t i = 1; i != first.size(); ++i) link.says.add(opcode::text, first[i]);
      break;
    }
    default: link.says.add_message(as, text, random);
    }
    if (what == mischief::endless || what == mischief::leaves) link.says.cut_off(1 + random.below(bytes));
    constexpr std::size_t paces[] = {300, 3000, 1 << 20};
    // One that is mute is given some of a map before it is closed.
    pace = what == mischief::trickle ? 1 : mute ? paces[0] : random.one_of(paces);
  }

  // What it must be told behind its message. Empty: nothing, or it never ends.
  std::string_view answer() const {
    switch (kind) {
    case mischief::wrong_end: return "no valid JSON";
    case mischief::two_long: return "only one member";
    case mischief::call: return "does not exist";
    case mischief::no_object: return "must be a JSON object";
    case mischief::gap: return "is expected";
    case mischief::nested: return "must not hold another";
    case mischief::interleaved: return "is under way";
    case mischief::envelope: return in_front ? "must be one of its first 16" : "";
    default: return {};
    }
  }
  // The code with which it must be closed. 0: it stays.
  std::uint16_t closed_with() const {
    switch (kind) {
    case mischief::binary: return link.speaks == tongue::numbers ? 0 : 1003;
    case mischief::too_long: return 1009;
    case mischief::no_text: return 1007;
    default: return 0;
    }
  }
  bool ends() const {
    return kind != mischief::endless && kind != mischief::trickle && kind != mischief::leaves &&
           kind != mischief::no_last;
  }

  long_link link;
  mischief kind;
  bool is_mute;
  bool in_front = false; // of the long member of an envelope are the others
  std::uint64_t stops_before;
  std::size_t pace = 1;
  std::size_t reads = 200; // if it is mute: bytes in a turn
  std::string told{};      // the last
  unsigned judged_in = 4;  // cycles behind its end
  bool judged = false;
};

} // namespace flow
