// SPDX-License-Identifier: Apache-2.0
#include "service/graph/type_services.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "service/base/names.hpp"
#include "service/base/service_limits.hpp"
#include "wire/codec/own_names.hpp"
#include "wire/codec/refusal.hpp"
#include "wire/codec/ros_typedefs.hpp"
#include "wire/text/text_out.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/description.hpp"

namespace rowe::service {
namespace {

constexpr std::array names{wire::types_name,           wire::message_details_name,
                           wire::request_details_name, wire::response_details_name,
                           wire::goal_details_name,    wire::result_details_name,
                           wire::feedback_details_name};

// What stands behind the last entry of a page, at most.
constexpr std::string_view page_end = R"(],"next":18446744073709551615})";

std::optional<json::value> member(const wire::call_args& what, std::string_view name) noexcept {
  if (what.text.empty()) return std::nullopt;
  return json::find(json::root(what.text).raw, name);
}

void write_entry(json::writer& into, std::string_view what, std::string_view name, std::string_view type) {
  into.begin_object();
  into.member(what, name);
  into.member("type", type);
}

void write_member(json::writer& into, std::string_view key, const schema_description* its) noexcept {
  if (its == nullptr) return;
  into.key(key);
  json::write_description(into, *its);
}

} // namespace

bool type_services::answers(std::string_view service) noexcept {
  return std::find(names.begin(), names.end(), service) != names.end();
}

bool type_services::sees(topic_id topic, const connection* by) const noexcept {
  return by == nullptr || state_.rights.sees(*by, state_.topics.name(topic));
}
bool type_services::calls(std::string_view service, const connection* by) const noexcept {
  return by == nullptr || state_.rights.calls(*by, service);
}

// Whether the endpoint has this service of its own, and the peer may call it.
bool type_services::has_own(const own_service_type& own, const connection* by) const noexcept {
  return calls(own.name, by) && (!own.of_stop || stop_rules_.in_use());
}

void type_services::answer(call_index call, std::string_view service, const wire::call_args& what,
                           const connection* by) noexcept {
  state_.cycle.work_bytes += answer_work;
  if (service == wire::types_name) return answer_page(call, what, by);
  std::array<char, detail::queue_pair::name_bytes_max> buffer;
  const auto said = member(what, "type");
  const auto type = said ? json::to_string(*said, buffer) : std::nullopt;
  if (!type || type->empty())
    return call_completion_.fail(call, errc::refused,
                                 "the arguments need a member `type`, a text of 1 to 255 bytes");
  answer_details(call, service, *type, by);
}

// `too_large`: that is why there is no slot.
template <class Write>
slot_id type_services::compose(bool& too_large, const Write& write) noexcept {
  return outbox_.compose(message_lifetime{}, [&](json::writer& into) {
    write(into);
    too_large = into.overflowed();
    state_.cycle.work_bytes += into.bytes();
  });
}

void type_services::complete(call_index call, slot_id slot, bool too_large, std::string_view what) noexcept {
  if (slot) return call_completion_.complete(call, slot);
  if (!too_large) return call_completion_.fail_for_room(call);
  wire::text_of<wire::refusal::text_bytes_max> why;
  why.add("the description of ").add_name(what, topic_bytes_shown);
  why.add(" is longer than a message may be: raise message_bytes_max");
  call_completion_.fail(call, errc::refused, why.text());
}

// ---- /rowe/types

// Topics by their rows, then services by theirs, then parameters, then the endpoint's own services; a page
// ends where the next entry does not fit. One that needs a large slot has one entry: whoever asks may take
// less than that slot.
struct type_services::pages {
  json::writer& into;
  const std::uint64_t from;
  const bool longest; // no message is longer than `into`
  std::uint64_t at = 0;
  std::uint64_t next = 0; // 0: this is the last page
  std::string_view first_name{};

  template <class Write>
  void add(std::string_view name, const Write& write) noexcept {
    if (at++ < from || next != 0) return;
    const json::writer before = into;
    write();
    json::writer behind = into;
    behind.append(page_end);
    if (first_name.empty() && is_own_name(name) && behind.overflowed() && longest) {
      into = before; // no message here is long enough for it; the program's own types follow all the same
    } else if (first_name.empty()) {
      first_name = name;
    } else if (behind.overflowed() || longest) {
      into = before;
      next = at - 1;
    }
  }
};

void type_services::answer_page(call_index call, const wire::call_args& what, const connection* by) noexcept {
  const auto said = member(what, "from");
  const auto from = said ? json::to_unsigned(*said) : std::optional<std::uint64_t>{0};
  if (!from)
    return call_completion_.fail(call, errc::refused, "the member `from` must be a number, 0 or more");
  parameters_.take();
  std::string_view first_name;
  bool too_large = false;
  unsigned tries = 0;
  const slot_id slot = compose(too_large, [&](json::writer& into) {
    pages page{.into = into, .from = *from, .longest = tries++ != 0}; // a small slot is tried first
    into.begin_object();
    into.begin_array("types");
    for (const topic_id topic : state_.topics.topic_ids()) {
      const schema_description* const schema = state_.topics.at(topic).schema;
      if (state_.topics.at(topic).holders == 0 || schema == nullptr || !sees(topic, by)) continue;
      page.add(state_.topics.name(topic), [&] {
        write_entry(into, "topic", state_.topics.name(topic), state_.topics.type(topic));
        write_member(into, "message", schema);
        into.end_object();
      });
    }
    for (const pair_index i : state_.pairs.ids()) {
      if (!state_.pair_rows[i].attached) continue; // set-up may be building it
      const detail::queue_pair& one = state_.pairs[i];
      const bool responds = detail::responds(one.kind);
      const bool typed = one.encoded != nullptr || one.decoded != nullptr;
      if ((!responds && !detail::calls(one.kind)) || !typed || !calls(one.name(), by)) continue;
      page.add(one.name(), [&] {
        write_entry(into, "service", one.name(), one.type());
        write_member(into, "request", responds ? one.decoded : one.encoded);
        write_member(into, "answer", responds ? one.encoded : one.decoded);
        into.end_object();
      });
    }
    for (const parameter_id which : parameters_.ids()) {
      // Who may call this service may read all parameters.
      if (parameters_.is_read_only(which) || !calls(wire::get_param_name, by)) break;
      if (!parameters_.in_use(which)) continue;
      const std::string_view name = parameters_.name(which, {});
      page.add(name, [&] {
        write_entry(into, "parameter", name, {});
        into.key("value");
        parameters_.write_description(which, into);
        into.end_object();
      });
    }
    for (const own_service_type& own : own_service_types()) {
      if (!has_own(own, by)) continue;
      page.add(own.name, [&] {
        write_entry(into, "service", own.name, own.type);
        write_member(into, "request", own.request);
        write_member(into, "answer", own.answer);
        into.end_object();
      });
    }
    into.end_array();
    into.key("next");
    page.next == 0 ? into.null() : into.number(page.next);
    into.end_object();
    first_name = page.first_name;
  });
  complete(call, slot, too_large, first_name);
}

// ---- rosapi

// Of a topic of this type; else of a type with this name inside of another one.
const schema_description* type_services::find_message(std::string_view type,
                                                      const connection* by) const noexcept {
  for (const topic_id topic : state_.topics.topic_ids()) {
    const service::topic& one = state_.topics.at(topic);
    if (one.holders == 0 || one.schema == nullptr || !sees(topic, by)) continue;
    if (same_type(state_.topics.type(topic), type) || one.schema->type_name == type) return one.schema;
  }
  return find_inside(type, by);
}
const schema_description* type_services::find_inside(std::string_view type,
                                                     const connection* by) const noexcept {
  for (const topic_id topic : state_.topics.topic_ids()) {
    const service::topic& one = state_.topics.at(topic);
    if (one.holders == 0 || one.schema == nullptr || !sees(topic, by)) continue;
    if (const schema_description* found = wire::find_type(*one.schema, type)) return found;
  }
  return nullptr;
}

// Of who provides a service of this type, or calls one; else of the endpoint's own.
const schema_description* type_services::find_call(std::string_view type, side_of_call which,
                                                   const connection* by) const noexcept {
  for (const pair_index i : state_.pairs.ids()) {
    if (!state_.pair_rows[i].attached) continue;
    const detail::queue_pair& one = state_.pairs[i];
    const bool responds = detail::responds(one.kind);
    if ((!responds && !detail::calls(one.kind)) || !calls(one.name(), by)) continue;
    if (!same_type(one.type(), type)) continue;
    const bool comes_in = responds == (which == side_of_call::request);
    if (const schema_description* found = comes_in ? one.decoded : one.encoded) return found;
  }
  for (const own_service_type& own : own_service_types()) {
    if (same_type(own.type, type) && has_own(own, by))
      return which == side_of_call::request ? own.request : own.answer;
  }
  return nullptr;
}

void type_services::answer_details(call_index call, std::string_view service, std::string_view type,
                                   const connection* by) noexcept {
  const schema_description* const found =
      service == wire::message_details_name    ? find_message(type, by)
      : service == wire::request_details_name  ? find_call(type, side_of_call::request, by)
      : service == wire::response_details_name ? find_call(type, side_of_call::answer, by)
                                               : nullptr; // of actions, which only peers provide
  wire::text_of<wire::refusal::text_bytes_max> why;
  why.add("the type ").add_name(type, topic_bytes_shown);
  if (found == nullptr)
    return call_completion_.fail(call, errc::refused,
                                 why.add(": no handle of this endpoint has a schema for it").text());
  bool too_many = false;
  bool too_large = false;
  const slot_id slot = compose(too_large, [&](json::writer& into) {
    into.begin_object();
    into.key("typedefs");
    too_many = !wire::write_typedefs(into, *found, type);
    if (too_many) into.fail();
    into.end_object();
  });
  if (!too_many) return complete(call, slot, too_large, type);
  why.add(" has more than ").add(wire::typedefs_max).add(" types inside");
  call_completion_.fail(call, errc::refused, why.text());
}

} // namespace rowe::service
