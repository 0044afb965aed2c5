// SPDX-License-Identifier: Apache-2.0
// Every code of ROWE_ERRORS, provoked by a program that uses nothing but the public interface. The table is
// made from that list, so a code that nobody can provoke does not compile.
#include <gtest/gtest.h>

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <rowe/recording.hpp>
#include <rowe/ros_type.hpp>

#include "endpoints.hpp"

struct errors_test_request {
  int n;
};
struct errors_test_reply {
  std::int8_t n;
  rowe::fixed_string<2> text;
};
template <>
inline constexpr auto rowe::schema<errors_test_request> = rowe::fields<&errors_test_request::n>{};
template <>
inline constexpr auto rowe::schema<errors_test_reply> =
    rowe::fields<&errors_test_reply::n, &errors_test_reply::text>{};

namespace errors_test {
namespace {

using namespace endpoints;
using rowe::errc;
using rowe::error;
using rowe::json_text;

// Where this machine does not let a row do what it must.
struct out_of_reach : std::runtime_error {
  using std::runtime_error::runtime_error;
};

template <class Result>
error of(const Result& result) {
  if (result) throw std::logic_error{"no error"};
  return result.error();
}

rowe::endpoint alone(rowe::endpoint_options options = quick()) {
  return rowe::endpoint::listen(0, options).value();
}
rowe::endpoint with(auto change) {
  auto options = quick();
  change(options.limits);
  return alone(options);
}

error of_sending(std::string_view text) {
  auto endpoint = alone();
  return of(endpoint.send(text, 0ns));
}

// What a caller is told of a reply with this text.
error of_reading(std::string_view reply) {
  auto endpoint = alone();
  auto provides = endpoint.serve<json_text, json_text>("/n").value();
  auto calls = endpoint.client<errors_test_request, errors_test_reply>("/n").value();
  (void)calls.start({1}, timeout, rowe::rt::monotonic_clock::now()).value();
  auto asked = provides.next(timeout);
  (void)provides.reply(*asked, reply); // an object: what is wrong with it is the caller's to say
  for (;;) {
    if (const auto ended = calls.try_finish()) return of(ended->reply);
    std::this_thread::yield();
  }
}

// In a child process in which no thread can be made: its calls of clone() and clone3() fail with EAGAIN, as
// where a limit on threads is met, which does not bind root. Returns the child's exit status.
int in_a_child_without_threads(int (*what)()) {
  const pid_t child = ::fork();
  if (child == 0) {
    constexpr auto number = static_cast<std::uint32_t>(offsetof(seccomp_data, nr));
    std::array filter{
        sock_filter BPF_STMT(BPF_LD | BPF_W | BPF_ABS, number),
        sock_filter BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_clone, 1, 0),
        sock_filter BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_clone3, 0, 1),
        sock_filter BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EAGAIN),
        sock_filter BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    };
    sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
    const bool filtered = ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
                          ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0) == 0;
    ::_exit(filtered ? what() : 255);
  }
  int status = 0;
  if (child < 0 || ::waitpid(child, &status, 0) != child || !WIFEXITED(status)) return 255;
  return WEXITSTATUS(status);
}

namespace provoked {

error full() {
  auto endpoint = alone();
  auto lane = endpoint.open_lane({.depth = 1, .calls = 1}).value();
  for (;;) { // they wait for a peer, first in the endpoint's slots, then in the lane
    const auto sent = lane.try_send("{}", rowe::rt::for_ever);
    if (!sent) return sent.error();
  }
}
error empty() {
  auto endpoint = alone();
  return of(endpoint.open_lane().value().try_receive());
}
error no_peer() {
  auto endpoint = alone();
  return of(endpoint.advertise<json_text>("/x").value().publish("{}"));
}
error closed() {
  auto endpoint = alone();
  (void)endpoint.close(); // nothing is there to be written
  return of(endpoint.send("{}", timeout));
}
error timed_out() {
  auto endpoint = alone();
  return of(endpoint.receive(1ms));
}
error too_big() { return of_sending(std::string(5000, ' ')); }
error malformed() { return of_sending(R"({"a":01})"); }
error too_deep() { return of_sending(R"({"a":)" + std::string(64, '[') + std::string(64, ']') + "}"); }
error bad_argument() {
  auto options = quick();
  options.poll_period = 0ns;
  return of(rowe::endpoint::listen(0, options));
}
error bad_url() { return of(rowe::endpoint::connect("http://localhost", quick())); }
error bad_address() {
  auto options = quick();
  options.address = "no address";
  return of(rowe::endpoint::listen(0, options));
}
error address_in_use() {
  const auto first = alone();
  return of(rowe::endpoint::listen(first.port(), quick()));
}
error not_loopback() {
  auto options = quick();
  options.address = "0.0.0.0";
  return of(rowe::endpoint::listen(0, options));
}
error bad_access() {
  auto options = quick();
  options.access.local_role = "pilot";
  return of(rowe::endpoint::listen(0, options));
}
error bad_certificate() {
  auto options = quick();
  options.tls.certificate = "/nowhere/certificate.pem";
  return of(rowe::endpoint::listen(0, options));
}
error bad_web() {
  auto options = quick();
  options.web = "/nowhere";
  return of(rowe::endpoint::listen(0, options));
}
error bad_recording() { return of(rowe::recording_reader::open("/nowhere/run.mcap")); }
error bad_definition() { return of(rowe::ros_type::parse("a/A", "float x", rowe::ros_version::ros1)); }
error bad_message() {
  const auto type = rowe::ros_type::parse("a/A", "float32 x", rowe::ros_version::ros1).value();
  std::string json;
  return of(type.to_json(rowe::ros_encoding::ros1, "abc", json, 100));
}
error bad_config() { return of(rowe::endpoint_options::from_file("/dev/null/rowe.toml")); }
error too_many_handles() {
  auto endpoint = with([](rowe::limits& l) { l.handles_max = 1; });
  const auto first = endpoint.open_lane().value();
  return of(endpoint.open_lane());
}
error too_many_topics() {
  auto endpoint = with([](rowe::limits& l) { l.topics_max = 3; }); // /rowe/stats and /rowe/stop/state
  const auto first = endpoint.advertise<json_text>("/x").value();
  return of(endpoint.advertise<json_text>("/y"));
}
error handle_memory() {
  auto endpoint = with([](rowe::limits& l) { l.handle_bytes = 4096; });
  return of(endpoint.open_lane());
}
error reserved_topic() {
  auto endpoint = alone();
  return of(endpoint.advertise<json_text>("/rowe/stats"));
}
error type_conflict() {
  auto endpoint = alone();
  const auto first = endpoint.advertise<json_text>("/x", {.type = "a/A"}).value();
  return of(endpoint.advertise<json_text>("/x", {.type = "b/B"}));
}
error no_memory() {
  auto options = quick();
  options.limits.message_bytes_max = 1U << 26;
  options.limits.large_slots = 1U << 20;
  return of(rowe::endpoint::listen(0, options));
}
error no_thread() {
  const int status = in_a_child_without_threads([] {
    const auto made = rowe::endpoint::listen(0, quick());
    return made || made.error().value != EAGAIN ? 254 : static_cast<int>(made.code());
  });
  if (status == 255) throw out_of_reach{"no seccomp filters here, so threads cannot be made to fail"};
  return {static_cast<errc>(status)};
}
error expired() { return of_sending("{}"); }
error peer_lost() {
  auto endpoint = alone();
  return of(endpoint.send("{}", timeout, {0, 1}));
}
error no_service() {
  auto endpoint = alone();
  return of(endpoint.client<errors_test_request, errors_test_reply>("/none").value().call({1}, timeout));
}
error refused() {
  auto endpoint = alone();
  auto provides = endpoint.serve<errors_test_request, errors_test_reply>("/n").value();
  auto calls = endpoint.client<errors_test_request, errors_test_reply>("/n").value();
  (void)calls.start({1}, timeout, rowe::rt::monotonic_clock::now()).value();
  (void)provides.next(timeout).value(); // which refuses what is dropped
  for (;;) {
    if (const auto ended = calls.try_finish()) return of(ended->reply);
    std::this_thread::yield();
  }
}
error too_many_calls() {
  auto endpoint = alone();
  auto lane = endpoint.open_lane({.calls = 1}).value();
  const auto now = rowe::rt::monotonic_clock::now();
  (void)lane.start("{}", timeout, now).value();
  return of(lane.start("{}", timeout, now));
}
error too_many_services() {
  auto endpoint = with([](rowe::limits& l) { l.services_max = 1; });
  const auto first = endpoint.serve<json_text, json_text>("/x").value();
  return of(endpoint.serve<json_text, json_text>("/y"));
}
error too_many_latches() {
  auto endpoint = alone();
  std::vector<rowe::stop_latch> latches;
  for (;;) {
    auto one = endpoint.stop_latch();
    if (!one) return of(one);
    latches.push_back(std::move(*one));
  }
}
error too_many_recordings() {
  auto endpoint = alone();
  const std::string path = testing::TempDir() + "rowe-too-many-" + std::to_string(::getpid());
  std::vector<rowe::recorder> all;
  for (int i = 0;; ++i) {
    auto one = endpoint.record({.file = {.path = path + "/", .buffer_bytes = 1 << 20}});
    if (one) {
      all.push_back(std::move(*one));
      continue;
    }
    all.clear();
    std::filesystem::remove_all(path);
    return one.error();
  }
}
error too_many_leases() {
  auto endpoint = alone();
  std::vector<rowe::subscriber<errors_test_request>> commands;
  for (int i = 0;; ++i) {
    auto one = endpoint.subscribe<errors_test_request>("/n" + std::to_string(i), {.lease = 300ms});
    if (!one) return of(one);
    commands.push_back(std::move(*one));
  }
}
error parameter_taken() {
  auto endpoint = alone();
  const auto first = endpoint.parameter<bool>("/x", true).value();
  return of(endpoint.parameter<int>("x", 1));
}
error too_many_parameters() {
  auto endpoint = with([](rowe::limits& l) { l.parameters_max = 1; });
  const auto first = endpoint.parameter<bool>("/x", true).value();
  return of(endpoint.parameter<bool>("/y", true));
}
error service_taken() {
  auto endpoint = alone();
  const auto first = endpoint.serve<json_text, json_text>("/x").value();
  return of(endpoint.serve<json_text, json_text>("x"));
}
error not_an_object() { return of_sending("[]"); }
error reserved_member() { return of_sending(R"({"op":1})"); }
error missing_member() { return of_reading(R"({"n":1})"); }
error duplicate_member() { return of_reading(R"({"n":1,"n":1,"text":""})"); }
error wrong_type() { return of_reading(R"({"n":"1","text":""})"); }
error out_of_range() { return of_reading(R"({"n":128,"text":""})"); }
error too_long() { return of_reading(R"({"n":1,"text":"abc"})"); }
error forked() {
  auto endpoint = alone();
  auto lane = endpoint.open_lane().value();
  const pid_t child = ::fork();
  if (child == 0) ::_exit(static_cast<int>(lane.try_send("{}", 1s).code()));
  int code = 0;
  if (::waitpid(child, &code, 0) != child || !WIFEXITED(code)) throw std::logic_error{"no child"};
  return error{static_cast<errc>(WEXITSTATUS(code))};
}
error not_utf8() { return of(alone().advertise<json_text>("/a\xff")); }
error control_character() { return of(alone().advertise<json_text>("/a\n")); }
error misuse() {
  auto endpoint = alone();
  auto lane = endpoint.open_lane().value();
  const rowe::lane moved{std::move(lane)};
  return of(lane.try_send("{}", 1s)); // NOLINT(bugprone-use-after-move): that is the point
}

} // namespace provoked

struct row {
  errc code;
  error (*provoke)();
};
constexpr row table[] = {
#define ROWE_ERROR_ROW(name, text) {errc::name, provoked::name},
    ROWE_ERRORS(ROWE_ERROR_ROW)
#undef ROWE_ERROR_ROW
};

class errors : public ::testing::TestWithParam<row> {};
INSTANTIATE_TEST_SUITE_P(all, errors, ::testing::ValuesIn(table),
                         [](const auto& one) { return std::string{error{one.param.code}.name()}; });

TEST_P(errors, can_be_met_and_say_what_they_mean) try {
  const error met = GetParam().provoke();
  EXPECT_EQ(met.name(), error{GetParam().code}.name());
  const std::string diagnostic = met.message();
  EXPECT_GT(diagnostic.size(), 10U);
  EXPECT_EQ(diagnostic.find('%'), std::string::npos) << diagnostic;
} catch (const out_of_reach& why) {
  GTEST_SKIP() << why.what(); // of no_thread alone, where the kernel has no seccomp to refuse one
}

} // namespace
} // namespace errors_test
