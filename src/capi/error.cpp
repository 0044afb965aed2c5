// SPDX-License-Identifier: Apache-2.0
#include "capi/error.hpp"

#include <array>
#include <iterator>

namespace rowe::capi {
namespace {

// From errc to the numbers of rowe.h; an error without a number does not compile.
constexpr int numbers[] = {
#define ROWE_NUMBER(name, diagnostic) rowe_error_##name,
    ROWE_ERRORS(ROWE_NUMBER)
#undef ROWE_NUMBER
};

// And back; a number without an error does not compile.
struct named {
  int number;
  errc code;
};
constexpr named names[] = {
#define ROWE_NUMBERED(number, name) {number, errc::name},
    ROWE_ERROR_CODES(ROWE_NUMBERED)
#undef ROWE_NUMBERED
};

consteval bool the_lists_agree() {
  if (std::size(numbers) != std::size(names)) return false;
  for (const named& n : names) {
    if (numbers[static_cast<std::size_t>(n.code)] != n.number) return false;
  }
  return true;
}
static_assert(the_lists_agree(), "result.hpp and rowe.h name different errors");

// The diagnostics, with N, MAX and TOTAL where an error has its numbers, and without an argument's name.
constexpr std::size_t diagnostic_bytes = 128;
using diagnostic = std::array<char, diagnostic_bytes>;

consteval diagnostic without_numbers(std::string_view from) {
  diagnostic to{};
  std::size_t at = 0;
  while (!from.empty()) {
    const bool value = from.starts_with("%v");
    const bool limit = from.starts_with("%l");
    const bool whole = from.starts_with("%w");
    const bool name = from.starts_with("%n");
    const std::string_view next = value   ? "N"
                                  : limit ? "MAX"
                                  : whole ? "TOTAL"
                                  : name  ? ""
                                          : from.substr(0, 1);
    for (const char c : next) to[at++] = c;
    from.remove_prefix(value || limit || whole || name ? 2 : 1);
  }
  to[diagnostic_bytes - 1] = '\0'; // a diagnostic that is too long does not compile
  return to;
}
constexpr diagnostic diagnostics[] = {
#define ROWE_DIAGNOSTIC(name, text) without_numbers(text),
    ROWE_ERRORS(ROWE_DIAGNOSTIC)
#undef ROWE_DIAGNOSTIC
};

// Constant-initialised: a thread's first error needs no constructor.
struct last_error {
  int number = rowe_ok;
  char text[512] = {}; // a diagnostic of ours and one of 192 bytes
};
constinit thread_local last_error last;

} // namespace

int number_of(errc code) noexcept { return numbers[static_cast<std::size_t>(code)]; }

int fail(const error& reason, std::string_view more) noexcept {
  last.number = number_of(reason.code);
  std::size_t used = reason.message({last.text, sizeof last.text - 1}).size();
  for (const std::string_view piece : {std::string_view{more.empty() ? "" : ": "}, more}) {
    used += piece.copy(last.text + used, sizeof last.text - 1 - used);
  }
  last.text[used] = '\0';
  return last.number;
}

} // namespace rowe::capi

using namespace rowe::capi;

const char* rowe_strerror(int error) {
  if (error == rowe_ok) return "no error";
  for (const named& n : names) {
    if (n.number == error) return diagnostics[static_cast<std::size_t>(n.code)].data();
  }
  return "no error of rowe has this number";
}

int rowe_last_error(void) { return last.number; }
const char* rowe_last_error_text(void) { return last.text; }
int rowe_abi_version(void) { return ROWE_ABI_VERSION; }
