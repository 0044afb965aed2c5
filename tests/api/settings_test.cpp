// SPDX-License-Identifier: Apache-2.0
// Settings: a file, the environment and a command line put together.
#include <rowe/recording.hpp>
#include <rowe/settings.hpp>

#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <rowe/rowe.hpp>

#include "rt/folder.hpp"
#include "variable.hpp"

namespace settings_test {
namespace {

using namespace std::chrono_literals;
using rowe::errc;
using rowe::setting_source;
using rowe::settings;

// A file of this text, as long as the object lives.
class toml {
 public:
  explicit toml(const std::string& text, mode_t mode = 0600) : path_{in_.put("rowe.toml", text, mode)} {}
  const std::string& path() const { return path_; }
  std::string at(int line) const { return path_ + ":" + std::to_string(line) + ": "; }

 private:
  const rowe::tests::folder in_;
  const std::string path_;
};

// What is wrong with a file, by reading it or by checking it.
struct verdict {
  std::string why;
  std::int64_t line = 0;
};
verdict judge(const toml& file) {
  settings chosen;
  verdict found;
  rowe::status done = chosen.read_file(file.path(), &found.why);
  if (done) done = chosen.check(&found.why);
  if (done) return {};
  EXPECT_EQ(done.code(), errc::bad_config);
  found.line = done.error().value;
  return found;
}

const std::string hash_a(64, 'a');

TEST(a_file, sets_the_options_of_an_endpoint) {
  const toml file{R"([endpoint]
name = "ang-01"
address = "0.0.0.0"
port = 9000
insecure = true
idle = "wake"
poll_period = "500 us"
inbound_ttl = "forever"
allow_hosts = ["ang-01.local"]

[limits]
topics_max = 256
handle_bytes = 3_000_000

[stop]
guard_timeout = "1 s"
unguarded = true

[access]
local_role = "driver"

[[role]]
name = "driver"
publish = ["/cmd_vel"]
guard = true

[[identity]]
name = "anna"
role = "supervisor"
token_sha256 = ")" +
                  hash_a + "\"\n"};
  std::string why;
  const auto options = rowe::endpoint_options::from_file(file.path(), &why);
  ASSERT_TRUE(options) << why;
  EXPECT_EQ(options->name, "ang-01");
  EXPECT_EQ(options->address, "0.0.0.0");
  EXPECT_EQ(options->port, 9000);
  EXPECT_TRUE(options->insecure);
  EXPECT_EQ(options->idle_policy, rowe::idle::wake);
  EXPECT_EQ(options->poll_period, 500us);
  EXPECT_EQ(options->inbound_ttl, rowe::rt::for_ever);
  EXPECT_EQ(options->allow_hosts, std::vector<std::string>{"ang-01.local"});
  EXPECT_EQ(options->limits.topics_max, 256U);
  EXPECT_EQ(options->limits.handle_bytes, 3'000'000U);
  EXPECT_EQ(options->stop.guard_timeout, 1s);
  EXPECT_TRUE(options->stop.unguarded);
  EXPECT_EQ(options->access.local_role, "driver");
  ASSERT_EQ(options->access.roles.size(), 1U);
  EXPECT_EQ(options->access.roles[0].publish, std::vector<std::string>{"/cmd_vel"});
  EXPECT_TRUE(options->access.roles[0].guard);
  ASSERT_EQ(options->access.identities.size(), 1U);
  EXPECT_EQ(options->access.identities[0].token_sha256, hash_a);
  EXPECT_EQ(options->silence_max, rowe::endpoint_options{}.silence_max); // not said
}

TEST(a_file, says_what_is_recorded) {
  const toml file{R"([record]
path = "all/"
topics = ["/odom", "/arm/**"]
compression = "zstd"
split_size = "1 GiB"
split_time = "10 m"
total = 50_000_000_000
sync = true

[black_box]
path = "/var/lib/robot"
exclude = ["/camera/*"]
before = "1 m"
memory = "8 MiB"
on_lease = false
)"};
  rowe::settings chosen;
  std::string why;
  ASSERT_TRUE(chosen.read_file(file.path(), &why)) << why;
  EXPECT_TRUE(chosen.check(&why)) << why;
  const auto all = rowe::recordings_of(chosen.values());
  ASSERT_EQ(all.size(), 2U);
  const rowe::recording_options& plain = all[0].file;
  EXPECT_EQ(plain.path, file.path().substr(0, file.path().rfind('/') + 1) + "all/");
  EXPECT_EQ(all[0].topics, (std::vector<std::string>{"/odom", "/arm/**"}));
  EXPECT_EQ(plain.packed, rowe::compression::zstd);
  EXPECT_EQ(plain.split_bytes, 1U << 30);
  EXPECT_EQ(plain.split_time, 10min);
  EXPECT_EQ(plain.total_bytes, 50'000'000'000U);
  EXPECT_TRUE(plain.sync);
  EXPECT_EQ(plain.black_box.before, 0s);
  const rowe::recording_options& box = all[1].file;
  EXPECT_EQ(box.path, "/var/lib/robot/");
  EXPECT_EQ(all[1].exclude, std::vector<std::string>{"/camera/*"});
  EXPECT_EQ(box.black_box.before, 1min);
  EXPECT_EQ(box.black_box.after, 5s);
  EXPECT_EQ(box.black_box.bytes, 8U << 20);
  EXPECT_TRUE(box.black_box.on_stop);
  EXPECT_FALSE(box.black_box.on_lease);
  EXPECT_TRUE(rowe::recordings_of({}).empty());
}

TEST(an_endpoint, listens_where_its_options_say) {
  const toml file{"[endpoint]\nport = 0\n"};
  const auto options = rowe::endpoint_options::from_file(file.path());
  ASSERT_TRUE(options);
  const auto robot = rowe::endpoint::listen(*options);
  ASSERT_TRUE(robot) << robot.error().message();
  EXPECT_NE(robot->port(), 0);
}

// A token's file is like one of TOML: a text and a mode.
TEST(an_endpoint, that_connects_shows_the_token_of_the_file_that_its_options_name) {
  const toml token{"the-token-of-rowan-and-oak\nnot this line\n"};
  rowe::endpoint_options asked;
  asked.port = 0;
  asked.access.identities = {{"rowan", "peer", rowe::hash_token("the-token-of-rowan-and-oak")}};
  auto hub = rowe::endpoint::listen(asked);
  ASSERT_TRUE(hub) << hub.error().message();
  const toml file{"[client]\ntoken_file = \"" + token.path() + "\"\n"};
  std::string why;
  const auto options = rowe::endpoint_options::from_file(file.path(), &why);
  ASSERT_TRUE(options) << why;
  auto robot = rowe::endpoint::connect("ws://127.0.0.1:" + std::to_string(hub->port()), *options);
  ASSERT_TRUE(robot) << robot.error().message();
  ASSERT_TRUE(robot->wait_peer(10s));
  ASSERT_TRUE(hub->wait_peer(10s));
  EXPECT_EQ(hub->connections().front().identity, "rowan");
}

TEST(what_a_client_needs, is_checked_with_the_rest) {
  const toml readable{"the-token-of-rowan-and-oak\n", 0644};
  const toml short_one{"too-short\n"};
  const auto fault_of = [](const std::string& line) {
    const toml file{"[client]\n" + line + "\n"};
    std::string why = judge(file).why;
    if (why.starts_with(file.at(2))) why.erase(0, file.at(2).size());
    return why;
  };
  const std::string key = "client.token_file: ";
  EXPECT_EQ(fault_of("token_file = \"" + readable.path() + '"'),
            key + readable.path() + ": others can read it (mode 0644): chmod 600");
  EXPECT_EQ(fault_of("token_file = \"" + short_one.path() + '"'),
            key + short_one.path() +
                ": its first line is not a token: 16 to 128 letters, digits and - . _ ~");
  EXPECT_EQ(fault_of("token_file = \"/nowhere/token\""), key + "/nowhere/token: No such file or directory");
  EXPECT_EQ(fault_of("ca = \"/nowhere/root.pem\""),
            "client.ca: /nowhere/root.pem: No such file or directory");
  EXPECT_EQ(fault_of("pin = \"12\""), "client.pin \"12\": it must be 64 hexadecimal digits");

  rowe::endpoint_options both;
  both.token = "the-token-of-rowan-and-oak";
  both.token_file = readable.path();
  EXPECT_EQ(rowe::endpoint::connect("ws://127.0.0.1:1", both).code(), errc::bad_access);
  both.token = "";
  EXPECT_EQ(rowe::endpoint::connect("ws://127.0.0.1:1", both).code(), errc::bad_access);
}

TEST(what_is_wrong_in_a_file, is_told_with_file_line_key_value_and_what_is_allowed) {
  const toml file{
      "[endpoint]\nport = 70000\npage = \"yes\"\nidle = \"sleep\"\nprot = 1\npoll_period = \"20 us\"\n"
      "allow_hosts = [\"a\", 5]\nname = 5\n[limit]\n[limits]\ntopics_max = 1.5\n"};
  const verdict found = judge(file);
  EXPECT_EQ(found.line, 2);
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < found.why.size();) {
    const auto end = std::min(found.why.find('\n', at), found.why.size());
    lines.push_back(found.why.substr(at, end - at));
    at = end + 1;
  }
  ASSERT_EQ(lines.size(), 9U) << found.why;
  EXPECT_EQ(lines[0], file.at(2) + "endpoint.port is out of range: 70000 (0 to 65535)");
  EXPECT_EQ(lines[1], file.at(3) + "endpoint.page needs true or false, not \"yes\"");
  EXPECT_EQ(lines[2], file.at(4) + "endpoint.idle needs poll, spin, wake or phase, not \"sleep\"");
  EXPECT_TRUE(lines[3].starts_with(file.at(5) + "endpoint.prot is no key; there are name, address, port, "));
  EXPECT_EQ(lines[4], file.at(6) + "endpoint.poll_period is out of range: 20 us (50 us to 10 ms)");
  EXPECT_EQ(lines[5], file.at(7) + "endpoint.allow_hosts needs a list of texts, not one with 5");
  EXPECT_EQ(lines[6], file.at(8) + "endpoint.name needs a text, not 5");
  EXPECT_EQ(lines[7], file.at(9) +
                          "limit is no section; there are [endpoint], [tls], [client], [stop], [access], "
                          "[limits], [record], [black_box], [serve], [[role]] and [[identity]]");
  EXPECT_EQ(lines[8], file.at(11) + "limits.topics_max needs a whole number, not the real number 1.5 "
                                    "(3 to 1048576)");
}

TEST(what_is_wrong_in_a_file, is_told_at_most_twenty_times_and_counted_however_much_it_is) {
  for (const int mistakes : {30, 5000}) {
    std::string text = "[endpoint]\n";
    for (int i = 0; i < mistakes; ++i) text += "x" + std::to_string(i) + " = 1\n";
    const std::string why = judge(toml{text}).why;
    EXPECT_EQ(std::count(why.begin(), why.end(), '\n'), 20);
    EXPECT_TRUE(why.ends_with("\nand " + std::to_string(mistakes - 20) + " more mistakes"));
  }
}

TEST(what_is_wrong_together, is_told_with_the_line_of_the_value) {
  const toml tick{"[stop]\nguard_timeout = \"100 ms\"\ntick = \"60 ms\"\n"};
  EXPECT_EQ(judge(tick).why,
            tick.at(3) + "stop.tick is out of range: \"60 ms\" (at most \"50 ms\": half of guard_timeout "
                         "at most)");
  const toml silence{"[endpoint]\nsilence_max = \"1 s\"\n"};
  EXPECT_EQ(judge(silence).why, silence.at(2) +
                                    "endpoint.silence_max is out of range: \"1 s\" (at least \"3 s\": "
                                    "ping_period or more)");
  const toml slots{"[limits]\nsmall_slot_bytes = 4096\nmessage_bytes_max = 2048\n"};
  EXPECT_EQ(judge(slots).why, slots.at(2) + "limits.small_slot_bytes is out of range: 4096 (at most 2048: "
                                            "message_bytes_max at most)");
  const toml open{"[endpoint]\n\naddress = \"0.0.0.0\"\n"};
  EXPECT_EQ(judge(open).why,
            open.at(3) +
                "endpoint.address is \"0.0.0.0\", where everyone who reaches it may "
                "read and publish: that needs a certificate and identities, or insecure = true (--insecure)");
  EXPECT_EQ(judge(open).line, 3);
  const toml name{"[endpoint]\naddress = \"robot.local\"\n"};
  EXPECT_EQ(judge(name).why, name.at(2) + "endpoint.address needs a numeric address such as \"127.0.0.1\" or "
                                          "\"::\", not \"robot.local\"");
  const toml total{"[record]\ntotal = \"1 KiB\"\n"};
  EXPECT_EQ(judge(total).why, total.at(2) + "record.total is out of range: 1 KiB (1 MiB or more, or 0)");
  const toml guarded{"[serve]\nguarded = true\n"};
  EXPECT_EQ(judge(guarded).why, guarded.at(2) + "serve.guarded is for the robot of serve.demo, or --demo");
}

TEST(what_is_wrong_together, is_told_all_at_once) {
  const toml file{"[endpoint]\naddress = \"x\"\nsilence_max = \"1 s\"\nweb = \"/nowhere/site\"\n"
                  "[stop]\nguard_timeout = \"100 ms\"\ntick = \"60 ms\"\n"
                  "[tls]\ncertificate = \"/nowhere/c.pem\"\nkey = \"/nowhere/key.pem\"\n"
                  "[client]\nca = \"/nowhere/root.pem\"\npin = \"12\"\ntoken_file = \"/nowhere/token\"\n"
                  "[access]\nlocal_role = \"captain\"\n"
                  "[[role]]\nname = \"a b\"\n"
                  "[[identity]]\nname = \"anna\"\nrole = \"pilot\"\ntoken_sha256 = \"12\"\n"
                  "[[identity]]\nname = \"bob\"\nrole = \"driver\"\ntoken_sha256 = \"12\"\n"
                  "[[identity]]\nname = \"eve\"\nrole = \"driver\"\ncertificate = \"eve\"\n"};
  const std::vector<std::pair<int, std::string>> told = {{2, "endpoint.address needs a numeric"},
                                                         {3, "endpoint.silence_max is out of range"},
                                                         {4, "endpoint.web: /nowhere/site"},
                                                         {7, "stop.tick is out of range"},
                                                         {9, "tls.certificate: /nowhere/c.pem"},
                                                         {12, "client.ca: /nowhere/root.pem"},
                                                         {13, "client.pin \"12\""},
                                                         {14, "client.token_file: /nowhere/token"},
                                                         {16, "local_role: there is no role"},
                                                         {17, "role `a b`: a name has"},
                                                         {19, "identity `anna`: there is no"},
                                                         {23, "identity `bob`: the hash of a token"},
                                                         {27, "identity `eve` has only a certificate"}};
  std::istringstream lines{judge(file).why};
  std::string line;
  for (const auto& [number, says] : told) {
    std::getline(lines, line);
    EXPECT_TRUE(line.starts_with(file.at(number) + says)) << line << " is not " << number << ": " << says;
  }
  EXPECT_FALSE(std::getline(lines, line)) << line;
}

TEST(roles_and_identities, that_are_wrong_are_told_with_their_line) {
  const toml unknown{"[[identity]]\nname = \"anna\"\nrole = \"pilot\"\ntoken_sha256 = \"" + hash_a + "\"\n"};
  EXPECT_EQ(judge(unknown).why, unknown.at(1) +
                                    "identity `anna`: there is no role `pilot`; there are observer, "
                                    "driver, supervisor, peer");
  const toml twice{"[[role]]\nname = \"a\"\n[[role]]\nname = \"a\"\n"};
  EXPECT_EQ(judge(twice).why,
            "access: there is no identity, so everyone may do everything: roles, local_role "
            "and anonymous_may_stop have no effect\n" +
                twice.at(3) + "role `a` is defined twice");
  const toml local{"[access]\nlocal_role = \"pilot\"\n[[identity]]\nname = \"anna\"\nrole = \"peer\"\n"
                   "token_sha256 = \"" +
                   hash_a + "\"\n"};
  EXPECT_TRUE(judge(local).why.starts_with(local.at(2) + "local_role: there is no role `pilot`"));
  const toml key{"[[role]]\nname = \"a\"\nsubcribe = []\n"};
  EXPECT_EQ(judge(key).why, key.at(3) +
                                "role.subcribe is no key; there are name, subscribe, publish, advertise, "
                                "call, provide, set, reset, guard, take_over");
  const toml plain{"[role]\nname = \"a\"\n"};
  EXPECT_EQ(judge(plain).why, plain.at(1) + "role needs tables: each begins with [[role]]");
}

TEST(a_file_with_identities, is_refused_where_others_may_write_it) {
  const std::string anna =
      "[[identity]]\nname = \"anna\"\nrole = \"peer\"\ntoken_sha256 = \"" + hash_a + "\"\n";
  const toml shared{anna, 0664};
  EXPECT_EQ(judge(shared).why,
            shared.path() + ": a file with identities may be written by its owner only (chmod go-w)");
  EXPECT_EQ(judge(toml{anna, 0644}).why, "");
  EXPECT_EQ(judge(toml{"[endpoint]\nport = 1\n", 0666}).why, "");
}

TEST(of_several_values, the_command_line_holds_before_the_environment_before_the_file) {
  const toml file{"[endpoint]\nname = \"file\"\nport = 1\ncpu = 2\n\n[limits]\ncalls_max = 9\n"};
  const variable name{"ROWE_ENDPOINT_NAME", "environment"};
  const variable port{"ROWE_ENDPOINT_PORT", "3"};
  const variable topics{"ROWE_LIMITS_TOPICS_MAX", "300"};
  const variable hosts{"ROWE_ENDPOINT_ALLOW_HOSTS", "a.local,b.local"};
  settings chosen;
  std::string why;
  const std::vector<std::string> texts{"command line"};
  ASSERT_TRUE(chosen.set("endpoint", "name", texts, "--name", &why)) << why; // in any order
  ASSERT_TRUE(chosen.read_environment(&why)) << why;
  ASSERT_TRUE(chosen.read_file(file.path(), &why)) << why;
  ASSERT_TRUE(chosen.set_default("endpoint", "priority", "70"));
  ASSERT_TRUE(chosen.set_default("endpoint", "cpu", "70"));
  const rowe::endpoint_options& options = chosen.values().endpoint;
  EXPECT_EQ(options.name, "command line");
  EXPECT_EQ(options.port, 3);
  EXPECT_EQ(options.service_cpu, 2);
  EXPECT_EQ(options.service_priority, 70);
  EXPECT_EQ(options.limits.calls_max, 9U);
  EXPECT_EQ(options.limits.topics_max, 300U);
  EXPECT_EQ(options.allow_hosts, (std::vector<std::string>{"a.local", "b.local"}));
  EXPECT_EQ(chosen.source_of("endpoint", "name"), setting_source::command_line);
  EXPECT_EQ(chosen.source_of("endpoint", "priority"), setting_source::fallback);
  std::vector<std::string> origins;
  for (const rowe::setting& one : chosen.list()) {
    if (one.origin != "default")
      origins.push_back(one.section + "." + one.name + " = " + one.value + " # " + one.origin);
  }
  EXPECT_EQ(origins, (std::vector<std::string>{
                         "endpoint.name = \"command line\" # --name",
                         "endpoint.port = 3 # ROWE_ENDPOINT_PORT",
                         "endpoint.allow_hosts = [\"a.local\", \"b.local\"] # ROWE_ENDPOINT_ALLOW_HOSTS",
                         "endpoint.cpu = 2 # " + file.path() + ":4",
                         "limits.topics_max = 300 # ROWE_LIMITS_TOPICS_MAX",
                         "limits.calls_max = 9 # " + file.path() + ":7",
                     }));
}

TEST(variables, that_are_wrong_are_named) {
  const variable port{"ROWE_ENDPOINT_PORT", "many"};
  const variable prot{"ROWE_ENDPOINT_PROT", "1"};
  const variable former{"ROWE_LIMIT_TOPICS_MAX", "5"};
  const variable foreign{"ROWE_URL", "ws://127.0.0.1:1"};
  settings chosen;
  std::string why;
  const auto done = chosen.read_environment(&why);
  EXPECT_EQ(done.code(), errc::bad_config);
  EXPECT_NE(why.find("ROWE_ENDPOINT_PORT needs a whole number, not \"many\" (0 to 65535)"), why.npos) << why;
  EXPECT_NE(why.find("there is no variable ROWE_ENDPOINT_PROT; there are ROWE_ENDPOINT_NAME, "), why.npos);
  EXPECT_NE(why.find("ROWE_LIMIT_TOPICS_MAX sets nothing: limits are ROWE_LIMITS_..."), why.npos);
  EXPECT_EQ(why.find("ROWE_URL"), why.npos);
}

TEST(settings, that_hold_are_written_as_a_file_that_says_the_same) {
  const toml file{
      "[endpoint]\nname = \"a \\\"b\\\"\"\npoll_period = \"1.5 ms\"\nallow_hosts = [\"x\", \"y\"]\n"
      "[[role]]\nname = \"r\"\ncall = [\"/a\", \"/b\"]\n[[identity]]\nname = \"anna\"\nrole = \"r\"\n"
      "token_sha256 = \"" +
      hash_a + "\"\n"};
  const auto text_of = [](const settings& of) {
    std::string text;
    for (const rowe::setting& one : of.list()) {
      if (one.first_of_section) text += "[" + one.section + "]\n";
      text += one.name + " = " + one.value + "\n";
    }
    return text;
  };
  settings first, second;
  std::string why;
  ASSERT_TRUE(first.read_file(file.path(), &why)) << why;
  const toml again{text_of(first)};
  ASSERT_TRUE(second.read_file(again.path(), &why)) << why << text_of(first);
  EXPECT_EQ(text_of(second), text_of(first));
  EXPECT_TRUE(second.check(&why)) << why;
}

TEST(a_file, that_cannot_be_read_is_named) {
  std::string why;
  EXPECT_EQ(rowe::endpoint_options::from_file("/nowhere/rowe.toml", &why).code(), errc::bad_config);
  EXPECT_EQ(why, "/nowhere/rowe.toml: the file cannot be read: No such file or directory");
  EXPECT_EQ(judge(toml{"a = 1\nb ="}).line, 2);
}

// What check() says is what listen() says.
TEST(a_check, judges_as_the_endpoint_itself_does) {
  for (const char* const text :
       {"[endpoint]\naddress = \"0.0.0.0\"\n", "[endpoint]\naddress = \"x\"\n",
        "[endpoint]\nsilence_max = \"1 s\"\n", "[endpoint]\nretry_max = \"1 ms\"\n",
        "[stop]\ntick = \"1 s\"\n", "[limits]\nsmall_slot_bytes = 65536\n",
        "[access]\nlocal_role = \"pilot\"\n", "[endpoint]\nport = 0\n", "[stop]\nunguarded = true\n"}) {
    const toml file{text};
    settings chosen;
    ASSERT_TRUE(chosen.read_file(file.path()));
    const bool opens{rowe::endpoint::listen(0, chosen.values().endpoint)};
    EXPECT_EQ(bool{chosen.check()}, opens) << text;
  }
}

TEST(a_check, of_access_is_about_roles_and_identities_alone) {
  const std::string anna =
      "[[identity]]\nname = \"anna\"\nrole = \"peer\"\ntoken_sha256 = \"" + hash_a + "\"\n";
  const auto why_of = [](const std::string& text) {
    const toml file{text};
    settings chosen;
    std::string why;
    EXPECT_TRUE(chosen.read_file(file.path(), &why)) << why;
    EXPECT_FALSE(chosen.check());
    if (!chosen.check_access(&why)) why.erase(0, file.path().size());
    return why;
  };
  for (const char* const other :
       {"[tls]\ncertificate = \"/nowhere/c.pem\"\n", "[client]\ntoken_file = \"/nowhere/token\"\n",
        "[endpoint]\nweb = \"/nowhere/site\"\n", "[endpoint]\naddress = \"x\"\n"}) {
    EXPECT_EQ(why_of(other + anna), "") << other;
  }
  EXPECT_EQ(why_of("[[identity]]\nname = \"anna\"\nrole = \"peer\"\ncertificate = \"anna\"\n"), "")
      << "nobody is asked for it, so it lets nobody in";
  EXPECT_EQ(why_of("[[identity]]\nname = \"anna\"\nrole = \"pilot\"\ntoken_sha256 = \"" + hash_a + "\"\n")
                .substr(0, 4),
            ":1: ");
}

TEST(a_file, has_another_version_when_it_is_written_to) {
  const toml file{"[endpoint]\n"};
  const auto before = rowe::file_version(file.path());
  EXPECT_EQ(rowe::file_version(file.path()), before);
  std::ofstream{file.path(), std::ios::app} << "port = 1\n";
  EXPECT_NE(rowe::file_version(file.path()), before);
  EXPECT_EQ(rowe::file_version(file.path() + ".none"), 0U);
}

} // namespace
} // namespace settings_test
