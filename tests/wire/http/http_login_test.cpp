// SPDX-License-Identifier: Apache-2.0
// Forms and cookies, as browsers and as others send them.
#include "wire/http/http_login.hpp"

#include <array>
#include <string>
#include <string_view>

#include "wire/requests.hpp"

namespace rowe::wire::test {
namespace http_login_test {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view form = "token=a-token-of-some-length";

// A right form, and the same with lines replaced (their name is what they begin with), removed or added.
std::string post(std::initializer_list<change> changes = {}, std::string_view body = form,
                 std::string_view path = login_path) {
  std::vector<std::pair<std::string_view, std::string>> lines = {
      {"Host", "Host: localhost:8080"},
      {"Origin", "Origin: http://localhost:8080"},
      {"Type", "Content-Type: application/x-www-form-urlencoded"},
      {"Length", "Content-Length: " + std::to_string(body.size())}};
  for (const change& one : changes) {
    bool replaced = false;
    for (auto& [name, line] : lines) {
      if (name == one.name) line = one.line, replaced = true;
    }
    if (!replaced) lines.emplace_back(one.name, one.line);
  }
  std::string out = "POST " + std::string{path} + " HTTP/1.1\r\n";
  for (const auto& [name, line] : lines) {
    if (!line.empty()) out += line + "\r\n";
  }
  return out + "\r\n" + std::string{body};
}

std::string token_of(std::string_view cookies, bool secure = false) {
  handshake_policy policy = policy_at(8080);
  policy.secure = secure;
  const std::string request = upgrade({{"Cookie", cookies}});
  const http_judgement j = judge_request(request, policy);
  EXPECT_EQ(j.outcome, http_outcome::upgrade) << j.rejection.what();
  EXPECT_FALSE(j.token_in_url);
  return std::string{j.token};
}

TEST(find_request_end, waits_for_the_form) {
  const std::string request = post();
  const std::string bytes = request + "behind";
  for (std::size_t first = 0; first <= bytes.size(); ++first) {
    const std::size_t end = find_request_end(std::string_view{bytes}.substr(0, first));
    ASSERT_EQ(end, first < request.size() ? 0 : request.size()) << first;
    if (end == 0) {
      ASSERT_EQ(find_request_end(bytes, first), request.size()) << first;
    }
  }
  const std::string page = header({"GET / HTTP/1.1", "Host: a", "Content-Length: 100"});
  EXPECT_EQ(find_request_end(page), page.size()) << "only a POST has a form";
}

TEST(find_request_end, waits_for_no_form_that_is_refused) {
  for (const std::string_view line :
       {"Content-Length: 513"sv, "Content-Length: -1"sv, "Content-Length: x"sv, "Content-Length: 1, 1"sv,
        "Content-Length: 99999999999999999999"sv, "Content-Length:"sv, ""sv,
        "Content-Length: 1\r\nContent-Length: 1"sv, "Transfer-Encoding: chunked\r\nContent-Length: 5"sv,
        "Content-Length: 5\r\nTransfer-Encoding: chunked"sv, "Content-Length: 5\r\n folded: x"sv}) {
    const std::string request = post({{"Length", line}}, "");
    EXPECT_EQ(find_request_end(request), request.size()) << line;
    EXPECT_EQ(judge_request(request, policy_at(8080)).outcome, http_outcome::rejected) << line;
  }
}

TEST(judge_request, takes_a_form) {
  const std::string request = post();
  const http_judgement j = judge_request(request, policy_at(8080));
  ASSERT_EQ(j.outcome, http_outcome::form) << j.rejection.what();
  EXPECT_EQ(j.form, form);
  EXPECT_EQ(j.path, login_path);
  EXPECT_FALSE(j.secure_cookie);
  EXPECT_TRUE(accepted(post({{"Type", "Content-Type: Application/X-WWW-form-urlencoded ; charset=UTF-8"}}),
                       policy_at(8080), http_outcome::form));
  EXPECT_TRUE(accepted(post({}, "", logout_path), policy_at(8080), http_outcome::form));
  EXPECT_TRUE(accepted(post({{"Type", ""}}, "", logout_path), policy_at(8080), http_outcome::form));
}

TEST(judge_request, refuses_forms_that_are_not_right_in_every_point) {
  EXPECT_TRUE(refused(post({{"Length", ""}}, ""), 411, "the Content-Length of the form is missing"));
  EXPECT_TRUE(refused(post({{"Chunks", "Transfer-Encoding: chunked"}}), 411, "Transfer-Encoding chunked"));
  EXPECT_TRUE(refused(post({{"Length", "Content-Length: 0x10"}}, ""), 400, "is no number: 0x10"));
  EXPECT_TRUE(refused(post({{"Length", "Content-Length: 18446744073709551615"}}, ""), 413, "is too long"));
  EXPECT_TRUE(refused(post({{"Length", "Content-Length: 18446744073709551616"}}, ""), 400, "is no number"));
  EXPECT_TRUE(refused(post({}, std::string(513, 'a')), 413, "a form of 513 bytes is too long", "512"));
  EXPECT_TRUE(refused(post({{"Length", "Content-Length: 99"}}), 400, "not as long as"));
  EXPECT_TRUE(refused(post({{"Length", "Content-Length: 3"}}), 400, "not as long as"));
  EXPECT_TRUE(refused(post({{"Type", "Content-Type: text/plain"}}), 415, "of the type text/plain"));
  EXPECT_TRUE(refused(post({{"Type", ""}}), 415, "of the type "));
  EXPECT_TRUE(refused(post({{"Type", "Content-Type: application/json"}}), 415, "application/json"));
  EXPECT_TRUE(refused(post({{"Upgrade", "Upgrade: websocket"}}), 405, "cannot be a POST request"));
  EXPECT_TRUE(refused(post({}, form, "/"), 405, "the method POST is not offered here"));
  EXPECT_TRUE(refused(post({}, form, "/rowe/login/"), 405, "the method POST"));
  EXPECT_TRUE(refused(post({{"Two", "Content-Type: text/plain"}}), 400, "Content-Type is there twice"));
}

TEST(judge_request, refuses_forms_of_other_pages) {
  EXPECT_TRUE(refused(post({{"Origin", ""}}), 403, "the Origin header is missing"));
  EXPECT_TRUE(refused(post({{"Origin", "Origin: null"}}), 403, "Origin null"));
  EXPECT_TRUE(refused(post({{"Origin", "Origin: http://evil.example"}}), 403, "http://evil.example"));
  EXPECT_TRUE(refused(post({{"Origin", "Origin: http://localhost:9090"}}), 403, "http://localhost:9090"));
  EXPECT_TRUE(refused(post({{"Host", "Host: evil.example"}}), 403, "Host evil.example"));
}

TEST(judge_request, takes_a_form_over_a_network_under_tls_only) {
  constexpr std::string_view hosts[] = {"robot.local"};
  constexpr std::string_view origins[] = {"https://robot.example"};
  handshake_policy policy{.port = 8080, .hosts = hosts, .origins = origins};
  const change host{"Host", "Host: robot.local:8080"};
  EXPECT_TRUE(refused(post({host, {"Origin", "Origin: http://robot.local:8080"}}), 403,
                      "could be read on the way", "certificate", policy));
  const std::string by_proxy = post({host, {"Origin", "Origin: https://robot.example"}});
  EXPECT_TRUE(accepted(by_proxy, policy, http_outcome::form));
  EXPECT_TRUE(judge_request(by_proxy, policy).secure_cookie);
  policy.secure = true;
  const std::string under_tls = post({host, {"Origin", "Origin: https://robot.local:8080"}});
  EXPECT_TRUE(judge_request(under_tls, policy).secure_cookie);
}

TEST(token_of_form, undoes_the_encoding) {
  std::array<char, form_bytes_max> out;
  for (const auto& [text, expected] : {std::pair{form, "a-token-of-some-length"sv},
                                       {"x=1&token=a%7Eb&y=2"sv, "a~b"sv},
                                       {"token=a%7eb"sv, "a~b"sv},
                                       {"token=+%09abc++"sv, "abc"sv},
                                       {"token="sv, ""sv},
                                       {"token"sv, ""sv},
                                       {""sv, ""sv},
                                       {"&&&"sv, ""sv},
                                       {"atoken=x"sv, ""sv},
                                       {"token=a&token=b"sv, ""sv},
                                       {"token=a%7"sv, ""sv},
                                       {"token=a%"sv, ""sv},
                                       {"token=a%zz"sv, ""sv},
                                       {"token=a=b"sv, "a=b"sv}})
    EXPECT_EQ(token_of_form(out, text), expected) << text;
  EXPECT_EQ(token_of_form(out, "token=" + std::string(506, 'a')), std::string(506, 'a'));
}

TEST(cookie, is_a_token_of_this_port_alone) {
  EXPECT_EQ(token_of("Cookie: rowe-8080=abc"), "abc");
  EXPECT_EQ(token_of("Cookie: theme=dark; rowe-8080=abc; other=1"), "abc");
  EXPECT_EQ(token_of("Cookie: rowe-8080=abc;other"), "abc");
  EXPECT_EQ(token_of("Cookie: rowe-8443=abc; rowe-80800=d; xrowe-8080=e; rowe-8080x=f; rowe-08080=g"), "");
  EXPECT_EQ(token_of("Cookie: ROWE-8080=abc"), "") << "names of cookies have a case";
  EXPECT_EQ(token_of("Cookie: rowe-8080"), "");
  EXPECT_EQ(token_of("Cookie: rowe-8080="), "");
  EXPECT_EQ(token_of("Cookie: ;;;=;=;;rowe-8080=abc;"), "abc");
  EXPECT_EQ(token_of("Cookie:"), "");
  EXPECT_EQ(token_of("Cookie: a=1\r\nCookie: rowe-8080=abc\r\ncookie: b=2"), "abc");
  EXPECT_EQ(token_of("Cookie: rowe-8080=\"abc\""), "\"abc\"") << "the quotes belong to the value";
  EXPECT_EQ(token_of("Cookie: rowe-8080=a=b"), "a=b");
}

TEST(cookie, that_is_there_twice_is_none) {
  EXPECT_EQ(token_of("Cookie: rowe-8080=abc; rowe-8080=def"), "");
  EXPECT_EQ(token_of("Cookie: rowe-8080=abc; rowe-8080=abc"), "");
  EXPECT_EQ(token_of("Cookie: rowe-8080=abc\r\nCookie: rowe-8080=def"), "");
}

TEST(cookie, under_tls_is_one_that_was_set_under_tls) {
  EXPECT_EQ(token_of("Cookie: __Host-rowe-8080=abc", true), "abc");
  EXPECT_EQ(token_of("Cookie: rowe-8080=abc", true), "");
  EXPECT_EQ(token_of("Cookie: rowe-8080=evil; __Host-rowe-8080=abc", true), "abc");
  EXPECT_EQ(token_of("Cookie: rowe-8080=evil; __Host-rowe-8080=abc"), "abc") << "a proxy has the TLS";
  EXPECT_EQ(token_of("Cookie: __host-rowe-8080=abc", true), "");
}

TEST(cookie, comes_after_whatever_was_shown_on_purpose) {
  EXPECT_EQ(token_of("Cookie: rowe-8080=abc\r\nAuthorization: Bearer def"), "def");
  EXPECT_EQ(token_of("Cookie: rowe-8080=abc\r\nAuthorization: Basic def"), "abc");
  EXPECT_EQ(token_of("Cookie: rowe-8080=abc\r\nSec-WebSocket-Protocol: rowe.v1, rowe.token.def"), "def");
}

TEST(cookie, may_fill_the_header_and_no_more) {
  const std::string request = upgrade({{"Cookie", "Cookie: rowe-8080=abc; a="}});
  std::string full = request;
  full.insert(request.find("a=") + 2, http_header_bytes_max - request.size(), 'x');
  EXPECT_EQ(judge_request(full, policy_at(8080)).token, "abc");
  full.insert(request.find("a=") + 2, "x");
  EXPECT_TRUE(refused(full, 431, "larger than 4096 bytes", "delete the cookies"));
  std::string many = "Cookie: rowe-8080=abc";
  for (int i = 0; i < 1500; ++i) many += ";a"; // no quadratic time, and none is kept
  EXPECT_EQ(token_of(many), "abc");
}

TEST(write_login_answer, sets_the_cookie_and_takes_it_away) {
  std::array<char, login_answer_bytes_max> out;
  http_judgement j;
  handshake_policy policy = policy_at(8080);
  const std::string token(128, 'x');
  EXPECT_EQ(write_login_answer(out, j, "abc", policy),
            "HTTP/1.1 303 See Other\r\nLocation: /\r\nSet-Cookie: rowe-8080=abc; Path=/; HttpOnly; "
            "SameSite=Strict\r\nContent-Length: 0\r\nConnection: close\r\nCache-Control: no-store\r\n"
            "X-Content-Type-Options: nosniff\r\n\r\n");
  j.secure_cookie = true;
  EXPECT_NE(write_login_answer(out, j, token, policy)
                .find("\r\nSet-Cookie: __Host-rowe-8080=" + token +
                      "; Path=/; HttpOnly; SameSite=Strict; Secure\r\n"),
            std::string_view::npos);
  const std::string_view ended = write_login_answer(out, j, "", policy);
  EXPECT_NE(ended.find("\r\nSet-Cookie: __Host-rowe-8080=; Path=/; HttpOnly; SameSite=Strict; Secure; "
                       "Max-Age=0\r\n"),
            std::string_view::npos);
  EXPECT_NE(ended.find("\r\nLocation: /rowe/login\r\n"), std::string_view::npos);
  EXPECT_EQ(write_login_answer(std::span{out}.first(100), j, token, policy), "");
  std::array<char, http_clean_bytes_max> clean;
  j.outcome = http_outcome::form;
  EXPECT_EQ(write_clean_request(clean, j), "") << "no library sees a form";
}

} // namespace
} // namespace http_login_test
} // namespace rowe::wire::test
