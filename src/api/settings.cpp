// SPDX-License-Identifier: Apache-2.0
// Settings: values, where each came from, and which of several holds. Set-up.
#include <rowe/recording.hpp>
#include <rowe/settings.hpp>

#include <unistd.h>

#include <algorithm>

#include "access/files.hpp"
#include "api/check_opening.hpp"
#include "api/settings_reader.hpp"
#include "config/environment.hpp"
#include "config/keys.hpp"

namespace rowe {
namespace {

using config::key;
using config::value;

std::string full_name(const key<configuration>& one) {
  return std::string{one.section} + "." + std::string{one.name};
}

template <class Owner>
setting shown(const key<Owner>& one, const Owner& of, std::string section, std::string origin, bool first) {
  return {std::move(section), std::string{one.name}, config::written(one.what, one.get(of)),
          std::move(origin), first};
}

} // namespace

settings::settings(configuration defaults) : values_{std::move(defaults)}, origins_(config::keys().size()) {
  roles_.resize(values_.endpoint.access.roles.size());
  identities_.resize(values_.endpoint.access.identities.size());
}

status settings::read_file(const std::string& path, std::string* why) {
  settings_reader reader{*this, path};
  config::file_text file;
  config::table root;
  config::fault wrong;
  if (!config::read_file(path, file, wrong) || !config::parse(file.text, root, wrong)) {
    const std::string line = wrong.line > 0 ? ":" + std::to_string(wrong.line) : std::string{};
    reader.faults.add(wrong.line, path + line + ": " + wrong.text);
  } else {
    reader.read(root, file.writable_by_others);
  }
  return reader.faults.finish(why);
}

status settings::read_environment(std::string* why) {
  setting_faults faults;
  for (char** one = environ; one != nullptr && *one != nullptr; ++one) {
    const std::string_view entry = *one;
    const auto equals = entry.find('=');
    if (!entry.starts_with("ROWE_") || equals == entry.npos) continue;
    const std::string variable{entry.substr(0, equals)};
    const std::size_t at = config::find_variable(variable);
    if (at == config::keys().size()) {
      if (std::string wrong = config::unknown_variable(variable); !wrong.empty())
        faults.add(0, std::move(wrong));
      continue;
    }
    value found;
    if (const std::string wrong = config::read(config::keys()[at].what, entry.substr(equals + 1), found);
        !wrong.empty()) {
      faults.add(0, variable + " " + wrong);
    } else if (origins_[at].source <= setting_source::environment) {
      config::keys()[at].set(values_, std::move(found));
      origins_[at] = {setting_source::environment, variable, 0};
    }
  }
  return faults.finish(why);
}

status settings::set(std::string_view section, std::string_view name, std::span<const std::string> texts,
                     std::string_view shown_as, std::string* why) {
  setting_faults faults;
  const std::size_t at = config::find(section, name);
  value found;
  if (at == config::keys().size()) {
    faults.add(0, std::string{shown_as} + " is no key");
  } else if (const std::string wrong = config::read(config::keys()[at].what, texts, found); !wrong.empty()) {
    faults.add(0, std::string{shown_as} + " " + wrong);
  } else {
    config::keys()[at].set(values_, std::move(found));
    origins_[at] = {setting_source::command_line, std::string{shown_as}, 0};
  }
  return faults.finish(why);
}

status settings::set_default(std::string_view section, std::string_view name, std::string_view text) {
  const std::size_t at = config::find(section, name);
  value found;
  if (at == config::keys().size() || !config::read(config::keys()[at].what, text, found).empty())
    return errc::bad_config;
  if (origins_[at].source == setting_source::fallback) config::keys()[at].set(values_, std::move(found));
  return {};
}

setting_source settings::source_of(std::string_view section, std::string_view name) const noexcept {
  const std::size_t at = config::find(section, name);
  return at == config::keys().size() ? setting_source::fallback : origins_[at].source;
}

std::vector<setting> settings::list() const {
  std::vector<setting> all;
  std::string_view section;
  for (std::size_t i = 0; i < config::keys().size(); ++i) {
    const auto& one = config::keys()[i];
    const std::string& place = origins_[i].place;
    all.push_back(shown(one, values_, std::string{one.section}, place.empty() ? "default" : place,
                        one.section != section));
    section = one.section;
  }
  const auto add = [&](const auto& entries, const auto& origins, auto names, std::string_view header) {
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const std::string& place = origins[i].place;
      for (const auto& one : names) {
        all.push_back(shown(one, entries[i], std::string{header}, place.empty() ? "default" : place,
                            &one == names.data()));
      }
    }
  };
  add(values_.endpoint.access.roles, roles_, config::role_keys(), "[role]");
  add(values_.endpoint.access.identities, identities_, config::identity_keys(), "[identity]");
  return all;
}

std::vector<setting_key> settings::keys() {
  std::vector<setting_key> all;
  const configuration defaults;
  for (const auto& one : config::keys()) {
    std::string may_be = config::allowed(one.what);
    if (!one.bounded_by.empty()) may_be.append(", ").append(one.bounded_by);
    all.push_back({.section = one.section,
                   .name = one.name,
                   .option = one.option,
                   .meaning = one.meaning,
                   .placeholder = config::placeholder(one.what),
                   .allowed = std::move(may_be),
                   .fallback = config::written(one.what, one.get(defaults)),
                   .is_switch = one.what.is == config::kind::boolean,
                   .is_list = one.what.is == config::kind::texts});
  }
  return all;
}

// ---- checking

// "rowe.toml:12: stop.tick", "ROWE_STOP_TICK", "--stop-tick": whose value it is.
std::string settings::subject(std::size_t at) const {
  const origin& of = origins_[at];
  const std::string name = full_name(config::keys()[at]);
  if (of.source == setting_source::file) return of.place + ": " + name;
  return of.source == setting_source::fallback ? name : of.place;
}

// Also where the role or identity stands that is wrong. `with_proofs`: and whether each can prove who it is.
void settings::find_access_faults(setting_faults& to, bool with_proofs) const {
  using place = access::fault::place;
  std::vector<access::fault> found = access::faults_of(values_.endpoint.access);
  if (with_proofs) std::ranges::move(detail::check_proofs(values_.endpoint), std::back_inserter(found));
  for (const access::fault& one : found) {
    const origin* const at = one.where == place::role       ? &roles_[one.index]
                             : one.where == place::identity ? &identities_[one.index]
                             : one.where == place::local_role
                                 ? &origins_[config::find("access", "local_role")]
                                 : nullptr;
    if (at == nullptr || at->place.empty())
      to.add(0, "access: " + one.text);
    else
      to.add(at->line, at->place + ": " + one.text);
  }
}

// Adds the key to what is wrong with a file, or with the pin; the text begins with their name.
config::fault settings::explain_file(const std::string& fault) const {
  if (fault.starts_with("pin ")) {
    const std::size_t at = config::find("client", "pin");
    return {origins_[at].line, subject(at) + fault.substr(std::string_view{"pin"}.size())};
  }
  const auto names_value_of = [&](const key<configuration>& one) {
    if (one.what.is != config::kind::path) return false;
    const std::string path = std::get<std::string>(one.get(values_));
    return !path.empty() && fault.starts_with(path + ": ");
  };
  const auto found = std::ranges::find_if(config::keys(), names_value_of);
  const auto at = static_cast<std::size_t>(found - config::keys().begin());
  if (at == config::keys().size()) return {0, fault};
  return {origins_[at].line, subject(at) + ": " + fault};
}

// What check_listen() found wrong, in the words of who configured it.
config::fault settings::explain(const error& reason) const {
  const std::string address = config::quoted(values_.endpoint.address);
  const std::size_t address_at = config::find("endpoint", "address");
  if (reason.code == errc::not_loopback) {
    return {origins_[address_at].line, subject(address_at) + " is " + address +
                                           ", where everyone who reaches it may read and publish: that needs "
                                           "a certificate and identities, or insecure = true (--insecure)"};
  }
  if (reason.code == errc::bad_address) {
    return {origins_[address_at].line,
            subject(address_at) + " needs a numeric address such as \"127.0.0.1\" or \"::\", not " + address};
  }
  if (reason.code == errc::bad_certificate) {
    const tls_options& tls = values_.endpoint.tls;
    return explain_file(check_tls(detail::server_part(tls)));
  }
  const std::size_t at = config::find(reason.about);
  if (at == config::keys().size()) return {0, reason.message()};
  const key<configuration>& one = config::keys()[at];
  const std::string bound = config::written(one.what, value{reason.limit});
  return {origins_[at].line, subject(at) +
                                 " is out of range: " + config::written(one.what, one.get(values_)) +
                                 (reason.value < reason.limit ? " (at least " : " (at most ") + bound +
                                 (one.bounded_by.empty() ? "" : ": ") + std::string{one.bounded_by} + ")"};
}

status settings::check(std::string* why) const {
  setting_faults faults;
  const auto add = [&](config::fault found) { faults.add(found.line, std::move(found.text)); };
  const auto add_file = [&](const std::string& wrong) {
    if (!wrong.empty()) add(explain_file(wrong));
  };
  find_access_faults(faults, true);
  for (const error& one : detail::listen_faults(values_.endpoint)) add(explain(one));
  const tls_options& tls = values_.endpoint.tls;
  add_file(check_tls({.ca = tls.ca}));
  add_file(check_tls({.pin = tls.pin}));
  std::string token;
  (void)detail::token_to_show(values_.endpoint, &token); // says why, or nothing
  add_file(token);
  if (const std::string& web = values_.endpoint.web; !web.empty()) {
    if (const std::string wrong = check_web(web); !wrong.empty()) {
      const std::size_t at = config::find("endpoint", "web");
      faults.add(origins_[at].line, subject(at) + ": " + wrong);
    }
  }
  const auto add_about = [&](std::string_view section, std::string_view name, const std::string& text) {
    const std::size_t at = config::find(section, name);
    faults.add(origins_[at].line, subject(at) + text);
  };
  if (values_.serve.guarded && !values_.serve.demo)
    add_about("serve", "guarded", " is for the robot of serve.demo, or --demo");
  constexpr std::uint64_t total_min = 1 << 20;
  if (const std::uint64_t total = values_.record.total_bytes; total != 0 && total < total_min)
    add_about("record", "total",
              " is out of range: " + config::written_size(static_cast<std::int64_t>(total)) +
                  " (1 MiB or more, or 0)");
  return faults.finish(why);
}

status settings::check_access(std::string* why) const {
  setting_faults faults;
  find_access_faults(faults, false);
  return faults.finish(why);
}

std::vector<record_options> recordings_of(const configuration& chosen) {
  std::vector<record_options> all;
  if (const record_settings& one = chosen.record; !one.path.empty()) {
    all.push_back({.file = {.path = one.path,
                            .packed = one.packed,
                            .split_bytes = one.split_bytes,
                            .split_time = one.split_time,
                            .total_bytes = one.total_bytes,
                            .sync = one.sync},
                   .topics = one.topics,
                   .exclude = one.exclude});
  }
  if (const black_box_settings& one = chosen.black_box; !one.path.empty()) {
    all.push_back({.file = {.path = one.path.ends_with('/') ? one.path : one.path + "/",
                            .packed = one.packed,
                            .black_box = {.before = one.before,
                                          .after = one.after,
                                          .bytes = static_cast<std::size_t>(one.bytes),
                                          .files_max = one.files_max,
                                          .on_stop = one.on_stop,
                                          .on_lease = one.on_lease}},
                   .topics = one.topics,
                   .exclude = one.exclude});
  }
  return all;
}

std::uint64_t file_version(const std::string& path) noexcept { return access::version_of(path); }

result<endpoint_options> endpoint_options::from_file(const std::string& path, std::string* why) {
  settings chosen;
  if (const status ok = chosen.read_file(path, why); !ok) return ok.error();
  if (const status ok = chosen.check(why); !ok) return ok.error();
  return chosen.values().endpoint;
}

} // namespace rowe
