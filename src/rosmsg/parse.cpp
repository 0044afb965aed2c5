// SPDX-License-Identifier: Apache-2.0
#include "rosmsg/parse.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "rosmsg/declaration.hpp"
#include "rosmsg/from_json.hpp"

namespace rowe::rosmsg {
namespace {

constexpr std::uint64_t sum_max = std::uint64_t{1} << 32; // larger ones are as good as this

std::uint64_t sum_of(std::uint64_t sum, std::uint64_t count, std::uint64_t each) noexcept {
  return std::min(sum_max, sum + std::min(sum_max, count * each)); // all are at most 2^32: fits
}

class parser {
 public:
  parser(std::string_view name, ros_version version) {
    made_.version = version;
    begin_type(plain_name(name));
  }

  std::optional<definition> parse(std::string_view text, std::string& why) {
    if (text.size() > definition_bytes_max) {
      why_ = "the definition has " + std::to_string(text.size()) + " bytes; " +
             std::to_string(definition_bytes_max) + " are the most";
    } else if (read_lines(text) && resolve(0)) {
      check_size();
    }
    if (why_.empty()) return std::move(made_);
    why = std::move(why_);
    return std::nullopt;
  }

 private:
  using places = std::map<std::string, std::size_t, std::less<>>;

  bool fail(const std::string& what) {
    why_ = what;
    return false;
  }
  bool fail_at(std::uint32_t line, const std::string& what) {
    return fail("line " + std::to_string(line) + ": " + what);
  }

  // ---- lines ----

  void begin_type(const std::string& name) {
    skips_ = !name.empty() && !places_.emplace(name, made_.types.size()).second;
    if (skips_) return; // the same once more, as some programs write it
    made_.types.emplace_back().name = name;
    names_.clear();
  }

  bool read_lines(std::string_view text) {
    std::uint32_t number = 0;
    bool begins = false; // a part, with its name
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      const std::string_view line = stripped(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
      ++number;
      if (!line.empty() && line.find_first_not_of('=') == line.npos) {
        if (begins) return fail_at(number, "a part without `MSG: package/Type`");
        begins = true;
      } else if (line.starts_with("MSG:")) {
        if (!read_name(line.substr(4), begins, number)) return false;
        begins = false;
      } else if (begins && !line.empty() && line.front() != '#') {
        return fail_at(number, "`MSG: package/Type` must stand here");
      } else if (!add_line(line, number)) {
        return false;
      }
    }
    return !begins || fail_at(number, "a part without `MSG: package/Type`");
  }

  bool read_name(std::string_view rest, bool begins, std::uint32_t line) {
    const std::string_view written = stripped(rest.substr(0, rest.find('#')));
    const std::string name = plain_name(written);
    const std::size_t slash = name.rfind('/');
    if (slash == name.npos || slash == 0 || !is_identifier(name.substr(slash + 1)) ||
        written.size() > 3 * (name_bytes_max + 1))
      return fail_at(line, "`MSG:` without a name package/Type behind it");
    if (begins) {
      if (made_.types.size() >= types_max)
        return fail_at(line, "more than " + std::to_string(types_max) + " types");
      begin_type(name);
      return true;
    }
    // Some programs also say the name of the message itself.
    if (made_.types.size() > 1 || !made_.types[0].members.empty())
      return fail_at(line, "`MSG:` without a line of = before it");
    return true;
  }

  bool add_line(std::string_view line, std::uint32_t number) {
    declaration found;
    if (const auto wrong = read_line(line, made_.version, found)) return fail_at(number, *wrong);
    if (found.is != declaration::sort::member || skips_) return true;
    type& to = made_.types.back();
    if (!names_.insert(found.read.name).second)
      return fail_at(number, "a second member of the name " + found.read.name);
    if (to.members.size() >= members_max)
      return fail_at(number, "more than " + std::to_string(members_max) + " members of a type");
    if (++members_ > all_members_max)
      return fail_at(number, "more than " + std::to_string(all_members_max) + " members in all types");
    failure why;
    if (!found.read.default_json.empty() && !check_default(made_.version, found.read, why))
      return fail_at(number, "the default of " + found.read.name + " " + why.what);
    found.read.line = number;
    found.read.key = (to.members.empty() ? "{\"" : ",\"") + found.read.name + "\":";
    to.members.push_back(std::move(found.read));
    return true;
  }

  // ---- types within types ----

  // Finds the types of the members of a type, and of theirs, as deep as it goes.
  bool resolve(std::size_t place) {
    open_.push_back(place);
    std::size_t depth = 1;
    for (member& one : made_.types[place].members) {
      if (one.what != kind::object) continue;
      if (!find_type(made_.types[place].name, one)) return false;
      if (one.what != kind::object) continue;
      if (std::find(open_.begin(), open_.end(), one.object) != open_.end())
        return fail_at(one.line, "the type " + one.type_name + " has itself as a member");
      const type& inner = made_.types[one.object];
      const auto too_deep = [&] { return open_.size() + std::max<std::size_t>(inner.depth, 1) > depth_max; };
      if (too_deep() || (inner.depth == 0 && !resolve(one.object)) || too_deep()) {
        return !why_.empty() ? false
                             : fail_at(one.line, "types within types, more than " +
                                                     std::to_string(depth_max) + " levels");
      }
      depth = std::max(depth, inner.depth + 1);
    }
    open_.pop_back();
    made_.types[place].depth = depth;
    measure(made_.types[place]);
    return true;
  }

  bool find_type(std::string_view owner, member& into) {
    const std::string name = plain_name(into.type_name);
    const std::string package{owner.substr(0, std::min(owner.find('/'), owner.size()))};
    places::const_iterator found = places_.end();
    if (name.find('/') != name.npos) {
      found = places_.find(name);
    } else {
      if (name == "Header" && made_.version == ros_version::ros1) found = places_.find("std_msgs/Header");
      if (found == places_.end()) found = places_.find(package + "/" + name);
      if (found == places_.end()) found = only_one_of(name);
    }
    if (made_.version == ros_version::ros2 && is_built_in(name, found)) {
      into.what = name.ends_with("Time") ? kind::time : kind::duration;
      return true;
    }
    if (found == places_.end())
      return fail_at(into.line, "there is no definition of the type " + into.type_name);
    into.object = static_cast<std::uint32_t>(found->second);
    return true;
  }

  // The type of this name, if there is one in one package only.
  places::const_iterator only_one_of(const std::string& name) const {
    const auto is_it = [end = "/" + name](const auto& one) { return one.first.ends_with(end); };
    const auto first = std::find_if(places_.begin(), places_.end(), is_it);
    if (first == places_.end() || std::find_if(std::next(first), places_.end(), is_it) == places_.end())
      return first;
    return places_.end();
  }

  // ROS 2's times; many recordings leave out their definitions.
  bool is_built_in(std::string_view name, places::const_iterator found) const {
    if (name != "builtin_interfaces/Time" && name != "builtin_interfaces/Duration") return false;
    if (found == places_.end()) return true;
    const std::vector<member>& members = made_.types[found->second].members;
    const auto is = [&](std::size_t i, std::string_view called, kind what) {
      const member& one = members[i];
      return one.name == called && one.what == what && one.many == form::one && one.default_json.empty();
    };
    return members.size() == 2 && is(0, "sec", kind::int32) && is(1, "nanosec", kind::uint32);
  }

  // Sums of what is in the type; those of the types inside are known.
  void measure(type& of) {
    for (std::size_t i = 0; i < of.members.size(); ++i) of.by_name.push_back(static_cast<std::uint16_t>(i));
    std::sort(of.by_name.begin(), of.by_name.end(),
              [&](std::uint16_t a, std::uint16_t b) { return of.members[a].name < of.members[b].name; });
    of.objects = 1;
    if (of.members.empty()) of.bytes_min[static_cast<std::size_t>(wire::cdr)] = 1;
    for (const member& one : of.members) {
      const type* const inner = one.what == kind::object ? &made_.types[one.object] : nullptr;
      const std::uint64_t count = one.many == form::fixed ? one.count : 1;
      for (std::size_t in = 0; in < of.bytes_min.size(); ++in) {
        const std::uint64_t each = one.many == form::sequence ? 4
                                   : inner != nullptr         ? inner->bytes_min[in]
                                                              : bytes_of(one.what);
        of.bytes_min[in] = sum_of(of.bytes_min[in], count, each);
      }
      if (inner != nullptr && one.many != form::sequence)
        of.objects = sum_of(of.objects, count, inner->objects);
    }
  }

  // Arrays of fixed length multiply what a message has at least.
  void check_size() {
    for (const type& one : made_.types) {
      if (one.objects > least_objects_max)
        fail("a value of the type " + one.name + " has more than " + std::to_string(least_objects_max) +
             " objects at least");
      if (std::max(one.bytes_min[0], one.bytes_min[1]) > least_bytes_max)
        fail("a value of the type " + one.name + " has more than " + std::to_string(least_bytes_max) +
             " bytes at least");
    }
  }

  definition made_;
  places places_;
  std::set<std::string, std::less<>> names_; // of the members of the type that is read
  std::vector<std::size_t> open_;            // types whose members are being found
  std::size_t members_ = 0;
  bool skips_ = false;
  std::string why_;
};

} // namespace

std::optional<definition> parse(std::string_view name, std::string_view text, ros_version version,
                                std::string& why) {
  return parser{name, version}.parse(text, why);
}

} // namespace rowe::rosmsg
