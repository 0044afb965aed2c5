// SPDX-License-Identifier: Apache-2.0
// rowe setup: what a robot needs to be put on a network, in a folder. A private root and a certificate, a
// token for each role, the settings that name them, and a URL with a QR code for a phone.
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "../arguments/command_line.hpp"
#include "../console.hpp"
#include "../network/host_addresses.hpp"
#include "../output.hpp"
#include "../setup/certificate.hpp"
#include "../setup/files.hpp"
#include "../setup/qr_code.hpp"
#include "../setup/renewal.hpp"
#include "../setup/secret.hpp"
#include "../setup/texts.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

constexpr std::int64_t port_for_tls = 8443;
constexpr int root_days = 3650; // of a root whose key is kept
constexpr std::string_view avahi_services = "/etc/avahi/services";
// A certificate carries dates, and a clock that was never set is some fifty years late.
constexpr calendar_time clock_is_set{std::chrono::sys_days{std::chrono::year{2025} / 1 / 1}};

// Their tokens, each named like its role.
constexpr std::array<std::string_view, 4> token_roles{"observer", "driver", "supervisor", "peer"};
// Who sees the terminal, or a picture of it, has the token in the QR code. A driver drives and stops; to let
// a stopped robot go again is left to who copies the supervisor's.
constexpr std::size_t link_default = 1;

struct setup_settings {
  std::string name;
  std::string dir;
  std::string address = "0.0.0.0"; // "::" has no IPv4
  std::int64_t port = port_for_tls;
  std::int64_t days = 0;
  std::vector<std::string> hosts;
  std::size_t link = link_default; // of token_roles
  bool keep_ca = false;
  bool save_tokens = false;
  bool avahi = false;
  bool force = false;
  bool quiet = false;
  bool renew = false;
  bool qr = false;
};

command table_of(setup_settings& o) {
  return {
      .verb = "setup",
      .examples = {{{"rowe setup --name ang-01", "makes the folder rowe-ang-01 and prints a QR code"},
                    {"rowe setup --renew --dir rowe-ang-01", "a new certificate by the root of --keep-ca"}}},
      .description =
          "Makes what a robot needs to be put on a network: rowe.toml, a certificate for all names and\n"
          "addresses of this machine, the root that signed it, for phones to import (it can vouch for\n"
          "private names and addresses only), and a token for each role, of which only hashes are stored.\n"
          "The tokens are printed once. The folder appears once all of it is there and they are\n"
          "printed, or not at all.\n",
      .operands = {},
      .options = {
          {"--name", "", "NAME", "of the robot (default: this machine's)", &o.name},
          {"--dir", "", "DIR", "the folder (default rowe-NAME)", &o.dir},
          {"--address", "", "ADDR", "where it will listen (default 0.0.0.0: all IPv4 networks)", &o.address},
          {"--port", "", "N", "its TCP port (default 8443)", integer{&o.port, 1, 65535}},
          {"--host", "", "NAME|ADDR", "a further name or address in URLs; repeatable", &o.hosts},
          {"--days", "", "N", "how many days the certificate is valid (default 397)",
           integer{&o.days, 1, certificate_days_max}},
          {"--keep-ca", "", "", "keep the root's key (ca-key.pem), so that certificates can be renewed",
           &o.keep_ca},
          {"--save-tokens", "", "", "write the tokens to tokens.txt as well", &o.save_tokens},
          {"--avahi", "", "", "announce the robot: put rowe-NAME.service into /etc/avahi/services", &o.avahi},
          {"--link", "", "ROLE", "whose token the link has, and the QR code (default driver)",
           choice{&o.link, token_roles}},
          {"--qr", "", "", "print the QR code even where stdout is no terminal", &o.qr},
          {"--quiet", "-q", "", "no hints of what to do next on stderr", &o.quiet},
          {"--force", "", "", "replace what an earlier set-up made in the folder", &o.force},
          {"--renew", "", "", "only make a new certificate in the folder --dir", &o.renew},
      }};
}

calendar_time now() {
  return std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
}

std::string date_of(calendar_time when) {
  const std::chrono::year_month_day date{std::chrono::floor<std::chrono::days>(when)};
  const auto two = [](unsigned number) { return joined(number < 10 ? "0" : "", number); };
  return joined(static_cast<int>(date.year()), "-", two(static_cast<unsigned>(date.month())), "-",
                two(static_cast<unsigned>(date.day())));
}

struct token {
  identity who;
  std::string secret;
};

std::vector<token> new_tokens() {
  std::vector<token> made;
  for (const std::string_view role : token_roles) {
    const std::string secret = new_token();
    if (secret.empty()) return {};
    const std::string name{role};
    made.push_back({{.name = name, .role = name, .token_sha256 = hash_token(secret)}, secret});
  }
  return made;
}

// What set-up made, and what is said about it.
struct robot {
  std::string name;
  std::vector<token> tokens;
  std::vector<new_file> files;
  calendar_time end;
  std::string fingerprint;
  std::string pin;
  std::string url;            // by name, or by a loopback address; without a token
  std::string url_by_address; // empty: no network, or loopback alone
};

std::string tokens_text(const robot& made) {
  std::string text;
  for (const token& one : made.tokens) text += joined(one.who.name, " ", one.secret, "\n");
  return text;
}

bool is_loopback(std::string_view address) noexcept {
  return address.starts_with("127.") || address == "::1";
}

// Where the robot will be found.
void add_urls(robot& made, const setup_settings& o) {
  const auto url = [&](const std::string& host) { return joined("https://", host, ":", o.port, "/"); };
  if (is_loopback(o.address)) { // its name leads to other addresses
    made.url = url(in_brackets(o.address));
    return;
  }
  const std::string local = own_local_name();
  made.url = url(local.empty() ? joined(made.name, ".local") : local);
  const std::string address = host_for_others(o.address);
  if (!address.empty()) made.url_by_address = url(address);
}

// What URLs may call it: all names in the certificate, and the further addresses. (Those of the machine,
// which may change, the endpoint finds itself.)
std::vector<std::string> hosts_of(const host_names& names, const std::vector<std::string>& further) {
  std::vector<std::string> hosts = names.names;
  std::erase(hosts, "localhost"); // as everywhere
  for (const std::string& one : further) {
    if (is_address(one)) hosts.push_back(in_brackets(one));
  }
  return hosts;
}

std::optional<robot> make_robot(const setup_settings& o, const std::string& name, std::string& wrong) {
  std::vector<std::string> further = o.hosts;
  if (!is_any(o.address)) further.push_back(o.address);
  const host_names names = names_of_robot(name, further);
  const int days = o.days > 0 ? static_cast<int>(o.days) : certificate_days_default;
  // A root that cannot sign again need not outlive what it signed.
  const auto root = root_authority::make(name, names, now(), o.keep_ca ? root_days : days, wrong);
  if (!root) return std::nullopt;
  const auto key = private_key::make(wrong);
  if (!key) return std::nullopt;
  const auto signed_by_it = root->sign(name, names, *key, now(), days, wrong);
  if (!signed_by_it) return std::nullopt;

  robot made{.name = name,
             .tokens = new_tokens(),
             .files = {},
             .end = signed_by_it->end(),
             .fingerprint = signed_by_it->fingerprint(),
             .pin = signed_by_it->pin(),
             .url = {},
             .url_by_address = {}};
  if (made.tokens.empty()) {
    wrong = "the kernel gives no random bytes for tokens";
    return std::nullopt;
  }
  robot_settings settings{.name = name,
                          .address = o.address,
                          .port = static_cast<std::uint16_t>(o.port),
                          .hosts = hosts_of(names, o.hosts),
                          .identities = {}};
  for (const token& one : made.tokens) settings.identities.push_back(one.who);
  const auto add = [&](std::string_view file, ::mode_t mode, std::string content) {
    made.files.push_back({std::string{file}, mode, std::move(content)});
  };
  add(key_file, secret_mode, key->pem());
  add(certificate_file, public_mode, signed_by_it->pem());
  add(root_file, public_mode, root->own().pem());
  add(root_phone_file, public_mode, root->own().der());
  if (o.keep_ca) add(root_key_file, secret_mode, root->key_pem());
  add(avahi_file, public_mode, avahi_service_of(name, settings.port));
  if (o.save_tokens) add(tokens_file, secret_mode, tokens_text(made));
  add(settings_file, secret_mode, toml_of(settings));
  add_urls(made, o);
  return made;
}

// Whether stdout is a terminal with so many columns.
bool terminal_has(std::size_t columns) noexcept {
  struct winsize size {};
  if (::isatty(STDOUT_FILENO) == 0) return false;
  return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_col >= columns;
}

std::string in_fragment(const std::string& url, const std::string& secret) {
  return joined(url, "#token=", secret); // browsers do not send it, so no log has it
}

// What goes to stdout: the tokens, the links, the QR code.
std::string page_of(const robot& made, const setup_settings& o) {
  std::string text;
  for (const token& one : made.tokens)
    text += joined(one.who.name, std::string(12 - one.who.name.size(), ' '), one.secret, "\n");
  const std::string& secret = made.tokens[o.link].secret;
  std::string for_phone = in_fragment(made.url, secret);
  text += joined("\n", for_phone, "\n");
  if (!made.url_by_address.empty()) {
    for_phone = in_fragment(made.url_by_address, secret);
    text += joined(for_phone, "\n");
  }
  const auto code = qr_code::of(for_phone);
  if (code && (o.qr || terminal_has(code->width()))) text += joined("\n", code->drawn());
  return text;
}

void say_what_next(const robot& made, const setup_settings& o, const std::string& dir, const console& to) {
  to.note("made ", dir, "; the certificate is valid until ", date_of(made.end), ", SHA-256 ",
          made.fingerprint);
  to.note("the tokens are printed once",
          o.save_tokens ? joined(" and are in ", dir, "/", tokens_file) : " and stored nowhere",
          "; the links and the QR code have that of the ", token_roles[o.link]);
  const bool here_alone = is_loopback(o.address);
  const std::string local = own_local_name();
  if (!here_alone && local != joined(made.name, ".local"))
    to.note("in mDNS this machine is called ", local.empty() ? "nothing" : local, ", not ", made.name,
            ".local; `hostnamectl set-hostname ", made.name, "` changes that");
  if (here_alone) {
    to.note("only programs on this machine reach ", o.address);
  } else if (made.url_by_address.empty()) {
    to.note("this machine has no address that others could reach");
  }
  if (o.quiet) return;
  to.note("next: rowe serve --demo --config ", dir, "/", settings_file);
  if (!here_alone)
    to.note("phones ask once about the certificate, and never if they have imported ", dir, "/",
            root_phone_file);
  to.note("programs trust the robot by --ca ", dir, "/", root_file, ", or by --pin ", made.pin);
  if (!o.avahi && !here_alone) {
    to.note("to announce the robot: sudo install -m 644 ", dir, "/", avahi_file, " ", avahi_services,
            "/rowe-", made.name, ".service");
  }
  if (o.keep_ca) {
    to.note("whoever has ", dir, "/", root_key_file, " can pretend to be this robot to those who imported ",
            root_phone_file);
  }
}

// The file that announces it.
new_file service_of(const robot& made, const setup_settings& o) {
  return {joined("rowe-", made.name, ".service"), public_mode,
          avahi_service_of(made.name, static_cast<std::uint16_t>(o.port))};
}

// What is wrong with the arguments; empty: nothing.
std::string check(const setup_settings& o, const std::string& name) {
  if (std::string wrong = check_robot_name(name); !wrong.empty())
    return joined(o.name.empty() ? "this machine's name cannot be a robot's; give --name: " : "--name: ",
                  wrong);
  if (!is_address(o.address))
    return joined("--address needs an IPv4 or IPv6 address, not ", quoted(o.address));
  for (const std::string& one : o.hosts) {
    const std::string wrong = is_address(one) ? "" : check_host_name(one);
    if (!wrong.empty()) return joined("--host: ", wrong);
  }
  return {};
}

// Where services are announced, if that can be done.
std::optional<folder> services_folder(std::string& wrong) {
  auto services = folder::open(std::string{avahi_services}, wrong);
  if (!services) wrong += " (package avahi-daemon)";
  if (services && !services->is_writable())
    wrong = joined(avahi_services, " cannot be written: --avahi needs root");
  return services;
}

exit_code make(const setup_settings& o, const console& to) {
  const std::string name = o.name.empty() ? own_name() : o.name;
  if (const std::string wrong = check(o, name); !wrong.empty()) return usage_error("setup", wrong);
  const auto fail = [&](const std::string& why) {
    to.error(why);
    return exit_code::failed;
  };
  if (now() < clock_is_set)
    return fail(joined("the clock says ", date_of(now()), ", and a certificate carries dates: set it first"));
  const std::string dir = o.dir.empty() ? joined("rowe-", name) : o.dir;
  if (const std::size_t files = files_in(dir); files > 0 && !o.force) {
    to.error(dir, " is there already, with ", counted(files, "file"));
    return fail("--force replaces what an earlier set-up made there: its root, certificate and tokens end");
  }
  std::string wrong;
  const auto services = o.avahi ? services_folder(wrong) : std::nullopt;
  if (!wrong.empty()) return fail(wrong);
  const auto made = make_robot(o, name, wrong);
  if (!made) return fail(wrong);
  // Tokens that nobody has seen are of no use, and with --force they would replace those that are.
  const auto show = [&] {
    return emit(page_of(*made, o)) ? std::string{}
                                   : std::string{"the tokens could not be shown, so nothing was made"};
  };
  if (wrong = make_folder(dir, made->files, o.force, setup_files(), show); !wrong.empty()) return fail(wrong);

  const std::string unannounced = services ? services->write(service_of(*made, o)) : "";
  say_what_next(*made, o, dir, to);
  return unannounced.empty() ? exit_code::done
                             : fail(joined("all but the announcement is made: ", unannounced));
}

exit_code renew_in(const setup_settings& o, const console& to) {
  if (o.dir.empty()) return usage_error("setup", "--renew needs --dir DIR, the folder of an earlier set-up");
  const setup_settings untouched;
  const bool other = !o.name.empty() || !o.hosts.empty() || o.address != untouched.address ||
                     o.port != untouched.port || o.link != untouched.link || o.keep_ca || o.save_tokens ||
                     o.avahi || o.qr || o.force;
  if (other) return usage_error("setup", "--renew takes --dir and --days alone");
  const renewal done = renew(o.dir, now(), static_cast<int>(o.days));
  for (const std::string& one : done.left_out)
    to.error("not in the new certificate, since its root may not vouch for it: ", printable(one));
  switch (done.what) {
  case renewal::outcome::renewed:
    emit(joined("renewed: valid until ", date_of(done.end), "\n"));
    return exit_code::done;
  case renewal::outcome::without_root:
    to.error("the root's key was not kept (", o.dir, "/", root_key_file,
             " is not there), so nothing can be renewed");
    to.error("`rowe setup --force --keep-ca` makes all anew, and keeps it; phones then import the new root");
    return exit_code::failed;
  default: to.error(done.wrong); return exit_code::failed;
  }
}

} // namespace

exit_code setup(argument_list arguments) {
  setup_settings chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  const console to{"setup"};
  return chosen.renew ? renew_in(chosen, to) : make(chosen, to);
}

} // namespace rowe::tools
