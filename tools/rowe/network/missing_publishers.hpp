// SPDX-License-Identifier: Apache-2.0
// Says which of the topics nobody publishes, as far as the server tells, and which one may have been meant:
// what is misspelt looks like what is silent. Asked once, and not waited for. One thread.
#pragma once
#include <string>
#include <vector>

#include <rowe/endpoint.hpp>

#include "../console.hpp"
#include "remote.hpp"
#include "robot_names.hpp"

namespace rowe::tools {

class missing_publishers {
 public:
  // Without topics nothing is asked.
  missing_publishers(endpoint& hub, const remote& at, const std::vector<std::string>& topics,
                     const console& to);

  // What has been answered since the last call.
  void report();

 private:
  struct one {
    call_id call;
    std::string topic;
  };
  static constexpr rt::duration answer_time = std::chrono::seconds{10};

  const remote& at_;
  const std::vector<std::string> wanted_;
  const console& to_;
  caller<json_text, json_text> publishers_;
  caller<json_text, json_text> names_;
  std::vector<one> asked_;             // and not answered yet
  bool knows_names_ = false;           // or there is no answer
  std::vector<robot_name> all_{};      // topics there are, besides those asked for
  std::vector<std::string> missing_{}; // and not told of yet
};

} // namespace rowe::tools
