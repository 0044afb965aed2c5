// SPDX-License-Identifier: Apache-2.0
// A certificate that an endpoint shows to those who connect: how long it is good.
#include <array>
#include <chrono>

#include "../rowe/console.hpp"
#include "../rowe/setup/certificate.hpp"
#include "check.hpp"

namespace rowe::tools::fitness {
namespace {

constexpr std::int64_t warned_days = 30; // as the endpoint's events

finding certificate_end(const machine& on) {
  const reading file = on.files.read(on.certificate);
  if (!file) return {.mark = level::fail, .found = joined(on.certificate, " cannot be read")};
  std::string wrong;
  const auto shown = certificate::read(file.text, wrong);
  if (!shown) return {.mark = level::fail, .found = joined(on.certificate, ": ", wrong)};
  const auto left = shown->end() - std::chrono::system_clock::now();
  const std::int64_t days = std::chrono::floor<std::chrono::days>(left).count();
  finding result;
  result.values = {{"days", days}};
  result.found = days < 0 ? joined("it ended ", -days, days == -1 ? " day ago" : " days ago")
                          : joined(days, days == 1 ? " day is left" : " days are left");
  result.found += joined("; its key: --pin ", shown->pin());
  result.mark = days < 0 ? level::fail : days < warned_days ? level::warn : level::ok;
  return result;
}

constexpr std::array checks{
    check{.name = "certificate_end",
          .title = "days until the certificate ends",
          .wanted = "30 or more",
          .why = "nobody can connect any more when it has ended",
          .change = "renew it (docs/network.md)",
          .vital = true,
          .examine = certificate_end},
};

} // namespace

group certificate_group() { return {"certificate", checks}; }

} // namespace rowe::tools::fitness
