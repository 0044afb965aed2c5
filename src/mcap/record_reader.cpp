// SPDX-License-Identifier: Apache-2.0
#include "mcap/record_reader.hpp"

namespace rowe::mcap {
namespace {

text_map read_map(field_reader& from) {
  text_map all;
  from.list([&](field_reader& entry) {
    const std::string_view name = entry.text();
    const std::string_view value = entry.text();
    if (entry.whole()) all.insert_or_assign(std::string{name}, std::string{value});
  });
  return all;
}

template <class T>
std::optional<T> if_whole(const field_reader& from, T&& read) {
  return from.whole() ? std::optional<T>{std::forward<T>(read)} : std::nullopt;
}

} // namespace

std::optional<record> next_record(std::string_view& from) noexcept {
  field_reader head{from};
  const auto what = head.number<std::uint8_t>();
  const std::string_view content = head.bytes(head.number<std::uint64_t>());
  if (!head.whole()) return {};
  from = head.rest();
  return record{static_cast<opcode>(what), content};
}

std::optional<header> read_header(std::string_view content) {
  field_reader from{content};
  header read;
  read.profile = from.text();
  read.program = from.text();
  return if_whole(from, std::move(read));
}

std::optional<footer> read_footer(std::string_view content) noexcept {
  field_reader from{content};
  footer read;
  read.summary_at = from.number<std::uint64_t>();
  read.offsets_at = from.number<std::uint64_t>();
  read.check_sum = from.number<std::uint32_t>();
  return if_whole(from, std::move(read));
}

std::optional<schema> read_schema(std::string_view content) {
  field_reader from{content};
  schema read;
  read.id = from.number<std::uint16_t>();
  read.name = from.text();
  read.encoding = from.text();
  read.data = from.text();
  if (read.id == 0) return {};
  return if_whole(from, std::move(read));
}

std::optional<channel> read_channel(std::string_view content) {
  field_reader from{content};
  channel read;
  read.id = from.number<std::uint16_t>();
  read.schema = from.number<std::uint16_t>();
  read.topic = from.text();
  read.encoding = from.text();
  read.metadata = read_map(from);
  return if_whole(from, std::move(read));
}

std::optional<message> read_message(std::string_view content) noexcept {
  field_reader from{content};
  message read;
  read.channel = from.number<std::uint16_t>();
  read.sequence = from.number<std::uint32_t>();
  read.logged_ns = from.number<std::uint64_t>();
  read.published_ns = from.number<std::uint64_t>();
  read.data = from.rest();
  return if_whole(from, std::move(read));
}

std::optional<chunk_index> read_chunk_index(std::string_view content) {
  field_reader from{content};
  chunk_index read;
  read.times = from.times();
  read.offset = from.number<std::uint64_t>();
  read.bytes = from.number<std::uint64_t>();
  from.list([&](field_reader& entry) {
    const auto channel = entry.number<std::uint16_t>();
    const auto offset = entry.number<std::uint64_t>();
    if (entry.whole()) read.indexes.emplace_back(channel, offset);
  });
  read.indexes_bytes = from.number<std::uint64_t>();
  read.compression = from.text();
  read.compressed_bytes = from.number<std::uint64_t>();
  read.plain_bytes = from.number<std::uint64_t>();
  return if_whole(from, std::move(read));
}

std::optional<attachment_index> read_attachment_index(std::string_view content) {
  field_reader from{content};
  attachment_index read;
  read.offset = from.number<std::uint64_t>();
  read.bytes = from.number<std::uint64_t>();
  read.logged_ns = from.number<std::uint64_t>();
  read.created_ns = from.number<std::uint64_t>();
  read.data_bytes = from.number<std::uint64_t>();
  read.name = from.text();
  read.media_type = from.text();
  return if_whole(from, std::move(read));
}

std::optional<metadata_index> read_metadata_index(std::string_view content) {
  field_reader from{content};
  metadata_index read;
  read.offset = from.number<std::uint64_t>();
  read.bytes = from.number<std::uint64_t>();
  read.name = from.text();
  return if_whole(from, std::move(read));
}

std::optional<statistics> read_statistics(std::string_view content) {
  field_reader from{content};
  statistics read;
  read.messages = from.number<std::uint64_t>();
  (void)from.number<std::uint16_t>(); // schemas and
  (void)from.number<std::uint32_t>(); // channels: the summary has them
  read.attachments = from.number<std::uint32_t>();
  read.metadata = from.number<std::uint32_t>();
  read.chunks = from.number<std::uint32_t>();
  const time_span times = from.times();
  if (read.messages != 0) read.times = times;
  from.list([&](field_reader& entry) {
    const auto channel = entry.number<std::uint16_t>();
    const auto count = entry.number<std::uint64_t>();
    if (entry.whole()) read.messages_of[channel] = count;
  });
  return if_whole(from, std::move(read));
}

std::optional<std::pair<std::string, text_map>> read_metadata(std::string_view content) {
  field_reader from{content};
  std::string name{from.text()};
  text_map values = read_map(from);
  return if_whole(from, std::pair{std::move(name), std::move(values)});
}

std::optional<std::pair<chunk_head, std::size_t>> read_chunk_head(std::string_view content) noexcept {
  field_reader from{content};
  chunk_head read;
  read.times = from.times();
  read.plain_bytes = from.number<std::uint64_t>();
  read.plain_check_sum = from.number<std::uint32_t>();
  read.compression = from.text();
  read.packed_bytes = from.number<std::uint64_t>();
  return if_whole(from, std::pair{read, content.size() - from.rest().size()});
}

} // namespace rowe::mcap
