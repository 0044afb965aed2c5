// SPDX-License-Identifier: Apache-2.0
// The service /rowe/rights: what the role of whoever asks allows. Everyone may ask. Nothing is refused by it,
// so nothing is counted or reported as a denial. Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <string_view>

#include "service/incoming/access_control.hpp"
#include "service/state/core_state.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

struct rights_service_needs {
  core_state& state_;
  const access_control& access_control_;
};

class rights_service : rights_service_needs {
 public:
  static constexpr std::size_t asked_max = 64; // in one request; what is beyond is not answered

  explicit rights_service(const rights_service_needs& parts) noexcept : rights_service_needs{parts} {}

  // Writes the answer. `args`: a JSON object with `asked`, a list of {right, name}, or nothing. `c`: the
  // peer; null: this process asks, which may do everything.
  void write_answer(json::writer& into, const connection* c, std::string_view args) const noexcept;

 private:
  bool allowed(const connection* c, std::string_view right, std::string_view name) const noexcept;
};

} // namespace rowe::service
