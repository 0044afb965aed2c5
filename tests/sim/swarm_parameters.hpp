// SPDX-License-Identifier: Apache-2.0
// Parameters of the process in the swarm. Whatever peers write, a loop reads what is in the range; and once
// the service thread has had its turn, the loop and whoever asks read the same.
#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/parameter.hpp>

#include "swarm_context.hpp"

namespace swarm {

inline constexpr std::string_view parameter_names[] = {"/p0", "/p1", "/p2"};

class process_parameters {
 public:
  explicit process_parameters(context& in) : in_{in} {}

  void act() {
    const std::size_t which = in_.random.below(handles_.size());
    auto& one = handles_[which];
    if (!one.cell) return open(one, parameter_names[which]);
    const double now = one.handle->get();
    if (now < 0 || now > 4) in_.fail("parameters", "a loop read " + std::to_string(now) + " of 0 to 4");
    if (in_.random.one_in(6)) return close(one);
    if (in_.random.one_in(2))
      (void)one.handle->set(static_cast<double>(in_.random.below(8))); // or is refused
  }

 private:
  struct owned {
    rowe::detail::parameter_cell* cell = nullptr;
    std::optional<rowe::parameter<double>> handle;
  };

  void open(owned& one, std::string_view name) {
    one.cell = in_.on.shared.parameters.open(
        rowe::detail::parameter_request_of(name, 1.0, rowe::range<double>{0, 4}), -1);
    if (one.cell == nullptr) return; // all are taken until the service thread has had its turn
    one.handle.emplace(rowe::detail::parameter_handle{nullptr, *one.cell}, 1.0, rowe::range<double>{0, 4});
  }
  void close(owned& one) {
    in_.on.shared.parameters.close(*one.cell);
    one.cell = nullptr;
    one.handle.reset();
  }

  context& in_;
  std::array<owned, std::size(parameter_names)> handles_;
};

} // namespace swarm
