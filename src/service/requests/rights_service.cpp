// SPDX-License-Identifier: Apache-2.0
#include "service/requests/rights_service.hpp"

#include <array>
#include <optional>

#include <rowe/detail/mutation_points.hpp>
#include <rowe/detail/queue_pair.hpp>

#include "service/base/service_limits.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {
namespace {

constexpr std::array all_rights{access::right::subscribe, access::right::publish, access::right::advertise,
                                access::right::call,      access::right::provide, access::right::set,
                                access::right::reset,     access::right::guard,   access::right::take_over};

} // namespace

void rights_service::write_answer(json::writer& into, const connection* c,
                                  std::string_view args) const noexcept {
  const bool has_role = c != nullptr && state_.rights.apply_to(*c);
  const access::policy& policy = state_.rights.policy();
  const access::role_number told = ROWE_MUTANT(rights_of_others) || !has_role ? 0 : c->who.role;
  into.begin_object();
  into.member_or_null("role", has_role ? policy.role_name(told) : std::string_view{});
  into.member_or_null("identity", has_role ? policy.identity_name(c->who.identity) : std::string_view{});
  into.begin_array("allowed");
  if (const auto asked = args.empty() ? std::nullopt : json::find(json::root(args).raw, "asked")) {
    std::array<char, 16> right_buffer;
    std::array<char, 2 * detail::queue_pair::name_bytes_max> name_buffer;
    const auto text_of = [](const json::value& of, std::string_view member, std::span<char> buffer) {
      const auto found = json::find(of.raw, member);
      const auto text = found ? json::to_string(*found, buffer) : std::nullopt;
      return text.value_or(std::string_view{});
    };
    json::array_walk walk{asked->raw};
    json::value one;
    for (std::size_t i = 0; i < asked_max && walk.next(one); ++i)
      into.boolean(allowed(c, text_of(one, "right", right_buffer), text_of(one, "name", name_buffer)));
  }
  into.end_array();
  into.end_object();
}

bool rights_service::allowed(const connection* c, std::string_view right,
                             std::string_view name) const noexcept {
  for (const access::right each : all_rights) {
    if (access::name_of(each) != right) continue;
    if (c == nullptr) return true;
    const bool of_stop = each == access::right::reset || each == access::right::guard;
    if (of_stop) return access_control_.may(*c, each) || ROWE_MUTANT(rights_stop);
    const std::size_t patterns = state_.rights.policy().patterns(c->who.role, each);
    state_.cycle.work_bytes += patterns * pattern_work_bytes;
    if (ROWE_MUTANT(rights_names) && patterns != 0) return true;
    return each == access::right::call ? state_.rights.calls(*c, name) : state_.rights.allow(*c, each, name);
  }
  return false; // there is no such right
}

} // namespace rowe::service
