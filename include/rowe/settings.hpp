// SPDX-License-Identifier: Apache-2.0
// What an endpoint is opened with, put together from a program's own defaults, a file, the environment and
// the command line. docs/config.md lists the keys. Ordinary threads, at set-up; allocates.
//
//   rowe::settings chosen;
//   std::string why;
//   if (!chosen.read_file("rowe.toml", &why) || !chosen.read_environment(&why) || !chosen.check(&why)) ...
//   auto robot = rowe::endpoint::listen(chosen.values().endpoint);
//
// endpoint_options::from_file() is the short form, where only the file counts.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/options.hpp>
#include <rowe/result.hpp>

namespace rowe {

class setting_faults;
struct record_options; // rowe/recording.hpp
namespace config {
struct fault;
}

// How `rowe serve` writes what happens.
enum class log_format : std::uint8_t { text, json };

// What only the program `rowe serve` reads.
struct serve_options {
  bool demo = false;    // drive a simulated robot
  bool guarded = false; // which stands until a page guards it
  log_format log = log_format::text;
  bool quiet = false; // print errors and warnings only
};

// A recording of all that happens, as recording_options has it.
struct record_settings {
  std::string path; // empty: there is none
  std::vector<std::string> topics{};
  std::vector<std::string> exclude{};
  compression packed = compression::lz4;
  std::uint64_t split_bytes = 0;
  duration split_time{};
  std::uint64_t total_bytes = 0;
  bool sync = false;
};

// A black box, as black_box_options has it.
struct black_box_settings {
  std::string path; // of a folder; empty: there is none
  std::vector<std::string> topics{};
  std::vector<std::string> exclude{};
  compression packed = compression::lz4;
  duration before = std::chrono::seconds{30};
  duration after = std::chrono::seconds{5};
  std::uint64_t bytes = 32 << 20;
  std::uint32_t files_max = 20;
  bool on_stop = true;
  bool on_lease = true;
};

struct configuration {
  endpoint_options endpoint;
  serve_options serve;
  record_settings record{};
  black_box_settings black_box{};
};

// What a configuration wants to be recorded, for endpoint::record(): `rowe serve` does, and a program of its
// own may. Needs rowe/recording.hpp.
std::vector<record_options> recordings_of(const configuration& chosen);

// A key, for programs that make options or documents of all of them.
struct setting_key {
  std::string_view section; // "endpoint"
  std::string_view name;    // "poll_period"
  std::string_view option;  // of `rowe serve`: "--poll-period"; empty: `--limit NAME=VALUE`
  std::string_view meaning; // a phrase; empty: docs/limits.md
  std::string placeholder;  // of its value: "TIME"
  std::string allowed;      // "50 us to 10 ms"
  std::string fallback;     // the default, in TOML
  bool is_switch = false;   // true or false
  bool is_list = false;
};

// Which of several values of a key holds: the last of these.
enum class setting_source : std::uint8_t { fallback, file, environment, command_line };

// A value that holds, and where it came from.
struct setting {
  std::string section;           // "endpoint"; "[role]" and "[identity]" for the members of lists
  std::string name;              // "poll_period"
  std::string value;             // in TOML: "\"250 us\""
  std::string origin;            // "default", "rowe.toml:12", "ROWE_ENDPOINT_POLL_PERIOD", "--poll-period"
  bool first_of_section = false; // "[endpoint]" would stand in front of it
};

// Errors of every function: bad_config, with the number of the line in the file, or 0. If `why` is given, a
// diagnostic is assigned to it that names the place, the key, the value and what is allowed; a line for each
// mistake, twenty at most. What is wrong leaves its default.
class settings {
 public:
  // `defaults` hold where nothing else is said.
  explicit settings(configuration defaults = {});

  // Reads a file of TOML, of at most 1 MiB. One that has identities may be written by its owner only, unless
  // it is below $CREDENTIALS_DIRECTORY. The roles and identities of a later file replace those of an earlier
  // one.
  status read_file(const std::string& path, std::string* why = nullptr);

  // Reads ROWE_SECTION_KEY of each key: ROWE_ENDPOINT_PORT=9000. Members of lists are separated by commas. A
  // variable that begins with ROWE_ and a section's name, but is no key's, is a mistake. No other thread may
  // change the environment meanwhile.
  status read_environment(std::string* why = nullptr);

  // Sets one key from a text, or texts where it is a list, as an option of the command line does. `shown` is
  // what diagnostics call it: "--port".
  status set(std::string_view section, std::string_view name, std::span<const std::string> texts,
             std::string_view shown, std::string* why = nullptr);

  // Sets the default of a program for one key, from a text as in set(): it holds where nothing else is said.
  status set_default(std::string_view section, std::string_view name, std::string_view text);

  // Whether endpoint::listen() would take these values, and endpoint::connect() those of [client]: everything
  // that either would refuse before it opens a socket.
  status check(std::string* why = nullptr) const;

  // The part of check() that is about roles and identities alone, for programs that take these from a changed
  // file with endpoint::set_access(): nothing else that is wrong may keep a token from being revoked. Reads
  // no file.
  status check_access(std::string* why = nullptr) const;

  const configuration& values() const noexcept { return values_; }
  setting_source source_of(std::string_view section, std::string_view name) const noexcept;

  // Every value, in the order of the keys, then roles and identities.
  std::vector<setting> list() const;

  // Every key; roles and identities apart, which stand in files only.
  static std::vector<setting_key> keys();

 private:
  struct origin {
    setting_source source = setting_source::fallback;
    std::string place;     // "rowe.toml:12"; empty for a default
    std::int64_t line = 0; // in a file
  };
  friend struct settings_reader;

  std::string subject(std::size_t at) const;
  void find_access_faults(setting_faults& to, bool with_proofs) const;
  config::fault explain(const error& reason) const;
  config::fault explain_file(const std::string& fault) const;

  configuration values_;
  std::vector<origin> origins_;    // of each key
  std::vector<origin> roles_;      // of each [[role]]
  std::vector<origin> identities_; // of each [[identity]]
};

// Changes when the file is replaced or written to, for programs that read theirs again then. 0: it cannot be
// looked at. Any thread; enters the kernel.
std::uint64_t file_version(const std::string& path) noexcept;

} // namespace rowe
