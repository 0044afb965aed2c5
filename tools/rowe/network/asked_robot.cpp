// SPDX-License-Identifier: Apache-2.0
#include "asked_robot.hpp"

#include <utility>

#include "../arguments/limit_options.hpp"
#include "../interrupt.hpp"

namespace rowe::tools {

std::optional<exit_code> asked_robot::connect(const remote_place& at, std::optional<rt::duration> within) {
  const spelled_url url = read_url(at.url);
  if (url.url.empty()) return usage_error(verb_, url.wrong);
  url_ = url.url;
  const auto bounds = limits_for(verb_);
  if (!bounds) return exit_code::usage;
  endpoint_options options{.limits = *bounds};
  if (const auto end = use(at, options, to_)) return end;
  auto hub = endpoint::connect(url_, options);
  if (!hub) return cannot_open(url_, hub.error(), to_);
  open_ = std::make_unique<opened>(std::move(*hub), url_, to_);
  if (const auto end = open_->connection.wait(within)) return end;
  open_->waits.emplace(open_->connection);
  return std::nullopt;
}

std::optional<std::string> asked_robot::ask(std::string_view service, std::string_view request) {
  why_.clear();
  end_ = exit_code::failed;
  auto client =
      hub().client<json_text, json_text>(service, {.depth = 1, .text_bytes_max = limits{}.message_bytes_max});
  if (!client) {
    why_ = joined("cannot call ", printable(service), ": ", client.error().message());
    return std::nullopt;
  }
  const auto answer = waits().during([&] { return client->call(request, timeout_); });
  if (answer) return std::string{answer->value()};
  code_ = answer.code();
  if (interrupt::seen()) {
    end_ = exit_code::interrupted;
  } else if (code_ == errc::timed_out) {
    end_ = exit_code::timed_out;
    why_ = joined("it does not answer within ", seconds_text(timeout_));
  } else {
    why_ = code_ == errc::refused ? printable(client->refusal()) : answer.error().message();
  }
  return std::nullopt;
}

exit_code asked_robot::give_up(std::string_view what) const {
  if (!why_.empty()) to_.error(url_, " does not say ", what, ": ", why_);
  return end_;
}

} // namespace rowe::tools
