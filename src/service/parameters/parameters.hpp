// SPDX-License-Identifier: Apache-2.0
// Folder parameters: the values of parameters, who may set them, who gets them. No other settings.
// Parameters, for services and codecs: those of handles of this process, and, read only, the endpoint's own
// limits and counters below /rowe/. Knows no protocol: values go in and out as JSON. Service thread only;
// nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/detail/parameter_cell.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/ids.hpp"
#include "service/base/limit_table.hpp"
#include "service/state/core_state.hpp"
#include "wire/text/text_out.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

struct parameters_needs {
  core_state& state_;
};

class parameters : parameters_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<row>(bounds.parameters_max);
  }
  // How many there may be, with the endpoint's own.
  static constexpr std::uint32_t count_max(const limits& bounds) noexcept {
    return bounds.parameters_max +
           static_cast<std::uint32_t>(limit_table.size() + counter_descriptions.size());
  }
  parameters(rt::arena& memory, const parameters_needs& parts) noexcept;

  // Takes what handles have opened, set and closed since: once a cycle, and before a request is carried
  // out, so that a peer finds what was opened before it asked.
  void take() noexcept {
    if (state_.shared.parameters.take_news()) look();
  }

  // All numbers, for a walk: those of handles first, then the endpoint's own. Some are not in use.
  auto ids() const noexcept { return rows<parameter_id, const row>::numbers{count_}; }
  std::uint32_t count() const noexcept { return count_; }
  bool in_use(parameter_id which) const noexcept { return !is_of_handle(which) || rows_[which].in_use; }
  // None: there is no parameter of that name, in either spelling.
  parameter_id find(std::string_view name) const noexcept;
  // With its slash; of one that is not in use, that of the last that was. Valid as long as the parameter and
  // the buffer, which has name_bytes_max bytes.
  std::string_view name(parameter_id which, std::span<char> buffer) const noexcept;
  static constexpr std::size_t name_bytes_max = detail::parameter_cell::name_bytes_max;
  bool is_read_only(parameter_id which) const noexcept { return !is_of_handle(which); }
  // Whether its type is a double or a float.
  bool is_real(parameter_id which) const noexcept {
    return is_of_handle(which) && cell(which).what.kind == detail::parameter_kind::real;
  }

  void write_value(parameter_id which, json::writer& into) const noexcept;
  // What it may be; of one that is in use and not read only.
  void write_description(parameter_id which, json::writer& into) const noexcept;
  // Sets it to the value of a valid JSON text. False: it may not have this value, and `why` says what may be
  // and what was found.
  bool set(parameter_id which, std::string_view json, wire::text_out& why) noexcept;

  // How often a parameter of a handle came, went or changed; and what this count was when this one last did
  // (0: it is the endpoint's own, whose changes are not announced).
  std::uint64_t changes() const noexcept { return changes_; }
  std::uint64_t changed_at(parameter_id which) const noexcept {
    return is_of_handle(which) ? rows_[which].changed_at : 0;
  }

 private:
  struct row {
    bool in_use = false;
    std::uint32_t opened = 0; // of the cell, when it was taken
    std::uint64_t changed_at = 0;
    detail::parameter_value value;
    std::array<char, name_bytes_max> name_text{}; // the cell's, which set-up may write again once it is free
    std::uint8_t name_bytes = 0;
    std::string_view name() const noexcept { return {name_text.data(), name_bytes}; }
  };

  bool is_of_handle(parameter_id which) const noexcept { return which.value < rows_.size(); }
  detail::parameter_cell& cell(parameter_id which) const noexcept {
    return state_.shared.parameters.cells()[which.value];
  }
  void look() noexcept;
  void take(parameter_id which) noexcept;

  rows<parameter_id, row> rows_;
  std::uint32_t count_;
  std::uint64_t changes_ = 0;
};

} // namespace rowe::service
