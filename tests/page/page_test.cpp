// SPDX-License-Identifier: Apache-2.0
// What the endpoint answers to a browser: every file the page names, in both forms, and nothing from
// elsewhere.
#include "page/page.hpp"

#include <array>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace page_test {
namespace {

using rowe::page::answer;
using rowe::service::http_answer;
using rowe::service::http_request;

constexpr std::size_t page_bytes_max = 90'000;  // what a browser loads, compressed, with what draws plots
constexpr std::size_t first_bytes_max = 45'000; // … and before the page is seen
constexpr std::size_t recording_bytes_max = 25'000; // … with the first recording that is opened

std::string_view text_of(const http_answer& from) {
  return {reinterpret_cast<const char*>(from.body.data()), from.body.size()};
}

http_answer plain(std::string_view path) { return answer({path, {}, false}); }
http_answer compressed(std::string_view path) { return answer({path, {}, true}); }

// What stands between `before` and the next quote, at each place where it occurs in `text`.
std::vector<std::string> quoted_after(std::string_view text, std::string_view before) {
  std::vector<std::string> found;
  for (std::size_t at = text.find(before); at != text.npos; at = text.find(before, at + 1)) {
    const std::size_t begin = at + before.size();
    found.emplace_back(text.substr(begin, text.find('"', begin) - begin));
  }
  return found;
}

// Where `name` leads to from the file at `path`.
std::string below(std::string_view path, std::string_view name) {
  return std::string{path.substr(0, path.rfind('/') + 1)}.append(name);
}

// Every path a browser asks for: what the index names, and what the scripts load later.
std::set<std::string> loaded_paths() {
  std::set<std::string> paths{"/"};
  std::vector<std::string> left;
  const auto add = [&](std::string path) {
    if (paths.insert(path).second) left.push_back(std::move(path));
  };
  const std::string_view index = text_of(plain("/"));
  for (const std::string_view before :
       {"src=\"", "link rel=\"icon\" href=\"", "stylesheet\" href=\"", "modulepreload\" href=\""}) {
    for (const std::string& name : quoted_after(index, before)) add(below("/", name));
  }
  while (!left.empty()) {
    const std::string path = std::move(left.back());
    left.pop_back();
    if (!path.ends_with(".js")) continue;
    for (const std::string_view before : {"import(\"./", "href:\"", "new Worker(new URL(\""}) {
      for (const std::string& name : quoted_after(text_of(plain(path)), before)) add(below(path, name));
    }
  }
  return paths;
}

// CRC-32 as in RFC 1952, section 8, a bit at a time.
std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = 0xffffffff;
  for (const char each : bytes) {
    crc ^= static_cast<unsigned char>(each);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc;
}

std::uint32_t little_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (std::size_t index = 4; index-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[index]);
  return value;
}

TEST(page, serves_the_index_at_the_root) {
  const http_answer index = plain("/");
  EXPECT_EQ(index.status, 200);
  EXPECT_EQ(index.content_type, "text/html; charset=utf-8");
  EXPECT_EQ(index.cache_control, "no-cache");
  EXPECT_TRUE(text_of(index).starts_with("<!doctype html>"));
}

TEST(page, serves_every_file_that_the_index_or_a_script_names) {
  const std::set<std::string> paths = loaded_paths();
  EXPECT_TRUE(paths.contains("/app.js"));
  EXPECT_TRUE(paths.contains("/page.css"));
  EXPECT_TRUE(paths.contains("/dygraph.min.js"));
  EXPECT_TRUE(paths.contains("/dygraph.min.css"));
  EXPECT_TRUE(paths.contains("/recording.js"));
  EXPECT_TRUE(paths.contains("/recording_worker.js"));
  for (const std::string& path : paths) EXPECT_EQ(plain(path).status, 200) << path;
  for (const std::string& path : paths) EXPECT_EQ(plain("/rowe" + path).status, 200) << path;
  EXPECT_EQ(text_of(plain("/rowe/")), text_of(plain("/")));
  EXPECT_EQ(plain("/rowe").status, 404);
  EXPECT_EQ(plain("/rowe/rowe/").status, 404);
}

TEST(page, says_what_each_file_is) {
  EXPECT_EQ(plain("/app.js").content_type, "text/javascript; charset=utf-8");
  EXPECT_EQ(plain("/style.css").content_type, "text/css; charset=utf-8");
  EXPECT_EQ(plain("/favicon.svg").content_type, "image/svg+xml");
}

TEST(page, sends_plain_bytes_to_a_client_that_does_not_accept_gzip) {
  for (const std::string& path : loaded_paths()) {
    EXPECT_EQ(plain(path).content_encoding, "") << path;
    EXPECT_EQ(text_of(plain(path)).find('\0'), std::string_view::npos) << path;
  }
}

TEST(page, sends_the_same_file_compressed_to_a_client_that_accepts_gzip) {
  for (const std::string& path : loaded_paths()) {
    const http_answer packed = compressed(path);
    const std::string_view bytes = text_of(packed);
    const std::string_view whole = text_of(plain(path));
    ASSERT_EQ(packed.content_encoding, "gzip") << path;
    ASSERT_GT(bytes.size(), 18u) << path;
    EXPECT_TRUE(bytes.starts_with("\x1f\x8b\x08")) << path;
    EXPECT_EQ(little_endian(bytes.substr(4)), 0u) << path << " holds the time of the build";
    EXPECT_EQ(little_endian(bytes.substr(bytes.size() - 8)), crc32(whole)) << path;
    EXPECT_EQ(little_endian(bytes.substr(bytes.size() - 4)), whole.size()) << path;
  }
}

TEST(page, shows_the_licence_of_what_draws_plots) {
  EXPECT_NE(text_of(plain("/dygraphs.txt")).find("Permission is hereby granted"), std::string_view::npos);
}

TEST(page, stays_within_its_budget) {
  std::size_t bytes = 0;
  std::size_t of_recordings = 0;
  for (const std::string& path : loaded_paths())
    (path.starts_with("/recording") ? of_recordings : bytes) += compressed(path).body.size();
  EXPECT_LE(bytes, page_bytes_max);
  EXPECT_LE(of_recordings, recording_bytes_max);
  std::size_t first = 0;
  for (const char* path : {"/", "/app.js", "/page.css", "/favicon.svg"})
    first += compressed(path).body.size();
  EXPECT_LE(first, first_bytes_max);
}

TEST(page, gives_each_form_of_each_file_a_quoted_tag_of_its_own) {
  std::set<std::string_view> tags;
  const std::set<std::string> paths = loaded_paths();
  for (const std::string& path : paths) {
    for (const http_answer& form : {plain(path), compressed(path)}) {
      ASSERT_EQ(form.etag.size(), 34u) << path;
      EXPECT_EQ(form.etag.front(), '"');
      EXPECT_EQ(form.etag.find('"', 1), form.etag.size() - 1);
      EXPECT_TRUE(tags.insert(form.etag).second) << path;
    }
  }
}

TEST(page, says_in_words_that_there_is_nothing_elsewhere) {
  for (const std::string_view path : {"/index.html", "/nothing", "/app.js/", "//", "", "/../app.js"}) {
    const http_answer nothing = compressed(path);
    EXPECT_EQ(nothing.status, 404) << path;
    EXPECT_EQ(nothing.content_type, "text/plain; charset=utf-8");
    EXPECT_NE(text_of(nothing).find("The page is at /"), std::string_view::npos);
  }
}

// What dygraphs says of licences and the web is its own; what it loads, the browser's tests see.
std::set<std::string> own_paths() {
  std::set<std::string> own = loaded_paths();
  std::erase_if(own, [](const std::string& path) { return path.starts_with("/dygraph"); });
  return own;
}

TEST(page, loads_nothing_from_elsewhere_and_nothing_that_the_content_policy_forbids) {
  for (const std::string& path : own_paths()) {
    std::string text{text_of(plain(path))};
    const std::string_view name_space = "http://www.w3.org/2000/svg"; // a name, not an address
    if (const std::size_t at = text.find(name_space); at != text.npos) text.erase(at, name_space.size());
    for (const std::string_view forbidden : {"http://", "https://", "@import"}) {
      EXPECT_EQ(text.find(forbidden), text.npos) << path << " holds " << forbidden;
    }
    EXPECT_TRUE(path.ends_with(".js") || text.find("url(") == text.npos) << path;
  }
  const std::string_view index = text_of(plain("/"));
  for (const std::string_view forbidden : {"<style", " style=", " onclick=", " onload=", "javascript:"}) {
    EXPECT_EQ(index.find(forbidden), index.npos) << forbidden;
  }
}

TEST(page, opens_every_source_with_its_licence) {
  for (const std::string& path : own_paths()) {
    EXPECT_NE(text_of(plain(path)).substr(0, 200).find("SPDX-License-Identifier: Apache-2.0"),
              std::string_view::npos)
        << path;
  }
}

} // namespace
} // namespace page_test
