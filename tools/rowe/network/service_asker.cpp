// SPDX-License-Identifier: Apache-2.0
#include "service_asker.hpp"

#include "../interrupt.hpp"

namespace rowe::tools {

std::optional<std::string> service_asker::ask(std::string_view service, std::string_view request) {
  why_.clear();
  end_ = exit_code::failed;
  auto client = hub_.client<json_text, json_text>(
      service, {.depth = 1, .text_bytes_max = limits{}.message_bytes_max});
  if (!client) {
    code_ = client.code();
    why_ = joined("cannot call ", printable(service), ": ", client.error().message());
    return std::nullopt;
  }
  const auto answer = waits_.during([&] { return client->call(request, timeout_); });
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

} // namespace rowe::tools
