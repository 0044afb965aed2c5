// SPDX-License-Identifier: Apache-2.0
// What the verbs that connect have in common: reading the URL, waiting for the connection, and telling what
// happens to it.
#pragma once
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <rowe/endpoint.hpp>

#include "../arguments/command_line.hpp"
#include "../console.hpp"
#include "../exit_code.hpp"

namespace rowe::tools {

// A URL as people write it.
struct spelled_url {
  std::string url;   // "ws[s]://HOST[:PORT][/PATH]"; empty when it is none
  std::string wrong; // and then: why
};

// Takes ws://..., wss://..., HOST[:PORT][/PATH], where the port is 8080 if there is none, and http[s]://...
// as a browser shows it for the page.
spelled_url read_url(std::string_view text);

// Whether a word is meant as a URL rather than as a topic's name or JSON.
bool reads_like_url(std::string_view word) noexcept;

// Where a verb connects to, and what it shows there.
struct remote_place {
  std::string url;
  std::string ca;
  std::string pin;
  std::string cert;
  std::string key;
  std::string token_file;
};

// The options that every verb with a place has, behind its own. Each has a variable of the environment.
std::vector<option> with_remote(remote_place& into, std::vector<option> own);
// The options among them that were given, as they are to be typed for another verb at the same place, each
// with a space in front. What the environment says it goes on saying.
std::string typed_again(const remote_place& at);
// Puts them into the options. Otherwise the verb ends with this, and the reason was printed.
std::optional<exit_code> use(const remote_place& at, endpoint_options& options, const console& to);

// An endpoint that a verb has opened, and where it connects to.
struct opened_endpoint {
  endpoint hub;
  std::string url;
};
// Opens one, which is not connected yet; see remote::wait(). Nothing: the verb ends with `otherwise`, and the
// reason was printed. `verb`: whose arguments are to blame.
std::optional<opened_endpoint> open_endpoint(std::string_view verb, const remote_place& at,
                                             endpoint_options options, const console& to,
                                             exit_code& otherwise);

// The entries that the verbs' tables share: the URL, or $ROWE_URL; and the kind of peer that is there, as an
// index of websocket_profile.
operand url_operand(std::string& into) noexcept;
option profile_option(std::size_t& into) noexcept;
websocket_profile profile_of(std::size_t index) noexcept;

// An endpoint that connects, and the person waiting for it. One thread.
class remote {
 public:
  remote(endpoint& via, std::string url, const console& to) : via_{via}, url_{std::move(url)}, to_{to} {}

  // Waits until we are connected, at most `timeout` (nothing: until Ctrl-C), and says so when it takes a
  // while; not at all where what is wrong will be so again, a token say. Nothing: connected. Otherwise the
  // verb ends with this, and the reason was printed.
  std::optional<exit_code> wait(std::optional<rt::duration> timeout);

  // Prints what has happened since the last call. The same failure again and again is printed once.
  void report();

  // Ends it at once.
  void close();

  const std::string& url() const noexcept { return url_; }
  // Says that there is no connection within that time, and why unless that was said already.
  exit_code give_up(rt::duration timeout);
  // Of the newest attempt to connect that was reported; empty once connected.
  const std::string& failure() const noexcept { return failure_; }
  // Whether the next attempt will fail as well.
  bool in_vain() const noexcept { return in_vain_; }

  // Whether report() has printed that.
  bool failure_reported() const noexcept { return failure_reported_; }

  // How often the other side has said that something of ours was wrong, as far as report() has read it.
  std::uint64_t errors_reported() const noexcept { return errors_reported_; }
  // What it said last of them; empty: nothing.
  const std::string& error_reported() const noexcept { return error_reported_; }
  // Whether it takes neither our topic nor what we publish there.
  bool topic_refused() const noexcept { return advertise_refused_ && publish_refused_; }

 private:
  void report_error(std::string_view said, const std::string& sentence);

  endpoint& via_;
  std::string url_;
  const console& to_;
  std::string failure_;
  bool failure_reported_ = false;
  bool in_vain_ = false;
  std::uint64_t errors_reported_ = 0;
  std::string error_reported_;
  std::string reason_reported_; // of it, or of one before
  bool advertise_refused_ = false;
  bool publish_refused_ = false;
  bool connected_before_ = false;
};

// Watches over waits inside handles, from a thread of its own: prints what happens meanwhile, and closes the
// endpoint once a signal comes, so that the handle says errc::closed. Nothing is drained then, so this is for
// what is waited for one by one.
class watcher {
 public:
  explicit watcher(remote& hub) : hub_{hub}, thread_{[this] { watch(); }} {}
  watcher(const watcher&) = delete;
  watcher& operator=(const watcher&) = delete;
  ~watcher();

  // Returns what wait() does. The endpoint and the remote are used by the thread while it does, and not
  // otherwise.
  template <class Wait>
  auto during(Wait&& wait) {
    set(phase::waiting);
    auto outcome = wait();
    set(phase::idle);
    return outcome;
  }

 private:
  enum class phase { idle, waiting, over };
  void set(phase now);
  void watch();

  remote& hub_;
  std::mutex mutex_; // guards phase_, and keeps during() from returning while the thread is at work
  std::condition_variable over_;
  phase phase_ = phase::idle;
  std::thread thread_; // last: it begins when all the rest is there
};

// Says why there is no endpoint, and how the verb ends.
exit_code cannot_open(const std::string& url, const error& reason, const console& to);

// How a verb ends that could not be set up: `usage` where its arguments are to blame.
exit_code exit_code_of(const error& reason) noexcept;

// Messages that were lost on this side, after close(). A value that was refused for want of room is not: the
// verbs offer it again; nor is a call.
std::uint64_t lost_here(const endpoint& closed);

} // namespace rowe::tools
