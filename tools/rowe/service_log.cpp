// SPDX-License-Identifier: Apache-2.0
#include "service_log.hpp"

#include <string>
#include <string_view>

#include "text/json_values.hpp"

namespace rowe::tools {
namespace {

// In event::kind's order.
constexpr std::array<std::string_view, 10> kind_names{
    "peer_joined",      "peer_left", "refused_handshake", "cannot_connect", "refused_request",
    "status_from_peer", "limit",     "warning",           "stop",           "denied"};
static_assert(kind_names.size() == static_cast<std::size_t>(event::kind::denied) + 1);

// What a program would raise in its options is raised here on the command line.
std::string with_option(std::string sentence) {
  constexpr std::string_view member = "`limits::";
  if (const auto at = sentence.find(member); at != sentence.npos)
    sentence.replace(at, member.size(), "`--limit ");
  return sentence;
}

severity severity_of(event::kind what) noexcept {
  using kind = event::kind;
  switch (what) {
  case kind::limit:
  case kind::warning: return severity::warning;
  case kind::cannot_connect:
  case kind::refused_handshake:
  case kind::stop:
  case kind::denied: return severity::notice;
  case kind::peer_joined:
  case kind::peer_left:
  case kind::refused_request:
  case kind::status_from_peer: break;
  }
  return severity::info;
}

} // namespace

service_log::service_log(const console& to)
    : to_{to},
      strangers_{[this](const event& e, std::uint64_t more) { write(e, more); },
                 [this](std::uint64_t count) { write_rest(count); }},
      stops_{[this](const event& e, std::uint64_t more) { write(e, more); },
             [this](std::uint64_t count) { write_rest(count); }},
      own_{[this](const event& e, std::uint64_t more) { write(e, more); },
           [this](std::uint64_t count) { write_rest(count); }} {}

event_folder& service_log::folder_of(event::kind what) noexcept {
  if (what == event::kind::stop) return stops_;
  return what == event::kind::warning || what == event::kind::cannot_connect ? own_ : strangers_;
}

void service_log::report(endpoint& of, rt::time_point now) {
  while (const auto happened = of.try_event()) folder_of(happened->what_kind).take(*happened, now);
  for (event_folder* const each : {&strangers_, &stops_, &own_}) each->flush(now);
}

void service_log::finish() {
  for (event_folder* const each : {&strangers_, &stops_, &own_}) each->finish();
  if (left_out_ != 0) to_.note("log: ", counted(left_out_, "event"), " got no line");
}

void service_log::write(const event& happened, std::uint64_t more) {
  const std::string_view kind = kind_names[static_cast<std::size_t>(happened.what_kind)];
  std::string members = joined("\"event\":\"", kind, "\"");
  const auto add = [&](std::string_view name, std::string_view value) {
    if (!value.empty()) members.append(joined(",\"", name, "\":", json_string_of(value)));
  };
  add("peer", happened.peer);
  add("identity", happened.identity);
  add("what", happened.what);
  add("remedy", happened.remedy);
  std::string sentence = with_option(sentence_of(happened, with_kind::yes));
  if (more != 0) {
    members.append(joined(",\"more\":", more));
    sentence.append(joined(" [and ", more, " more like it in a second]"));
  }
  to_.say(severity_of(happened.what_kind), sentence, members);
}

void service_log::write_rest(std::uint64_t left_out) {
  left_out_ += left_out;
  to_.say(severity::warning, joined(counted(left_out, "other event"), " in a second got no line"),
          joined("\"left_out\":", left_out));
}

} // namespace rowe::tools
