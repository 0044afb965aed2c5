// SPDX-License-Identifier: Apache-2.0
#include "page/site.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include <rowe/options.hpp>

#include "access/files.hpp"
#include "access/token.hpp"
#include "wire/codec/own_names.hpp"
#include "json/text/digits.hpp"

namespace rowe::page {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<std::string_view, std::string_view>, 24> types{{
    {".css", "text/css; charset=utf-8"},
    {".csv", "text/csv; charset=utf-8"},
    {".gif", "image/gif"},
    {".glb", "model/gltf-binary"},
    {".gltf", "model/gltf+json"},
    {".htm", "text/html; charset=utf-8"},
    {".html", "text/html; charset=utf-8"},
    {".ico", "image/x-icon"},
    {".jpeg", "image/jpeg"},
    {".jpg", "image/jpeg"},
    {".js", "text/javascript; charset=utf-8"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".mjs", "text/javascript; charset=utf-8"},
    {".mp4", "video/mp4"},
    {".pdf", "application/pdf"},
    {".png", "image/png"},
    {".svg", "image/svg+xml"},
    {".txt", "text/plain; charset=utf-8"},
    {".wasm", "application/wasm"},
    {".webmanifest", "application/manifest+json"},
    {".webp", "image/webp"},
    {".woff2", "font/woff2"},
    {".xml", "application/xml"},
}};

std::string_view type_of(std::string_view path) noexcept {
  const std::size_t dot = path.rfind('.');
  const std::string_view ending = dot == path.npos ? std::string_view{} : path.substr(dot);
  const auto* const found =
      std::ranges::find(types, ending, &std::pair<std::string_view, std::string_view>::first);
  return found == types.end() ? "application/octet-stream" : found->second;
}

// What a browser sends as it is (RFC 3986, pchar). Anything else it would send in another form, or not at
// all.
bool can_be_asked_for(std::string_view path) noexcept {
  constexpr std::string_view marks = "/-._~!$&'()*+,;=:@";
  return path.size() <= site::path_bytes_max && std::ranges::all_of(path, [&](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  marks.find(c) != marks.npos;
         });
}

// These are answered before any file is looked for.
bool is_own(std::string_view path) noexcept {
  return path == wire::metrics_path || path == wire::health_path || path.starts_with("/rowe/") ||
         path.starts_with(wire::api_prefix);
}

std::string etag_of(std::string_view text) {
  const auto hash = access::hash_of(text);
  if (!hash) return {}; // then it is sent each time
  std::string tag = "\"";
  for (std::size_t i = 0; i < 16; ++i) {
    tag += json::hex_digits[(*hash)[i] >> 4U];
    tag += json::hex_digits[(*hash)[i] & 15U];
  }
  return tag + '"';
}

} // namespace

// This and the next return what is wrong; empty: nothing.
std::string site::read(const std::string& where, std::size_t& total, content& bytes) {
  const access::open_file file{where};
  if (!file) return ::strerrordesc_np(errno);
  const struct stat& facts = file.facts();
  if (!S_ISREG(facts.st_mode)) return "it is not a file";
  // Keys and tokens are like that, and what is served can be read by everyone.
  if ((facts.st_mode & S_IROTH) == 0)
    return "not everyone may read it, so it is not served: chmod o+r, or move it";
  total += static_cast<std::size_t>(facts.st_size);
  if (total > bytes_max) return "with it the folder has more than " + std::to_string(bytes_max) + " bytes";
  bytes.resize(static_cast<std::size_t>(facts.st_size));
  const ssize_t got = file.read(bytes.data(), bytes.size());
  if (got < 0) return ::strerrordesc_np(errno);
  return got < facts.st_size ? "it became shorter while it was read" : std::string{};
}

std::string site::add(const std::string& path, const std::string& where, std::size_t& total) {
  if (!can_be_asked_for(path))
    return "its name has more than 255 bytes, or others than letters, digits and -._~!$&'()*+,;=:@";
  if (is_own(path)) return "/metrics, /healthz and what is below /rowe/ and /api/v1/ are the endpoint's own";
  content bytes;
  if (std::string wrong = read(where, total, bytes); !wrong.empty()) return wrong;
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  file one{path, type_of(path), etag_of(text), {}};
  one.body = std::make_shared<const content>(std::move(bytes));
  constexpr std::string_view index = "/index.html";
  if (path.ends_with(index)) {
    file folder = one;
    folder.path.resize(path.size() - index.size() + 1);
    files_.push_back(std::move(folder));
  }
  files_.push_back(std::move(one));
  return {};
}

std::string site::load(const std::string& folder) {
  files_.clear();
  std::error_code failed;
  fs::recursive_directory_iterator at{folder, failed};
  if (failed) return folder + ": " + failed.message();
  const std::string inside = fs::canonical(folder, failed).string() + '/';
  std::size_t count = 0;
  std::size_t total = 0;
  for (const fs::recursive_directory_iterator end; at != end; at.increment(failed)) {
    const std::string where = at->path().string();
    if (++count > files_max)
      return folder + ": it has more than " + std::to_string(files_max) + " files and folders";
    if (at->path().filename().string().starts_with('.')) {
      at.disable_recursion_pending();
      continue;
    }
    if (at->is_directory(failed)) continue;
    if (at->is_symlink(failed) && !fs::canonical(at->path(), failed).string().starts_with(inside))
      return where + ": it is a link that leads out of the folder";
    const std::string path = '/' + at->path().lexically_relative(folder).generic_string();
    if (std::string wrong = add(path, where, total); !wrong.empty()) return where + ": " + wrong;
  }
  if (failed) return folder + ": " + failed.message();
  std::ranges::sort(files_, {}, &file::path);
  return {};
}

service::http_answer site::answer(const service::http_request& request) const noexcept {
  const auto found = std::ranges::lower_bound(files_, request.path, {},
                                              [](const file& one) { return std::string_view{one.path}; });
  if (found == files_.end() || found->path != request.path) return beneath_(request);
  service::http_answer answer;
  answer.status = 200;
  answer.content_type = found->type;
  answer.etag = found->etag;
  answer.kind = service::page_kind::users;
  answer.lasts = true;
  answer.body = *found->body;
  return answer;
}

} // namespace rowe::page

namespace rowe {

std::string check_web(const std::string& folder) { return page::site{nullptr}.load(folder); }

} // namespace rowe
