// SPDX-License-Identifier: Apache-2.0
// Types as an endpoint describes them to programs elsewhere (/rowe/types), read into descriptions from which
// rowe/types.hpp writes declarations.
#pragma once
#include <deque>
#include <map>
#include <string>
#include <vector>

#include <rowe/json_value.hpp>
#include <rowe/schema.hpp>

namespace rowe::tools {

// Keeps what it has read; descriptions refer to it. Two types that are described alike are the same one.
class described_types {
 public:
  // Null, and wrong() says why: it is no description, or nests deeper than one may.
  const schema_description* read(json_value type);
  const std::string& wrong() const noexcept { return wrong_; }

 private:
  const schema_description* read(json_value type, int depth);
  const value_description* read_value(json_value from, member_description* owner, int depth);
  bool read_number(json_value from, value_description& into);
  std::string_view keep(std::string text) { return texts_.emplace_back(std::move(text)); }

  std::deque<std::string> texts_;
  std::deque<std::vector<enumerator_description>> enums_;
  std::deque<value_description> values_;
  std::deque<std::vector<member_description>> members_;
  std::deque<schema_description> types_;
  std::map<std::string, const schema_description*, std::less<>> known_; // by their texts
  std::string wrong_;
};

} // namespace rowe::tools
