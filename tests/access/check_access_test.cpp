// SPDX-License-Identifier: Apache-2.0
#include <rowe/access.hpp>

#include <gtest/gtest.h>

namespace check_access_test {
namespace {

using rowe::access_options;
using rowe::check_access;
using rowe::hash_token;

const std::string hash = hash_token("a-token-of-some-length");

TEST(check_access, accepts_what_is_right) {
  EXPECT_EQ(check_access({}), "");
  EXPECT_EQ(check_access({.roles = {{.name = "arm", .publish = {"/arm/*"}}},
                          .identities = {{"arm-1", "arm", hash},
                                         {"a@b", "observer", hash_token("another-token-of-some-length")},
                                         {.name = "eve", .role = "driver", .certificate = "Eve, Dr."}},
                          .local_role = "supervisor",
                          .anonymous_may_stop = true}),
            "");
}

TEST(check_access, names_the_value_and_what_is_allowed) {
  const std::vector<std::pair<access_options, std::string>> cases = {
      {{.roles = {{.name = "an arm"}}}, "role `an arm`: a name has 1 to 64 letters, digits and . _ -"},
      {{.roles = {{.name = "arm"}, {.name = "arm"}}}, "role `arm` is defined twice"},
      {{.roles = {{.name = "arm", .call = {""}}}}, "role `arm`, call: a pattern is empty"},
      {{.roles = {{.name = "arm", .publish = {"/a/***"}}}},
       "role `arm`, publish: the pattern `/a/***` has three stars in a row; only `*` and `**` have a "
       "meaning"},
      {{.roles = {{.name = "arm", .publish = {std::string(129, 'a')}}}},
       "role `arm`, publish: the pattern `" + std::string(80, 'a') + "` has 129 bytes; it may have 128"},
      {{.roles = {{.name = "arm", .provide = std::vector<std::string>(65, "a")}}},
       "role `arm`, provide: 65 patterns: there may be 64"},
      {{.roles = {{.name = "arm", .set = {""}}}}, "role `arm`, set: a pattern is empty"},
      {{.identities = {{"", "driver", hash}}}, "identity ``: a name has 1 to 64 letters, digits and . _ - @"},
      {{.identities = {{"bob", "pilot", hash}}},
       "identity `bob`: there is no role `pilot`; there are observer, driver, supervisor, peer"},
      {{.identities = {{"bob", "driver", "12ab"}}},
       "identity `bob`: the hash of a token has 64 hexadecimal digits, this one has 4 bytes"},
      {{.identities = {{"bob", "driver", hash}, {"bob", "peer", hash}}}, "identity `bob` is defined twice"},
      {{.identities = {{"bob", "driver", hash}}, .local_role = "pilot"},
       "local_role: there is no role `pilot`; there are observer, driver, supervisor, peer"},
      {{.local_role = "driver"},
       "there is no identity, so everyone may do everything: roles, local_role and anonymous_may_stop have "
       "no effect"},
      {{.roles = {{.name = "arm"}}},
       "there is no identity, so everyone may do everything: roles, local_role and anonymous_may_stop have "
       "no effect"},
      {{.roles = {{.name = "arm", .call = {"*a*a*a*a*"}}}},
       "role `arm`, call: the pattern `*a*a*a*a*` has 5 stars; it may have 4"},
      {{.identities = {{"bob", "driver", hash}, {"eve", "peer", hash}}},
       "identities `bob` and `eve` have one token"},
      {{.identities = {{"bob", "driver", ""}}},
       "identity `bob`: the hash of a token has 64 hexadecimal digits, this one has 0 bytes"},
      {{.identities = {{.name = "bob", .role = "driver", .token_in_url = true, .certificate = "bob"}}},
       "identity `bob`: token_in_url without a token"},
      {{.identities = {{.name = "bob", .role = "driver", .certificate = "b\xc3\xb6"}}},
       "identity `bob`: `certificate` is the common name of a certificate, 1 to 64 bytes of printable ASCII, "
       "not `b\xc3\xb6`"},
      {{.identities = {{.name = "bob", .role = "driver", .certificate = std::string(65, 'b')}}},
       "identity `bob`: `certificate` is the common name of a certificate, 1 to 64 bytes of printable ASCII, "
       "not `" +
           std::string(65, 'b') + "`"},
      {{.identities = {{.name = "bob", .role = "driver", .certificate = "b"},
                       {.name = "eve", .role = "driver", .token_sha256 = hash, .certificate = "b"}}},
       "identities `bob` and `eve` have one certificate"},
  };
  for (const auto& [options, expected] : cases) EXPECT_EQ(check_access(options), expected);
  access_options many;
  many.roles.resize(65);
  EXPECT_EQ(check_access(many), "65 roles: there may be 64");
}

TEST(check_access, hashes_tokens_of_a_good_length_and_form_only) {
  // echo -n abcdefghijklmnop | sha256sum
  EXPECT_EQ(hash_token("abcdefghijklmnop"),
            "f39dac6cbaba535e2c207cd0cd8f154974223c848f727f98b3564cea569b41cf");
  EXPECT_EQ(hash_token("abcdefghijklmno"), "");
  EXPECT_EQ(hash_token("abcdefghijklmno p"), "");
  EXPECT_EQ(hash_token(std::string(129, 'a')), "");
  EXPECT_EQ(hash_token(std::string(128, 'a')).size(), 64U);
}

} // namespace
} // namespace check_access_test
