// SPDX-License-Identifier: Apache-2.0
#include "api/check_connect.hpp"

#include <algorithm>
#include <utility>

#include "access/token.hpp"
#include "net/tls/files.hpp"

namespace rowe::detail {
namespace {

constexpr const char* form_of_token = "16 to 128 letters, digits and - . _ ~";

error wrong(std::string* why, std::string text) {
  if (why != nullptr) *why = std::move(text);
  return errc::bad_access;
}

} // namespace

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
