// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/setup/files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "rt/folder.hpp"

namespace rowe::tools {
namespace files_test {
namespace {

namespace fs = std::filesystem;

class files : public testing::Test {
 protected:
  std::string at(const std::string& name) const { return top / name; }
  void put(const std::string& name, const std::string& text) const { std::ofstream{at(name)} << text; }
  std::string text(const std::string& name) const {
    std::ifstream from{at(name)};
    return {std::istreambuf_iterator<char>{from}, {}};
  }
  ::mode_t mode(const std::string& name) const {
    struct stat about {};
    EXPECT_EQ(::stat(at(name).c_str(), &about), 0);
    return about.st_mode & 07777;
  }
  std::size_t count() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator{top.path()}, fs::directory_iterator{}));
  }
  std::string make(const std::string& name, bool replace = false) const {
    return make_folder(at(name), {{"a", secret_mode, "1"}, {"b", public_mode, "2"}}, replace,
                       {"a", "b", "old"});
  }
  folder opened(const std::string& name = ".") const {
    std::string wrong;
    auto made = folder::open(at(name), wrong);
    EXPECT_TRUE(made) << wrong;
    return std::move(made).value();
  }

  const tests::folder top;
};

TEST_F(files, make_a_folder_that_only_its_owner_may_enter) {
  EXPECT_EQ(make("new/"), "");
  EXPECT_EQ(text("new/a") + text("new/b"), "12");
  EXPECT_EQ(mode("new"), 0700U);
  EXPECT_EQ(mode("new/a"), 0600U);
  EXPECT_EQ(count(), 1U);
}

TEST_F(files, take_an_empty_folder_and_no_other) {
  fs::create_directory(at("empty"));
  EXPECT_EQ(make("empty"), "");
  EXPECT_NE(make("empty").find("is there already, with 2 files"), std::string::npos);
  put("file", "x");
  EXPECT_NE(make("file"), "");
  EXPECT_EQ(text("file"), "x");
  fs::create_directory_symlink(at("empty"), at("link"));
  EXPECT_NE(make("link"), "");
  EXPECT_EQ(count(), 3U);
}

TEST_F(files, replace_what_is_known_and_leave_what_is_not) {
  fs::create_directory(at("f"));
  put("f/old", "x");
  EXPECT_EQ(make("f", true), "");
  EXPECT_FALSE(fs::exists(at("f/old")));
  EXPECT_EQ(text("f/a"), "1");
  put("f/mine", "y");
  EXPECT_NE(make("f", true).find("does not make: mine"), std::string::npos);
  EXPECT_EQ(text("f/mine"), "y");
  EXPECT_EQ(count(), 1U);
}

TEST_F(files, that_cannot_be_made_leave_nothing) {
  EXPECT_NE(make("no/such"), "");
  const std::vector<new_file> twice{{"a", secret_mode, "1"}, {"a", secret_mode, "2"}};
  EXPECT_NE(make_folder(at("f"), twice, false, {"a"}).find("f/a cannot be written"), std::string::npos);
  EXPECT_EQ(count(), 0U);
}

TEST_F(files, are_replaced_whole_and_keep_a_narrower_mode) {
  put("a", "before");
  ::chmod(at("a").c_str(), 0400);
  put(".a.new", "left by one that was cut off");
  EXPECT_EQ(opened().write({"a", public_mode, "after"}), "");
  EXPECT_EQ(text("a"), "after");
  EXPECT_EQ(mode("a"), 0400U);
  EXPECT_EQ(count(), 1U);
}

TEST_F(files, keep_their_owner) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root may give files away";
  put("a", "before");
  ASSERT_EQ(::chown(at("a").c_str(), 12345, 23456), 0);
  EXPECT_EQ(opened().write({"a", secret_mode, "after"}), "");
  struct stat about {};
  ::stat(at("a").c_str(), &about);
  EXPECT_EQ(about.st_uid, 12345U);
  EXPECT_EQ(about.st_gid, 23456U);
}

TEST_F(files, are_not_reached_through_symbolic_links) {
  put("secret", "x");
  fs::create_symlink(at("secret"), at("link"));
  std::string into = "nothing";
  EXPECT_NE(opened().read("link", into).find("symbolic link"), std::string::npos);
  EXPECT_EQ(into, "nothing");
  EXPECT_NE(opened().write({"link", secret_mode, "y"}).find("is not a file"), std::string::npos);
  EXPECT_EQ(text("secret"), "x");
}

TEST_F(files, that_are_none_are_not_read) {
  std::string into;
  fs::create_directory(at("d"));
  EXPECT_NE(opened().read("d", into), "");
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  EXPECT_NE(opened().read("pipe", into).find("is not a file"), std::string::npos);
  EXPECT_NE(opened().read("none", into).find("No such file"), std::string::npos);
  put("big", std::string((1 << 20) + 1, 'x'));
  EXPECT_NE(opened().read("big", into).find("longer than 1048576 bytes"), std::string::npos);
}

} // namespace
} // namespace files_test
} // namespace rowe::tools
