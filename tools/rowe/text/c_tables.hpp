// SPDX-License-Identifier: Apache-2.0
// Types as a C program declares them: a struct for each, and the table of its members (rowe/struct.h). What
// is written, and read, is the same text. Where C has no such type, another one stands for it:
//
//   optionals         the value, which a message may leave out
//   times in seconds  nanoseconds, written in seconds
//   bounded arrays    an array, and a member that counts
//
// There is nothing for arrays within arrays, for optionals within arrays, and for arrays of more than 64 MiB.
#pragma once
#include <string>
#include <vector>

#include <rowe/types.hpp>

namespace rowe::tools {

struct c_text {
  std::string text;                 // of a header; types with what C does not have are left out
  std::vector<std::string> reasons; // why, for each of the given types that was left out
};

// `names` are made identifiers; the types inside have the names of their schemas, or are called after the
// type and the member that they are in.
c_text c_tables(const std::vector<named_type>& types);

} // namespace rowe::tools
