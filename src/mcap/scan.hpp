// SPDX-License-Identifier: Apache-2.0
// Looks through a whole recording, record by record, and says what is there and what is damaged. It needs no
// summary, so it reads what a program left that was killed. Behind what is damaged it goes on with the next
// chunk. Allocates, and waits for its source.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "mcap/compression.hpp"
#include "mcap/format.hpp"
#include "mcap/record_reader.hpp"
#include "mcap/sink.hpp"
#include "mcap/writer.hpp"

namespace rowe::mcap {

// A part of a file that cannot be read, and why.
struct damage {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::string why;
};

// Messages that lie in no chunk, one behind the other.
struct loose_messages {
  time_span times{};
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::uint64_t count = 0;
};

struct findings {
  std::string wrong; // not empty: it is no recording, or cannot be read at all
  header head;
  bool has_head = false;
  // As it is found, whatever the file's own summary says. A chunk's message index that is missing has the
  // offset 0.
  summary all;
  std::vector<loose_messages> loose;
  std::vector<damage> damaged;
  std::uint64_t unknown_records = 0;  // of kinds that this version does not know
  std::uint64_t unknown_messages = 0; // whose channel is described nowhere in front of them
  std::uint64_t whole_until = 0; // the end of the last whole record of messages, or of what describes them
  bool ended = false;            // the footer and the magic at the end are there
};

// What is told while a file is looked through; each may be empty.
struct scan_visitor {
  std::function<void(const schema&)> on_schema{};
  std::function<void(const channel&)> on_channel{};
  // With the whole record, and where its messages lie in its plain records.
  std::function<void(const chunk_index&, std::string_view, const std::vector<placed_message>&)> on_chunk{};
  std::function<void(const message&)> on_loose_message{};
  std::function<void(const attachment_index&, std::string_view)> on_attachment{};
  std::function<void(const metadata_index&, std::string_view)> on_metadata{};
  std::function<void(std::uint64_t bytes_read)> on_progress{};
};

findings scan(source& from, const scan_visitor& tell = {});

// ---- for readers, too

// The plain records of a chunk, whose record's content this is. Empty text: all is well; else why not.
std::string unpack_chunk(std::string_view content, decompressor& by, std::string& records);

// The messages in records, by their places; what describes them is told. False: they are damaged.
bool list_messages(std::string_view records, std::vector<placed_message>& into,
                   const scan_visitor& tell = {});

} // namespace rowe::mcap
