// SPDX-License-Identifier: Apache-2.0
#include "service/control/control_service.hpp"

#include <array>
#include <optional>

#include <rowe/detail/mutation_points.hpp>

#include "wire/text/text_out.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {

control_service::decision control_service::carry_out(connection* c, std::string_view args) noexcept {
  using refusal = driver_rules::refusal;
  if (!args.empty()) args = json::root(args).raw;
  std::array<char, control_member_bytes_max> buffer; // of one at a time
  const auto text_of = [&](std::string_view member) -> std::string_view {
    const auto found = args.empty() ? std::nullopt : json::find(args, member);
    const auto text = found ? json::to_string(*found, buffer) : std::nullopt;
    return text.value_or(std::string_view{});
  };
  decision made{.topic = command_gate_.find(text_of("topic"))};
  const auto refuse_as = [&](refusal why) {
    made.refused = why;
    state_.counts.add(counter::control_refusals);
    if (why == refusal::role && c != nullptr) access_control_.report_denial(*c, made.needed);
    return made;
  };
  if (!made.topic) return refuse_as(refusal::topic);
  const std::uint64_t key = c != nullptr ? key_of(c->id) : key_of_this_process;
  const auto tick = args.empty() ? std::nullopt : json::find(args, "tick");
  const std::int64_t given = tick ? json::to_integer(*tick).value_or(wire::no_tick) : wire::no_tick;
  wire::text_of<peer_name_bytes_max> name;
  c != nullptr ? state_.rights.write_name(name, c->name(), text_of("name")) : name.add("this process");
  driver_rules::asker by{.peer = key, .name = name.text()};
  if (c != nullptr && state_.rights.apply_to(*c)) {
    const std::string_view topic = state_.topics.name(command_gate_.at(made.topic).topic);
    by.may_drive = state_.rights.allow(*c, access::right::publish, topic);
    by.may_take_over = state_.rights.allow(*c, access::right::take_over, {}) || ROWE_MUTANT(role_take_over);
    made.needed = by.may_drive ? access::right::take_over : access::right::publish;
  }
  const std::string_view action = text_of("action");
  command_gate_.change(made.topic, [&](driver_rules& rules) {
    if (action == "release") {
      rules.release(key, state_.cycle.now);
    } else if (action == "take" || action == "take_over") {
      const rt::time_point issued = stop_rules_.issued(given, state_.cycle.now);
      made.refused = rules.take(by, action == "take_over", issued, state_.cycle.now);
    } else if (!action.empty()) {
      made.refused = refusal::action;
    }
  });
  made.own = command_gate_.at(made.topic).rules.driven_by(key);
  return made.refused == refusal::none ? made : refuse_as(made.refused);
}

void control_service::write_answer(json::writer& into, const decision& made) const noexcept {
  using refusal = driver_rules::refusal;
  into.begin_object();
  if (made.topic) {
    const driver_rules& rules = command_gate_.at(made.topic).rules;
    into.member("topic", state_.topics.name(command_gate_.at(made.topic).topic));
    into.member_or_null("driver", rules.driver());
    into.member("number", rules.number());
    into.member("yours", made.own);
    into.member("lease_ms", whole_ms(rules.lease()));
    into.member("hold_ms", whole_ms(rules.kept_for()));
  }
  into.member("tick", stop_rules_.tick(state_.cycle.now));
  into.member_or_null("refused", driver_rules::name_of(made.refused));
  if (made.refused == refusal::role) into.member_or_null("right", access::name_of(made.needed));
  into.end_object();
}

void control_service::write_state(json::writer& into) const noexcept {
  const rt::time_point now = state_.cycle.now;
  into.begin_object();
  into.member("tick", stop_rules_.tick(now));
  into.begin_array("topics");
  for (const command_gate::place& p : command_gate_.places()) {
    if (!p.topic) continue;
    into.begin_object();
    into.member("topic", state_.topics.name(p.topic));
    into.member("lease_ms", whole_ms(p.rules.lease()));
    into.member("hold_ms", whole_ms(p.rules.kept_for()));
    into.member_or_null("driver", p.rules.driver());
    into.member("number", p.rules.number());
    into.member("since_ms", whole_ms(now - p.rules.since()));
    into.key("age_ms");
    const rt::time_point accepted_at = p.rules.accepted_at();
    accepted_at == rt::time_point{} ? into.null() : into.number(whole_ms(now - accepted_at));
    into.end_object();
  }
  into.end_array();
  into.end_object();
}

} // namespace rowe::service
