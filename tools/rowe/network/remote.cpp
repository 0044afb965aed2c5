// SPDX-License-Identifier: Apache-2.0
#include "remote.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>

#include "../interrupt.hpp"

namespace rowe::tools {
namespace {

// Connections on one machine are there within this; who waits longer is told.
constexpr rt::duration unremarkable = std::chrono::milliseconds{200};

constexpr std::array<std::string_view, 3> profile_names{"standard", "hop", "hop_2014"};
static_assert(static_cast<std::size_t>(websocket_profile::hop) == 1 &&
              static_cast<std::size_t>(websocket_profile::hop_2014) == 2);

// Where endpoints listen unless they are told otherwise. ws:// alone means 80, as for every WebSocket.
constexpr std::string_view usual_port = ":8080";

} // namespace

spelled_url read_url(std::string_view text) {
  constexpr std::string_view socket = "ws://";
  constexpr std::string_view page = "http://";
  constexpr std::string_view secure_socket = "wss://";
  constexpr std::string_view secure_page = "https://";
  if (text.starts_with(socket)) return {std::string{text}, {}};
  if (text.starts_with(page)) return {joined(socket, text.substr(page.size())), {}};
  if (text.starts_with(secure_socket)) return {std::string{text}, {}};
  if (text.starts_with(secure_page)) return {joined(secure_socket, text.substr(secure_page.size())), {}};
  const std::string_view authority = text.substr(0, text.find('/'));
  if (authority.empty() || authority.find_first_of(" \"{}") != text.npos || text.find("://") != text.npos)
    return {{}, joined(quoted(text), " is no URL: it must read ws[s]://HOST[:PORT][/PATH] or HOST[:PORT]")};
  const std::size_t bracket = authority.rfind(']'); // behind an address of IPv6
  const bool names_port = authority.find(':', bracket == authority.npos ? 0 : bracket) != authority.npos;
  return {joined(socket, authority, names_port ? "" : usual_port, text.substr(authority.size())), {}};
}

bool reads_like_url(std::string_view word) noexcept {
  if (word.find("://") != word.npos) return true;
  if (word.find_first_of("/{\"") == 0) return false;
  // A topic's name has no points either, mostly.
  const std::string_view host = word.substr(0, word.find('/'));
  return word.find(':') != word.npos || host.find('.') != host.npos || host == "localhost";
}

namespace {

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : "";
}

// The file's only line. It is no secret from who may read the file, so its mode is the user's affair.
std::optional<std::string> first_line(const std::string& path) {
  std::ifstream from{path};
  std::string line;
  if (!std::getline(from, line)) return std::nullopt;
  while (line.ends_with('\r') || line.ends_with(' ')) line.pop_back();
  return line;
}

} // namespace

std::vector<option> with_remote(remote_place& into, std::vector<option> own) {
  own.push_back({"--ca", "", "FILE",
                 "the root that vouches for a wss:// server (default $ROWE_CA, else the system's)",
                 &into.ca});
  own.push_back({"--pin", "", "SHA256", "the wss:// server's public key (default $ROWE_PIN)", &into.pin});
  own.push_back({"--cert", "", "FILE",
                 "our certificate, for a wss:// server that asks for one (default $ROWE_CERT)", &into.cert});
  own.push_back({"--key", "", "FILE", "its key (default $ROWE_KEY, else the file of --cert)", &into.key});
  own.push_back({"--token-file", "", "FILE",
                 "has our token in its first line (default: the token is in $ROWE_TOKEN)", &into.token_file});
  return own;
}

namespace {

// As a shell reads it as one word.
std::string shell_word(std::string_view text) {
  constexpr std::string_view plain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=@%+,";
  if (!text.empty() && text.find_first_not_of(plain) == text.npos) return std::string{text};
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string{"'\\''"} : std::string{c};
  return quoted + "'";
}

} // namespace

std::string typed_again(const remote_place& at) {
  std::string words;
  const auto add = [&](std::string_view option, std::string_view value) {
    if (!value.empty()) words += joined(" ", option, " ", printable(shell_word(value)));
  };
  add("--ca", at.ca);
  add("--pin", at.pin);
  add("--cert", at.cert);
  add("--key", at.key);
  add("--token-file", at.token_file);
  return words;
}

std::optional<exit_code> use(const remote_place& at, endpoint_options& options, const console& to) {
  options.tls.ca = at.ca.empty() ? variable("ROWE_CA") : at.ca;
  options.tls.pin = at.pin.empty() ? variable("ROWE_PIN") : at.pin;
  options.tls.certificate = at.cert.empty() ? variable("ROWE_CERT") : at.cert;
  options.tls.key = at.key.empty() ? variable("ROWE_KEY") : at.key;
  if (options.tls.key.empty()) options.tls.key = options.tls.certificate;
  if (at.token_file.empty()) {
    options.token = variable("ROWE_TOKEN");
  } else if (auto token = first_line(at.token_file)) {
    options.token = std::move(*token);
  } else {
    to.error("cannot read a token from ", printable(at.token_file));
    return exit_code::usage;
  }
  if (const std::string wrong = check_tls(options.tls); !wrong.empty()) {
    to.error(printable(wrong));
    return exit_code::usage;
  }
  return std::nullopt;
}

operand url_operand(std::string& into) noexcept {
  return {.name = "URL",
          .meaning = "ws[s]://HOST[:PORT][/PATH] or HOST[:PORT] (default $ROWE_URL)",
          .into = &into,
          .variable = "ROWE_URL",
          .reads_like_it = reads_like_url};
}

option profile_option(std::size_t& into) noexcept {
  return {"--profile", "", "standard|hop|hop_2014",
          "the kind of WebSocket of the peer: hop and hop_2014 are for Hop programs (default standard)",
          choice{&into, profile_names}};
}

websocket_profile profile_of(std::size_t index) noexcept { return static_cast<websocket_profile>(index); }

std::optional<exit_code> remote::wait(std::optional<rt::duration> timeout) {
  const auto begin = rt::monotonic_clock::now();
  const auto end = rt::deadline_after(begin, timeout.value_or(rt::for_ever));
  bool told = false;
  for (;;) {
    const auto now = rt::monotonic_clock::now();
    const bool connected =
        via_.wait_peer(std::min<rt::duration>(interrupt::slice, end - std::min(now, end))).has_value();
    report();
    if (connected) return std::nullopt;
    if (interrupt::seen()) return exit_code::interrupted;
    if (in_vain_ || rt::monotonic_clock::now() >= end) return give_up(timeout.value_or(rt::for_ever));
    if (!told && rt::monotonic_clock::now() - begin >= unremarkable) {
      to_.note("waiting for ", url_, " (Ctrl-C to stop)");
      told = true;
    }
  }
}

exit_code remote::give_up(rt::duration timeout) {
  to_.error("could not connect to ", url_, in_vain_ ? "" : joined(" within ", seconds_text(timeout)),
            failure_reported_ ? "" : joined(": ", failure_.empty() ? "no answer" : failure_));
  return exit_code::no_connection;
}

void remote::report() {
  while (const auto happened = via_.try_event()) {
    const std::string text = sentence_of(*happened);
    switch (happened->what_kind) {
    case event::kind::cannot_connect:
      if (in_vain_) break; // whatever comes of further attempts, until one is not in vain
      in_vain_ = happened->lasting;
      if (text == failure_) break;
      failure_ = text;
      // Who waits for the first connection is told of this at the end.
      failure_reported_ = !to_.quiet() && (connected_before_ || !in_vain_);
      if (failure_reported_) to_.note(text);
      break;
    case event::kind::peer_joined:
      if (connected_before_) to_.note("connected again to ", url_);
      connected_before_ = true;
      failure_.clear();
      reason_reported_.clear();
      failure_reported_ = in_vain_ = false;
      break;
    case event::kind::status_from_peer: report_error(happened->what, text); break;
    default: to_.note(text); break;
    }
  }
}

// Servers say "OPERATION: REASON". Each operation on a topic that is refused is refused for the same reason,
// which is told once. Taking back an advertisement that was refused is an error only because of that.
void remote::report_error(std::string_view said, const std::string& sentence) {
  constexpr std::string_view between = ": ";
  const std::size_t end = said.find(between);
  const std::string_view operation = end == said.npos ? std::string_view{} : said.substr(0, end);
  const std::string_view reason = end == said.npos ? said : said.substr(end + between.size());
  if (advertise_refused_ && operation == "unadvertise") return;
  if (operation == "advertise") advertise_refused_ = true;
  if (operation == "publish") publish_refused_ = true;
  ++errors_reported_;
  error_reported_ = said;
  if (reason == reason_reported_) return;
  reason_reported_ = reason;
  to_.error(sentence);
}

void remote::close() {
  (void)via_.close(); // with nothing to drain there is nothing to report
}

watcher::~watcher() {
  set(phase::over);
  thread_.join();
}

// Wakes the thread at the end only: a wait may be one whose time is measured.
void watcher::set(phase now) {
  const std::lock_guard guard{mutex_};
  phase_ = now;
  if (now == phase::over) over_.notify_one();
}

void watcher::watch() {
  std::unique_lock guard{mutex_};
  while (!over_.wait_for(guard, interrupt::slice, [this] { return phase_ == phase::over; })) {
    if (phase_ != phase::waiting) continue;
    if (interrupt::seen()) return hub_.close();
    hub_.report();
  }
}

exit_code cannot_open(const std::string& url, const error& reason, const console& to) {
  to.error(printable(url), ": ", reason.message());
  return exit_code_of(reason);
}

std::optional<opened_endpoint> open_endpoint(std::string_view verb, const remote_place& at,
                                             endpoint_options options, const console& to,
                                             exit_code& otherwise) {
  const spelled_url url = read_url(at.url);
  if (url.url.empty()) {
    otherwise = usage_error(verb, url.wrong);
    return std::nullopt;
  }
  if (const auto end = use(at, options, to)) {
    otherwise = *end;
    return std::nullopt;
  }
  auto hub = endpoint::connect(url.url, options);
  if (hub) return opened_endpoint{std::move(*hub), url.url};
  otherwise = cannot_open(url.url, hub.error(), to);
  return std::nullopt;
}

exit_code exit_code_of(const error& reason) noexcept {
  switch (reason.code) {
  case errc::bad_url:
  case errc::bad_access:
  case errc::bad_certificate:
  case errc::bad_argument:
  case errc::not_utf8:
  case errc::control_character:
  case errc::reserved_topic: return exit_code::usage;
  default: return exit_code::failed;
  }
}

std::uint64_t lost_here(const endpoint& closed) {
  std::uint64_t lost = 0;
  for (const count& one : closed.counts()) {
    const bool of_calls = one.name.starts_with("calls_") || one.name.starts_with("replies_");
    if (one.group == "loss" && one.name != "full" && !of_calls) lost += one.value;
  }
  return lost;
}

} // namespace rowe::tools
