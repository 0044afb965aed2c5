// SPDX-License-Identifier: Apache-2.0
// Encryption (TLS 1.2 and 1.3). Ordinary threads, at set-up; allocates.
#pragma once
#include <string>

#include <rowe/rt/attributes.hpp>

namespace rowe {

// All files are in PEM. With a certificate, an endpoint that listens speaks TLS alone: `wss` and `https`. It
// looks each second whether the files have changed, and takes the new ones for new connections. If those are
// wrong, it keeps what it has, and an event says why.
struct tls_options {
  // Our certificate. endpoint::connect presents it to servers that ask for one.
  std::string certificate = {}; // a file: the certificate, then those that lead to the root; empty: a server
                                // speaks no TLS, a client presents none
  std::string key = {}; // a file: the certificate's key, not encrypted, that only its owner can read. Below
                        // $CREDENTIALS_DIRECTORY others may read it, too
  // endpoint::listen.
  std::string client_ca = {}; // a file: the roots that vouch for clients. Clients are asked for a certificate
                              // then. Who has none may send a token. A certificate that has expired, or for
                              // which these roots do not vouch, ends the handshake. Whose one it is, says
                              // identity::certificate. Empty: nobody is asked
  // endpoint::connect to `wss`.
  std::string ca = {};  // a file: the roots to trust; empty: those that the system trusts
  std::string pin = {}; // the SHA-256 of the server's public key, as 64 hexadecimal digits, colons or none
                        // between pairs of them: no other server is spoken to, whoever vouches for it; and
                        // with a pin and no `ca`, nobody has to vouch. Empty: any key
};

// What is wrong with the options, in words that name the file; empty: nothing. Reads the files.
std::string check_tls(const tls_options& options);

} // namespace rowe
