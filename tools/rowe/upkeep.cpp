// SPDX-License-Identifier: Apache-2.0
#include "upkeep.hpp"

#include <unistd.h>

#include <chrono>
#include <optional>
#include <utility>

#include <rowe/settings.hpp>

#include "setup/renewal.hpp"

namespace rowe::tools {
namespace {

std::string folder_of(const std::string& file) {
  const auto slash = file.rfind('/');
  return slash == file.npos ? "." : file.substr(0, slash);
}

} // namespace

upkeep::upkeep(const configuration_options& given, const console& to)
    : given_{given}, to_{to}, file_{given.file()}, seen_{file_version(file_)} {}

void upkeep::look(endpoint& hub, rt::time_point now) {
  if (file_.empty()) return;
  if (now >= look_at_) {
    look_at_ = now + look_period;
    const std::uint64_t version = file_version(file_);
    if (version != 0 && version != seen_ && take_access(hub)) seen_ = version;
  }
  if (const bool was_set = clock_was_set(now); was_set || now >= renew_at_) {
    renew_at_ = now + renewal_period;
    renew_certificate();
  }
}

// Only what is wrong with roles and identities keeps them from being taken: a revocation must not wait for a
// certificate or a page that somebody else has broken. Read again and again until it is right: what cannot be
// read now, because no descriptor is left, can be read later, without any change.
bool upkeep::take_access(endpoint& hub) {
  std::string why;
  const auto chosen = given_.read_unchecked(why);
  if (!chosen || !chosen->check_access(&why)) {
    if (std::exchange(told_, why) == why) return false;
    configuration_options::say_lines(to_, severity::error, why);
    to_.error(printable(file_), " has changed and is wrong: the values that it had before hold");
    return false;
  }
  if (const status taken = hub.set_access(chosen->values().endpoint.access, &why); !taken) {
    if (why.empty()) why = taken.error().message();
    if (std::exchange(told_, why) == why) return false;
    to_.error(printable(file_), " has changed, but its roles and identities are not used: ", printable(why));
    return false;
  }
  told_.clear();
  to_.note(printable(file_), " has changed: its roles and identities hold now; all else needs a restart");
  if (!chosen->check(&why)) {
    to_.say(severity::warning, "a restart would be refused:");
    configuration_options::say_lines(to_, severity::warning, why);
  }
  return true;
}

// A machine without a clock of its own learns the time late. A certificate that was good may have ended then.
bool upkeep::clock_was_set(rt::time_point now) {
  using std::chrono::system_clock;
  const auto between = system_clock::now().time_since_epoch() - now.time_since_epoch();
  const auto step = std::chrono::abs(between - std::exchange(clock_between_, between));
  return step > clock_step_min;
}

// The server takes the new file by itself.
void upkeep::renew_certificate() {
  const std::string folder = folder_of(file_);
  if (::access((folder + "/ca-key.pem").c_str(), R_OK) != 0) return; // not kept: an event tells of the end
  const renewal done =
      renew_if_due(folder, std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now()));
  if (done.what == renewal::outcome::renewed)
    to_.note("the certificate in ", printable(folder), " was renewed");
  if (done.what == renewal::outcome::failed)
    to_.error("the certificate in ", printable(folder), " could not be renewed: ", printable(done.wrong));
}

} // namespace rowe::tools
