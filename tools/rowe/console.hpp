// SPDX-License-Identifier: Apache-2.0
// What the program says to people, on stderr, one line at a time; data goes to stdout (see output.hpp).
// Nothing is coloured, so nothing has to be switched off where no colour is wanted.
#pragma once
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <rowe/event.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>

namespace rowe::tools {

// A view of a text, or a whole number: one part of what joined() puts together.
class part {
 public:
  template <class T>
  requires std::integral<T> || std::convertible_to<const T&, std::string_view>
  explicit part(const T& value) noexcept {
    if constexpr (std::integral<T>) {
      number_ = static_cast<std::uint64_t>(value);
      kind_ = std::signed_integral<T> ? kind::signed_number : kind::unsigned_number;
    } else {
      text_ = std::string_view{value};
    }
  }
  void append_to(std::string& text) const;

 private:
  enum class kind : std::uint8_t { text, signed_number, unsigned_number };
  std::string_view text_;
  std::uint64_t number_ = 0;
  kind kind_ = kind::text;
};

// Texts and whole numbers, one after another.
std::string joined_parts(std::span<const part> parts);
template <class... Parts>
std::string joined(const Parts&... parts) {
  return joined_parts({{part{parts}...}});
}

// "1 message", "2 messages".
template <std::integral Count>
std::string counted(Count count, std::string_view thing) {
  return joined(count, " ", thing, count == 1 ? "" : "s");
}

// What is typed to run a verb: "rowe serve"; a program of its own, such as "rowe_echo", is its own verb.
inline std::string typed(std::string_view verb) {
  return joined(verb.starts_with("rowe_") ? "" : verb.empty() ? "rowe" : "rowe ", verb);
}

// As syslog numbers them.
enum class severity : std::uint8_t { error = 3, warning = 4, notice = 5, info = 6 };

// How lines are written for programs that read them.
struct log_style {
  bool json = false;       // an object a line, with the time
  bool priorities = false; // "<4>" in front, which journald takes out again
};

// Whether what is written to stderr goes to journald.
bool journal_reads_stderr();

class console {
 public:
  // The verb opens every line: "rowe serve: ...".
  explicit console(std::string_view verb) : verb_{typed(verb)} {}

  void write_as(const log_style& style) noexcept { style_ = style; }

  // --quiet: errors and warnings only.
  void be_quiet(bool quiet) noexcept { quiet_ = quiet; }
  bool quiet() const noexcept { return quiet_; }

  template <class... Parts>
  void note(const Parts&... parts) const {
    say(severity::info, joined(parts...));
  }
  template <class... Parts>
  void error(const Parts&... parts) const {
    say(severity::error, joined(parts...));
  }
  // `members`: of the JSON object, besides time, severity, program and message.
  void say(severity how, std::string_view message, std::string_view members = {}) const;

 private:
  std::string verb_;
  log_style style_;
  bool quiet_ = false;
};

// "10.0.0.7:4711: driver: denied: ... (allow it with ...)": who it concerns, always in front; as whom it came
// in; the kind of event; what. What a peer said is in quotes, so nobody can write a line that looks like one
// of another. Without `kind`: who, and what.
enum class with_kind : bool { no, yes };
std::string sentence_of(const event& happened, with_kind kind = with_kind::no);

// Text from a peer, fit for a terminal: control characters (C0, DEL, and C1 in UTF-8) become "\u009b" and the
// like, since some of them move the cursor or do worse; and so does what ends a line, has no width or changes
// the direction of writing, since it makes a text look like another. What is no UTF-8 becomes U+FFFD.
std::string printable(std::string_view text);
// Where the first character begins that is no UTF-8; nothing: all of the text is.
std::optional<std::size_t> not_utf8_at(std::string_view text) noexcept;

// The same in quotes.
std::string quoted(std::string_view text);

// "1.250 s".
std::string seconds_text(rt::duration time);

} // namespace rowe::tools
