// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/setup/identities.hpp"

#include <gtest/gtest.h>

#include <random>

namespace rowe::tools {
namespace identities_test {
namespace {

std::string hash(char digit) { return std::string(64, digit); }
identity who(const std::string& name, const std::string& role, char digit) {
  return {.name = name, .role = role, .token_sha256 = hash(digit)};
}
std::string table(const std::string& name, char digit) { return toml_of(who(name, "driver", digit)); }

identities_text read(const std::string& toml) {
  std::string wrong;
  auto made = identities_text::read(toml, wrong);
  EXPECT_TRUE(made) << wrong << "\n" << toml;
  return made ? std::move(*made) : *identities_text::read("", wrong);
}

std::vector<std::string> names(const identities_text& in) {
  std::vector<std::string> found;
  for (const identity& one : in.all()) found.push_back(one.name);
  return found;
}

std::string refusal(const std::string& toml) {
  std::string wrong;
  EXPECT_FALSE(identities_text::read(toml, wrong)) << toml;
  return wrong;
}

using list = std::vector<std::string>;

TEST(identities, are_read_however_toml_lets_one_write_them) {
  const identities_text in =
      read("[endpoint]\nname = \"x\"\n"
           "  [[ identity ]] # first\r\n name=\"a\"\r\n\"role\" = 'driver' # drives\r\n"
           "token_sha256 = \"" +
           hash('1') +
           "\"\ntoken_in_url = true\n"
           "[[\"identity\"]]\nname = 'b.c@d'\n[stop]\nname = \"no identity\"\n");
  ASSERT_EQ(names(in), (list{"a", "b.c@d"}));
  EXPECT_EQ(in.all()[0].role, "driver");
  EXPECT_EQ(in.all()[0].token_sha256, hash('1'));
  EXPECT_TRUE(in.all()[0].token_in_url);
  EXPECT_FALSE(in.all()[1].token_in_url);
}

TEST(identities, in_strings_comments_and_arrays_are_none) {
  const identities_text in = read("a = \"\"\"\n[[identity]]\nname = \"1\"\n\\\"\"\"\"\n"
                                  "b = '''\n[[identity]]\nname = \"2\"\n'''\n"
                                  "c = [\n[[1, 2], [3]],\n\"[[identity]]\", # ]\n]\n"
                                  "# [[identity]]\n# name = \"3\"\n"
                                  "d = \"# [[identity]] \\\" [\"\ne = '\"'\n" +
                                  table("real", '1'));
  EXPECT_EQ(names(in), list{"real"});
}

TEST(identities, are_added_behind_what_is_there) {
  identities_text in = read("# mine\n[endpoint]\nport = 1 # one");
  EXPECT_EQ(in.add(who("anna", "supervisor", '2')), "");
  EXPECT_EQ(in.text(), "# mine\n[endpoint]\nport = 1 # one\n\n" + toml_of(who("anna", "supervisor", '2')));
  EXPECT_EQ(names(in), list{"anna"});
}

TEST(identities, are_removed_whole_and_nothing_else_is) {
  identities_text in = read("# top\n\n" + table("a", '1') + "\n# about b\n" + table("b", '2') +
                            "# behind b\n\n[limits]\npeers_max = 3\n\n" + table("c", '3'));
  EXPECT_TRUE(in.remove("b"));
  EXPECT_EQ(in.text(), "# top\n\n" + table("a", '1') +
                           "\n# about b\n# behind b\n\n[limits]\npeers_max = 3\n\n" + table("c", '3'));
  EXPECT_TRUE(in.remove("c"));
  EXPECT_TRUE(in.text().ends_with("peers_max = 3\n"));
  EXPECT_FALSE(in.remove("c"));
  EXPECT_EQ(names(in), list{"a"});
}

TEST(identities, values_of_several_lines_go_with_them) {
  identities_text in =
      read("[[identity]]\nname = \"a\"\nnote = \"\"\"\nx\n[[identity]]\n\"\"\"\nlist = [\n1,\n]\n[stop]\n");
  EXPECT_TRUE(in.remove("a"));
  EXPECT_EQ(in.text(), "[stop]\n");
}

TEST(identities, that_would_not_be_taken_are_not_added) {
  identities_text in = read(table("a", '1'));
  const std::string before = in.text();
  EXPECT_NE(in.add(who("a", "driver", '2')).find("defined twice"), std::string::npos);
  EXPECT_NE(in.add(who("b", "pilot", '2')).find("no role"), std::string::npos);
  EXPECT_NE(in.add(who("b c", "driver", '2')).find("64 letters"), std::string::npos);
  EXPECT_NE(in.add(who("b\"\n[x]", "driver", '2')), "");
  EXPECT_NE(in.add(who("b", "driver", '1')).find("one token"), std::string::npos);
  EXPECT_EQ(in.text(), before);
}

TEST(identities, may_have_a_role_of_the_file) {
  identities_text in = read("[[role]]\nname = \"pilot\"\npublish = [\"**\"]\n[[role]]\nname = 'cook'\n");
  EXPECT_EQ(in.add(who("anna", "pilot", '1')), "");
  EXPECT_EQ(in.add(who("bert", "cook", '2')), "");
}

TEST(identities, in_forms_that_cannot_be_edited_are_refused_by_line) {
  EXPECT_EQ(refusal("\nidentity = [{name = \"a\"}]\n"),
            "line 2: an identity is a table [[identity]], not a value");
  EXPECT_EQ(refusal("identity.a = 1\n").substr(0, 6), "line 1");
  EXPECT_EQ(refusal("[identity]\n"), "line 1: an identity is a table [[identity]], and has none of its own");
  EXPECT_EQ(refusal("[[identity]]\n[identity.more]\n").substr(0, 6), "line 2");
  EXPECT_EQ(refusal("[[identity]]\nname = \"a\\u0062\"\n").substr(0, 34),
            "line 2: name is not a plain string");
  EXPECT_EQ(refusal("[[identity]]\nname = \"\"\"a\"\"\"\n").substr(0, 34),
            "line 2: name is not a plain string");
  EXPECT_EQ(refusal("a = \"\"\"\n"), "a string or an array does not end");
  EXPECT_EQ(refusal("a = [\n"), "a string or an array does not end");
}

// Whatever the text, reading it ends, and where it can be edited, adding and removing leave it as it was.
TEST(identities, come_and_go_without_a_trace_in_random_texts) {
  constexpr unsigned seed = 20261125;
  const list pieces{"[[identity]]\n",
                    "name = \"n\"\n",
                    "[a]\n",
                    "\"\"\"",
                    "'''",
                    "\"",
                    "'",
                    "\\",
                    "[",
                    "]",
                    "#",
                    "\n",
                    "\r\n",
                    " ",
                    "x = 1\n",
                    "{",
                    "}",
                    "identity",
                    "=",
                    "role",
                    "\\\"",
                    "\0",
                    "[[role]]\n"};
  std::mt19937 random{seed};
  int edited = 0;
  for (int round = 0; round < 20000; ++round) {
    std::string toml;
    const auto length = random() % 24;
    for (unsigned at = 0; at < length; ++at) toml += pieces[random() % pieces.size()];
    if (!toml.empty() && !toml.ends_with('\n')) toml += '\n';
    std::string wrong;
    auto in = identities_text::read(toml, wrong);
    if (!in || !in->add(who("anna", "driver", '1')).empty()) continue;
    ++edited;
    ASSERT_EQ(std::count(in->text().begin(), in->text().end(), '@'), 0);
    ASSERT_TRUE(in->remove("anna")) << toml;
    ASSERT_EQ(in->text(), toml) << "seed " << seed << ", round " << round;
  }
  EXPECT_GT(edited, 1000);
}

} // namespace
} // namespace identities_test
} // namespace rowe::tools
