// SPDX-License-Identifier: Apache-2.0
#include <rowe/ros_type.hpp>

#include <utility>

#include <rowe/json_value.hpp>

#include "rosmsg/from_json.hpp"
#include "rosmsg/parse.hpp"
#include "rosmsg/to_json.hpp"

namespace rowe {

struct ros_type::parts {
  std::string name;
  rosmsg::definition all;
};

ros_type::ros_type(std::unique_ptr<const parts> made) noexcept : parts_{std::move(made)} {}
ros_type::ros_type(ros_type&&) noexcept = default;
ros_type& ros_type::operator=(ros_type&&) noexcept = default;
ros_type::~ros_type() = default;

const std::string& ros_type::name() const noexcept { return parts_->name; }
ros_version ros_type::version() const noexcept { return parts_->all.version; }

result<ros_type> ros_type::parse(std::string_view name, std::string_view definition, ros_version version,
                                 std::string* why) {
  std::string wrong;
  auto all = rosmsg::parse(name, definition, version, wrong);
  if (!all) {
    if (why != nullptr) *why = std::move(wrong);
    return errc::bad_definition;
  }
  return ros_type{std::make_unique<const parts>(parts{std::string{name}, std::move(*all)})};
}

namespace {

status finished(bool good, rosmsg::output& to, std::string& into, const rosmsg::failure& wrong,
                std::string* why) {
  if (good && to.finish()) return {};
  into.clear();
  if (!good) {
    if (why != nullptr) *why = wrong.message();
    return wrong.reason;
  }
  const auto limit = static_cast<std::int64_t>(to.limit());
  if (why != nullptr) *why = "the message is longer than " + std::to_string(limit) + " bytes";
  return error{errc::too_big, limit + 1, limit};
}

} // namespace

status ros_type::to_json(ros_encoding encoding, std::string_view bytes, std::string& json,
                         std::size_t json_bytes_max, std::string* why) const {
  rosmsg::output to{json, json_bytes_max};
  rosmsg::failure wrong;
  const bool good = rosmsg::to_json(parts_->all, encoding, bytes, to, wrong);
  return finished(good, to, json, wrong, why);
}

status ros_type::from_json(ros_encoding encoding, std::string_view json, std::string& bytes,
                           std::size_t bytes_max, std::string* why) const {
  const auto checked = json_value::parse(json);
  if (checked) return from_json(encoding, *checked, bytes, bytes_max, why);
  bytes.clear();
  if (why != nullptr) {
    *why = checked.code() == errc::too_deep
               ? "the message nests deeper than 64 levels"
               : "the message is no valid JSON (at byte " + std::to_string(checked.error().value) + ")";
  }
  return checked.error();
}

status ros_type::from_json(ros_encoding encoding, const json_value& json, std::string& bytes,
                           std::size_t bytes_max, std::string* why) const {
  rosmsg::output to{bytes, bytes_max};
  rosmsg::failure wrong;
  const bool good = rosmsg::from_json(parts_->all, encoding, json.text(), to, wrong);
  return finished(good, to, bytes, wrong, why);
}

} // namespace rowe
