// SPDX-License-Identifier: Apache-2.0
// Tables of a C program's structs (rowe/struct.h) as the descriptions that schemas of C++ become. So the same
// encoders and decoders are compiled of both. At set-up, on any thread.
//
// The service thread reads a description as long as a handle, or a topic that it was for, exists. So an
// endpoint keeps all that were made for it. Two tables that say the same are one description: a program that
// opens the same handles again and again does not gather any.
#pragma once
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <rowe/result.hpp>
#include <rowe/schema.hpp>
#include <rowe/struct.h>

namespace rowe::capi {

class struct_descriptions {
 public:
  // What a table describes; valid as long as this is. Errors: bad_argument, and `why` says which member of
  // which table is wrong.
  result<const schema_description*> describe(const rowe_struct& table, std::string& why);

 private:
  class reading;

  // A description, with what it refers to, and how much is inside of it.
  struct kept {
    schema_description itself;
    std::string name;
    std::deque<std::string> texts; // the names of members
    std::deque<value_description> values;
    std::deque<std::vector<enumerator_description>> enums;
    std::vector<member_description> members;
    std::size_t levels = 1;
    std::size_t members_all = 0;
  };

  std::mutex mutex_;
  std::map<std::string, kept> all_; // by what their tables say
};

} // namespace rowe::capi
