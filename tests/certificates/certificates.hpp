// SPDX-License-Identifier: Apache-2.0
// Certificates for tests: made when they are needed, so that none of them ends one day.
#pragma once
#include <string>
#include <vector>

namespace rowe::test {

struct certificate_request {
  std::vector<std::string> names{"localhost"}; // DNS
  std::vector<std::string> addresses{"127.0.0.1", "::1"};
  long valid_from_s = -24 * 60 * 60; // seconds from now
  long valid_to_s = 397L * 24 * 60 * 60;
  std::string common_name = "robot";
  std::string second_common_name = {}; // in the same subject
  std::string usage = "serverAuth,clientAuth";
  bool is_authority = false;
};

// Keys and certificates are PEM; P-256.
struct made_certificate {
  std::string certificate;
  std::string key;
};

made_certificate make_root(const std::string& common_name = "rowe test root");
made_certificate make_leaf(const made_certificate& root, const certificate_request& wanted = {});
made_certificate make_self_signed(const certificate_request& wanted = {});
// The SHA-256 of its public key, as tls_options::pin.
std::string pin_of(const made_certificate& of);

// Writes a file; only its owner can read it.
void write_private(const std::string& path, const std::string& text);

// Writes ca.pem, certificate.pem (the leaf) and key.pem into a folder.
void write_files(const std::string& folder, const made_certificate& root, const made_certificate& leaf);

} // namespace rowe::test
