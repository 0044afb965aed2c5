// SPDX-License-Identifier: Apache-2.0
// What the program says to people, on stderr, one line at a time; data goes to stdout, through emit().
// Nothing is coloured, so nothing has to be switched off where no colour is wanted.
#pragma once
#include <string>
#include <string_view>

#include <rowe/event.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>

namespace rowe::tools {

class console {
 public:
  // `verb` opens every line: "rowe serve: ...".
  explicit console(std::string_view verb) : prefix_{"rowe "} { prefix_.append(verb).append(": "); }

  // --quiet: notes are left out, errors are not.
  void be_quiet(bool quiet) noexcept { quiet_ = quiet; }
  bool quiet() const noexcept { return quiet_; }

  void note(std::string_view text) const;
  void error(std::string_view text) const;

 private:
  std::string prefix_;
  bool quiet_ = false;
};

// Writes `text` to stdout and flushes it. False when nobody reads any more (EPIPE): a pipe that `head` has
// closed is no error, and the verb ends quietly.
[[nodiscard]] bool emit(std::string_view text);

// An error's sentence.
std::string sentence_of(const error& reason);
// "10.0.0.7:4711: refused: ... (allow it with ...)".
std::string sentence_of(const event& happened);

// Text from a peer, fit for a terminal: control characters (C0, DEL, and C1 in UTF-8) become "\u009b" and the
// like, since some of them move the cursor or do worse.
std::string printable(std::string_view text);

// "1.250 s".
std::string seconds_text(rt::duration time);

} // namespace rowe::tools
