// SPDX-License-Identifier: Apache-2.0
// Retains the newest messages in memory, compressed, and writes them into a file when something happens, with
// those that come for a while after it. One ordinary thread; allocates, and waits for the disk.
#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mcap/chunk_builder.hpp"
#include "mcap/files.hpp"
#include "mcap/writer.hpp"
#include "recording/file_names.hpp"
#include "recording/messages_target.hpp"
#include "recording/triggers.hpp"

namespace rowe::recording {

class black_box final : public messages_target {
 public:
  explicit black_box(recording_options chosen);

  bool begin(rt::time_point now) override;
  void set_topic(std::uint32_t number, std::string name, std::string type, std::string schema) override;
  void add(std::uint32_t number, std::string_view json, std::int64_t logged_ns,
           std::int64_t published_ns) override;
  void note_lost(std::uint32_t number, std::uint64_t count, std::int64_t logged_ns) override;
  void tend(rt::time_point now) override;
  bool flush() override;
  bool close() override;
  // Asked for by somebody: the file is called "asked", whatever the cause.
  void snapshot(std::string_view cause) override;

  const std::string& fault() const noexcept override { return fault_; }
  void describe(recording_figures& into) const override;
  const std::vector<std::string>& unended() const noexcept override { return unended_; }

 private:
  struct topic {
    std::string name;
    std::string type;
    std::string schema;
    std::uint32_t sequence = 0;
    mcap::channel_number channel = 0; // 0: none yet
  };
  struct piece { // a chunk
    mcap::chunk_index index;
    std::string record;
    std::vector<mcap::placed_message> messages;
    std::size_t bytes() const noexcept {
      return sizeof(piece) + record.capacity() + messages.capacity() * sizeof messages[0];
    }
  };
  struct file {
    std::string path;
    rt::time_point until;
    rt::time_point latest; // it ends then, whatever happens
    std::string what;
    mcap::file_sink to{};
    std::optional<mcap::writer> writes{};
  };

  void end_chunk();
  void drop_oldest();
  void give_channel(topic& to);
  void forget_unused();
  void add_message(topic& of, std::string_view json, std::int64_t logged_ns, std::int64_t published_ns);
  void forget_all();
  // `what`: a part of the file's name.
  void begin_file(std::string_view what, std::string_view cause);
  bool open_file(std::string_view what);
  void rename_to(std::string_view what);
  file_names names_of(std::string_view what) const;
  void add_notes(std::string_view what, std::string_view cause);
  void end_file();

  const recording_options chosen_;
  mcap::chunk_builder chunk_;
  std::deque<piece> pieces_;    // the oldest first
  std::size_t bytes_ = 0;       // of these
  std::size_t names_bytes_ = 0; // of what describes topics: an eighth of what all may have
  std::vector<topic> topics_;
  topic losses_;
  // What describes topics, by all that it says, so that who comes again takes no more.
  std::map<std::string, mcap::schema, std::less<>> schemas_;
  std::map<std::string, mcap::channel, std::less<>> channels_;
  triggers triggers_;
  std::optional<file> file_;
  rt::time_point now_{};
  rt::time_point chunk_due_{};
  std::string fault_;
  std::vector<std::string> unended_;
  std::string last_path_;
  std::uint64_t files_ = 0;
  std::uint64_t deleted_ = 0;
  std::uint64_t lost_ = 0;             // that the disk did not take, or for which there was no memory
  std::uint64_t written_messages_ = 0; // in files that have ended
  std::uint64_t written_bytes_ = 0;    // likewise
};

} // namespace rowe::recording
