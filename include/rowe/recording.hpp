// SPDX-License-Identifier: Apache-2.0
// Recordings: files of messages with their times, in the format MCAP (https://mcap.dev), which Foxglove and
// others open. For ordinary threads: what is said of a function here holds for none that has a real-time
// priority. `rowe record` and `rowe info` are programs on it.
//
//   std::string why;
//   auto file = rowe::recording_writer::create({.path = "run.mcap"}, &why);
//   auto odom = file->add_topic<odometry>("/odom");
//   file->add(*odom, R"({"x":1})", rowe::wall_clock_ns());
//   file->close(&why);
#pragma once
#include <concepts>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <rowe/options.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/schema.hpp>

namespace rowe {

// Nanoseconds since 1970, in UTC, as all times in recordings are. Enters the kernel where the clock does.
std::int64_t wall_clock_ns() noexcept;

using recording_metadata = std::map<std::string, std::string, std::less<>>;

// ---- writing

// A recording that is kept in memory, and written when something happens: then the files have what led to it.
struct black_box_options {
  rt::duration before{};                        // how far back a file goes; 0: there is no black box
  rt::duration after = std::chrono::seconds{5}; // how long it goes on
  std::size_t bytes = 32 << 20;                 // in memory, compressed; at least 1 MiB
  std::uint32_t files_max = 20;                 // of each cause: the oldest ones are deleted
  bool on_stop = true;                          // when the robot was stopped
  bool on_lease = true;                         // when who drives fell silent
};

struct recording_options {
  // Not empty. A file, which must not be there yet; or a folder (it exists, or ends in '/'), which gets files
  // that are called by `name` and the time of their begin: "ang-01_2026-11-30T04-09-58Z.mcap".
  std::string path{};
  std::string name{}; // of the robot; also written into the file
  compression packed = compression::lz4;
  std::uint64_t split_bytes = 0;       // a file that has as many ends, and the next one begins; 0: never
  rt::duration split_time{};           // likewise, since its begin; 0: never
  std::uint64_t total_bytes = 0;       // of all files of this path: the oldest ones are deleted; 0: no limit
  bool sync = false;                   // each chunk lies on the disk before the next one is written
  std::size_t buffer_bytes = 32 << 20; // of messages that wait for the disk; 1 MiB to 1 GiB, rounded down
  // to a power of two; what is longer is not recorded
  recording_metadata metadata{}; // written into each file, as "rowe"
  // With one, `path` is a folder. Its files are called by `name`, cause and time:
  // "ang-01-stop_2026-11-30T04-09-58Z.mcap"; `split_bytes`, `split_time` and `total_bytes` do not count.
  black_box_options black_box{};
};

// What a recording has done so far.
struct recording_figures {
  std::string path;            // of the file that is being written, or the last one
  std::uint64_t files = 0;     // that were begun
  std::uint64_t deleted = 0;   // for `total_bytes`
  std::uint64_t messages = 0;  // that were written
  std::uint64_t bytes = 0;     // of all files, as they lie on the disk
  std::uint64_t lost = 0;      // there was no room in the buffer, or the disk took them no more
  std::uint64_t retained = 0;  // bytes in the memory of a black box
  std::uint64_t waiting = 0;   // bytes in the buffer
  std::uint64_t disk_free = 0; // bytes that are free where the file is
  std::string fault;           // why nothing is written now; empty: all is well
};

// Writes recordings. A thread of its own writes to the disk, so no call waits for that, but those that say
// so. A chunk is written each 150 ms, or when it has 1 MiB: whatever ends the program, what was written
// before is whole. After 131 072 chunks a new file begins, as with `split_bytes`, so that their list does not
// grow for ever. One thread at a time.
class recording_writer {
 public:
  using topic_number = std::uint32_t;

  // Makes the first file. Errors: bad_recording, and `why`, if given, is assigned what is wrong, with the
  // path; bad_argument (buffer_bytes), no_memory, no_thread.
  static result<recording_writer> create(const recording_options& options, std::string* why = nullptr);
  recording_writer(recording_writer&&) noexcept;
  recording_writer& operator=(recording_writer&&) noexcept;
  ~recording_writer(); // close()

  // A topic with messages in JSON. `type`: its name, such as "nav_msgs/Odometry"; `schema`: a JSON Schema, or
  // empty if it is not known. Errors: too_many_topics (4096), too_big (the texts have more than 256 KiB),
  // full.
  result<topic_number> add_topic(std::string_view topic, std::string_view type = {},
                                 std::string_view schema = {});
  // Of a struct with a schema (rowe/schema.hpp).
  template <class T>
  result<topic_number> add_topic(std::string_view topic) {
    return add_topic(topic, describe<T>());
  }
  result<topic_number> add_topic(std::string_view topic, const schema_description& type);

  // Adds a message that was recorded at `logged_ns`, and published at `published_ns` (0: not known). Never
  // waits, allocates nothing. Errors: full (there is no room; it is counted as lost, and the file says so),
  // too_big (for the buffer), bad_argument (there is no such topic), closed.
  status add(topic_number topic, std::string_view json, std::int64_t logged_ns,
             std::int64_t published_ns = 0) noexcept;

  // Counts messages of a topic that were lost before they came here. The file says so.
  void add_lost(topic_number topic, std::uint64_t count) noexcept;

  // Waits until a message of so many bytes would have room, at most `timeout` (negative: for ever). Errors:
  // timed_out, too_big, closed; bad_recording (the disk takes nothing).
  status wait_room(std::size_t bytes, rt::duration timeout);

  // Waits until all that was added is written and, with `sync`, lies on the disk. Errors: as wait_room().
  status flush(rt::duration timeout);

  recording_figures figures() const;

  // Writes what waits, and ends the file. Errors: bad_recording (the disk is full, say), and `why` is
  // assigned what is wrong. What was whole before is whole then, too.
  status close(std::string* why = nullptr);

 private:
  struct parts;
  explicit recording_writer(std::unique_ptr<parts> made) noexcept;
  std::unique_ptr<parts> parts_;
};

// ---- recording an endpoint

struct record_options {
  recording_options file{}; // with an empty `name`, that of the endpoint
  // Names of topics: `*` stands for any text without a slash, `**` for any text. None: all topics, those of
  // the endpoint below /rowe/ included, which say when it was stopped, who drove, and what was lost.
  std::vector<std::string> topics{};
  std::vector<std::string> exclude{}; // likewise; what is described here is not recorded, but for the two
                                      // topics by which a black box learns what happens
};

// Records what is published on an endpoint, by this process or by peers: endpoint::record() makes one. The
// service thread copies each message into the buffer, and a thread of the recorder writes it. So no loop, and
// no peer, waits for the disk; what the buffer has no room for is counted, and the file says so. Set-up calls
// and queries, from any thread, one at a time.
class recorder {
 public:
  recorder() noexcept; // none: calls say misuse, or nothing
  recorder(recorder&&) noexcept;
  recorder& operator=(recorder&&) noexcept;
  ~recorder(); // close()

  explicit operator bool() const noexcept { return parts_ != nullptr; }

  // Of an endpoint that connects: subscribes to a topic there, if the options want it to be recorded; without
  // that, what its handles subscribe to is recorded. A black box there learns what happens only if it
  // subscribes to /rowe/stop/state and /rowe/control/state. `schema`: of its messages; it has to stay valid
  // until the recorder is closed; null: it is not known. `throttle`: see topic_options. Takes a handle.
  // Errors: as endpoint::subscribe().
  status subscribe(std::string_view topic, std::string_view type = {},
                   const schema_description* schema = nullptr, rt::duration throttle = {});

  // Files of the same name that an earlier program did not end: repair_recording() does it.
  std::vector<std::string> unended() const;
  // Of a black box: writes what it retains, and what comes for a while (`after`). `cause` stands in the file.
  // Returns at once. Errors: misuse (it is none).
  status snapshot(std::string_view cause = {});
  recording_figures figures() const;
  // Waits until what the service thread has taken is written, at most `timeout` (negative: for ever). Values
  // that still wait for that thread are not among it. Errors: timed_out; bad_recording (see figures().fault),
  // misuse, forked.
  status flush(rt::duration timeout);
  // Ends the recording and its file. Waits for the disk. Errors: bad_recording, and `why` is assigned what is
  // wrong.
  status close(std::string* why = nullptr);

 private:
  friend class endpoint;
  struct parts;
  explicit recorder(std::unique_ptr<parts> made) noexcept;
  std::unique_ptr<parts> parts_;
};

// ---- reading

// Who is told how many bytes of a file were read, and of how many: anything that is called with both. It is
// referred to, and called by the function that it is given to, on the same thread.
class recording_progress {
 public:
  recording_progress() noexcept = default; // nobody
  template <std::invocable<std::uint64_t, std::uint64_t> Tell>
  recording_progress(Tell&& tell) noexcept // NOLINT(google-explicit-constructor): a lambda is given
      : to_{const_cast<void*>(static_cast<const void*>(std::addressof(tell)))},
        tell_{[](void* to, std::uint64_t bytes, std::uint64_t of) {
          (*static_cast<std::remove_reference_t<Tell>*>(to))(bytes, of);
        }} {}
  explicit operator bool() const noexcept { return tell_ != nullptr; }
  void operator()(std::uint64_t bytes, std::uint64_t of) const { tell_(to_, bytes, of); }

 private:
  void* to_ = nullptr;
  void (*tell_)(void* to, std::uint64_t bytes, std::uint64_t of) = nullptr;
};

struct recorded_topic {
  std::string name;
  std::string type;            // of its messages; empty: not known
  std::string encoding;        // of its messages: "json", "cdr", "ros1"
  std::string schema;          // of its type, in the encoding `schema_encoding`; beyond 64 MiB in all: none
  std::string schema_encoding; // "jsonschema", "ros2msg", "ros1msg"; empty: there is none
  recording_metadata metadata;
  std::uint64_t messages = 0;
};

struct recorded_message {
  std::size_t topic = 0; // the place in topics()
  std::uint32_t sequence = 0;
  std::int64_t logged_ns = 0;
  std::int64_t published_ns = 0;
  std::string_view data{}; // until the next one is read
};

// A part of a file that cannot be read.
struct recording_damage {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::string why;
};

struct recording_chunk {
  std::int64_t begin_ns = 0; // of its first message, by time
  std::int64_t end_ns = 0;
  std::uint64_t bytes = 0; // in the file
  std::uint64_t plain_bytes = 0;
  std::string packed{}; // "", "lz4", "zstd"
};

struct recording_notes {
  std::string name;
  recording_metadata values;
};

struct recording_attachment {
  std::string name;
  std::string media_type;
  std::uint64_t bytes = 0;
};

// Reads recordings, in the order of the messages' times, also those that others wrote, were cut off or are
// damaged. Files are not read into memory. One thread at a time; allocates, and waits for the disk.
class recording_reader {
 public:
  // `on_progress` is told how many bytes were read, and of how many, where a whole file has to be looked
  // through because its summary is missing. Errors: bad_recording, and `why` is assigned what is wrong.
  static result<recording_reader> open(const std::string& path, std::string* why = nullptr,
                                       recording_progress on_progress = {});
  recording_reader(recording_reader&&) noexcept;
  recording_reader& operator=(recording_reader&&) noexcept;
  ~recording_reader();

  // A topic that had different types, or publishers, may be there several times.
  const std::vector<recorded_topic>& topics() const noexcept;
  std::uint64_t messages() const noexcept;
  std::int64_t begin_ns() const noexcept; // of the first message; 0: there is none
  std::int64_t end_ns() const noexcept;
  std::uint64_t file_bytes() const noexcept;
  const std::string& written_by() const noexcept; // the program's name
  const std::string& profile() const noexcept;    // "", "ros1", "ros2"
  // Whether the file has an end, as it has when its program ended as it should.
  bool is_ended() const noexcept;
  // What could not be read so far.
  std::vector<recording_damage> damaged() const;
  std::vector<recording_chunk> chunks() const;
  std::vector<recording_notes> metadata() const;
  std::vector<recording_attachment> attachments() const;

  // Which messages next() gives, from the first one on: those logged in [from_ns, until_ns), of the topics at
  // these places (empty: all).
  struct selection {
    std::int64_t from_ns = 0;
    std::int64_t until_ns = (std::numeric_limits<std::int64_t>::max)(); // the last possible time is included
    std::vector<std::size_t> topics{};
  };
  void select(const selection& wanted);
  // The next message; null: there are no more. Messages of the same time come in the order of the file.
  const recorded_message* next();

 private:
  struct parts;
  explicit recording_reader(std::unique_ptr<parts> made) noexcept;
  std::unique_ptr<parts> parts_;
};

// ---- repairing

struct recording_repair {
  std::string path;           // of the whole recording
  bool was_whole = false;     // there was nothing to do
  bool in_place = false;      // else the damaged file stands beside it, as it was
  std::uint64_t messages = 0; // that are in it
  std::vector<recording_damage> damaged;
};

// Makes a recording whole that its program left without an end, or that is damaged. What lacks only its end
// gets one. What is damaged elsewhere is copied without the damaged parts, to NAME.repaired.mcap. Either is
// read back before it counts as done. Errors: bad_recording, and `why` is assigned what is wrong.
result<recording_repair> repair_recording(const std::string& path, std::string* why = nullptr,
                                          recording_progress on_progress = {});

} // namespace rowe
