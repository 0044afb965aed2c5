// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/setup/renewal.hpp"

#include <algorithm>
#include <gtest/gtest.h>

#include "rt/folder.hpp"
#include "tools/rowe/setup/files.hpp"
#include "tools/rowe/setup/texts.hpp"

namespace rowe::tools {
namespace renewal_test {
namespace {

using namespace std::chrono_literals;
using outcome = rowe::tools::renewal::outcome;

constexpr calendar_time today{std::chrono::sys_days{std::chrono::year{2026} / 11 / 25}};
constexpr std::chrono::days day{1};

class renewal_of : public testing::Test {
 protected:
  // As `rowe setup` makes it, but without settings.
  void set_up(int days, bool keep_root = true, const std::vector<std::string>& further = {}) {
    std::string wrong;
    const host_names names = names_of_robot("ang-01", further);
    const auto root = root_authority::make("ang-01", names, today, 3650, wrong);
    const auto key = private_key::make(wrong);
    const auto leaf = root->sign("ang-01", names, *key, today, days, wrong);
    ASSERT_TRUE(leaf) << wrong;
    std::vector<new_file> files{{std::string{key_file}, secret_mode, key->pem()},
                                {std::string{certificate_file}, public_mode, leaf->pem()},
                                {std::string{root_file}, public_mode, root->own().pem()}};
    if (keep_root) files.push_back({std::string{root_key_file}, secret_mode, root->key_pem()});
    ASSERT_EQ(make_folder(top, files, false, setup_files()), "");
  }

  std::string text(std::string_view file) const {
    std::string wrong, into;
    const auto in = folder::open(top, wrong);
    EXPECT_EQ(in->read(std::string{file}, into), "");
    return into;
  }
  void put(std::string_view file, const std::string& content) const {
    std::string wrong;
    EXPECT_EQ(folder::open(top, wrong)->write({std::string{file}, secret_mode, content}), "");
  }
  certificate there_is() const {
    std::string wrong;
    return *certificate::read(text(certificate_file), wrong);
  }

  const tests::folder made;
  const std::string& top = made.path();
};

TEST_F(renewal_of, a_certificate_is_due_thirty_days_before_its_end) {
  set_up(397);
  const auto end = today + 397 * day;
  const renewal before = renew_if_due(top, end - 31 * day);
  EXPECT_EQ(before.what, outcome::not_due);
  EXPECT_EQ(before.end, end);
  EXPECT_EQ(there_is().end(), end);
  const renewal after = renew_if_due(top, end - 30 * day);
  EXPECT_EQ(after.what, outcome::renewed) << after.wrong;
  EXPECT_EQ(after.end, end - 30 * day + 397 * day);
  EXPECT_EQ(there_is().end(), after.end);
}

TEST_F(renewal_of, a_short_one_is_due_in_its_last_third_and_stays_short) {
  set_up(8); // and the day before
  EXPECT_EQ(renew_if_due(top, today + 4 * day).what, outcome::not_due);
  const renewal done = renew_if_due(top, today + 5 * day);
  EXPECT_EQ(done.what, outcome::renewed);
  EXPECT_EQ(done.end, today + 13 * day);
}

TEST_F(renewal_of, one_that_has_ended_already_works_as_well) {
  set_up(10);
  EXPECT_EQ(renew_if_due(top, today + 100 * day).what, outcome::renewed);
}

TEST_F(renewal_of, one_that_was_made_while_the_clock_was_ahead_is_due) {
  set_up(397);
  ASSERT_EQ(renew(top, today + 100 * day).what, outcome::renewed);
  EXPECT_EQ(renew_if_due(top, today + 99 * day).what, outcome::not_due); // it begins a day before
  const renewal done = renew_if_due(top, today + 98 * day);
  EXPECT_EQ(done.what, outcome::renewed) << done.wrong;
  EXPECT_LE(there_is().begin(), today + 98 * day);
}

TEST_F(renewal_of, a_certificate_keeps_key_and_names) {
  set_up(397, true, {"gate.example", "203.0.113.7"});
  const certificate before = there_is();
  const std::string key = text(key_file);
  ASSERT_EQ(renew(top, today + 1 * day).what, outcome::renewed);
  EXPECT_EQ(there_is().names().names, before.names().names);
  EXPECT_EQ(there_is().names().addresses, before.names().addresses);
  EXPECT_NE(there_is().fingerprint(), before.fingerprint());
  EXPECT_EQ(text(key_file), key);
  std::string wrong;
  EXPECT_TRUE(there_is().belongs_to(*private_key::read(key, wrong)));
}

TEST_F(renewal_of, a_private_address_that_is_gone_is_not_taken_along) {
  set_up(397, true, {"10.255.254.253"});
  ASSERT_EQ(renew(top, today).what, outcome::renewed);
  EXPECT_EQ(std::ranges::count(there_is().names().addresses, "10.255.254.253"), 0);
}

TEST_F(renewal_of, names_that_the_root_may_not_vouch_for_are_left_out_and_told) {
  set_up(397);
  std::string wrong;
  const host_names foreign{.names = {"localhost", "bank.example"}, .addresses = {"127.0.0.1", "8.8.8.8"}};
  const auto root = root_authority::make("other", foreign, today, 397, wrong);
  put(certificate_file, root->sign("other", foreign, *private_key::make(wrong), today, 397, wrong)->pem());
  const renewal done = renew(top, today);
  EXPECT_EQ(done.what, outcome::renewed) << done.wrong;
  EXPECT_EQ(done.left_out, (std::vector<std::string>{"bank.example", "8.8.8.8"}));
  EXPECT_EQ(there_is().names().names, std::vector<std::string>{"localhost"});
}

TEST_F(renewal_of, nothing_happens_where_the_roots_key_was_thrown_away) {
  set_up(397, false);
  const std::string before = text(certificate_file);
  const renewal done = renew_if_due(top, today + 390 * day);
  EXPECT_EQ(done.what, outcome::without_root);
  EXPECT_EQ(done.end, today + 397 * day);
  EXPECT_EQ(text(certificate_file), before);
}

TEST_F(renewal_of, what_cannot_be_read_is_named_and_nothing_changes) {
  set_up(397);
  const std::string before = text(certificate_file);
  put(root_key_file, "no key");
  const renewal done = renew(top, today);
  EXPECT_EQ(done.what, outcome::failed);
  EXPECT_NE(done.wrong.find("ca-key.pem: it has no private key"), std::string::npos) << done.wrong;
  EXPECT_EQ(text(certificate_file), before);
  put(certificate_file, "no certificate");
  EXPECT_NE(renew_if_due(top, today).wrong.find("certificate.pem: it has no certificate"), std::string::npos);
  EXPECT_EQ(renew_if_due(top + "/none", today).what, outcome::failed);
}

TEST_F(renewal_of, a_root_that_has_ended_renews_nothing) {
  set_up(397);
  const renewal done = renew(top, today + 3651 * day);
  EXPECT_EQ(done.what, outcome::failed);
  EXPECT_NE(done.wrong.find("expired"), std::string::npos) << done.wrong;
}

} // namespace
} // namespace renewal_test
} // namespace rowe::tools
