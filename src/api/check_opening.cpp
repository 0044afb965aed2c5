// SPDX-License-Identifier: Apache-2.0
#include "api/check_opening.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>

#include "access/token.hpp"
#include "api/check_options.hpp"
#include "net/base/address.hpp"
#include "net/tls/files.hpp"

namespace rowe::detail {
namespace {

constexpr const char* form_of_token = "16 to 128 letters, digits and - . _ ~";

error wrong(std::string* why, std::string text) {
  if (why != nullptr) *why = std::move(text);
  return errc::bad_access;
}

} // namespace

tls_options server_part(const tls_options& of) {
  return {.certificate = of.certificate, .key = of.key, .client_ca = of.client_ca};
}

bool may_be_reached(const endpoint_options& options) noexcept {
  return options.insecure || (!options.tls.certificate.empty() && !options.access.identities.empty());
}

std::vector<access::fault> check_proofs(const endpoint_options& options) {
  std::vector<access::fault> found;
  if (!options.tls.client_ca.empty()) return found;
  for (std::size_t i = 0; i < options.access.identities.size(); ++i) {
    const identity& one = options.access.identities[i];
    if (one.token_sha256.empty() && !one.certificate.empty()) {
      found.push_back({access::fault::place::identity, i,
                       "identity `" + one.name +
                           "` has only a certificate, and clients are not asked for one: set `client_ca`"});
    }
  }
  return found;
}

std::vector<error> listen_faults(const endpoint_options& options) {
  std::vector<error> found;
  const auto add = [&](const status& ok) {
    if (!ok) found.push_back(ok.error());
  };
  add(check_values(options));
  for (const status& one : check_relations(options)) add(one);
  const auto address = net::numeric_address(options.address, 0);
  if (!address) add(error{errc::bad_address, EINVAL});
  if (address && !may_be_reached(options) && !net::is_loopback(*address)) add(errc::not_loopback);
  if (!check_tls(server_part(options.tls)).empty()) add(errc::bad_certificate);
  return found;
}

status check_listen(const endpoint_options& options) {
  if (!check_access(options.access).empty() || !check_proofs(options).empty()) return errc::bad_access;
  const std::vector<error> found = listen_faults(options);
  return found.empty() ? status{} : found.front();
}

result<std::string> token_to_show(const endpoint_options& options, std::string* why) {
  if (options.token_file.empty()) {
    if (options.token.empty() || access::is_token(options.token)) return options.token;
    return wrong(why, std::string{"the option `token` is not a token: "} + form_of_token);
  }
  if (!options.token.empty()) return wrong(why, "set `token` or `token_file`, not both");
  std::string text;
  const std::string fault = net::tls::read_file(options.token_file, net::tls::readers::owner, text);
  if (!fault.empty()) return wrong(why, options.token_file + ": " + fault);
  text.resize(std::min(text.size(), text.find('\n')));
  while (text.ends_with('\r') || text.ends_with(' ')) text.pop_back();
  if (!access::is_token(text))
    return wrong(why, options.token_file + ": its first line is not a token: " + form_of_token);
  return text;
}

} // namespace rowe::detail
