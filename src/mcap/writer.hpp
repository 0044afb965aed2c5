// SPDX-License-Identifier: Apache-2.0
// Writes a recording: messages are gathered into chunks, each is compressed and written by one call together
// with its index, and the summary follows at the end. So whatever ends the program, what was written before
// is whole, but for the chunk that was being written. One thread at a time; allocates, and waits for its
// sink.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mcap/chunk_builder.hpp"
#include "mcap/compression.hpp"
#include "mcap/format.hpp"
#include "mcap/sink.hpp"

namespace rowe::mcap {

struct writer_options {
  compression how = compression::zstd;
  std::size_t chunk_bytes =
      1 << 20; // a chunk ends when it holds as many; a longer message has one of its own
  std::string profile{};
  std::string program{};
};

class writer {
 public:
  // Writes the begin of the file.
  writer(sink& to, writer_options chosen);
  // Goes on behind what a file holds already, up to `bytes`: `so_far`.
  writer(sink& to, writer_options chosen, std::uint64_t bytes, summary so_far);

  // Numbers for what is new; those of what was added before if it is the same. None: 65 535 are taken.
  std::optional<schema_number> add_schema(std::string_view name, std::string_view encoding,
                                          std::string_view data);
  std::optional<channel_number> add_channel(schema_number schema, std::string_view topic,
                                            std::string_view encoding, const text_map& metadata = {});

  // To the chunk that is gathered. `one.channel` was given by add_channel().
  void add(const message& one);
  // Ends the chunk, if it holds anything, and writes it.
  void end_chunk();
  // Written at once, behind the chunk that is gathered.
  void add_metadata(std::string_view name, const text_map& values);
  // Ends the file. Nothing may be added then.
  void end();

  // False once the sink has refused something. What it has taken is whole up to whole_bytes().
  bool writes() const noexcept { return writes_; }
  std::uint64_t bytes() const noexcept { return bytes_; }             // that the sink was given
  std::uint64_t whole_bytes() const noexcept { return whole_bytes_; } // with the last record that it took
  std::size_t gathered_bytes() const noexcept { return chunk_.bytes(); }
  std::uint64_t messages() const noexcept { return all_.counts.messages + chunk_.messages().size(); }

  // ---- for repair: what another file holds, as it is there

  // A whole record of this kind: an attachment or metadata.
  void copy(const attachment_index& of, std::string_view whole_record);
  void copy(const metadata_index& of, std::string_view whole_record);
  // A whole chunk; of `of` the offsets are those of the other file. `messages` are what it holds, in their
  // order, by the offset of each in its plain records.
  void copy(chunk_index of, std::string_view whole_record, std::vector<placed_message> messages);
  // The message index of the chunk that was written last, if the file ends behind that.
  void index_last_chunk(std::vector<placed_message> messages);
  void copy(const schema& one);
  void copy(const channel& one);

  const summary& written() const noexcept { return all_; }
  // How many channels all chunks have together: each takes 16 bytes in memory, and in the file's summary.
  std::uint64_t index_entries() const noexcept { return index_entries_; }

 private:
  void put(std::string_view bytes);
  template <class Record>
  void put_record(const Record& one);
  void note_chunk(chunk_index index, const std::vector<placed_message>& messages);

  sink& to_;
  writer_options chosen_;
  chunk_builder chunk_;
  summary all_;
  std::map<std::string, schema_number, std::less<>> schema_of_;   // by all that it says
  std::map<std::string, channel_number, std::less<>> channel_of_; // likewise
  std::string out_;
  std::uint64_t index_entries_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t whole_bytes_ = 0;
  bool writes_ = true;
};

} // namespace rowe::mcap
