// SPDX-License-Identifier: Apache-2.0
#include <rowe/tls.hpp>

#include "net/tls/context.hpp"

namespace rowe {

std::string check_tls(const tls_options& options) {
  net::tls::file_fault why;
  const auto text = [&] { return why.file + ": " + why.what; };
  if (!options.certificate.empty() && !net::tls::context::open(net::tls::end::server, options, &why))
    return text();
  if (options.certificate.empty() && !options.key.empty())
    return options.key + ": a key without its certificate: set `certificate`";
  if (options.certificate.empty() && !options.client_ca.empty())
    return options.client_ca + ": clients show certificates to a server that has one: set `certificate`";
  if ((!options.ca.empty() || !options.pin.empty()) &&
      !net::tls::context::open(net::tls::end::client, options, &why))
    return text();
  return {};
}

} // namespace rowe
