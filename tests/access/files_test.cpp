// SPDX-License-Identifier: Apache-2.0
#include "access/files.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "rt/folder.hpp"

namespace files_test {
namespace {

using rowe::access::is_credential;
using rowe::access::version_of;

// A folder with FOLDER/inside/file, FOLDER/beside and links between them.
struct credential_files : testing::Test {
  credential_files() {
    made.put("inside/file", "a");
    made.put("beside", "a");
    std::filesystem::create_symlink(folder + "/beside", folder + "/inside/out");
    std::filesystem::create_symlink(folder + "/inside", folder + "/in");
    ::setenv("CREDENTIALS_DIRECTORY", (folder + "/inside").c_str(), 1);
  }
  ~credential_files() override { ::unsetenv("CREDENTIALS_DIRECTORY"); }

  const rowe::tests::folder made;
  const std::string& folder = made.path();
};

TEST_F(credential_files, are_those_below_the_folder_wherever_links_lead) {
  EXPECT_TRUE(is_credential(folder + "/inside/file"));
  EXPECT_TRUE(is_credential(folder + "/in/file"));
  EXPECT_FALSE(is_credential(folder + "/beside"));
  EXPECT_FALSE(is_credential(folder + "/inside/out"));
  EXPECT_FALSE(is_credential(folder + "/inside/../beside"));
  EXPECT_FALSE(is_credential(folder + "/inside/none"));
  EXPECT_FALSE(is_credential(folder + "/inside"));
}

TEST_F(credential_files, are_none_without_the_folder) {
  ::setenv("CREDENTIALS_DIRECTORY", "", 1);
  EXPECT_FALSE(is_credential(folder + "/inside/file"));
  ::setenv("CREDENTIALS_DIRECTORY", (folder + "/none").c_str(), 1);
  EXPECT_FALSE(is_credential(folder + "/inside/file"));
  ::unsetenv("CREDENTIALS_DIRECTORY");
  EXPECT_FALSE(is_credential(folder + "/inside/file"));
}

TEST_F(credential_files, have_another_version_when_written_to_or_replaced) {
  const std::string path = folder + "/beside";
  const auto first = version_of(path);
  EXPECT_NE(first, 0U);
  EXPECT_EQ(version_of(path), first);
  made.put("beside", "ab"); // longer: the clock of files may stand still meanwhile
  const auto second = version_of(path);
  EXPECT_NE(second, first);
  made.put("new", "cd");
  std::filesystem::rename(folder + "/new", path);
  EXPECT_NE(version_of(path), second);
  std::filesystem::remove(path);
  EXPECT_EQ(version_of(path), 0U);
  EXPECT_EQ(version_of(""), 0U);
}

} // namespace
} // namespace files_test
