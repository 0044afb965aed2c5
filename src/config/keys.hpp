// SPDX-License-Identifier: Apache-2.0
// Every key of a configuration, in one table: how it is called in a file, in the environment and on the
// command line, where its value is stored, what it may be, and what it means. Files, variables, options,
// `rowe config show`, docs/config.md and the checks of endpoint_options are made from it.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/result.hpp>
#include <rowe/settings.hpp>

#include "config/values.hpp"

namespace rowe::config {

template <class Owner>
struct key {
  std::string_view section;
  std::string_view name;
  form what;
  value (*get)(const Owner& of);
  void (*set)(Owner& of, value&& to); // in the form of `what`, and within its range
  // Of integers, times and words among the options of an endpoint, for checks that must not allocate.
  std::int64_t (*number)(const endpoint_options& of) noexcept = nullptr;
  std::string_view option = {}; // of `rowe serve`; empty: `--limit NAME=VALUE`, or none
  std::string_view meaning = {};
  argument which = argument::unnamed; // as the errors of check_options() call it
  std::string_view bounded_by = {};   // what else its range depends on
};

// In the order in which they are shown; those of a section stand together.
std::span<const key<configuration>> keys() noexcept;

// The members of [[role]] and of [[identity]].
std::span<const key<role>> role_keys() noexcept;
std::span<const key<identity>> identity_keys() noexcept;

// The index of a key; keys().size(): there is none.
std::size_t find(std::string_view section, std::string_view name) noexcept;
// Of an option or limit that an error is about; keys().size(): none.
std::size_t find(argument which) noexcept;

} // namespace rowe::config
