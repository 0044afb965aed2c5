// SPDX-License-Identifier: Apache-2.0
// The page's files as the linker placed them, and which of them answers a request. The bytes are those of the
// assembler files that embed.cmake writes when the library is built.
#include "page/page.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "wire/http/http_login.hpp"

// The file's name with _ for its dot, as CMakeLists.txt has it; where it is served; what it is.
#define ROWE_PAGE_ASSETS(X)                                                                                  \
  X(index_html, "/", html)                                                                                   \
  X(login_html, "/rowe/login", html)                                                                         \
  X(app_js, "/app.js", javascript)                                                                           \
  X(page_css, "/page.css", css)                                                                              \
  X(style_css, "/style.css", css)                                                                            \
  X(favicon_svg, "/favicon.svg", svg)                                                                        \
  X(recording_js, "/recording.js", javascript)                                                               \
  X(recording_worker_js, "/recording_worker.js", javascript)                                                 \
  X(dygraph_min_js, "/dygraph.min.js", javascript)                                                           \
  X(dygraph_min_css, "/dygraph.min.css", css)                                                                \
  X(dygraphs_txt, "/dygraphs.txt", plain_text)

extern "C" {
#define ROWE_PAGE_SYMBOLS(id, path, type)                                                                    \
  extern const std::byte rowe_asset_##id[], rowe_asset_##id##_end[];                                         \
  extern const std::byte rowe_asset_##id##_gzip[], rowe_asset_##id##_gzip_end[];                             \
  extern const char rowe_asset_##id##_etag[], rowe_asset_##id##_gzip_etag[];
ROWE_PAGE_ASSETS(ROWE_PAGE_SYMBOLS)
#undef ROWE_PAGE_SYMBOLS
}

namespace rowe::page {
namespace {

constexpr std::string_view html = "text/html; charset=utf-8";
constexpr std::string_view css = "text/css; charset=utf-8";
constexpr std::string_view javascript = "text/javascript; charset=utf-8";
constexpr std::string_view plain_text = "text/plain; charset=utf-8";
constexpr std::string_view svg = "image/svg+xml";

constexpr std::size_t etag_chars = 34; // 32 hexadecimal digits between quotes; embed.cmake writes them

struct form {
  const std::byte* begin;
  const std::byte* end;
  const char* etag;
};

struct asset {
  std::string_view path;
  std::string_view type;
  form identity;
  form gzip;
};

constexpr asset assets[] = {
#define ROWE_PAGE_ROW(id, path, type)                                                                        \
  {path,                                                                                                     \
   type,                                                                                                     \
   {rowe_asset_##id, rowe_asset_##id##_end, rowe_asset_##id##_etag},                                         \
   {rowe_asset_##id##_gzip, rowe_asset_##id##_gzip_end, rowe_asset_##id##_gzip_etag}},
    ROWE_PAGE_ASSETS(ROWE_PAGE_ROW)
#undef ROWE_PAGE_ROW
};
#undef ROWE_PAGE_ASSETS

service::http_answer plain(std::uint16_t status, std::string_view words) noexcept {
  service::http_answer answer;
  answer.status = status;
  answer.body = std::as_bytes(std::span{words});
  return answer;
}

service::http_answer serve(const asset& found, bool gzip) noexcept {
  const form& chosen = gzip ? found.gzip : found.identity;
  service::http_answer answer;
  answer.status = 200;
  answer.content_type = found.type;
  if (gzip) answer.content_encoding = "gzip";
  answer.etag = {chosen.etag, etag_chars};
  answer.lasts = true;
  answer.body = {chosen.begin, chosen.end};
  if (found.path == wire::login_path) answer.kind = service::page_kind::form;
  return answer;
}

} // namespace

// Below /rowe the page is found as well, where no file of a user can stand in its place.
service::http_answer answer(const service::http_request& request) noexcept {
  constexpr std::string_view own = "/rowe";
  const std::string_view below = request.path.starts_with("/rowe/") ? request.path.substr(own.size()) : "";
  for (const asset& each : assets) {
    if (each.path == request.path || each.path == below) return serve(each, request.accepts_gzip);
  }
  return plain(404, "There is nothing here. The page is at /, the health at /healthz, the counts at "
                    "/metrics and /api/v1/stats.\n");
}

service::http_answer login_alone(const service::http_request& request) noexcept {
  constexpr std::string_view style = "/rowe/style.css"; // of the form, too
  return request.path == wire::login_path || request.path == style ? answer(request) : service::http_answer{};
}

} // namespace rowe::page
