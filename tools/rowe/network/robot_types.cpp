// SPDX-License-Identifier: Apache-2.0
#include "robot_types.hpp"

#include <algorithm>
#include <utility>

#include "../text/json_values.hpp"

namespace rowe::tools {
namespace {
constexpr std::size_t types_max = 10'000;  // more than an endpoint can have; and so many entries
constexpr std::size_t entries_a_page = 10; // as which a page counts that has fewer
} // namespace

bool robot_types::read_all(service_asker& robot) {
  found_.clear();
  read_ = 0;
  for (std::uint64_t from = 0;;) {
    const auto answer = robot.ask("/rowe/types", joined(R"({"from":)", from, "}"));
    if (!answer) {
      wrong_ = robot.why();
      end_ = robot.end();
      return false;
    }
    const json_value page = read_json(*answer);
    if (!read_page(page)) return false;
    const auto next = page.get<std::uint64_t>("next");
    if (!next) return true;
    if (*next <= from || (read_ += entries_a_page) > types_max) {
      wrong_ =
          *next <= from ? "the answer's page ends where it begins" : "it has more types than there can be";
      return false;
    }
    from = *next;
  }
}

const typed_name* robot_types::find_topic(std::string_view name) const noexcept {
  const auto found = std::ranges::find_if(
      found_, [&](const typed_name& one) { return !one.is_service && one.name == name; });
  return found == found_.end() ? nullptr : &*found;
}

bool robot_types::read_page(json_value page) {
  const auto list = page.find("types");
  if (!list) {
    wrong_ = "the answer has no member `types`";
    return false;
  }
  for (const json_value one : list->elements()) {
    if (++read_ > types_max) break; // read_all() says so
    const auto topic = one.get<std::string>("topic");
    const auto service = one.get<std::string>("service");
    const auto said = one.get<std::string>("type");
    if (!topic && !service) continue;
    typed_name its{.name = service ? *service : *topic,
                   .type = said ? *said : std::string{},
                   .is_service = service.has_value()};
    if (!read_type(one, service ? "request" : "message", its.name, its.message) ||
        !read_type(one, "answer", its.name, its.answer))
      return false;
    // Several handles of one name say the same.
    const auto same = [&](const typed_name& known) {
      return known.is_service == its.is_service && known.name == its.name;
    };
    if (std::ranges::none_of(found_, same)) found_.push_back(std::move(its));
  }
  return true;
}

bool robot_types::read_type(json_value from, std::string_view member, const std::string& name,
                            const schema_description*& into) {
  const auto its = from.find(member);
  if (!its) return true;
  into = types_.read(*its);
  if (into == nullptr) wrong_ = joined("cannot read the type of ", printable(name), ": ", types_.wrong());
  return into != nullptr;
}

} // namespace rowe::tools
