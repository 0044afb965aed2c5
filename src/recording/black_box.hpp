// SPDX-License-Identifier: Apache-2.0
// Retains the newest messages in memory, compressed, and writes them into a file when something happens, with
// those that come for a while after it. One ordinary thread; allocates, and waits for the disk.
#pragma once
#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mcap/chunk_builder.hpp"
#include "recording/described_topics.hpp"
#include "recording/file_names.hpp"
#include "recording/messages_target.hpp"
#include "recording/recording_file.hpp"
#include "recording/triggers.hpp"

namespace rowe::recording {

// The numbers 1 to 65 535, which schemas and channels have.
class number_pool {
 public:
  static constexpr std::size_t numbers = 65'536;
  // One that is free; 0: none is.
  std::uint16_t take() noexcept {
    for (std::size_t looked = 0; looked < numbers; ++looked) {
      const auto number = static_cast<std::uint16_t>(next_++ % numbers);
      if (number == 0 || taken_[number]) continue;
      taken_[number] = true;
      ++taken_count_;
      return number;
    }
    return 0;
  }
  bool has_free() const noexcept { return taken_count_ < numbers - 1; }
  void set_taken(std::vector<bool> those) noexcept {
    taken_ = std::move(those);
    taken_count_ = static_cast<std::size_t>(std::count(taken_.begin() + 1, taken_.end(), true));
  }

 private:
  std::vector<bool> taken_ = std::vector<bool>(numbers);
  std::size_t taken_count_ = 0;
  std::size_t next_ = 1;
};

class black_box final : public messages_target {
 public:
  explicit black_box(recording_options chosen);

  bool begin(rt::time_point now) override;
  void set_topic(std::uint32_t number, std::string name, std::string type, std::string schema) override;
  void add(std::uint32_t number, std::string_view json, std::int64_t logged_ns,
           std::int64_t published_ns) override;
  void note_lost(std::uint32_t number, std::uint64_t count, std::int64_t logged_ns) override;
  void tend(rt::time_point now, bool drained) override;
  bool flush() override;
  bool close() override;
  // Asked for by somebody: the file is called "asked", whatever the cause.
  void snapshot(std::string_view cause) override;

  const std::string& fault() const noexcept override { return fault_; }
  void describe(recording_figures& into) const override;
  const std::vector<std::string>& unended() const noexcept override { return unended_; }

 private:
  struct piece { // a chunk
    mcap::chunk_index index;
    std::string record;
    std::vector<mcap::placed_message> messages;
    std::vector<mcap::channel_number> channels;
    std::size_t bytes() const noexcept {
      return sizeof(piece) + record.capacity() + messages.capacity() * sizeof messages[0] +
             channels.capacity() * sizeof channels[0];
    }
  };
  void end_chunk();
  void drop_first();
  void drop_oldest();
  bool give_channel(described_topic& to);
  mcap::schema_number give_schema(const described_topic& of);
  void make_room_for_a_topic();
  void forget_unused();
  void add_message(described_topic& of, std::string_view json, std::int64_t logged_ns,
                   std::int64_t published_ns);
  // `what`: a part of the file's name.
  void begin_file(std::string_view what, std::string_view cause);
  void go_on(std::string_view what, std::string_view cause);
  bool open_file(std::string_view what, std::string_view cause);
  bool may_take_more_of_the_disk(std::string_view what);
  file_names with_room_for_one(std::string_view what);
  void rename_to(std::string_view what);
  file_names names_of(std::string_view what) const;
  mcap::text_map notes_of(std::string_view what, std::string_view cause) const;
  void end_file();

  const recording_options chosen_;
  mcap::chunk_builder chunk_;
  std::deque<piece> pieces_;    // the oldest first
  std::size_t bytes_ = 0;       // of these
  std::size_t names_bytes_ = 0; // of what describes topics
  std::size_t forget_at_ = 0;   // when these are as many, what no piece needs is forgotten
  described_topics topics_;
  described_topic losses_;
  // What describes topics, by all that it says, so that who comes again takes no more.
  std::map<std::string, mcap::schema, std::less<>> schemas_;
  std::map<std::string, mcap::channel, std::less<>> channels_;
  number_pool schema_numbers_;
  number_pool channel_numbers_;
  triggers triggers_;
  std::optional<recording_file> file_;
  std::string what_;              // has happened, for which it is written
  std::uint32_t asked_notes_ = 0; // in it, of what was asked for
  rt::time_point until_{};        // it ends then,
  rt::time_point until_latest_{}; // and then, whatever happens
  rt::time_point now_{};
  rt::time_point chunk_due_{};
  std::string fault_;
  struct wish { // for a file that could not be made: it is tried again while its messages are there
    std::string what, cause;
    rt::time_point next{}, until{};
  };
  std::optional<wish> wish_;
  std::vector<std::string> unended_;
  std::string last_path_;
  std::uint64_t files_ = 0;
  std::uint64_t deleted_ = 0;
  std::uint64_t lost_ = 0;             // that the disk did not take, or for which there was no memory
  std::uint64_t written_messages_ = 0; // in files that have ended
  std::uint64_t written_bytes_ = 0;    // likewise
};

} // namespace rowe::recording
