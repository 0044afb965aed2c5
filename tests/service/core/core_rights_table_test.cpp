// SPDX-License-Identifier: Apache-2.0
// Every verb of every role, for names that are its own and for others, in each codec: one table says what is
// allowed. What is not allowed names the right that is missing, is counted, is reported with who and what,
// and leaves no trace. Each cell is tried with a core of its own.
#include "rights_table.hpp"

#include <algorithm>

namespace core_rights_table_test {
namespace {

using namespace rights_table;

// ---- the table

struct row {
  verb what;
  std::string_view name; // empty: it has none
  std::optional<right> needs;
  std::string_view allowed; // to whom
};
constexpr row table[] = {
    {verb::message, "", right::publish, "dspel"},
    {verb::publish, own, right::publish, "dspael"},
    {verb::publish, deep, right::publish, "dspel"},
    {verb::publish, outside, right::publish, "dspel"},
    {verb::publish, near, right::publish, "dspel"},
    {verb::subscribe, own, right::subscribe, "odspael"},
    {verb::subscribe, deep, right::subscribe, "odspael"},
    {verb::subscribe, outside, right::subscribe, "odspel"},
    {verb::subscribe, near, right::subscribe, "odspel"},
    {verb::subscribe, "/rowe/stats", right::subscribe, "odspel"},
    {verb::advertise, own, right::advertise, "dspael"},
    {verb::advertise, deep, right::advertise, "dspael"},
    {verb::advertise, outside, right::advertise, "dspel"},
    {verb::advertise, near, right::advertise, "dspel"},
    {verb::call, "", right::call, "dspel"},
    {verb::call, own, right::call, "dspael"},
    {verb::call, deep, right::call, "dspel"},
    {verb::call, outside, right::call, "dspel"},
    {verb::call, near, right::call, "dspel"},
    {verb::call, "/rowe/stats", right::call, "odspel"},
    {verb::call, "/rosapi/topics", right::call, "odspel"},
    {verb::call, "/rosapi/services", right::call, "odspel"},
    {verb::call, "/rosapi/publishers", right::call, "odspel"},
    {verb::advertise_service, own, right::provide, "pael"},
    {verb::advertise_service, deep, right::provide, "pel"},
    {verb::advertise_service, outside, right::provide, "pel"},
    {verb::advertise_service, near, right::provide, "pel"},
    {verb::send_goal, own, right::call, "dspael"},
    {verb::send_goal, deep, right::call, "dspel"},
    {verb::send_goal, outside, right::call, "dspel"},
    {verb::send_goal, near, right::call, "dspel"},
    {verb::advertise_action, own, right::provide, "pael"},
    {verb::advertise_action, deep, right::provide, "pel"},
    {verb::advertise_action, outside, right::provide, "pel"},
    {verb::advertise_action, near, right::provide, "pel"},
    // What was allowed may be taken back, and what asks for nothing needs no right. Nobody takes back, or
    // answers, what is another's.
    {verb::unsubscribe, own, {}, "odspagnel"},
    {verb::unsubscribe, outside, {}, "odspagnel"},
    {verb::unadvertise, own, {}, "odspagnel"},
    {verb::unadvertise, outside, {}, "odspagnel"},
    {verb::unadvertise_service, own, {}, "odspagnel"},
    {verb::unadvertise_service, outside, {}, "odspagnel"},
    {verb::unadvertise_action, own, {}, "odspagnel"},
    {verb::unadvertise_action, outside, {}, "odspagnel"},
    {verb::cancel_goal, own, {}, "odspagnel"},
    {verb::cancel_goal, outside, {}, "odspagnel"},
    {verb::goal_feedback, own, {}, "odspagnel"},
    {verb::goal_feedback, outside, {}, "odspagnel"},
    {verb::goal_result, own, {}, "odspagnel"},
    {verb::goal_result, outside, {}, "odspagnel"},
    {verb::reply, own, {}, "odspagnel"},
    {verb::reply, outside, {}, "odspagnel"},
    {verb::status, "", {}, "odspagnel"},
    {verb::set_level, "", {}, "odspagnel"},
    {verb::fragment, "", {}, "odspagnel"}, // the whole message needs its own
    {verb::unsupported, "", {}, "odspagnel"},
    {verb::unknown, outside, {}, "odspagnel"},
};

constexpr bool is_foxgloves(verb what) { // below, because no other format has it
  return what == verb::get_parameters || what == verb::set_parameters || what == verb::subscribe_parameters ||
         what == verb::unsubscribe_parameters || what == verb::subscribe_graph ||
         what == verb::unsubscribe_graph;
}
constexpr bool has_row(verb what) {
  return std::any_of(std::begin(table), std::end(table), [what](const row& one) { return one.what == what; });
}
constexpr bool each_verb_has_a_row() {
  for (std::size_t i = 0; i <= static_cast<std::size_t>(verb::unknown); ++i) {
    if (!has_row(static_cast<verb>(i)) && !is_foxgloves(static_cast<verb>(i))) return false;
  }
  return true;
}
static_assert(each_verb_has_a_row());

constexpr bool
each_right_is_needed() { // by a name; `set` is below, the stop's own are in core_stop_rights_test.cpp
  for (std::size_t i = 0; i < static_cast<std::size_t>(right::reset); ++i) {
    if (static_cast<right>(i) == right::set) continue;
    const auto needs = [i](const row& one) { return one.needs == static_cast<right>(i); };
    if (std::none_of(std::begin(table), std::end(table), needs)) return false;
  }
  return true;
}
static_assert(each_right_is_needed());

bool allows(verb what, std::string_view name, const asker& who) {
  const auto is_it = [&](const row& one) { return one.what == what && one.name == name; };
  const auto* const found = std::find_if(std::begin(table), std::end(table), is_it);
  return found != std::end(table) && is_among(who.sign, found->allowed);
}

// ---- one cell

std::string of_name(std::string_view begins, std::string_view name) {
  return std::string{begins} + '"' + std::string{name} + "\"}";
}

std::string publish_on(std::string_view name) {
  return R"({"op":"publish","msg":{"mark":1234567},"topic":")" + std::string{name} + "\"}";
}
std::string call_of(std::string_view name) {
  return R"({"op":"call_service","id":"w","args":{"mark":1234567},"service":")" + std::string{name} + "\"}";
}
std::string goal_of(std::string_view name) {
  return R"({"op":"send_action_goal","id":"w","feedback":true,"args":{"mark":1234567},"action":")" +
         std::string{name} + "\"}";
}
constexpr std::string_view other_mark = "1234567";

// What must be there before it is asked.
void prepare(scene& in, verb what, about& of) {
  const std::string_view name = of.name;
  const bool endpoints = name.starts_with("/rowe") || name.starts_with("/ros");
  switch (what) {
  case verb::subscribe:
  case verb::unadvertise:
    if (!endpoints) in.host.say(of_name(R"({"op":"advertise","type":"a/B","topic":)", name));
    break;
  case verb::publish:
  case verb::unsubscribe: in.host.say(of_name(R"({"op":"subscribe","topic":)", name)); break;
  case verb::call:
  case verb::reply:
  case verb::unadvertise_service:
    if (!endpoints && !name.empty())
      in.host.say(of_name(R"({"op":"advertise_service","type":"a/B","service":)", name));
    break;
  case verb::send_goal:
  case verb::unadvertise_action:
  case verb::cancel_goal:
  case verb::goal_feedback:
  case verb::goal_result:
    in.host.say(of_name(R"({"op":"advertise_action","type":"a/B","action":)", name));
    break;
  default: break; // they need nothing; has_effect() lists them all
  }
  in.on.cycles(2);
  const bool of_goal = what == verb::cancel_goal || what == verb::goal_feedback || what == verb::goal_result;
  if (what == verb::reply || of_goal) { // the id under which the host is asked
    in.other.say(of_goal ? goal_of(name) : call_of(name));
    in.on.cycles(2);
    for (const std::string& text : in.host.hear()) {
      if (const auto id = rowe::json::find(rowe::json::root(text).raw, "id")) of.id = id->raw;
    }
  }
  of = in.with_numbers(of);
  (void)in.host.hear();
  (void)in.subject.hear();
  in.read_events();
}

// Whether it has taken effect; for what takes back or answers: on what is another's.
bool has_effect(scene& in, const row& of) {
  switch (of.what) {
  case verb::message: return has(in.inbox(), mark);
  case verb::publish: return has(scene::all_of(in.host), mark);
  case verb::subscribe:
    if (of.name == "/rowe/stats") {
      in.on.cycles(30, 100ms);
      return has(scene::all_of(in.subject), "uptime_s");
    }
    in.host.say(publish_on(of.name));
    in.on.cycles(2);
    return has(scene::all_of(in.subject), other_mark);
  case verb::unsubscribe:
    in.other.say(publish_on(of.name));
    in.on.cycles(2);
    return !has(scene::all_of(in.host), other_mark);
  case verb::advertise: {
    const std::string lists = in.answer_to(in.other, call_of("/rosapi/topics"));
    return has(lists, '"' + std::string{of.name} + '"') &&
           (in.words == codec::numbers || has(lists, "\"a/B\""));
  }
  case verb::unadvertise:
    return !has(in.answer_to(in.other, call_of("/rosapi/topics")), '"' + std::string{of.name} + '"');
  case verb::call:
    if (of.name.empty()) return has(in.inbox(), mark);
    if (of.name.starts_with("/ro"))
      return (has(in.told, "\"result\":true") || has(in.told, "in_reply_to") || in.told.starts_with('r')) &&
             !has(in.told, "error");
    return has(scene::all_of(in.host), mark);
  case verb::send_goal: return has(scene::all_of(in.host), mark);
  case verb::cancel_goal: return has(scene::all_of(in.host), "cancel_action_goal");
  case verb::goal_feedback:
  case verb::goal_result:
  case verb::reply: return has(scene::all_of(in.other), mark);
  case verb::advertise_action:
    in.other.say(goal_of(of.name));
    in.on.cycles(3);
    return has(scene::all_of(in.subject), other_mark);
  case verb::unadvertise_action:
    in.other.say(goal_of(of.name));
    in.on.cycles(3);
    return !has(scene::all_of(in.host), other_mark);
  case verb::advertise_service:
    (void)in.answer_to(in.other, call_of(of.name));
    return has(scene::all_of(in.subject), other_mark);
  case verb::unadvertise_service:
    (void)in.answer_to(in.other, call_of(of.name));
    return !has(scene::all_of(in.host), other_mark);
  case verb::status: return in.statuses != 0;
  case verb::set_level:
  case verb::get_parameters:
  case verb::set_parameters:
  case verb::subscribe_parameters:
  case verb::unsubscribe_parameters:
  case verb::subscribe_graph:
  case verb::unsubscribe_graph:
  case verb::fragment:
  case verb::unsupported:
  case verb::unknown: break;
  }
  return false;
}

// Whether what is allowed can be seen: what needs a right, and of the rest a status.
bool shows_effect(const row& of) { return of.needs || of.what == verb::status; }

std::string denial_of(const asker& who, right what, std::string_view name) {
  const std::string role = "role " + std::string{who.role};
  return (who.has_token ? std::string{who.role} + ", " + role + "," : role) + " has no right to " +
         std::string{rowe::access::name_of(what)} + " " +
         (name.empty() ? "plain messages" : std::string{name});
}

// By numbers nobody can name what it was not told, and publishes only on what it has offered.
bool names_nothing(codec in, const row& of, const asker& who) {
  if (in != codec::numbers) return false;
  if (of.what == verb::publish) return !allows(verb::advertise, of.name, who);
  return of.what == verb::subscribe || of.what == verb::unsubscribe || of.what == verb::unadvertise ||
         of.what == verb::call;
}

void expect_denied(scene& in, const row& of, const std::string& why) {
  EXPECT_EQ(in.on.count(counter::denied), 1U);
  EXPECT_EQ(in.denials, std::vector<std::string>{std::string{in.who.address} + ": " + why});
  EXPECT_TRUE(has(in.told, why)) << in.told;
  if (of.what != verb::call && of.what != verb::send_goal) return;
  EXPECT_EQ(in.on.count(counter::calls_refused), 1U);
  EXPECT_TRUE(has(in.told, call_id)) << in.told; // whoever waits for the answer gets it
}

void try_cell(const asker& who, codec words, const row& of, spelling how, std::size_t form) {
  scene in{who, words};
  ASSERT_EQ(in.on.core.peers(), 3U);
  about what{.name = std::string{of.name}};
  prepare(in, of.what, what);
  what.name = spelled(of.name, how);
  if (words == codec::numbers && of.what == verb::publish && allows(verb::advertise, of.name, who)) {
    in.say({R"({"offer":[[5,")" + what.name + R"("]]})"});
    ASSERT_EQ(in.on.count(counter::denied), 0U);
  }
  in.say(said(words, of.what, what)[form]);
  in.read_events();
  const std::string why = denial_of(who, of.needs.value_or(right::publish), said_name(of.name, how));
  const bool allowed = is_among(who.sign, of.allowed);
  const std::size_t denials = in.denials.size();
  const auto denied = in.on.count(counter::denied);
  if (allowed) {
    EXPECT_EQ(denied, 0U) << in.told;
    EXPECT_EQ(denials, 0U);
  } else if (who.stop_only) {
    const bool unknown = names_nothing(words, of, who) || of.what == verb::unknown;
    const bool by_role = !who.has_token && of.what == verb::call && !unknown;
    EXPECT_EQ(denied, by_role ? 1U : 0U);
    EXPECT_TRUE(unknown || has(in.told, by_role ? why : "may only stop")) << in.told;
    EXPECT_FALSE(in.told.empty());
  } else if (names_nothing(words, of, who)) {
    EXPECT_EQ(denied, 0U);
    EXPECT_EQ(in.on.count(of.what == verb::call ? counter::calls_refused : counter::refused_requests), 1U);
    EXPECT_TRUE(has(in.told, "no topic or service has the number")) << in.told;
    EXPECT_FALSE(has(in.told, of.name)) << in.told;
  } else {
    expect_denied(in, of, why);
  }
  EXPECT_EQ(has_effect(in, of), allowed && shows_effect(of)) << in.told;
}

void try_codec(codec words) {
  std::size_t cells = 0;
  for (const row& of : table) {
    for (const asker& who : askers) {
      for (const spelling how : {spelling::plain, spelling::no_slash, spelling::escaped}) {
        const bool by_name = words == codec::rosbridge && !of.name.empty();
        if (how != spelling::plain && !by_name) continue;
        const auto forms = said(words, of.what, {.name = spelled(of.name, how)});
        for (std::size_t form = 0; form < forms.size(); ++form) {
          SCOPED_TRACE(std::string{who.sign} + " (" + std::string{who.role} + ") says " + forms[form].bytes);
          try_cell(who, words, of, how, form);
          ++cells;
        }
      }
    }
  }
  EXPECT_GT(cells, 200U);
}

TEST(rights_table, holds_in_rosbridge) { try_codec(codec::rosbridge); }
TEST(rights_table, holds_in_rowe_v1) { try_codec(codec::rowe_v1); }
TEST(rights_table, holds_in_hop) { try_codec(codec::hop); }
TEST(rights_table, holds_in_hop_2014) { try_codec(codec::hop_2014); }
TEST(rights_table, holds_by_numbers) { try_codec(codec::numbers); }

// ---- parameters, by rosbridge's service and by Foxglove's requests

// A scene with one.
struct scene_with_parameter : scene {
  scene_with_parameter(const asker& asks, codec in, std::string_view name) : scene{asks, in} {
    auto* const cell =
        on.shared.parameters.open(rowe::detail::parameter_request_of<bool>(name, false, {}), -1);
    flag = rowe::parameter<bool>{rowe::detail::parameter_handle{nullptr, *cell}, false, {}};
    (void)subject.hear_after(10);
    read_events();
  }
  rowe::parameter<bool> flag;
};

// Who may call the service, or says it without one, needs another right for the parameter.
TEST(rights_table, holds_for_setting_parameters) {
  struct parameter_row {
    std::string_view name;
    std::string_view allowed;
  };
  for (const auto& [name, allowed] : {parameter_row{own, "sael"}, {deep, "sel"}, {outside, "sel"}}) {
    for (const asker& who : askers) {
      for (const codec words : {codec::rosbridge, codec::foxglove}) {
        SCOPED_TRACE(std::string{who.sign} + " sets " + std::string{name});
        scene_with_parameter in{who, words, name};
        const std::string its = R"({"name":")" + std::string{name} + R"(","value":)";
        const bool by_service = words == codec::rosbridge;
        in.say({by_service ? R"({"op":"call_service","id":"c","service":"/rosapi/set_param","args":)" + its +
                                 R"("true"}})"
                           : R"({"op":"setParameters","id":"c","parameters":[)" + its + "true}]}"});
        in.read_events();
        const bool may = is_among(who.sign, allowed);
        EXPECT_EQ(in.flag.get(), may) << in.told;
        if (!may && is_among(who.sign, by_service ? "dpa" : "odpagn"))
          expect_denied(in, {by_service ? verb::status : verb::set_parameters, name, right::set, allowed},
                        denial_of(who, right::set, name));
      }
    }
  }
}

// As for calling the service that answers the same.
TEST(rights_table, holds_for_reading_parameters) {
  for (const asker& who : askers) {
    for (const char* const op : {"getParameters", "subscribeParameterUpdates"}) {
      SCOPED_TRACE(std::string{who.sign} + " says " + op);
      scene_with_parameter in{who, codec::foxglove, own};
      in.say({R"({"op":")" + std::string{op} + R"(","parameterNames":[")" + std::string{own} + "\"]}"});
      in.read_events();
      const bool may = is_among(who.sign, "odspel");
      EXPECT_EQ(has(in.told, "\"value\":false"), may) << in.told;
      if (!may && !who.stop_only)
        expect_denied(in, {verb::get_parameters, "/rosapi/get_param", right::call, {}},
                      denial_of(who, right::call, "/rosapi/get_param"));
      EXPECT_TRUE(in.flag.set(true));
      in.on.now += 20ms;
      in.on.cycles(2);
      EXPECT_EQ(has(scene::all_of(in.subject), "\"value\":true"),
                may && std::string_view{op} == "subscribeParameterUpdates");
    }
  }
}

} // namespace
} // namespace core_rights_table_test
