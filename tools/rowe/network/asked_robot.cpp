// SPDX-License-Identifier: Apache-2.0
#include "asked_robot.hpp"

#include "../arguments/limit_options.hpp"

namespace rowe::tools {

std::optional<exit_code> asked_robot::connect(const remote_place& at, std::optional<rt::duration> within,
                                              std::optional<limits> bounds) {
  if (!bounds) bounds = limits_for(verb_);
  if (!bounds) return exit_code::usage;
  exit_code otherwise = exit_code::failed;
  auto opened_here = open_endpoint(verb_, at, {.limits = *bounds}, to_, otherwise);
  if (!opened_here) return otherwise;
  url_ = opened_here->url;
  open_ = std::make_unique<opened>(std::move(opened_here->hub), url_, to_);
  if (const auto end = open_->connection.wait(within)) return end;
  open_->waits.emplace(open_->connection);
  open_->services.emplace(open_->hub, *open_->waits, timeout_);
  return std::nullopt;
}

exit_code asked_robot::give_up(std::string_view what) {
  if (!services().why().empty()) to_.error(url_, " does not say ", what, ": ", services().why());
  return services().end();
}

exit_code asked_robot::give_up_statistics() {
  if (!services().has_no_such()) return give_up("how it is");
  to_.error(url_, " does not let us call /rowe/stats: our role may not, or it is no rowe endpoint");
  return exit_code::failed;
}

} // namespace rowe::tools
