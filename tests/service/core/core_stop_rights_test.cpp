// SPDX-License-Identifier: Apache-2.0
// The stop, its other services, lists, statistics and pages, of every role and in each codec: one table says
// who may. A reset or a heartbeat that is denied names the right that is missing, is counted and reported,
// and changes nothing.
#include "rights_table.hpp"

#include <algorithm>

namespace core_stop_rights_test {
namespace {

using namespace rights_table;

struct row {
  stop_verb what;
  bool resigns; // guard: ends the guard of somebody else
  std::optional<right> needs;
  std::string_view allowed; // to whom
};
constexpr row table[] = {
    {stop_verb::stop, false, {}, everyone},        {stop_verb::state, false, {}, everyone},
    {stop_verb::reset, false, right::reset, "sl"}, {stop_verb::guard, false, right::guard, "sgl"},
    {stop_verb::guard, true, right::reset, "sl"},
};
constexpr bool each_verb_has_a_row() {
  for (std::size_t i = 1; i <= static_cast<std::size_t>(stop_verb::state); ++i) {
    const auto is_it = [i](const row& one) { return one.what == static_cast<stop_verb>(i); };
    if (std::none_of(std::begin(table), std::end(table), is_it)) return false;
  }
  return true;
}
static_assert(each_verb_has_a_row());

constexpr bool each_right_is_needed() { // of those without a name
  for (std::size_t i = static_cast<std::size_t>(right::reset); i <= static_cast<std::size_t>(right::guard);
       ++i) {
    const auto needs = [i](const row& one) { return one.needs == static_cast<right>(i); };
    if (std::none_of(std::begin(table), std::end(table), needs)) return false;
  }
  return true;
}
static_assert(each_right_is_needed());

std::string call_of(std::string_view service) {
  return R"({"op":"call_service","id":"1","service":")" + std::string{service} + "\"}";
}

struct stop_scene : scene {
  stop_scene(const asker& asks, codec in) : scene{asks, in} { (void)loop.moves(); }

  void let_go() { // by the supervisor, who may
    (void)call_stop(on, other, "reset", "");
    ASSERT_TRUE(loop.moves());
  }
  void guard() {
    const std::string answer = call_stop(on, other, "guard", R"("guard":"panel",)");
    ASSERT_TRUE(has(answer, R"("refused":null)"));
  }
  stoppable_loop loop{on};
};

void prepare(stop_scene& in, const row& of) {
  if (of.what == stop_verb::stop) in.let_go();
  if (of.resigns) in.guard();
}
std::string args_of(stop_scene& in, const row& of) {
  switch (of.what) {
  case stop_verb::reset: return stop_as_shown(in.on, in.other) + ",";
  case stop_verb::guard:
    return stop_as_shown(in.on, in.other) + R"(,"guard":"panel",)" + (of.resigns ? R"("resign":true,)" : "");
  case stop_verb::none:
  case stop_verb::stop:
  case stop_verb::state: break;
  }
  return {};
}
bool has_effect(stop_scene& in, const row& of) {
  switch (of.what) {
  case stop_verb::none: break;
  case stop_verb::stop: return !in.loop.moves();
  case stop_verb::reset: return in.loop.moves();
  case stop_verb::guard:
    return has(in.answer_to(in.other, call_of("/rowe/stop/state")), R"("name":"panel")") != of.resigns;
  case stop_verb::state: return has(in.told, R"("loops":[)");
  }
  return false;
}

std::string denial_of(const asker& who, right what) {
  const std::string name{rowe::access::name_of(what)};
  if (!who.roles) return "without roles only peers on this machine may " + name;
  return std::string{who.role} + ", role " + std::string{who.role} + ", has no right to " + name;
}

void try_cell(const asker& who, codec words, const row& of, std::size_t form) {
  stop_scene in{who, words};
  ASSERT_EQ(in.on.core.peers(), 3U);
  prepare(in, of);
  const std::string args = args_of(in, of);
  const std::string name{rowe::service::stop_gate::name_of(of.what)};
  const about named = in.with_numbers({.name = name});
  (void)in.subject.hear();
  in.read_events();
  const auto refused_before = in.on.count(counter::stop_refusals);
  in.say(said_to_stop(words, of.what, args, named.service)[form]);
  in.read_events();
  const bool allowed = is_among(who.sign, of.allowed);
  const auto denied = in.on.count(counter::denied);
  if (allowed) {
    EXPECT_EQ(denied, 0U) << in.told;
    EXPECT_TRUE(in.denials.empty());
  } else if (who.stop_only) { // it asks for nothing but the stop and its state
    EXPECT_TRUE(has(in.told, "may only stop") || has(in.told, "has no right to call " + name)) << in.told;
  } else {
    const std::string missing{rowe::access::name_of(*of.needs)};
    EXPECT_TRUE(has(in.told, R"("refused":"role")")) << in.told;
    EXPECT_TRUE(has(in.told, R"("right":")" + missing + '"')) << in.told;
    EXPECT_EQ(denied, 1U);
    EXPECT_EQ(in.on.count(counter::stop_refusals), refused_before + 1);
    EXPECT_EQ(in.denials,
              std::vector<std::string>{std::string{who.address} + ": " + denial_of(who, *of.needs)});
  }
  EXPECT_EQ(has_effect(in, of), allowed) << in.told;
}

TEST(stop_rights_table, holds_in_each_codec) {
  std::size_t cells = 0;
  for (const codec words : codecs) {
    for (const row& of : table) {
      for (const asker& who : askers) {
        for (std::size_t form = 0; form < said_to_stop(words, of.what, "", 1).size(); ++form) {
          SCOPED_TRACE(std::string{who.sign} + " (" + std::string{who.role} + ") says " +
                       said_to_stop(words, of.what, "", 1)[form].bytes);
          try_cell(who, words, of, form);
          ++cells;
        }
      }
    }
  }
  EXPECT_GT(cells, 500U);
}

// ---- what is shown

// Topics and services are listed to whoever may subscribe to them, or call them; the identities of others to
// whoever sees everything.
struct shown_row {
  char sign;
  std::string_view topics, services; // of j(oint), l(eft), c(md_vel)
  bool others;
};
constexpr shown_row shown[] = {
    {'o', "jlc", "", true},  {'d', "jlc", "jlc", true}, {'s', "jlc", "jlc", true}, {'p', "jlc", "jlc", true},
    {'a', "jl", "j", false}, {'e', "jlc", "jlc", true}, {'l', "jlc", "jlc", true}};
constexpr std::pair<char, std::string_view> listed[] = {{'j', own}, {'l', deep}, {'c', outside}};

void expect_listed(const std::string& in, std::string_view which) {
  for (const auto& [sign, name] : listed)
    EXPECT_EQ(has(in, '"' + std::string{name} + '"'), is_among(sign, which)) << name << " in " << in;
}

struct list_scene : scene {
  list_scene(const asker& asks, codec in)
      : scene{asks, in, [](rowe::endpoint_options& options) {
                for (rowe::role& one : options.access.roles) {
                  if (one.name == "arm") one.call = {"/arm/*", "/rosapi/**", "/rowe/stats"};
                }
              }} {
    for (const auto& [sign, name] : listed) {
      host.say(R"({"op":"advertise","type":"a/B","topic":")" + std::string{name} + "\"}");
      host.say(R"({"op":"advertise_service","type":"a/B","service":")" + std::string{name} + "\"}");
    }
    on.cycles(3);
  }
};

TEST(shown_rights, are_those_of_lists_and_statistics) {
  for (const shown_row& of : shown) {
    const auto* const who =
        std::find_if(std::begin(askers), std::end(askers), [&](auto& one) { return one.sign == of.sign; });
    SCOPED_TRACE(who->role);
    list_scene in{*who, codec::rosbridge};
    expect_listed(in.answer_to(in.subject, call_of("/rosapi/topics")), of.topics);
    expect_listed(in.answer_to(in.subject, call_of("/rosapi/services")), of.services);
    const std::string stats = in.answer_to(in.subject, call_of("/rowe/stats"));
    expect_listed(stats, of.topics);
    const bool named = has(stats, R"("identity":"peer")") && has(stats, R"("identity":"supervisor")");
    if (who->roles && who->role != "peer" && who->role != "supervisor") {
      EXPECT_EQ(named, of.others) << stats;
      const std::string role = '"' + std::string{who->role} + '"';
      EXPECT_TRUE(has(stats, R"("identity":)" + role + R"(,"identity_role":)" + role));
    }
    EXPECT_EQ(in.on.count(counter::denied), 0U);
  }
}

TEST(shown_rights, are_those_of_lists_by_number) {
  for (const shown_row& of : shown) {
    const auto* const who =
        std::find_if(std::begin(askers), std::end(askers), [&](auto& one) { return one.sign == of.sign; });
    SCOPED_TRACE(who->role);
    list_scene in{*who, codec::numbers};
    in.on.cycles(300);
    const auto heard = in.subject.hear();
    const auto topics = numbers::list_of(heard, 'T');
    const auto services = numbers::list_of(heard, 'S');
    for (const auto& [sign, name] : listed) {
      EXPECT_EQ(topics.contains(std::string{name}), is_among(sign, of.topics)) << name;
      EXPECT_EQ(services.contains(std::string{name}), is_among(sign, of.services)) << name;
    }
  }
}

// Pages are asked for by those who show a token, or none.
TEST(page_rights, are_those_to_call_the_statistics) {
  for (const asker& who : askers) {
    if (who.stop_only) continue;
    SCOPED_TRACE(who.role);
    core_harness on{options_for(who)};
    on.cycle();
    const std::string token = who.has_token ? token_of(who.role) : "";
    const auto may_read = [&](std::string_view path) {
      return static_cast<rowe::service::transport_sink&>(on.core)
          .may_read({.address = who.address, .path = path, .token = token})
          .status;
    };
    const bool allowed = is_among(who.sign, "odspel");
    EXPECT_EQ(may_read("/metrics"), allowed ? 0 : 403);
    EXPECT_EQ(on.count(counter::denied), allowed ? 0U : 1U);
    EXPECT_EQ(may_read("/healthz"), 0);
  }
  core_harness on{options_for(askers[0])};
  on.cycle();
  EXPECT_EQ(static_cast<rowe::service::transport_sink&>(on.core)
                .may_read({.address = far, .path = "/metrics", .token = {}})
                .status,
            401);
}

} // namespace
} // namespace core_stop_rights_test
