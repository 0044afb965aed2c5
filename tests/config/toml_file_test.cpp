// SPDX-License-Identifier: Apache-2.0
#include "config/toml_file.hpp"

#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "rt/folder.hpp"

namespace toml_file_test {
namespace {

using namespace rowe::config;
using rowe::tests::folder;

std::string fault_of(std::string_view text) {
  table into;
  fault wrong;
  return parse(text, into, wrong) ? "" : std::to_string(wrong.line) + ": " + wrong.text;
}

TEST(toml, is_taken_apart_into_items_that_know_their_lines) {
  table root;
  fault wrong;
  ASSERT_TRUE(parse("# a robot\n[endpoint]\nport = 9000\npage = false\n\n[[role]]\nname = \"a\"\n"
                    "call = [\n  \"/x\",\n  \"/y\"]\n[[role]]\nwhen = 2026-01-01\nhow = 1.5\nx = nan\n",
                    root, wrong))
      << wrong.text;
  ASSERT_EQ(root.of.size(), 2U);
  const auto& endpoint = std::get<table>(root.of[0].is);
  ASSERT_EQ(endpoint.of.size(), 2U);
  EXPECT_EQ(endpoint.of[0].name, "page");
  EXPECT_EQ(endpoint.of[0].line, 4);
  EXPECT_EQ(described(endpoint.of[0]), "false");
  EXPECT_EQ(endpoint.of[1].line, 3);
  EXPECT_EQ(described(endpoint.of[1]), "9000");
  const auto& roles = std::get<array>(root.of[1].is);
  ASSERT_EQ(roles.of.size(), 2U);
  EXPECT_EQ(roles.of[1].line, 11);
  const auto& first = std::get<table>(roles.of[0].is);
  EXPECT_EQ(first.of[0].line, 8);
  EXPECT_EQ(described(first.of[0]), "a list");
  EXPECT_EQ(described(std::get<array>(first.of[0].is).of[1]), "\"/y\"");
  const auto& second = std::get<table>(roles.of[1].is);
  EXPECT_EQ(described(second.of[0]), "the real number 1.5");
  EXPECT_EQ(described(second.of[1]), "a date or a time of day");
  EXPECT_EQ(described(second.of[2]), "the real number nan");
}

TEST(toml, that_is_none_is_told_with_its_line) {
  EXPECT_TRUE(fault_of("[endpoint]\nport = \n").starts_with("2: ")) << fault_of("[endpoint]\nport = \n");
  EXPECT_TRUE(fault_of("a = 1\nb = 2\na = 3\n").starts_with("3: ")); // twice
  EXPECT_TRUE(fault_of("a = \"\xff\"").starts_with("1: "));
}

TEST(toml, is_bounded_in_depth_and_in_the_length_of_lines) {
  EXPECT_EQ(fault_of("[[a]]\nb = [1]"), "");
  EXPECT_EQ(fault_of("x = 1\n[[a]]\nb = [[1]]"), "3: this nests deeper than 4 levels");
  EXPECT_EQ(fault_of("a.b.c.d = 1"), "");
  EXPECT_EQ(fault_of("a.b.c.d.e = 1"), "1: this nests deeper than 4 levels");
  EXPECT_NE(fault_of("a = " + std::string(1000, '[')), "");
  const std::string name(line_bytes_max - 4, 'n');
  EXPECT_EQ(fault_of("a = 1\n" + name + " = 15"), "2: the line has 2049 bytes; it may have 2048");
  EXPECT_EQ(fault_of("a = 1\n" + name + " = 1"), "");
}

// Where else they stand, the parser would ask whether they are white space: see toml_file.cpp.
TEST(toml, has_characters_beyond_ascii_in_comments_and_in_strings_of_one_line) {
  for (const std::string_view right :
       {"# für\na = 1", "a = \"für\" # für\n", "a = 'für'", "\"für\" = 1", "a = \"\\\"für\"",
        "a = ['\"', \"für\"]", "a = '\\' # für", "a = \"\" # für", "a = \"\"\"b\nc\"\"\" # für",
        "a = \"\"\"\"b\"\"\"\"\" # für", "a = '''b''''' # für", "a = \"#\" # \" für"}) {
    EXPECT_EQ(fault_of(right), "") << right;
  }
  for (const std::string_view wrong :
       {"\n\xd0\x99 = 1", "\n[\xd0\x99", "\na = \xd0\x99", "\na = \"b\" \xd0\x99", "\na = '#' \xd0\x99",
        "\na = '\\' \xd0\x99", "\na = \"\" \xd0\x99", "\na = \"\"\"\\ \xd0\x99\"\"\"", "\na = '''\xd0\x99'''",
        "\na = '''b''''' \xd0\x99"}) {
    EXPECT_EQ(fault_of(wrong),
              "2: characters beyond ASCII are allowed in comments, and in strings of one line")
        << wrong;
  }
}

// The deepest that the bounds let through: a table in a table for every two bytes of two lines.
TEST(toml, as_deep_as_it_can_be_is_refused_and_freed) {
  std::string dots;
  while (dots.size() + 8 < line_bytes_max) dots += "a.";
  EXPECT_NE(fault_of("[" + dots + "a]\n" + dots + "a = 1\n"), "");
}

TEST(files, are_read_whole_and_say_who_may_write_them) {
  const folder here;
  file_text read;
  fault wrong;
  ASSERT_TRUE(read_file(here.put("own", "a = 1\n"), read, wrong));
  EXPECT_EQ(read.text, "a = 1\n");
  EXPECT_FALSE(read.writable_by_others);
  for (const mode_t mode : {0620U, 0602U, 0666U}) {
    ASSERT_TRUE(read_file(here.put("shared", "", mode), read, wrong));
    EXPECT_TRUE(read.writable_by_others) << std::oct << mode;
  }
  ASSERT_TRUE(read_file(here.put("readable", "", 0644), read, wrong));
  EXPECT_FALSE(read.writable_by_others);
}

TEST(files, below_the_folder_of_credentials_are_systemds_business) {
  const folder credentials;
  const folder elsewhere;
  ::setenv("CREDENTIALS_DIRECTORY", credentials.path().c_str(), 1);
  file_text read;
  fault wrong;
  ASSERT_TRUE(read_file(credentials.put("rowe.toml", "", 0666), read, wrong));
  EXPECT_FALSE(read.writable_by_others);
  ASSERT_TRUE(read_file(elsewhere.put("rowe.toml", "", 0666), read, wrong));
  EXPECT_TRUE(read.writable_by_others);
  const std::string link = credentials / "link"; // what it leads to counts
  ASSERT_EQ(::symlink((elsewhere / "rowe.toml").c_str(), link.c_str()), 0);
  ASSERT_TRUE(read_file(link, read, wrong));
  EXPECT_TRUE(read.writable_by_others);
  ::unsetenv("CREDENTIALS_DIRECTORY");
}

TEST(files, that_cannot_be_read_are_told) {
  const folder here;
  file_text read;
  fault wrong;
  EXPECT_FALSE(read_file(here / "none", read, wrong));
  EXPECT_EQ(wrong.text, "the file cannot be read: No such file or directory");
  EXPECT_FALSE(read_file(here.path(), read, wrong));
  EXPECT_EQ(wrong.text, "this is no regular file");
  const std::string pipe = here / "pipe"; // nobody writes: to wait for it would take for ever
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_FALSE(read_file(pipe, read, wrong));
  EXPECT_EQ(wrong.text, "this is no regular file");
  EXPECT_FALSE(read_file(here.put("large", std::string(file_bytes_max + 1, '\n')), read, wrong));
  EXPECT_EQ(wrong.text, "the file has 1048577 bytes; it may have 1048576");
}

} // namespace
} // namespace toml_file_test
