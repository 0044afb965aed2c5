// SPDX-License-Identifier: Apache-2.0
#include "mcap/writer.hpp"

#include <algorithm>
#include <utility>

#include "mcap/check_sum.hpp"
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

writer::writer(sink& to, writer_options chosen) : to_{to}, chosen_{std::move(chosen)}, packs_{chosen_.how} {
  out_.assign(magic);
  record_writer into{out_};
  write_header(into, chosen_.profile, chosen_.library);
  put(out_);
}

writer::writer(sink& to, writer_options chosen, std::uint64_t bytes, summary so_far)
    : to_{to},
      chosen_{std::move(chosen)},
      packs_{chosen_.how},
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
  if (!is_new) return at->second;
  if (all_.schemas.size() == numbers_max) {
    schema_of_.erase(at);
    return {};
  }
  at->second = one.id = static_cast<schema_number>(all_.schemas.size() + 1);
  put_record(one);
  all_.schemas.emplace(one.id, std::move(one));
  return at->second;
}

std::optional<channel_number> writer::add_channel(schema_number schema, std::string_view topic,
                                                  std::string_view encoding, const text_map& metadata) {
  channel one{
      .schema = schema, .topic = std::string{topic}, .encoding = std::string{encoding}, .metadata = metadata};
  const auto [at, is_new] = channel_of_.try_emplace(key_of(one), channel_number{0});
  if (!is_new) return at->second;
  if (all_.channels.size() == numbers_max) {
    channel_of_.erase(at);
    return {};
  }
  at->second = one.id = static_cast<channel_number>(all_.channels.size() + 1);
  put_record(one);
  all_.channels.emplace(one.id, std::move(one));
  return at->second;
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
  placed_.push_back({one.channel, one.logged_ns, gathered_.size()});
  record_writer into{gathered_};
  write(into, one);
  times_.add(one.logged_ns);
  ++gathered_messages_;
  if (gathered_.size() >= chosen_.chunk_bytes) end_chunk();
}

void writer::end_chunk() {
  if (gathered_.empty()) return;
  chunk_index index{.times = times_,
                    .offset = bytes_,
                    .compression = std::string{name_of(chosen_.how)},
                    .plain_bytes = gathered_.size()};
  out_.clear();
  record_writer into{out_};
  into.begin(opcode::chunk);
  into.time(times_);
  into.number(index.plain_bytes);
  into.number(check_sum(gathered_));
  into.text(index.compression);
  const std::size_t length_at = out_.size();
  into.number(std::uint64_t{0});
  packs_.append(out_, gathered_);
  index.compressed_bytes = out_.size() - length_at - sizeof(std::uint64_t);
  into.patch(length_at, index.compressed_bytes);
  into.end();
  index.bytes = out_.size();
  append_indexes(index, placed_, index.offset);
  put(out_);
  if (writes_) {
    all_.counts.messages += gathered_messages_;
    all_.counts.times.add(times_);
    ++all_.counts.chunks;
    for (const placed_message& one : placed_) ++all_.counts.messages_of[one.channel];
    all_.chunks.push_back(std::move(index));
  }
  gathered_.clear();
  placed_.clear();
  times_ = {};
  gathered_messages_ = 0;
}

// A message index for each channel, behind what is in `out_`, which will lie at `out_at`.
void writer::append_indexes(chunk_index& of, std::vector<placed_message>& messages, std::uint64_t out_at) {
  std::stable_sort(messages.begin(), messages.end(), [](const placed_message& a, const placed_message& b) {
    return std::pair{a.channel, a.logged_ns} < std::pair{b.channel, b.logged_ns};
  });
  const std::size_t begin = out_.size();
  record_writer into{out_};
  for (auto first = messages.begin(); first != messages.end();) {
    const auto last = std::find_if(
        first, messages.end(), [first](const placed_message& one) { return one.channel != first->channel; });
    of.indexes.emplace_back(first->channel, out_at + out_.size());
    into.begin(opcode::message_index);
    into.number(first->channel);
    into.list([&] {
      for (; first != last; ++first) {
        into.number(first->logged_ns);
        into.number(first->offset);
      }
    });
    into.end();
  }
  of.indexes_bytes = out_.size() - begin;
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
  append_indexes(of, messages, bytes_);
  put(out_);
}

void writer::copy(chunk_index of, std::string_view whole_record, std::vector<placed_message> messages) {
  end_chunk();
  of.offset = bytes_;
  of.indexes.clear();
  out_.assign(whole_record);
  append_indexes(of, messages, of.offset);
  put(out_);
  if (!writes_) return;
  all_.counts.messages += messages.size();
  ++all_.counts.chunks;
  for (const placed_message& one : messages) {
    all_.counts.times.add(one.logged_ns);
    ++all_.counts.messages_of[one.channel];
  }
  all_.chunks.push_back(std::move(of));
}

} // namespace rowe::mcap
