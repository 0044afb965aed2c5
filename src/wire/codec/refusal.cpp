// SPDX-License-Identifier: Apache-2.0
#include "wire/codec/refusal.hpp"

#include "wire/codec/own_names.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::wire {
namespace {

constexpr std::size_t value_bytes_max = 64; // of a value quoted in a diagnostic

constexpr std::string_view no_service_begins = "Service ";
constexpr std::string_view no_service_ends = " does not exist";

} // namespace

std::string_view refusal::text(std::span<char> buffer) const noexcept {
  text_out out{buffer};
  if (!verb_text.empty()) out.add_name(verb_text, value_bytes_max).add(": ");
  const auto the_member = [&]() -> text_out& { return out.add("the member \"").add(member).add("\" "); };
  const auto it_is = [&] {
    if (!value.empty()) out.add("; it is ").add_shortened(value, value_bytes_max);
  };
  const auto the_operation = [&]() -> text_out& {
    return out.add("the operation \"").add_quoted(value, value_bytes_max, '"').add("\" is ");
  };
  switch (what) {
  case kind::not_an_object: out.add("a message must be one JSON object"); break;
  case kind::missing:
    the_member().add("is missing");
    if (!expected.empty()) out.add("; ").add(expected);
    break;
  case kind::twice: the_member().add("is there twice"); break;
  case kind::wrong_type:
    the_member().add("must be ").add(expected);
    it_is();
    break;
  case kind::negative:
    the_member().add("must not be negative");
    it_is();
    break;
  case kind::too_small:
    the_member().add("must be at least ").add(limit);
    it_is();
    break;
  case kind::too_large:
    the_member().add("must be at most ").add(limit);
    it_is();
    break;
  case kind::too_long: the_member().add("is ").add(bytes).add(" bytes long; the limit is ").add(limit); break;
  case kind::empty: the_member().add("must not be empty"); break;
  case kind::bad_characters:
    the_member().add("must have no control characters");
    it_is();
    break;
  case kind::not_offered:
    the_member().add("asks for ").add_shortened(value, value_bytes_max).add(", which is not offered; use ");
    out.add(expected).add(" or leave it out");
    break;
  case kind::unsupported_op: the_operation().add("not offered here; offered are ").add(expected); break;
  case kind::unknown_op: the_operation().add("unknown; offered are ").add(expected); break;
  }
  return out.text();
}

std::string_view no_service_diagnostic(std::string_view service, std::span<char> buffer) noexcept {
  text_out out{buffer};
  return out.add(no_service_begins).add(service).add(no_service_ends).text();
}

bool says_no_service(std::string_view diagnostic, std::string_view service) noexcept {
  if (!diagnostic.starts_with(no_service_begins) || !diagnostic.ends_with(no_service_ends)) return false;
  diagnostic.remove_prefix(no_service_begins.size());
  if (diagnostic.size() < no_service_ends.size()) return false;
  diagnostic.remove_suffix(no_service_ends.size());
  return !diagnostic.empty() && without_slash(diagnostic) == without_slash(service);
}

} // namespace rowe::wire
