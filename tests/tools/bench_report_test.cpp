// SPDX-License-Identifier: Apache-2.0
// What is said of a run: percentiles, verdict, JSON, the .hgrm file, the comparison, the drawing, and the
// line of the machine.
#include "tools/bench/compare.hpp"
#include "tools/bench/plot.hpp"
#include "tools/bench/report.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "rt/folder.hpp"
#include "tools/rowe/text/json_values.hpp"

namespace rowe::tools::bench {
namespace bench_report_test {
namespace {

using namespace std::chrono_literals;

// 1 to 1000 us, each once.
struct bench_report : testing::Test {
  recording samples{990us};
  report r;
  settings asked;

  void SetUp() override {
    samples.begin(rt::time_point{});
    for (int i = 1; i <= 1000; ++i)
      samples.record(rt::time_point{i * 1ms}, rt::time_point{i * 1ms + i * 1us});
    r.mode = "rpc";
    r.measured = "a <test> & \"more\"";
    r.where.kernel = "6.1-rt";
    r.where.real_time = "PREEMPT_RT";
    r.settings = {{"rate", "1000 Hz"}};
    r.ran = 1s;
    r.counts = {1000, 1000, 0, 0};
    r.samples = &samples;
    r.usage = thread_usage{0, 5, 1, 0, 0};
  }
  double number(const std::string& json, std::string_view path) {
    return read_json(json).get<double>(path).value();
  }
};

TEST_F(bench_report, percentiles_are_at_most_one_bucket_above_the_truth) {
  const std::string json = json_of(r);
  for (const auto& [key, truth] : {std::pair{"p50_ns", 500e3},
                                   {"p90_ns", 900e3},
                                   {"p99_ns", 990e3},
                                   {"p99_9_ns", 999e3},
                                   {"p99_99_ns", 1000e3}}) {
    EXPECT_GE(number(json, key), truth) << key;
    EXPECT_LE(number(json, key), truth * (1 + 1.0 / 128)) << key;
  }
  EXPECT_EQ(number(json, "min_ns"), 1e3);
  EXPECT_EQ(number(json, "max_ns"), 1000e3);
}

TEST_F(bench_report, bounds_of_any_percentile_are_looked_at) {
  asked.max = 2ms;
  asked.percentiles = {{50, 600us}, {99.95, 900us}};
  r.bounds = bounds_of(asked, samples.times());
  ASSERT_EQ(r.bounds.size(), 3U);
  EXPECT_TRUE(r.bounds[0].held());
  EXPECT_TRUE(r.bounds[1].held());
  EXPECT_FALSE(r.bounds[2].held());
  EXPECT_EQ(r.bounds[2].name, "p99.95");
  EXPECT_EQ(verdict_of(r), exit_code::exceeded);
}

TEST_F(bench_report, a_bound_weighs_more_than_failures_and_they_more_than_time_outs) {
  EXPECT_EQ(verdict_of(r), exit_code::done);
  r.counts.unfinished = 1;
  EXPECT_EQ(verdict_of(r), exit_code::timed_out);
  r.counts.failed = 1;
  EXPECT_EQ(verdict_of(r), exit_code::failed);
  r.bounds = {{"max", 1us, 2us}};
  EXPECT_EQ(verdict_of(r), exit_code::exceeded);
  r.bounds = {{"max", 2us, 2us}};
  EXPECT_EQ(verdict_of(r), exit_code::failed);
}

TEST_F(bench_report, nothing_measured_is_no_success) {
  const recording none;
  r.samples = &none;
  r.counts = {};
  EXPECT_EQ(verdict_of(r), exit_code::interrupted);
}

TEST_F(bench_report, samples_are_listed_above_the_maximum_or_the_largest_bound) {
  EXPECT_EQ(asked.listed_above(), rt::for_ever);
  asked.percentiles = {{50, 600us}, {99, 900us}};
  EXPECT_EQ(asked.listed_above(), 900us);
  asked.max = 2ms;
  EXPECT_EQ(asked.listed_above(), 2ms);
}

TEST_F(bench_report, the_machine_comes_before_any_number) {
  EXPECT_EQ(text_of(r).find("machine   " + r.where.line()), 0U);
  EXPECT_NE(hgrm_of(r).find(r.where.line()), std::string::npos);
  EXPECT_NE(json_of(r).find(r.where.line()), std::string::npos);
  EXPECT_NE(svg_of(r, nullptr).find("<title>" + r.where.line() + "</title>"), std::string::npos);
}

TEST_F(bench_report, json_is_one_object_on_a_line_with_units_in_its_keys) {
  const std::string json = json_of(r);
  EXPECT_EQ(json.find('\n'), json.size() - 1);
  EXPECT_EQ(object_fault(json), "");
  for (const std::string_view key : {"bench",
                                     "machine.line",
                                     "machine.real_time",
                                     "machine.warnings",
                                     "peer",
                                     "measured",
                                     "settings.rate",
                                     "ran_ns",
                                     "samples",
                                     "min_ns",
                                     "p50_ns",
                                     "p90_ns",
                                     "p99_ns",
                                     "p99_9_ns",
                                     "p99_99_ns",
                                     "max_ns",
                                     "intended",
                                     "finished",
                                     "failed",
                                     "unfinished",
                                     "over_limit_ns",
                                     "over",
                                     "over_samples",
                                     "worst_samples[0].at_ns",
                                     "worst_samples[0].value_ns",
                                     "buckets_ns",
                                     "parts",
                                     "figures",
                                     "measuring_thread.page_faults",
                                     "measuring_thread.own_context_switches",
                                     "measuring_thread.forced_context_switches",
                                     "measuring_thread.allocations",
                                     "bounds",
                                     "problem",
                                     "exit_code"}) {
    EXPECT_TRUE(read_json(json).find(key)) << key;
  }
  EXPECT_EQ(number(json, "over"), 10);
}

TEST_F(bench_report, what_was_not_counted_is_not_called_zero) {
  r.usage->allocations.reset();
  r.usage->locks.reset();
  const std::string json = json_of(r);
  EXPECT_EQ(read_json(json).find("measuring_thread.allocations")->kind(), json_kind::null);
  EXPECT_NE(text_of(r).find("allocations not counted"), std::string::npos);
}

// Four columns but in the last line; comments begin with #.
TEST_F(bench_report, hgrm_is_what_plotters_of_hdrhistogram_read) {
  std::istringstream lines{hgrm_of(r)};
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "       Value     Percentile TotalCount 1/(1-Percentile)");
  std::getline(lines, line);
  EXPECT_EQ(line, "");
  double last_value = 0;
  double last_level = 0;
  int rows = 0;
  while (std::getline(lines, line) && line.front() != '#') {
    std::istringstream columns{line};
    double value = 0;
    double level = 0;
    std::uint64_t count = 0;
    ASSERT_TRUE(columns >> value >> level >> count) << line;
    EXPECT_GE(value, last_value);
    EXPECT_GE(level, last_level);
    last_value = value;
    last_level = level;
    ++rows;
  }
  EXPECT_GT(rows, 10);
  EXPECT_EQ(last_level, 1);
  EXPECT_EQ(last_value, 1000); // in microseconds
  do EXPECT_EQ(line.front(), '#') << line;
  while (std::getline(lines, line));
}

TEST_F(bench_report, what_was_written_is_read_back_and_compared) {
  const auto before = earlier_of(json_of(r));
  ASSERT_TRUE(before);
  EXPECT_EQ(before->mode, "rpc");
  EXPECT_EQ(before->machine, r.where.line());
  EXPECT_EQ(before->number("max_ns"), 1e6);
  std::uint64_t total = 0;
  for (const bucket& b : before->buckets) total += b.count;
  EXPECT_EQ(total, 1000U);

  recording twice{990us};
  for (int i = 1; i <= 1000; ++i) twice.record(rt::time_point{}, rt::time_point{i * 2us});
  r.samples = &twice;
  r.settings[0].value = "500 Hz";
  const std::string table = comparison_of(*before, r);
  EXPECT_NE(table.find("differs   rate: 1000 Hz  ->  500 Hz\n"), std::string::npos) << table;
  EXPECT_NE(table.find("max_ns     1.00 ms     2.00 ms          2.00\n"), std::string::npos) << table;
  EXPECT_NE(table.find("samples        1000        1000          1.00\n"), std::string::npos) << table;
}

TEST_F(bench_report, what_is_no_result_is_not_compared) {
  EXPECT_FALSE(earlier_of(""));
  EXPECT_FALSE(earlier_of("{}"));
  EXPECT_FALSE(earlier_of("{\"bench\":\"rpc\"}"));
  EXPECT_FALSE(earlier_of("[1,2]"));
  std::string wrong;
  EXPECT_FALSE(read_earlier("/there/is/none", wrong));
  EXPECT_NE(wrong.find("/there/is/none"), std::string::npos);
}

// That it is well-formed is seen by bench_test.py, which parses it.
TEST_F(bench_report, the_drawing_has_every_bar_within_its_frame) {
  const std::string svg = svg_of(r, nullptr);
  EXPECT_NE(svg.find("a &lt;test&gt; &amp; &quot;more&quot;"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  const recording none;
  r.samples = &none;
  EXPECT_EQ(svg_of(r, nullptr).find("nan"), std::string::npos);
}

TEST_F(bench_report, times_are_said_with_three_figures) {
  EXPECT_EQ(time_text(0ns), "0 ns");
  EXPECT_EQ(time_text(999ns), "999 ns");
  EXPECT_EQ(time_text(1000ns), "1.00 µs");
  EXPECT_EQ(time_text(12345ns), "12.3 µs");
  EXPECT_EQ(time_text(999'600ns), "1.00 ms");
  EXPECT_EQ(time_text(90s), "90.0 s");
  EXPECT_EQ(percentile_name(99.99), "p99.99");
  EXPECT_EQ(percentile_key(99.99), "p99_99");
}

// A tree as /proc and /sys show it.
struct bench_machine : testing::Test {
  const tests::folder root;
  void put(const std::string& name, const std::string& text) const { root.put(name, text); }
  machine look() const { return machine_at(root.path(), {2, 3}); }
};

TEST_F(bench_machine, of_a_board_set_up_for_real_time_needs_no_warning) {
  put("sys/kernel/realtime", "1\n");
  put("proc/device-tree/model", std::string{"A board\0", 8});
  put("proc/sys/kernel/osrelease", "6.1.0-18-rt-arm64\n");
  put("proc/sys/kernel/sched_rt_runtime_us", "-1\n");
  put("sys/devices/system/cpu/cpu2/cpufreq/scaling_governor", "performance\n");
  put("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n");
  put("sys/devices/system/cpu/isolated", "2-3\n");
  put("sys/devices/system/clocksource/clocksource0/current_clocksource", "arch_sys_counter\n");
  put("proc/loadavg", "0.07 0.03 0.01 1/100 1234\n");
  const machine m = look();
  EXPECT_TRUE(m.is_real_time());
  EXPECT_TRUE(m.warnings.empty()) << m.warnings.front();
  const std::string line = m.line();
  for (const std::string_view part :
       {"6.1.0-18-rt-arm64, PREEMPT_RT", "A board", "hypervisor none", "governor performance",
        "isolated CPUs 2-3", "clock arch_sys_counter", "load 0.07"})
    EXPECT_NE(line.find(part), std::string::npos) << part << " in " << line;
}

TEST_F(bench_machine, that_is_virtual_and_ordinary_says_so) {
  put("proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC\n");
  put("proc/cpuinfo", "model name\t: A processor\nflags\t\t: fpu hypervisor tsc\n");
  put("sys/devices/system/cpu/cpu2/cpufreq/scaling_governor", "powersave\n");
  put("proc/sys/kernel/sched_rt_runtime_us", "950000\n");
  put("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n");
  const machine m = look();
  EXPECT_EQ(m.real_time, "PREEMPT_DYNAMIC");
  EXPECT_EQ(m.hypervisor, "yes");
  EXPECT_EQ(m.warnings.size(), 5U);
  EXPECT_NE(m.line().find("A processor"), std::string::npos);
}

TEST_F(bench_machine, that_shows_nothing_has_a_line_all_the_same) {
  EXPECT_NE(look().line().find("isolated CPUs none"), std::string::npos);
}

} // namespace
} // namespace bench_report_test
} // namespace rowe::tools::bench
