// SPDX-License-Identifier: Apache-2.0
// The files of a user's folder, as they are served.
#include "page/site.hpp"

#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include <rowe/options.hpp>

#include "rt/folder.hpp"

namespace site_test {
namespace {

namespace fs = std::filesystem;
using rowe::page::site;
using rowe::service::http_answer;
using rowe::service::page_kind;

http_answer beneath(const rowe::service::http_request& request) noexcept {
  http_answer answer;
  if (request.path == "/app.js") answer.status = 200;
  return answer;
}

struct a_site : testing::Test {
  const mode_t usual = ::umask(022); // everyone may read what a test writes
  const rowe::tests::folder made;
  const std::string& folder = made.path();
  site served{beneath};

  ~a_site() override { ::umask(usual); }
  std::string at(std::string_view name) const { return made / name; }
  void put(std::string_view name, std::string_view text) const { made.put(name, text); }
  http_answer get(std::string_view path) const { return served.answer({path, {}, true}); }
  std::string text(std::string_view path) const {
    const http_answer answer = get(path);
    EXPECT_EQ(answer.status, 200) << path;
    return {reinterpret_cast<const char*>(answer.body.data()), answer.body.size()};
  }
};

TEST_F(a_site, serves_each_file_under_its_path_and_what_is_beneath_elsewhere) {
  put("index.html", "<h1>arm</h1>");
  put("js/arm.js", "let a;");
  put("js/index.html", "<p>none</p>");
  put("meshes/arm.glb", std::string_view{"\0\1\2", 3});
  put("empty.txt", "");
  ASSERT_EQ(served.load(folder), "");
  EXPECT_EQ(text("/"), "<h1>arm</h1>");
  EXPECT_EQ(text("/index.html"), "<h1>arm</h1>");
  EXPECT_EQ(text("/js/arm.js"), "let a;");
  EXPECT_EQ(text("/js/"), "<p>none</p>");
  EXPECT_EQ(text("/meshes/arm.glb"), (std::string{"\0\1\2", 3}));
  EXPECT_EQ(text("/empty.txt"), "");
  EXPECT_EQ(get("/js").status, 404);
  EXPECT_EQ(get("/meshes/").status, 404);
  EXPECT_EQ(get("").status, 404);
  EXPECT_EQ(get("/app.js").kind, page_kind::own);
  EXPECT_EQ(get("/js/arm.js").kind, page_kind::users);
}

TEST_F(a_site, says_what_each_file_is) {
  for (const auto& [name, type] :
       {std::pair{"a.html", "text/html; charset=utf-8"},
        std::pair{"a.b.js", "text/javascript; charset=utf-8"}, std::pair{"a.png", "image/png"},
        std::pair{"a.wasm", "application/wasm"}, std::pair{"Makefile", "application/octet-stream"},
        std::pair{"a.PNG", "application/octet-stream"}}) {
    put(name, "x");
    ASSERT_EQ(served.load(folder), "");
    EXPECT_EQ(get('/' + std::string{name}).content_type, type);
  }
}

TEST_F(a_site, has_an_etag_that_changes_with_the_content) {
  put("a.txt", "one");
  put("b.txt", "one");
  ASSERT_EQ(served.load(folder), "");
  const std::string before{get("/a.txt").etag};
  EXPECT_EQ(before.size(), 34U);
  EXPECT_EQ(get("/b.txt").etag, before);
  put("a.txt", "two");
  EXPECT_EQ(get("/a.txt").etag, before); // read once
  ASSERT_EQ(served.load(folder), "");
  EXPECT_NE(get("/a.txt").etag, before);
}

TEST_F(a_site, keeps_what_begins_with_a_dot_to_itself) {
  put(".env", "secret");
  put(".git/config", "secret");
  put("a.txt", "x");
  ASSERT_EQ(served.load(folder), "");
  EXPECT_EQ(get("/.env").status, 404);
  EXPECT_EQ(get("/.git/config").status, 404);
  EXPECT_EQ(text("/a.txt"), "x");
}

TEST_F(a_site, names_the_file_that_cannot_be_served) {
  const auto fault = [&](std::string_view name) {
    put(name, "x");
    std::string wrong = served.load(folder);
    fs::remove_all(at(name.substr(0, name.find('/'))));
    EXPECT_TRUE(wrong.starts_with(folder + '/' + std::string{name} + ": ")) << wrong;
    return wrong.substr(std::min(wrong.size(), wrong.find(": ") + 2));
  };
  const std::string name_fault =
      "its name has more than 255 bytes, or others than letters, digits and -._~!$&'()*+,;=:@";
  EXPECT_EQ(fault("my page.html"), name_fault);
  EXPECT_EQ(fault("gr\xc3\xb6\xc3\x9f"
                  "e.html"),
            name_fault);
  EXPECT_EQ(fault(std::string(150, 'a') + '/' + std::string(150, 'b')), name_fault);
  const std::string own_fault =
      "/metrics, /healthz and what is below /rowe/ and /api/v1/ are the endpoint's own";
  EXPECT_EQ(fault("metrics"), own_fault);
  EXPECT_EQ(fault("rowe/stop.html"), own_fault);
  EXPECT_EQ(fault("api/v1/index.html"), own_fault);
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  EXPECT_EQ(served.load(folder), at("pipe") + ": it is not a file"); // and nobody waits for a writer
}

TEST_F(a_site, does_not_follow_links_to_folders_and_takes_those_to_files) {
  put("a@2x.txt", "x");
  put("a.txt", "x");
  fs::create_directory_symlink(folder, at("round"));
  fs::create_symlink(at("a.txt"), at("b.txt"));
  ASSERT_EQ(served.load(folder), "");
  EXPECT_EQ(text("/b.txt"), "x");
  EXPECT_EQ(text("/a@2x.txt"), "x");
  EXPECT_EQ(get("/round/a.txt").status, 404);
}

TEST_F(a_site, is_not_served_with_what_only_its_owner_may_read_or_what_lies_elsewhere) {
  made.put("key.pem", "secret", 0600);
  EXPECT_EQ(served.load(folder),
            at("key.pem") + ": not everyone may read it, so it is not served: chmod o+r, or move it");
  fs::remove(at("key.pem"));
  fs::create_symlink("/etc/hostname", at("name.txt"));
  EXPECT_EQ(served.load(folder), at("name.txt") + ": it is a link that leads out of the folder");
  fs::remove(at("name.txt"));
  fs::create_symlink("/nowhere", at("name.txt"));
  EXPECT_EQ(served.load(folder), at("name.txt") + ": it is a link that leads out of the folder");
}

TEST_F(a_site, has_a_limit_of_files_and_of_bytes) {
  for (std::size_t i = 0; i <= site::files_max; ++i) put("f" + std::to_string(i), "");
  EXPECT_EQ(served.load(folder), folder + ": it has more than 4096 files and folders");
  fs::remove_all(folder);
  put("large.bin", "");
  fs::resize_file(at("large.bin"), site::bytes_max);
  EXPECT_EQ(served.load(folder), "");
  fs::resize_file(at("large.bin"), site::bytes_max + 1);
  EXPECT_EQ(served.load(folder), at("large.bin") + ": with it the folder has more than 67108864 bytes");
}

TEST(a_folder, that_is_not_there_is_told) {
  EXPECT_EQ(rowe::check_web("/nowhere"), "/nowhere: No such file or directory");
  EXPECT_EQ(rowe::check_web("/dev/null"), "/dev/null: Not a directory");
}

} // namespace
} // namespace site_test
