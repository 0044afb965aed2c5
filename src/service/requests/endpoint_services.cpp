// SPDX-License-Identifier: Apache-2.0
#include "service/requests/endpoint_services.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <ranges>

#include "service/base/names.hpp"
#include "service/requests/fitting_names.hpp"
#include "service/topics/own_types.hpp"
#include "wire/codec/own_names.hpp"

namespace rowe::service {
namespace {

struct listed_name {
  bool shown = false;
  bool own = false; // of this process
  std::string_view name{};
  std::string_view type{};
};

// Writes the names of all rows that are listed, and their types if these have a key. The answer says how many
// found no room.
template <class Ids, class RowOf>
std::uint32_t list(json::writer& into, fitting_names fits, std::string_view key,
                   std::string_view key_of_types, const Ids& ids, const RowOf& row_of) noexcept {
  const auto bytes_of = [&](const listed_name& one) {
    return bytes_in_json(one.name) + 3 + (key_of_types.empty() ? 0 : bytes_in_json(one.type) + 3);
  };
  for (const auto i : ids)
    if (const listed_name one = row_of(i); one.shown) fits.add(bytes_of(one), one.own);
  const auto write = [&](std::string_view named, auto what) {
    fits.begin();
    into.begin_array(named);
    for (const auto i : ids) {
      const listed_name one = row_of(i);
      if (one.shown && fits.take(bytes_of(one), one.own)) into.string(one.*what);
    }
    into.end_array();
  };
  write(key, &listed_name::name);
  if (!key_of_types.empty()) write(key_of_types, &listed_name::type);
  if (fits.left_out() == 0) return 0;
  into.member("left_out", fits.left_out());
  return fits.left_out();
}

} // namespace

std::string_view endpoint_services::find(std::string_view asked) noexcept {
  const own_service_type* const own = own_type_of_service(asked);
  return own == nullptr || own->of_stop ? std::string_view{} : own->name;
}

void endpoint_services::answer(call_index index, std::string_view service,
                               const wire::call_args& what) noexcept {
  state_.calls.at(index).callee = {.who = call_endpoint::kind::core};
  connection* c = nullptr; // a peer with a role; null: whoever asks sees everything
  if (const call& one = state_.calls.at(index); one.caller.who == call_endpoint::kind::peer) {
    c = state_.peers.find(one.caller.connection());
    if (c != nullptr && !outbox_.has_place_for_reply({c->id.index}))
      return call_completion_.fail_for_room(index);
    if (service == wire::control_name) return answer_control(index, c, what);
    if (service == wire::rights_name) return answer_rights(index, c, what);
    if (service == wire::record_name) return answer_record(index, what);
    if (c != nullptr && !state_.rights.apply_to(*c)) c = nullptr;
  }
  if (service == wire::control_name) return answer_control(index, nullptr, what);
  if (service == wire::rights_name) return answer_rights(index, nullptr, what);
  if (service == wire::record_name) return answer_record(index, what);
  if (parameter_services::answers(service)) return parameter_services_.answer(index, service, what);
  if (type_services::answers(service)) return type_services_.answer(index, service, what, c);
  state_.cycle.work_bytes += answer_work;
  std::array<char, 2 * detail::queue_pair::name_bytes_max> buffer; // the call's own names are elsewhere
  const auto named = [&](std::string_view member) -> std::string_view {
    const auto found = what.text.empty() ? std::nullopt : json::find(json::root(what.text).raw, member);
    const auto text = found ? json::to_string(*found, buffer) : std::nullopt;
    return text.value_or(std::string_view{});
  };
  const auto sees = [&](topic_id i) {
    return i && (c == nullptr || state_.rights.sees(*c, state_.topics.name(i)));
  };
  const auto room = [&] {
    const wire::call_origin asked = state_.calls.origin(index);
    const std::size_t around = list_envelope_bytes + asked.id_raw.size() + bytes_in_json(asked.service);
    const std::size_t most = state_.bounds().message_bytes_max;
    return most > around ? most - around : 0;
  };
  std::uint32_t left_out = 0;
  const slot_id slot = outbox_.compose(message_lifetime{}, [&](json::writer& into) {
    if (service == wire::stats_name) {
      const statistics_report::reader by{.who = c != nullptr ? c->who : access::subject{}, .peer = c};
      return statistics_report_.write_for_service(into, c != nullptr ? &by : nullptr);
    }
    into.begin_object();
    if (service == wire::list_topics_name) {
      const listed_topics held = graph_services_.listed();
      left_out = list(
          into, fitting_names{room(), state_.bounds().topics_max}, "topics", "types",
          state_.topics.topic_ids(), [&](topic_id i) -> listed_name {
            if (!held(i) || !sees(i)) return {};
            return {true, state_.topics.at(i).own_holders != 0, state_.topics.name(i), state_.topics.type(i)};
          });
    } else if (service == wire::list_services_name) {
      left_out = list(into, fitting_names{room(), graph_services_.services_max()}, "services", {},
                      std::views::iota(std::uint32_t{0}, graph_services_.services_max()),
                      [&](std::uint32_t i) -> listed_name {
                        const graph_services::listed_service one = graph_services_.service(c, i);
                        return {!one.name.empty(), one.own, one.name, {}};
                      });
    } else if (service == wire::topic_type_name) {
      const topic_id topic = state_.topics.find(named("topic"));
      into.member("type", !sees(topic) ? std::string_view{} : state_.topics.type(topic));
    } else if (service != wire::service_type_name) {
      graph_services_.write(into, service, what, c);
    } else {
      into.member("type", graph_services_.find(c, named("service")).type);
    }
    into.end_object();
  });
  if (!slot) return call_completion_.fail_for_room(index);
  if (left_out != 0) [[unlikely]]
    state_.counts.add(counter::names_left_out, left_out);
  call_completion_.complete(index, slot);
}

// A request is carried out once, and then answered: a slot for the answer may have to be found.
void endpoint_services::answer_control(call_index index, connection* c,
                                       const wire::call_args& what) noexcept {
  const control_service::decision made = control_service_.carry_out(c, what.text);
  const slot_id slot = outbox_.compose(
      message_lifetime{}, [&](json::writer& into) { control_service_.write_answer(into, made); });
  slot ? call_completion_.complete(index, slot) : call_completion_.fail_for_room(index);
}

void endpoint_services::answer_rights(call_index index, const connection* c,
                                      const wire::call_args& what) noexcept {
  const slot_id slot = outbox_.compose(
      message_lifetime{}, [&](json::writer& into) { rights_service_.write_answer(into, c, what.text); });
  slot ? call_completion_.complete(index, slot) : call_completion_.fail_for_room(index);
}

// The threads of the black boxes write; nobody waits for them.
void endpoint_services::answer_record(call_index index, const wire::call_args& what) noexcept {
  state_.cycle.work_bytes += answer_work;
  const auto member = [&](std::string_view name) {
    return what.text.empty() ? std::nullopt : json::find(json::root(what.text).raw, name);
  };
  std::array<char, record_cause_bytes_max> buffer;
  std::string_view cause;
  if (const auto said = member("cause")) {
    const auto text = json::to_string(*said, buffer);
    if (!text || text->size() > buffer.size())
      return call_completion_.fail(index, errc::refused,
                                   "the member `cause` must be a text of 256 bytes at most");
    cause = *text;
  }
  const auto writes = member("write");
  const bool only_counted = writes && writes->raw == "false";
  const std::uint32_t asked =
      only_counted ? state_.recordings.black_boxes() : state_.recordings.snapshot(cause);
  const slot_id slot = outbox_.compose(message_lifetime{}, [&](json::writer& into) {
    into.begin_object();
    into.member("black_boxes", asked);
    into.end_object();
  });
  slot ? call_completion_.complete(index, slot) : call_completion_.fail_for_room(index);
}

} // namespace rowe::service
