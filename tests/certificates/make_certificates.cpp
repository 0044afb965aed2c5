// SPDX-License-Identifier: Apache-2.0
// make_certificates FOLDER: writes ca.pem, certificate.pem and key.pem for 127.0.0.1 and localhost there.
#include <cstdio>
#include <exception>

#include "certificates.hpp"

int main(int count, char** words) {
  if (count != 2) {
    std::fputs("usage: make_certificates FOLDER\n", stderr);
    return 2;
  }
  try {
    const auto root = rowe::test::make_root();
    rowe::test::write_files(words[1], root, rowe::test::make_leaf(root));
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "make_certificates: %s\n", failure.what());
    return 1;
  }
}
