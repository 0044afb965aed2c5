// SPDX-License-Identifier: Apache-2.0
// What `rowe serve` records, as its settings say.
#pragma once
#include <string>
#include <vector>

#include <rowe/endpoint.hpp>
#include <rowe/recording.hpp>
#include <rowe/settings.hpp>

#include "console.hpp"

namespace rowe::tools {

class recorders {
 public:
  // Begins all recordings. False: one cannot be begun, and the reason was printed.
  bool begin(endpoint& on, const configuration& of, const console& to);
  // Says once why one writes nothing, and when it writes again.
  void look(const console& to);
  // Before the robot ends: what it does then is no stop that a black box is for.
  void end_black_boxes(const console& to) { end(true, to); }
  // After the endpoint has closed. Waits for the disk. False: some of all that was recorded is missing.
  bool end_all(const console& to) {
    end(false, to);
    return all_whole_;
  }

 private:
  struct one {
    recorder of;
    bool is_black_box = false;
    std::string fault{}; // that was said
  };
  void end(bool black_boxes_only, const console& to);

  std::vector<one> all_;
  bool all_whole_ = true;
};

} // namespace rowe::tools
