// SPDX-License-Identifier: Apache-2.0
#include "mcap/writer.hpp"

#include <algorithm>
#include <utility>

#include "mcap/record_writer.hpp"

namespace rowe::mcap {
namespace {

constexpr std::size_t numbers_max = 65535;

// What only one schema or channel says: all of its record but the number.
template <class Record>
std::string key_of(Record one) {
  one.id = 0;
  std::string key;
  record_writer into{key};
  write(into, one);
  return key;
}

} // namespace

writer::writer(sink& to, writer_options chosen) : to_{to}, chosen_{std::move(chosen)}, chunk_{chosen_.how} {
  out_.assign(magic);
  record_writer into{out_};
  write_header(into, chosen_.profile, chosen_.program);
  put(out_);
}

writer::writer(sink& to, writer_options chosen, std::uint64_t bytes, summary so_far)
    : to_{to},
      chosen_{std::move(chosen)},
      chunk_{chosen_.how},
      all_{std::move(so_far)},
      bytes_{bytes},
      whole_bytes_{bytes} {
  for (const auto& [id, one] : all_.schemas) schema_of_.emplace(key_of(one), id);
  for (const auto& [id, one] : all_.channels) channel_of_.emplace(key_of(one), id);
}

std::optional<schema_number> writer::add_schema(std::string_view name, std::string_view encoding,
                                                std::string_view data) {
  schema one{.name = std::string{name}, .encoding = std::string{encoding}, .data = std::string{data}};
  const auto [at, is_new] = schema_of_.try_emplace(key_of(one), schema_number{0});
  if (!is_new && at->second != 0) return at->second;
  if (all_.schemas.size() == numbers_max) {
    schema_of_.erase(at);
    return {};
  }
  one.id = static_cast<schema_number>(all_.schemas.size() + 1);
  all_.schemas.emplace(one.id, one);
  at->second = one.id;
  put_record(one);
  return one.id;
}

std::optional<channel_number> writer::add_channel(schema_number schema, std::string_view topic,
                                                  std::string_view encoding, const text_map& metadata) {
  channel one{
      .schema = schema, .topic = std::string{topic}, .encoding = std::string{encoding}, .metadata = metadata};
  const auto [at, is_new] = channel_of_.try_emplace(key_of(one), channel_number{0});
  if (!is_new && at->second != 0) return at->second;
  if (all_.channels.size() == numbers_max) {
    channel_of_.erase(at);
    return {};
  }
  one.id = static_cast<channel_number>(all_.channels.size() + 1);
  all_.channels.emplace(one.id, one);
  at->second = one.id;
  put_record(one);
  return one.id;
}

// Not in a chunk: so no damage to one makes others unreadable.
template <class Record>
void writer::put_record(const Record& one) {
  out_.clear();
  record_writer into{out_};
  write(into, one);
  put(out_);
}

void writer::add(const message& one) {
  chunk_.add(one);
  if (chunk_.bytes() >= chosen_.chunk_bytes) end_chunk();
}

void writer::end_chunk() {
  if (chunk_.empty()) return;
  out_.clear();
  std::vector<placed_message> messages;
  chunk_index index = chunk_.finish(out_, bytes_, messages);
  put(out_);
  if (writes_) note_chunk(std::move(index), messages);
}

void writer::note_chunk(chunk_index index, const std::vector<placed_message>& messages) {
  all_.counts.messages += messages.size();
  all_.counts.times.add(index.times);
  ++all_.counts.chunks;
  for (const placed_message& one : messages) ++all_.counts.messages_of[one.channel];
  index_entries_ += index.indexes.size();
  index.indexes.shrink_to_fit();
  all_.chunks.push_back(std::move(index));
}

void writer::add_metadata(std::string_view name, const text_map& values) {
  out_.clear();
  record_writer into{out_};
  write_metadata(into, name, values);
  metadata_index index{.offset = bytes_, .bytes = out_.size(), .name = std::string{name}};
  put(out_);
  if (!writes_) return;
  all_.metadata.push_back(std::move(index));
  ++all_.counts.metadata;
}

void writer::end() {
  end_chunk();
  out_.clear();
  write_end(out_, bytes_, all_);
  put(out_);
}

void writer::put(std::string_view bytes) {
  if (!writes_) return;
  bytes_ += bytes.size();
  writes_ = to_.write(bytes);
  if (writes_) whole_bytes_ = bytes_;
}

// ---- for repair

void writer::copy(const schema& one) {
  put_record(one);
  all_.schemas.insert_or_assign(one.id, one);
}

void writer::copy(const channel& one) {
  put_record(one);
  all_.channels.insert_or_assign(one.id, one);
}

void writer::copy(const attachment_index& of, std::string_view whole_record) {
  attachment_index index = of;
  index.offset = bytes_;
  put(whole_record);
  if (!writes_) return;
  all_.attachments.push_back(std::move(index));
  ++all_.counts.attachments;
}

void writer::copy(const metadata_index& of, std::string_view whole_record) {
  metadata_index index = of;
  index.offset = bytes_;
  put(whole_record);
  if (!writes_) return;
  all_.metadata.push_back(std::move(index));
  ++all_.counts.metadata;
}

void writer::index_last_chunk(std::vector<placed_message> messages) {
  chunk_index& of = all_.chunks.back();
  of.indexes.clear();
  out_.clear();
  chunk_builder::append_indexes(out_, of, messages, bytes_);
  put(out_);
}

void writer::copy(chunk_index of, std::string_view whole_record, std::vector<placed_message> messages) {
  end_chunk();
  of.offset = bytes_;
  of.indexes.clear();
  out_.assign(whole_record);
  chunk_builder::append_indexes(out_, of, messages, of.offset + out_.size());
  put(out_);
  if (!writes_) return;
  note_chunk(std::move(of), messages);
}

} // namespace rowe::mcap
