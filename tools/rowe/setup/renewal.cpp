// SPDX-License-Identifier: Apache-2.0
#include "renewal.hpp"

#include <algorithm>

#include "../console.hpp"
#include "../network/host_addresses.hpp"
#include "files.hpp"
#include "texts.hpp"

namespace rowe::tools {
namespace {

renewal failed(std::string why) { return {.what = renewal::outcome::failed, .wrong = std::move(why)}; }

std::chrono::seconds life_of(const certificate& one) { return one.end() - one.begin(); }

// As it was asked for: it begins a day before.
int days_of(const certificate& one) {
  const auto days = std::chrono::duration_cast<std::chrono::days>(life_of(one)).count() - 1;
  return static_cast<int>(std::clamp<std::int64_t>(days, 1, certificate_days_max));
}

struct kept {
  std::string certificate, key, root, root_key;
};

// Empty, or which file cannot be read.
std::string read(const folder& in, kept& into) {
  for (const auto& [name, text] : {std::pair{certificate_file, &into.certificate},
                                   {key_file, &into.key},
                                   {root_file, &into.root},
                                   {root_key_file, &into.root_key}}) {
    if (std::string wrong = in.read(std::string{name}, *text); !wrong.empty()) return wrong;
  }
  return {};
}

renewal renew_in(const folder& in, const std::string& path, calendar_time now, int days) {
  kept texts;
  if (std::string wrong = read(in, texts); !wrong.empty()) return failed(std::move(wrong));
  std::string wrong;
  const auto of = [&](std::string_view file) { return joined(path, "/", file, ": ", wrong); };
  const auto old = certificate::read(texts.certificate, wrong);
  if (!old) return failed(of(certificate_file));
  const auto key = private_key::read(texts.key, wrong);
  if (!key) return failed(of(key_file));
  const auto root = root_authority::read(texts.root, texts.root_key, wrong);
  if (!root) return failed(of(root_key_file));

  const host_names before = old->names();
  host_names wanted{.names = before.names, .addresses = own_addresses()};
  for (const std::string& one : before.addresses) {
    if (!is_private(one) && std::ranges::count(wanted.addresses, one) == 0) wanted.addresses.push_back(one);
  }
  renewal done;
  const auto is_foreign = [&](const std::string& one) {
    const bool well_formed = is_address(one) || check_host_name(one).empty();
    if (well_formed && root->may_vouch_for(one)) return false;
    done.left_out.push_back(one);
    return true;
  };
  std::erase_if(wanted.names, is_foreign);
  std::erase_if(wanted.addresses, is_foreign);
  const auto made = root->sign(old->common_name(), wanted, *key, now, days > 0 ? days : days_of(*old), wrong);
  if (!made) return failed(std::move(wrong));
  if (std::string unwritten = in.write({std::string{certificate_file}, public_mode, made->pem()});
      !unwritten.empty())
    return failed(std::move(unwritten));
  done.what = renewal::outcome::renewed;
  done.end = made->end();
  return done;
}

} // namespace

renewal renew(const std::string& path, calendar_time now, int days) {
  std::string wrong;
  const auto in = folder::open(path, wrong);
  if (!in) return failed(std::move(wrong));
  if (!in->has(std::string{root_key_file})) return {.what = renewal::outcome::without_root};
  return renew_in(*in, path, now, days);
}

renewal renew_if_due(const std::string& path, calendar_time now) {
  std::string wrong, text;
  {
    const auto in = folder::open(path, wrong);
    if (!in) return failed(std::move(wrong));
    wrong = in->read(std::string{certificate_file}, text);
    if (!wrong.empty()) return failed(std::move(wrong));
  }
  const auto there_is = certificate::read(text, wrong);
  if (!there_is) return failed(joined(path, "/", certificate_file, ": ", wrong));
  const auto ahead = std::min<std::chrono::seconds>(renewal_time, life_of(*there_is) / 3);
  // One that was made while the clock was ahead is good for nobody now.
  const bool good = there_is->begin() <= now && there_is->end() - now > ahead;
  if (good) return {.what = renewal::outcome::not_due, .end = there_is->end()};
  renewal done = renew(path, now);
  if (done.what != renewal::outcome::renewed) done.end = there_is->end();
  return done;
}

} // namespace rowe::tools
