// SPDX-License-Identifier: Apache-2.0
// Errors as values. Everything that can fail returns result<T>, or status if there is nothing to return. An
// error has one code of a closed list, and the value and the limit that it is about. Only value() throws; it
// is for set-up code.
#pragma once
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#if defined(__cpp_exceptions)
#include <exception>
#endif

#include <rowe/rt/attributes.hpp>

namespace rowe {

// code, pattern. %v is replaced by the value, %l by the limit, %w by the whole, %n by the name of the
// argument and a space.
#define ROWE_ERRORS(X)                                                                                       \
  X(full, "the queue is full: all %l slots are taken")                                                       \
  X(empty, "nothing has arrived yet")                                                                        \
  X(no_peer, "nobody is listening")                                                                          \
  X(closed, "the endpoint or the handle is closed")                                                          \
  X(forked, "the endpoint belongs to the process that opened it, from which this one was forked")            \
  X(timed_out, "nothing happened within %l ns")                                                              \
  X(too_big, "%v bytes exceed the limit %nof %l bytes")                                                      \
  X(malformed, "the text is no valid JSON, or holds a number no double can (at byte %v)")                    \
  X(too_deep, "the JSON text nests deeper than %l levels")                                                   \
  X(bad_argument, "the argument %nis out of range: %v (limit %l)")                                           \
  X(not_utf8, "the argument %nis not UTF-8 (at byte %v)")                                                    \
  X(control_character, "the argument %nhas a control character (at byte %v)")                                \
  X(bad_url, "the URL must read ws[s]://HOST[:PORT][/PATH]; this one does not from byte %v on")              \
  X(bad_address, "cannot listen on the address (errno %v)")                                                  \
  X(address_in_use, "port %v is in use by another program")                                                  \
  X(not_loopback, "listening beyond loopback needs the options `tls` and `access`, or `insecure`")           \
  X(bad_access, "the option `access` or the token is wrong; check_access() checks `access`")                 \
  X(bad_certificate, "a file that the option `tls` names is wrong; check_tls() says how")                    \
  X(bad_config, "the configuration is wrong (line %v of a file, or 0)")                                      \
  X(bad_web, "the folder that the option `web` names cannot be served; check_web() says why")                \
  X(too_many_handles, "%v handles are open; the limit `handles_max` is %l")                                  \
  X(too_many_topics, "%v topics exist; the limit `topics_max` is %l")                                        \
  X(handle_memory, "%v bytes of handle memory are needed, %l of %w are left: raise `handle_bytes`")          \
  X(reserved_topic, "the name is one of the endpoint's own")                                                 \
  X(type_conflict, "the topic exists with another type (an event names both)")                               \
  X(too_many_latches, "%v stop latches exist; the limit is %l")                                              \
  X(too_many_leases, "%v topics with a lease exist; the limit is %l")                                        \
  X(too_many_recordings, "%v recordings are under way; the limit is %l")                                     \
  X(no_memory, "cannot allocate or lock %v bytes of memory (limit %l)")                                      \
  X(no_thread, "the service thread cannot be started (errno %v)")                                            \
  X(expired, "the time to live passed before it was sent")                                                   \
  X(peer_lost, "the peer went away")                                                                         \
  X(no_service, "nobody provides the service")                                                               \
  X(refused, "the service answered with an error")                                                           \
  X(too_many_calls, "%v calls are in flight; the limit is %l")                                               \
  X(too_many_services, "%v services exist; the limit `services_max` is %l")                                  \
  X(bad_recording, "the recording cannot be written or read; `why` says the file and the reason")            \
  X(bad_definition, "the definition of the type of ROS is wrong; `why` says the line and the reason")        \
  X(bad_message, "the bytes are no message of the type (at byte %v); `why` says the member")                 \
  X(parameter_taken, "a parameter of that name exists already")                                              \
  X(too_many_parameters, "%v parameters exist; the limit `parameters_max` is %l")                            \
  X(service_taken, "the service is provided already")                                                        \
  X(not_an_object, "a message must be one JSON object")                                                      \
  X(reserved_member, "op, message_id and in_reply_to are no members of a user's message (at byte %v)")       \
  X(missing_member, "a member or element that is wanted is missing")                                         \
  X(duplicate_member, "a member occurs twice (at byte %v)")                                                  \
  X(wrong_type, "a value is of another type than is wanted")                                                 \
  X(out_of_range, "a number does not fit what it is read into")                                              \
  X(too_long, "the text or array has %v elements, its member holds %l")                                      \
  X(misuse, "the handle is empty or was used in a way its documentation forbids")

// The closed list of what can go wrong.
enum class errc : std::uint8_t {
#define ROWE_ERROR_NAME(name, text) name,
  ROWE_ERRORS(ROWE_ERROR_NAME)
#undef ROWE_ERROR_NAME
};

// The options and limits that a bad_argument may be about.
// clang-format off
#define ROWE_ARGUMENTS(X)                                                                                    \
  X(idle_policy) X(poll_period) X(service_priority) X(service_cpu) X(ping_period) X(silence_max)             \
  X(message_time_max) X(stats_period) X(retry_min) X(retry_max) X(inbound_ttl) X(call_timeout) X(profile) X(ttl) X(period)   \
  X(depth) X(inbox_depth) X(calls) X(name) X(type) X(port) X(connections_max)                                \
  X(connections_per_address_max) X(handshakes_max) X(handshake_bytes)                                        \
  X(message_bytes_max) X(long_message_bytes_max) X(long_slots) X(fragments_max) X(depth_max) X(messages_per_second_max)                              \
  X(refusals_per_second_max) X(topics_max) X(topic_bytes_max)                                                \
  X(subscriptions_max) X(subscriptions_per_connection_max) X(advertisements_per_connection_max)              \
  X(small_slots) X(small_slot_bytes) X(large_slots) X(queue_depth_max) X(queued_max) X(latched_bytes) X(services_max) \
  X(calls_max) X(calls_per_connection_max) X(parameters_max) X(door_slots) X(door_slot_bytes) X(handles_max) X(handle_bytes)     \
  X(events_max) X(guard_timeout) X(tick) X(service_timeout) X(observe_timeout) X(loop_timeout) X(lease) X(throttle) X(buffer_bytes)
// clang-format on

enum class argument : std::uint8_t {
  unnamed,
#define ROWE_ARGUMENT_NAME(name) name,
  ROWE_ARGUMENTS(ROWE_ARGUMENT_NAME)
#undef ROWE_ARGUMENT_NAME
};

// An error: its code, and the numbers that matter (0 if there is none).
struct error {
  errc code;
  argument about = argument::unnamed; // of bad_argument; of too_big, where a limit can be raised
  std::uint32_t whole = 0;            // of handle_memory: `handle_bytes`, of which `limit` bytes are left
  std::int64_t value = 0;
  std::int64_t limit = 0;

  // NOLINTNEXTLINE(google-explicit-constructor): an errc is an error without numbers
  constexpr error(errc what, std::int64_t value_met = 0, std::int64_t limit_met = 0,
                  argument which = argument::unnamed, std::uint32_t of = 0) noexcept
      : code{what}, about{which}, whole{of}, value{value_met}, limit{limit_met} {}

  // The code's name, for logs and tests: "full". Never waits, never allocates.
  ROWE_RT std::string_view name() const noexcept;
  // The text, with the numbers filled in. Allocates; throws std::bad_alloc only.
  std::string message() const;
  // The same, written into `buffer` and cut where that ends; returns the part written. Never waits, never
  // allocates.
  std::string_view message(std::span<char> buffer) const noexcept;

  friend bool operator==(const error&, const error&) = default;
};

namespace detail {

inline constexpr std::size_t message_bytes_max = 191; // of any error, with the longest numbers

struct error_description {
  std::string_view name;
  std::string_view pattern;
};
inline constexpr std::string_view argument_names[] = {"",
#define ROWE_ARGUMENT_ROW(name) #name,
                                                      ROWE_ARGUMENTS(ROWE_ARGUMENT_ROW)
#undef ROWE_ARGUMENT_ROW
};
inline constexpr error_description error_descriptions[] = {
#define ROWE_ERROR_ROW(name, pattern) {#name, pattern},
    ROWE_ERRORS(ROWE_ERROR_ROW)
#undef ROWE_ERROR_ROW
};

} // namespace detail

// The option's or limit's own name: "poll_period"; empty for argument::unnamed.
constexpr std::string_view name_of(argument which) noexcept {
  return detail::argument_names[static_cast<std::size_t>(which)];
}

inline std::string_view error::name() const noexcept {
  return detail::error_descriptions[static_cast<std::size_t>(code)].name;
}

inline std::string_view error::message(std::span<char> buffer) const noexcept {
  std::string_view pattern = detail::error_descriptions[static_cast<std::size_t>(code)].pattern;
  if (code == errc::bad_url && value == 0)
    pattern = "missing ws://: the URL must read ws[s]://HOST[:PORT][/PATH]";
  if (code == errc::bad_argument && (about == argument::name || about == argument::type)) {
    pattern = value < limit ? "the argument %nhas %v bytes; it needs %l at least"
                            : "the argument %nhas %v bytes; it may have %l at most";
  }
  char* at = buffer.data();
  char* const end = at + buffer.size();
  const auto put = [&](std::string_view words) { at += words.copy(at, static_cast<std::size_t>(end - at)); };
  while (!pattern.empty() && at != end) {
    if (pattern.starts_with("%v") || pattern.starts_with("%l") || pattern.starts_with("%w")) {
      char digits[20]; // of the longest 64-bit number
      const std::int64_t number = pattern[1] == 'v' ? value : pattern[1] == 'l' ? limit : whole;
      const char* const last = std::to_chars(digits, digits + sizeof digits, number).ptr;
      put({digits, last});
      pattern.remove_prefix(2);
    } else if (pattern.starts_with("%n")) {
      const std::string_view named = name_of(about);
      put(named);
      if (!named.empty() && at != end) *at++ = ' ';
      pattern.remove_prefix(2);
    } else {
      *at++ = pattern.front();
      pattern.remove_prefix(1);
    }
  }
  return {buffer.data(), static_cast<std::size_t>(at - buffer.data())};
}

inline std::string error::message() const {
  char buffer[detail::message_bytes_max];
  return std::string{message(buffer)};
}

#if defined(__cpp_exceptions)
// The exception that value() throws. what() is the error's message.
class bad_result : public std::exception {
 public:
  explicit bad_result(const rowe::error& reason) noexcept : error_{reason} {
    const std::span<char> buffer{text_, detail::message_bytes_max};
    text_[reason.message(buffer).size()] = '\0';
  }
  const char* what() const noexcept override { return text_; }
  const rowe::error& error() const noexcept { return error_; }

 private:
  rowe::error error_;
  char text_[detail::message_bytes_max + 1];
};
#endif

namespace detail {
[[noreturn]] inline void fail(const error& reason) {
#if defined(__cpp_exceptions)
  throw bad_result{reason};
#else
  (void)reason; // without exceptions nothing can report it
  std::abort();
#endif
}
} // namespace detail

// A value or an error, as std::expected<T, error>. It neither waits nor allocates, unless T does.
template <class T>
class [[nodiscard]] result {
 public:
  // NOLINTBEGIN(google-explicit-constructor): `return value;`, `return errc::full;`
  constexpr result(T value) noexcept : value_{std::move(value)} {}
  constexpr result(errc code) noexcept : error_{code} {}
  constexpr result(const rowe::error& reason) noexcept : error_{reason} {}
  // NOLINTEND(google-explicit-constructor)

  ROWE_RT constexpr explicit operator bool() const noexcept { return value_.has_value(); }
  ROWE_RT constexpr bool has_value() const noexcept { return value_.has_value(); }
  // The value; undefined without one (checked by assertions of the standard library in dev builds).
  ROWE_RT constexpr T& operator*() & noexcept { return *value_; }
  ROWE_RT constexpr const T& operator*() const& noexcept { return *value_; }
  ROWE_RT constexpr T&& operator*() && noexcept { return *std::move(value_); }
  ROWE_RT constexpr T* operator->() noexcept { return &*value_; }
  ROWE_RT constexpr const T* operator->() const noexcept { return &*value_; }
  // The error; meaningless when there is a value.
  ROWE_RT constexpr const rowe::error& error() const noexcept { return error_; }
  ROWE_RT constexpr errc code() const noexcept { return error_.code; }

  // The value, or throws bad_result (aborts if exceptions are off). For set-up code. From a temporary the
  // value is moved out, so nothing dangles.
  constexpr T& value() & { return checked(*this); }
  constexpr const T& value() const& { return checked(*this); }
  constexpr T value() && { return std::move(checked(*this)); }

 private:
  template <class Self>
  static constexpr auto& checked(Self& self) {
    if (!self.value_) detail::fail(self.error_);
    return *self.value_;
  }

  std::optional<T> value_;
  rowe::error error_{errc::misuse};
};

// Success, or an error; there is no value, and *status is nothing.
template <>
class [[nodiscard]] result<void> {
 public:
  constexpr result() noexcept : ok_{true} {}
  constexpr result(errc code) noexcept : error_{code} {} // NOLINT(google-explicit-constructor)
  constexpr result(const rowe::error& reason) noexcept
      : error_{reason} {} // NOLINT(google-explicit-constructor)

  ROWE_RT constexpr explicit operator bool() const noexcept { return ok_; }
  ROWE_RT constexpr bool has_value() const noexcept { return ok_; }
  ROWE_RT constexpr void operator*() const noexcept {}
  ROWE_RT constexpr const rowe::error& error() const noexcept { return error_; }
  ROWE_RT constexpr errc code() const noexcept { return error_.code; }
  // Returns, or throws bad_result (aborts if exceptions are off). For set-up code.
  constexpr void value() const {
    if (!ok_) detail::fail(error_);
  }

 private:
  bool ok_ = false;
  rowe::error error_{errc::misuse};
};
using status = result<void>;

} // namespace rowe
