// SPDX-License-Identifier: Apache-2.0
// rowe token: who has one, in the rowe.toml of a folder that `rowe setup` made.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <rowe/settings.hpp>

#include "../arguments/command_line.hpp"
#include "../console.hpp"
#include "../output.hpp"
#include "../setup/certificate.hpp"
#include "../setup/files.hpp"
#include "../setup/identities.hpp"
#include "../setup/secret.hpp"
#include "../setup/texts.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

struct token_settings {
  std::string what;
  std::string name;
  std::string role;
  std::string dir = ".";
  std::string certificate;
  bool in_url = false;
};

command table_of(token_settings& o) {
  return {
      .verb = "token",
      .examples = {{{"rowe token add anna supervisor", "prints a new token for anna, once"},
                    {"rowe token remove anna", "from then on it is invalid"}}},
      .description = "Adds and removes those who may connect, in rowe.toml; `list` shows them. Only the hash "
                     "of a token\n"
                     "is written. The rest of the file stays as it is.\n",
      .operands =
          {{.name = "add|remove|list", .meaning = "what to do", .into = &o.what},
           {.name = "NAME", .meaning = "who: letters, digits and . _ - @", .into = &o.name, .optional = true},
           {.name = "ROLE",
            .meaning = "observer, driver, supervisor, peer, or one of the file",
            .into = &o.role,
            .optional = true}},
      .options = {
          {"--dir", "", "DIR", "the folder of rowe.toml (default: this one)", &o.dir},
          {"--certificate", "", "FILE",
           "a certificate in place of a token, by the root of --keep-ca: FILE gets it, and its key",
           &o.certificate},
          {"--in-url", "", "", "the new token may also come as ?token=, where logs may see it", &o.in_url},
      }};
}

std::string list_of(const identities_text& file) {
  std::string text;
  for (const identity& one : file.all())
    text += joined(printable(one.name), " ", printable(one.role), one.token_in_url ? " in-url" : "",
                   one.certificate.empty() ? "" : " certificate", "\n");
  return text;
}

// A certificate that the folder's root signs, and its key, in one text of PEM. Returns what went wrong;
// empty: nothing.
std::string certify(const folder& in, const token_settings& o, std::string& pem) {
  if (!in.has(std::string{root_key_file}))
    return joined("the root's key was not kept (", o.dir, "/", root_key_file,
                  " is not there), so nothing can be signed");
  std::string root_pem, root_key_pem, wrong;
  if (wrong = in.read(std::string{root_file}, root_pem); !wrong.empty()) return wrong;
  if (wrong = in.read(std::string{root_key_file}, root_key_pem); !wrong.empty()) return wrong;
  const auto root = root_authority::read(root_pem, root_key_pem, wrong);
  if (!root) return joined(o.dir, ": ", wrong);
  const auto key = private_key::make(wrong);
  if (!key) return wrong;
  const auto today = std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
  const auto made = root->sign_client(o.name, *key, today, certificate_days_default, wrong);
  if (made) pem = made->pem() + key->pem();
  return wrong;
}

// What is wrong with the words that were given; empty: nothing.
std::string misuse(const token_settings& o) {
  const bool add = o.what == "add";
  const bool list = o.what == "list";
  if (!add && !list && o.what != "remove")
    return joined("what to do is add, remove or list, not ", quoted(o.what));
  if (!list && o.name.empty()) return joined("`", o.what, "` needs a NAME");
  if (add == o.role.empty() || (list && !o.name.empty()))
    return "it is `add NAME ROLE`, `remove NAME`, or `list`";
  if ((o.in_url || !o.certificate.empty()) && !add) return "--in-url and --certificate are for `add`";
  if (o.in_url && !o.certificate.empty()) return "--certificate makes no token, so --in-url means nothing";
  return {};
}

// What each of these returns says what went wrong; empty: nothing.

std::string write_settings(const folder& in, const identities_text& file, const last_step& before = {}) {
  return in.write({std::string{settings_file}, secret_mode, file.text()}, before);
}

std::string remove(const folder& in, const token_settings& o, identities_text& file) {
  if (!file.remove(o.name)) return joined("there is no identity ", quoted(o.name));
  if (!file.all().empty()) return write_settings(in, file);
  return joined(quoted(o.name), " is the last one, and without identities everyone may do everything: ",
                "add another one first");
}

std::string add(const identity& one, identities_text& file) {
  const std::vector<identity> all = file.all();
  if (std::ranges::find(all, one.name, &identity::name) != all.end())
    return joined(quoted(one.name), " is there already: `rowe token remove ", printable(one.name), "` first");
  return file.add(one);
}

// Prints the new token. It is nobody's if that fails.
std::string add_token(const folder& in, const token_settings& o, identities_text& file) {
  const std::string secret = new_token();
  if (secret.empty()) return "the kernel gives no random bytes for a token";
  std::string wrong = add({o.name, o.role, hash_token(secret), o.in_url}, file);
  if (!wrong.empty()) return wrong;
  return write_settings(in, file, [&] {
    return emit(secret + "\n")
               ? std::string{}
               : joined("the token could not be shown, so ", quoted(o.name), " was not added");
  });
}

std::string add_certificate(const folder& in, const token_settings& o, identities_text& file) {
  std::string pem;
  if (std::string wrong = add({.name = o.name, .role = o.role, .certificate = o.name}, file); !wrong.empty())
    return wrong;
  if (std::string wrong = certify(in, o, pem); !wrong.empty()) return wrong;
  if (std::string wrong = write_new(o.certificate, secret_mode, pem); !wrong.empty()) return wrong;
  std::string wrong = write_settings(in, file);
  if (!wrong.empty()) ::unlink(o.certificate.c_str()); // we made it, and it is nobody's
  return wrong;
}

// Other mistakes in the file do not matter here.
bool asks_for_certificates(const token_settings& o) {
  settings chosen;
  (void)chosen.read_file(joined(o.dir, "/", settings_file));
  return !chosen.values().endpoint.tls.client_ca.empty();
}

void explain_certificate(const console& to, const token_settings& o) {
  to.note("made ", printable(o.certificate), "; clients show it by --cert ", printable(o.certificate));
  if (asks_for_certificates(o)) return;
  to.note("clients are not asked for a certificate yet: add `client_ca = \"", root_file, "\"` to [tls] in ",
          settings_file, ", and start the endpoint again");
}

} // namespace

exit_code token(argument_list arguments) {
  token_settings chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  if (const std::string wrong = misuse(chosen); !wrong.empty()) return usage_error("token", wrong);

  const console to{"token"};
  std::string wrong;
  const auto fail = [&](const std::string& why) {
    to.error(why);
    return exit_code::failed;
  };
  const auto in = folder::open(chosen.dir, wrong);
  if (!in) return fail(wrong);
  const std::string name{settings_file};
  std::string text;
  if (wrong = in->read(name, text); !wrong.empty()) return fail(wrong);
  auto file = identities_text::read(std::move(text), wrong);
  if (!file) return fail(joined(chosen.dir, "/", name, ": ", wrong));

  if (chosen.what == "list") {
    emit(list_of(*file));
  } else if (chosen.what == "remove") {
    wrong = remove(*in, chosen, *file);
  } else if (!chosen.certificate.empty()) {
    wrong = add_certificate(*in, chosen, *file);
    if (wrong.empty()) explain_certificate(to, chosen);
  } else {
    wrong = add_token(*in, chosen, *file);
  }
  return wrong.empty() ? exit_code::done : fail(wrong);
}

} // namespace rowe::tools
