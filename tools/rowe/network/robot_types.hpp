// SPDX-License-Identifier: Apache-2.0
// The types that an endpoint's program gave its topics and services, as its service /rowe/types says them,
// page after page.
#pragma once
#include <string>
#include <vector>

#include <rowe/endpoint.hpp>
#include <rowe/schema.hpp>

#include "../exit_code.hpp"
#include "../text/described_types.hpp"
#include "service_asker.hpp"

namespace rowe::tools {

// What one topic or service is called, and its types; null: the program has JSON text there.
struct typed_name {
  std::string name;
  std::string type; // that the endpoint says of it; may be empty
  bool is_service = false;
  const schema_description* message = nullptr; // of a service: what it is asked
  const schema_description* answer = nullptr;
};

// Keeps what it has read; what it has found refers to it.
class robot_types {
 public:
  // Asks for all of them anew. False: wrong() says why not.
  bool read_all(service_asker& robot);

  const std::vector<typed_name>& found() const noexcept { return found_; }
  const typed_name* find_topic(std::string_view name) const noexcept;
  const std::string& wrong() const noexcept { return wrong_; } // empty: a signal came
  exit_code end() const noexcept { return end_; }

 private:
  bool read_page(json_value page);
  bool read_type(json_value from, std::string_view member, const std::string& name,
                 const schema_description*& into);

  described_types types_;
  std::vector<typed_name> found_;
  std::size_t read_ = 0; // pages, and entries of them
  std::string wrong_;
  exit_code end_ = exit_code::failed;
};

} // namespace rowe::tools
