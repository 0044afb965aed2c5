// SPDX-License-Identifier: Apache-2.0
#include "delivery.hpp"

#include "../arguments/values.hpp"
#include "../console.hpp"

namespace rowe::tools {
namespace {
// "a message of 70000 bytes exceeds the limit NAME of N: ...", as rowe's servers say.
constexpr std::string_view before_name = " exceeds the limit ";
constexpr std::string_view before_number = " of ";

struct named_limit {
  std::string_view name;
  std::string_view number;
};

std::optional<named_limit> limit_in(std::string_view said) noexcept {
  const std::size_t found = said.starts_with("a message of ") ? said.find(before_name) : said.npos;
  if (found == said.npos) return std::nullopt;
  const std::string_view name = said.substr(found + before_name.size());
  const std::size_t end = name.find(before_number);
  if (end == name.npos) return std::nullopt;
  const std::string_view number = name.substr(end + before_number.size());
  return named_limit{name.substr(0, end), number.substr(0, number.find_first_not_of("0123456789"))};
}

} // namespace

result<bool> has_subscribers(endpoint& via, const std::string& topic, rt::duration timeout, watcher& wait) {
  auto asks =
      via.client<json_text, json_text>("/rosapi/subscribers", {.depth = 1, .text_bytes_max = 16 * 1024});
  if (!asks) return asks.error();
  const auto answer = wait.during([&] {
    return asks->call(message{"topic", std::string_view{topic}}, timeout);
  });
  if (!answer) return answer.error();
  if (answer->find("subscribers[0]")) return true;
  return answer->find("subscribers") ? result<bool>{false} : result<bool>{errc::no_service};
}

bool is_answer(const result<bool>& asked) noexcept {
  return asked || asked.code() == errc::refused || asked.code() == errc::no_service ||
         asked.code() == errc::too_big;
}

std::string refusal_of(std::string_view server, std::size_t bytes, std::string_view said) {
  const auto limit = limit_in(said);
  if (!limit) return {};
  return joined(printable(server), " refused the message of ", bytes, " bytes: it takes ",
                printable(limit->number), " at most (its limit ", printable(limit->name), ")");
}

std::optional<std::uint64_t> bytes_taken_by_server(std::string_view said) noexcept {
  const auto limit = limit_in(said);
  const auto number = limit ? integer_of(limit->number) : std::nullopt;
  return number && *number >= 0 ? std::optional{static_cast<std::uint64_t>(*number)} : std::nullopt;
}

} // namespace rowe::tools
