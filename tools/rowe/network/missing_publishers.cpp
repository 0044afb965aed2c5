// SPDX-License-Identifier: Apache-2.0
#include "missing_publishers.hpp"

#include <algorithm>
#include <string_view>

#include "../text/json_values.hpp"

namespace rowe::tools {
namespace {

bool says_nobody(json_value answer) noexcept {
  const auto publishers = answer.find("publishers");
  return publishers && publishers->kind() == json_kind::array && !publishers->find("[0]");
}

} // namespace

missing_publishers::missing_publishers(endpoint& hub, const remote& at,
                                       const std::vector<std::string>& topics, const console& to)
    : at_{at}, wanted_{topics}, to_{to} {
  if (topics.empty()) return;
  const auto now = rt::monotonic_clock::now();
  if (auto opened = hub.client<json_text, json_text>(
          "/rosapi/topics", {.depth = 1, .text_bytes_max = limits{}.message_bytes_max})) {
    names_ = std::move(*opened);
    knows_names_ = !names_.start("{}", answer_time, now);
  } else {
    knows_names_ = true;
  }
  auto opened = hub.client<json_text, json_text>("/rosapi/publishers",
                                                 {.depth = static_cast<std::uint32_t>(topics.size())});
  if (!opened) return;
  publishers_ = std::move(*opened);
  for (const std::string& topic : topics) {
    const std::string request = joined(R"({"topic":)", json_string_of(topic), "}");
    if (const auto started = publishers_.start(request, answer_time, now))
      asked_.push_back({*started, topic});
  }
}

void missing_publishers::report() {
  while (!asked_.empty()) {
    const auto end = publishers_.try_finish();
    if (!end) break;
    const auto about = std::ranges::find(asked_, end->id, &one::call);
    if (about == asked_.end()) break;
    if (end->reply && says_nobody(end->reply->json())) missing_.push_back(about->topic);
    asked_.erase(about);
  }
  if (missing_.empty()) return;
  if (!knows_names_) {
    const auto end = names_.try_finish();
    if (!end) return;
    knows_names_ = true;
    if (end->reply) {
      const json_value list = end->reply->json().find("topics").value_or(json_value{});
      for (const json_value listed : list.elements()) {
        const std::string name =
            plain_text_of(listed); // who is asked for is listed, too, though nobody publishes
        if (std::ranges::find(wanted_, name) == wanted_.end()) all_.push_back({name});
      }
    }
  }
  for (const std::string& topic : missing_)
    to_.note("nobody publishes ", printable(topic), " at ", at_.url(), " yet",
             did_you_mean(nearest_name(topic, all_)), "; waiting for it (Ctrl-C to stop)");
  missing_.clear();
}

} // namespace rowe::tools
