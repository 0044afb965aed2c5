// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/arguments/command_line.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace rowe::tools {
namespace command_line_test {
namespace {

using namespace std::chrono_literals;

// What reading the words says and shows.
struct reading {
  std::optional<exit_code> read(const command& table, std::vector<std::string> words) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    const auto end = tools::read(table, arguments);
    said = testing::internal::GetCapturedStderr();
    shown = testing::internal::GetCapturedStdout();
    return end;
  }
  std::string said;  // on stderr
  std::string shown; // on stdout
};

// A verb with one option of each kind.
struct fixture : reading {
  std::string url, topic, name;
  std::vector<std::string> origins;
  std::int64_t port = 8080;
  std::size_t idle = 0;
  std::optional<rt::duration> timeout;
  std::optional<double> frequency;
  std::vector<numbered_time> bounds;
  bool json = false;

  static constexpr std::array<std::string_view, 2> idle_names{"poll", "spin"};

  command table() {
    return {.verb = "try",
            .examples = {{{"rowe try A b", "first"}, {"rowe try A c", "second"}}},
            .description = "Tries.\n",
            .operands = {{"URL", "where", &url, "ROWE_TEST_URL"}, {"TOPIC", "what", &topic}},
            .options = {{"--port", "", "N", "a port", integer{&port, 0, 65535}},
                        {"--name", "", "NAME", "a name", &name},
                        {"--origin", "", "O", "an origin", &origins},
                        {"--idle", "", "poll|spin", "a policy", choice{&idle, idle_names}},
                        {"--timeout", "", "TIME", "a time", time_span{&timeout}},
                        {"--rate", "", "HZ", "a rate", rate{&frequency, 1000}},
                        {"--p", "", "TIME", "a bound", numbered_times{&bounds, 100}},
                        {"--json", "-j", "", "a switch", &json}}};
  }

  std::optional<exit_code> read(const std::vector<std::string>& words) {
    return reading::read(table(), words);
  }
};

TEST(command_line, reads_each_kind_of_option_and_the_operands_around_them) {
  fixture f;
  EXPECT_EQ(f.read({"--port", "0", "ws://h", "--name=a b", "--origin", "x", "--origin", "y", "/t", "--idle",
                    "spin", "--timeout", "50ms", "--rate", "1kHz", "-j"}),
            std::nullopt);
  EXPECT_EQ(f.url, "ws://h");
  EXPECT_EQ(f.topic, "/t");
  EXPECT_EQ(f.port, 0);
  EXPECT_EQ(f.name, "a b");
  EXPECT_EQ(f.origins, (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(f.idle, 1U);
  EXPECT_EQ(f.timeout, 50ms);
  EXPECT_EQ(f.frequency, 1000);
  EXPECT_TRUE(f.json);
}

TEST(command_line, leaves_defaults_alone) {
  fixture f;
  EXPECT_EQ(f.read({"u", "t"}), std::nullopt);
  EXPECT_EQ(f.port, 8080);
  EXPECT_EQ(f.timeout, std::nullopt);
  EXPECT_FALSE(f.json);
}

TEST(command_line, names_the_value_and_the_limit_of_what_is_out_of_range) {
  fixture f;
  EXPECT_EQ(f.read({"u", "t", "--port", "65536"}), exit_code::usage);
  EXPECT_NE(f.said.find("--port 65536 is out of range: 0 to 65535"), std::string::npos) << f.said;
  EXPECT_EQ(f.read({"u", "t", "--rate", "2kHz"}), exit_code::usage);
  EXPECT_NE(f.said.find("--rate 2kHz is out of range: at most 1000 Hz"), std::string::npos) << f.said;
}

TEST(command_line, refuses_values_that_are_none) {
  for (const std::vector<std::string>& words :
       std::initializer_list<std::vector<std::string>>{{"u", "t", "--port", "http"},
                                                       {"u", "t", "--timeout", "5"},
                                                       {"u", "t", "--timeout", "0"},
                                                       {"u", "t", "--rate", "-1"},
                                                       {"u", "t", "--idle", "sleep"},
                                                       {"u", "t", "--name", ""},
                                                       {"u", "t", "--json=yes"},
                                                       {"u", "t", "--port"},
                                                       {"u", "t", "more"},
                                                       {"u"},
                                                       {}}) {
    fixture f;
    EXPECT_EQ(f.read(words), exit_code::usage);
    EXPECT_NE(f.said.find("rowe try: "), std::string::npos);
    EXPECT_EQ(f.shown, "");
  }
}

TEST(command_line, suggests_the_option_that_was_meant) {
  fixture f;
  EXPECT_EQ(f.read({"u", "t", "--prot", "1"}), exit_code::usage);
  EXPECT_NE(f.said.find("did you mean --port?"), std::string::npos) << f.said;
  EXPECT_EQ(f.read({"u", "t", "--flavour", "1"}), exit_code::usage);
  EXPECT_EQ(f.said.find("did you mean"), std::string::npos) << f.said;
}

TEST(command_line, takes_from_the_environment_the_operand_that_is_missing) {
  ::setenv("ROWE_TEST_URL", "ws://from-there", 1);
  fixture f;
  EXPECT_EQ(f.read({"/t"}), std::nullopt);
  EXPECT_EQ(f.url, "ws://from-there");
  EXPECT_EQ(f.topic, "/t");
  EXPECT_EQ(f.read({"ws://given", "/t"}), std::nullopt);
  EXPECT_EQ(f.url, "ws://given");
  ::unsetenv("ROWE_TEST_URL");
}

// A verb whose arguments may be fewer: TRY URL [TOPIC...] or, with --plain, URL [JSON].
struct loose_fixture : reading {
  std::string url, json = "{}";
  std::vector<std::string> topics;
  bool plain = false;

  std::optional<exit_code> read(const std::vector<std::string>& words) {
    const command table{
        .verb = "try",
        .examples = {},
        .description = "Tries.\n",
        .operands = {{.name = "URL",
                      .meaning = "where",
                      .into = &url,
                      .variable = "ROWE_TEST_URL",
                      .reads_like_it = [](std::string_view word) { return word.starts_with("ws:"); }},
                     {.name = "TOPIC", .meaning = "what", .into = &topics, .left_out = &plain},
                     {.name = "JSON", .meaning = "with", .into = &json, .optional = true}},
        .options = {{"--plain", "", "", "without topics", &plain}}};
    return reading::read(table, words);
  }
};

TEST(command_line, gathers_options_whose_names_end_in_a_number) {
  fixture f;
  EXPECT_EQ(f.read({"url", "topic", "--p99.9", "80us", "--p50=1ms"}), std::nullopt);
  ASSERT_EQ(f.bounds.size(), 2U);
  EXPECT_EQ(f.bounds[0].number, 99.9);
  EXPECT_EQ(f.bounds[0].time, std::chrono::microseconds{80});
  EXPECT_EQ(f.bounds[1].number, 50);
  for (const char* const name : {"--p", "--p0", "--p101", "--p9x", "--p9Hz", "--p-1"}) {
    EXPECT_EQ(f.read({"url", "topic", name, "1ms"}), exit_code::usage) << name;
  }
  EXPECT_EQ(f.read({"url", "topic", "--p99", "soon"}), exit_code::usage);
  EXPECT_NE(f.said.find("--p99 needs a time"), std::string::npos) << f.said;
}

TEST(command_line, gathers_what_may_be_repeated_and_leaves_out_what_may_be) {
  loose_fixture f;
  EXPECT_EQ(f.read({"ws:h", "/a", "/b"}), std::nullopt);
  EXPECT_EQ(f.url, "ws:h");
  EXPECT_EQ(f.topics, (std::vector<std::string>{"/a", "/b"}));
  EXPECT_EQ(f.json, "{}");
  EXPECT_EQ(f.read({"ws:h"}), exit_code::usage);
  EXPECT_NE(f.said.find("TOPIC is missing"), std::string::npos) << f.said;
}

TEST(command_line, lets_an_option_do_away_with_an_argument_wherever_it_stands) {
  for (const std::vector<std::string>& words :
       std::initializer_list<std::vector<std::string>>{{"ws:h", "7", "--plain"}, {"--plain", "ws:h", "7"}}) {
    loose_fixture f;
    EXPECT_EQ(f.read(words), std::nullopt);
    EXPECT_TRUE(f.topics.empty());
    EXPECT_EQ(f.json, "7");
  }
  loose_fixture f;
  EXPECT_EQ(f.read({"ws:h", "7", "8", "--plain"}), exit_code::usage);
  EXPECT_NE(f.said.find("one argument too many: '8'"), std::string::npos) << f.said;
}

TEST(command_line, knows_by_its_looks_whether_the_environment_s_argument_was_given) {
  ::setenv("ROWE_TEST_URL", "ws:from-there", 1);
  loose_fixture f;
  EXPECT_EQ(f.read({"/a", "/b"}), std::nullopt);
  EXPECT_EQ(f.url, "ws:from-there");
  EXPECT_EQ(f.topics, (std::vector<std::string>{"/a", "/b"}));
  EXPECT_EQ(f.read({"ws:given", "/a"}), std::nullopt);
  EXPECT_EQ(f.url, "ws:given");
  EXPECT_EQ(f.topics, (std::vector<std::string>{"/a"}));
  ::unsetenv("ROWE_TEST_URL");
  EXPECT_EQ(f.read({"/a", "/b"}), std::nullopt);
  EXPECT_EQ(f.url, "/a"); // to be refused as a URL
}

TEST(command_line, shows_in_the_usage_what_may_be_left_out_or_repeated) {
  loose_fixture f;
  EXPECT_EQ(f.read({"--help"}), exit_code::done);
  EXPECT_NE(f.shown.find("usage: rowe try [options] URL [TOPIC...] [JSON]\n"), std::string::npos) << f.shown;
}

TEST(command_line, takes_words_with_dashes_behind_a_double_dash) {
  fixture f;
  EXPECT_EQ(f.read({"--", "--port", "--help"}), std::nullopt);
  EXPECT_EQ(f.url, "--port");
  EXPECT_EQ(f.topic, "--help");
}

TEST(command_line, writes_help_from_the_table_beginning_with_its_two_examples) {
  fixture f;
  EXPECT_EQ(f.read({"--help"}), exit_code::done);
  EXPECT_TRUE(f.shown.starts_with(
      "examples:\n  rowe try A b  first\n  rowe try A c  second\n\nusage: rowe try [options] URL TOPIC\n"))
      << f.shown;
  for (const option& o : f.table().options) EXPECT_NE(f.shown.find(o.meaning), std::string::npos) << o.name;
}

TEST(command_line, does_not_pass_control_characters_on_to_the_terminal) {
  fixture f;
  EXPECT_EQ(f.read({"u", "t", "--\x1b[2J"}), exit_code::usage);
  EXPECT_EQ(f.said.find('\x1b'), std::string::npos);
  EXPECT_NE(f.said.find("\\u001b[2J"), std::string::npos) << f.said;
}

} // namespace
} // namespace command_line_test
} // namespace rowe::tools
