// SPDX-License-Identifier: Apache-2.0
#include "configuration.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "../../demo_robot/demo.hpp"
#include "../console.hpp"
#include "../network/host_addresses.hpp"

namespace rowe::tools {
namespace {

constexpr int demo_service_priority = demo::priority - 10; // below the loop it serves

// A hub, where nothing else is said.
configuration hub_defaults() {
  configuration made;
  made.endpoint.relay = true;
  return made;
}

// The demo's robot has defaults of its own.
void set_demo_defaults(settings& in) {
  const stop_options stop = demo::stop_of(in.values().serve.guarded);
  const auto text_of = [](duration time) { return joined(time.count(), " ns"); };
  (void)in.set_default("endpoint", "priority", joined(demo_service_priority)); // these are keys, in range
  (void)in.set_default("stop", "guard_timeout", text_of(stop.guard_timeout));
  (void)in.set_default("stop", "service_timeout", text_of(stop.service_timeout));
  (void)in.set_default("stop", "observe_timeout", text_of(stop.observe_timeout));
  (void)in.set_default("stop", "unguarded", stop.unguarded ? "true" : "false");
}

// Sets one limit from NAME=VALUE; otherwise says what is wrong.
std::string set_limit(settings& in, std::string_view asked) {
  const auto equals = asked.find('=');
  if (equals == asked.npos)
    return joined("--limit needs NAME=VALUE such as topics_max=256, not ", quoted(asked));
  const std::string_view name = asked.substr(0, equals);
  const auto known = limits::names();
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    return joined("--limit: there is no limit ", quoted(name), did_you_mean(nearest(name, known)));
  }
  const std::array<std::string, 1> text{std::string{asked.substr(equals + 1)}};
  std::string why;
  (void)in.set("limits", name, text, joined("--limit ", name), &why); // says why, or nothing
  return why;
}

std::string_view unquoted(std::string_view value) {
  return value.starts_with('"') ? value.substr(1, value.size() - 2) : value;
}

} // namespace

configuration_options::configuration_options() : given_(keys_.size()) {
  const std::vector<setting> defaults =
      settings{hub_defaults()}.list(); // the keys come first, in their order
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    const setting_key& one = keys_[i];
    const std::string& value = defaults[i].value;
    std::string meaning{one.meaning};
    if (one.is_list) {
      meaning += "; repeatable";
    } else if (one.is_switch && value == "true") {
      meaning += joined(" (default true; ", one.option, "=false)");
    } else if (!one.is_switch && value != "\"\"") {
      meaning += joined(" (default ", unquoted(value), ")");
    }
    meanings_.push_back(std::move(meaning));
  }
}

std::vector<option> configuration_options::table() {
  std::vector<option> made{
      {"--config", "", "FILE", "read this file of TOML, too (default $ROWE_CONFIG)", &file_},
      {"--listen", "", "ADDR:PORT", "--address and --port in one", &listen_},
      {"--limit", "", "NAME=VALUE", "a member of rowe::limits, such as topics_max=256; repeatable", &limits_},
  };
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    const setting_key& one = keys_[i];
    if (one.option.empty()) continue;
    const std::string_view letter = one.option == "--quiet" ? "-q" : "";
    const target into = one.is_switch ? target{switch_text{&given_[i]}} : target{any_text{&given_[i]}};
    made.push_back({one.option, letter, one.placeholder, meanings_[i], into});
  }
  return made;
}

std::string configuration_options::set_listen(settings& in) const {
  if (listen_.empty()) return {};
  if (in.source_of("endpoint", "port") == setting_source::command_line ||
      in.source_of("endpoint", "address") == setting_source::command_line) {
    return "--listen excludes --address and --port";
  }
  std::array<std::string, 1> address;
  std::uint16_t number = 0;
  if (std::string wrong = split_listen(listen_, address[0], number); !wrong.empty()) return wrong;
  const std::array<std::string, 1> port{joined(number)};
  std::string why;
  if (in.set("endpoint", "address", address, "--listen", &why))
    (void)in.set("endpoint", "port", port, "--listen", &why); // says why, or nothing
  return why;
}

std::string configuration_options::set_all(settings& in) const {
  std::string why;
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    const setting_key& one = keys_[i];
    if (!given_[i].empty() && !in.set(one.section, one.name, given_[i], one.option, &why)) return why;
  }
  for (const std::string& one : limits_) {
    if (why = set_limit(in, one); !why.empty()) return why;
  }
  return set_listen(in);
}

std::string configuration_options::file() const {
  const char* const variable = std::getenv("ROWE_CONFIG");
  return file_.empty() && variable != nullptr ? variable : file_;
}

std::optional<settings> configuration_options::read_all(std::string_view verb) {
  settings made{hub_defaults()};
  if (const std::string why = set_all(made); !why.empty()) {
    usage_error(verb, printable(why));
    return std::nullopt;
  }
  std::string why;
  auto all = read_unchecked(why);
  if (all && all->check(&why)) return all;
  say_lines(console{verb}, severity::error, why);
  return std::nullopt;
}

std::optional<settings> configuration_options::read_unchecked(std::string& why) const {
  settings made{hub_defaults()};
  why = set_all(made);
  bool right = file().empty() || made.read_file(file(), &why);
  right = right && made.read_environment(&why);
  if (!right) return std::nullopt;
  if (made.values().serve.demo) set_demo_defaults(made);
  return made;
}

void configuration_options::say_lines(const console& to, severity how, std::string_view why) {
  while (!why.empty()) {
    const std::size_t end = std::min(why.find('\n'), why.size());
    to.say(how, printable(why.substr(0, end)));
    why.remove_prefix(std::min(end + 1, why.size()));
  }
}

} // namespace rowe::tools
