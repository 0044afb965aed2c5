// SPDX-License-Identifier: Apache-2.0
// What a bench says that has figures to meet: a table of what it measured, and of each figure what is wanted
// and whether it is met. Text on the standard output; with --benchmark_out=FILE the same as JSON, in the form
// that Google Benchmark writes, which this needs not. Timings never end such a program with an error.
#pragma once
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rowe::bench {

class claims {
 public:
  using counters = std::vector<std::pair<std::string, double>>;

  // Takes `--benchmark_out=FILE` and `--benchmark_out_format=json` out of the arguments.
  claims(int& count, char** arguments) {
    int kept = 1;
    for (int i = 1; i < count; ++i) {
      const std::string_view given = arguments[i];
      constexpr std::string_view out = "--benchmark_out=";
      if (given.starts_with(out)) {
        file_ = given.substr(out.size());
      } else if (given != "--benchmark_out_format=json") {
        arguments[kept++] = arguments[i];
      }
    }
    count = kept;
  }

  // A line of the table: `name` is "GROUP/CONTENDER".
  void add_row(std::string name, counters of) { rows_.push_back({std::move(name), std::move(of)}); }
  // A figure that is wanted to lie between two values, both included.
  void want(std::string what, double measured, double least, double most) {
    wanted_.push_back({std::move(what), measured, least, most});
  }

  // Prints all; false: the file cannot be written.
  bool say(int rounds) const {
    for (const row& one : rows_) {
      std::printf("%-28s", one.name.c_str());
      for (const auto& [name, value] : one.of) std::printf("  %s %.6g", name.c_str(), value);
      std::printf("\n");
    }
    std::printf("\n");
    for (const figure& one : wanted_)
      std::printf("%s: measured %.4g, wanted %s, %s\n", one.what.c_str(), one.measured, one.bounds().c_str(),
                  one.met() ? "met" : "not met");
    std::fflush(stdout);
    return file_.empty() || write(rounds);
  }

 private:
  struct row {
    std::string name;
    counters of;
  };
  struct figure {
    std::string what;
    double measured, least, most;

    bool met() const { return measured >= least && measured <= most; }
    std::string bounds() const {
      char text[64];
      if (least == most) {
        std::snprintf(text, sizeof text, "%g", most);
      } else if (std::isinf(least)) {
        std::snprintf(text, sizeof text, "at most %g", most);
      } else {
        std::snprintf(text, sizeof text, "%g to %g", least, most);
      }
      return text;
    }
  };

  bool write(int rounds) const {
    std::ofstream out{file_};
    out.precision(12);
    out << "{\"context\": {\"rounds\": \"" << rounds << "\"}, \"benchmarks\": [";
    const char* comma = "\n";
    for (const row& one : rows_) {
      out << comma << "{\"name\": \"" << one.name << R"(", "run_type": "iteration", "time_unit": "us")";
      for (const auto& [name, value] : one.of)
        if (std::isfinite(value)) out << ", \"" << name << "\": " << value;
      out << "}";
      comma = ",\n";
    }
    out << "\n]}\n";
    return static_cast<bool>(out.flush());
  }

  std::string file_;
  std::vector<row> rows_;
  std::vector<figure> wanted_;
};

} // namespace rowe::bench
