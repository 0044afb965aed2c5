// SPDX-License-Identifier: Apache-2.0
#include "service/parameters/parameter_services.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "service/base/service_limits.hpp"
#include "wire/codec/own_names.hpp"
#include "wire/codec/refusal.hpp"
#include "wire/text/text_out.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {
namespace {

constexpr std::array names{wire::get_param_names_name, wire::get_param_name,    wire::set_param_name,
                           wire::has_param_name,       wire::delete_param_name, wire::search_param_name};

using diagnostic_buffer = std::array<char, wire::refusal::text_bytes_max>;

std::optional<json::value> member(const wire::call_args& what, std::string_view name) noexcept {
  if (what.text.empty()) return std::nullopt;
  return json::find(json::root(what.text).raw, name);
}

std::string_view shown_diagnostic(wire::text_out& into, std::string_view name,
                                  std::string_view why) noexcept {
  return into.add("parameter ").add_name(name, topic_bytes_shown).add(why).text();
}

} // namespace

bool parameter_services::answers(std::string_view service) noexcept {
  return std::find(names.begin(), names.end(), service) != names.end();
}

template <class Write>
void parameter_services::complete(call_index call, Write&& write) noexcept {
  const slot_id slot = outbox_.compose(message_lifetime{}, [&](json::writer& into) {
    into.begin_object();
    write(into);
    into.end_object();
  });
  if (!slot) return call_completion_.fail_for_room(call);
  call_completion_.complete(call, slot);
}

void parameter_services::fail(call_index call, std::string_view why) noexcept {
  call_completion_.fail(call, errc::refused, why);
}

void parameter_services::answer(call_index call, std::string_view service,
                                const wire::call_args& what) noexcept {
  parameters_.take();
  if (service == wire::get_param_names_name) return list(call);
  std::array<char, parameters::name_bytes_max> buffer;
  const auto said = member(what, "name");
  const auto name = said ? json::to_string(*said, buffer) : std::nullopt;
  if (!name || name->empty())
    return fail(call, "the arguments need a member `name`, a text of 1 to 255 bytes");
  if (service == wire::get_param_name) return get(call, what, *name);
  if (service == wire::set_param_name) return set(call, what, *name);
  if (service == wire::has_param_name) {
    const bool exists = static_cast<bool>(parameters_.find(*name));
    return complete(call, [&](json::writer& into) { into.member("exists", exists); });
  }
  if (service == wire::search_param_name) return search(call, *name);
  diagnostic_buffer text;
  wire::text_out why{text};
  fail(call, shown_diagnostic(why, *name, ": it belongs to the robot's program, so nobody can delete it"));
}

void parameter_services::list(call_index call) noexcept {
  state_.cycle.work_bytes += answer_work;
  complete(call, [&](json::writer& into) {
    std::array<char, parameters::name_bytes_max> buffer;
    into.begin_array("names");
    for (const parameter_id which : parameters_.ids()) {
      if (parameters_.in_use(which)) into.string(parameters_.name(which, buffer));
    }
    into.end_array();
  });
}

// There is one namespace, so a name is found in it or nowhere.
void parameter_services::search(call_index call, std::string_view name) noexcept {
  const parameter_id which = parameters_.find(name);
  complete(call, [&](json::writer& into) {
    std::array<char, parameters::name_bytes_max> buffer;
    into.member("global_name", which ? parameters_.name(which, buffer) : std::string_view{});
  });
}

void parameter_services::write_quoted_value(parameter_id which, json::writer& into) noexcept {
  std::array<char, parameter_json_bytes_max> buffer;
  json::writer value{buffer};
  parameters_.write_value(which, value);
  into.string({buffer.data(), value.bytes()});
}

// Where there is none, its value is null, as ROS 1 says; ROS 2 says it by `successful` as well.
void parameter_services::get(call_index call, const wire::call_args& what, std::string_view name) noexcept {
  const parameter_id which = parameters_.find(name);
  auto instead = member(what, "default");
  if (!instead) instead = member(what, "default_value");
  const bool has_default = instead && instead->type == json::kind::string && instead->raw.size() > 2;
  diagnostic_buffer text;
  complete(call, [&](json::writer& into) {
    into.key("value");
    if (which) {
      write_quoted_value(which, into);
    } else if (has_default) {
      into.raw(instead->raw);
    } else {
      into.string("null");
    }
    into.member("successful", which || has_default);
    into.key("reason");
    wire::text_out why{text};
    into.string(which || has_default ? std::string_view{}
                                     : shown_diagnostic(why, name, ": there is no such parameter"));
  });
}

void parameter_services::set(call_index call, const wire::call_args& what, std::string_view name) noexcept {
  diagnostic_buffer text;
  wire::text_out why{text};
  const service::call& one = state_.calls.at(call);
  if (one.caller.who == call_endpoint::kind::peer) {
    const connection* const c = state_.peers.find(one.caller.connection());
    if (c != nullptr && !access_control_.may_set(*c, name, why))
      return call_completion_.deny(call, why.text());
  }
  const parameter_id which = parameters_.find(name);
  if (!which) return fail(call, shown_diagnostic(why, name, ": there is no such parameter"));
  const auto said = member(what, "value");
  if (!said) return fail(call, shown_diagnostic(why, name, ": the arguments need a member `value`"));
  // A text that holds JSON; one that holds none is the text itself, as there. Another value is what it is.
  std::array<char, parameter_json_bytes_max + json::reader::tailroom_bytes> buffer{};
  std::string_view json = said->raw;
  const auto inner = json::to_string(*said, std::span{buffer}.first(parameter_json_bytes_max));
  if (inner && inner->size() <= parameter_json_bytes_max) {
    if (inner->data() != buffer.data()) inner->copy(buffer.data(), inner->size());
    const std::string_view copied{buffer.data(), inner->size()};
    if (state_.seams.validator.validate(copied)) json = copied;
  }
  why.add("parameter ").add_name(name, topic_bytes_shown).add(": ");
  if (!parameters_.set(which, json, why)) return fail(call, why.text());
  complete(call, [&](json::writer& into) {
    into.member("successful", true);
    into.member("reason", "");
  });
}

} // namespace rowe::service
