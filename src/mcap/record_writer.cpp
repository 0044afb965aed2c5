// SPDX-License-Identifier: Apache-2.0
#include "mcap/record_writer.hpp"

#include "mcap/check_sum.hpp"

namespace rowe::mcap {

void write(record_writer& into, const schema& one) {
  into.begin(opcode::schema);
  into.number(one.id);
  into.text(one.name);
  into.text(one.encoding);
  into.text(one.data);
  into.end();
}

void write(record_writer& into, const channel& one) {
  into.begin(opcode::channel);
  into.number(one.id);
  into.number(one.schema);
  into.text(one.topic);
  into.text(one.encoding);
  into.map(one.metadata);
  into.end();
}

void write(record_writer& into, const message& one) {
  into.begin(opcode::message);
  into.number(one.channel);
  into.number(one.sequence);
  into.number(one.logged_ns);
  into.number(one.published_ns);
  into.bytes(one.data);
  into.end();
}

void write(record_writer& into, const chunk_index& one) {
  into.begin(opcode::chunk_index);
  into.time(one.times);
  into.number(one.offset);
  into.number(one.bytes);
  into.list([&] {
    for (const auto& [channel, offset] : one.indexes) {
      into.number(channel);
      into.number(offset);
    }
  });
  into.number(one.indexes_bytes);
  into.text(one.compression);
  into.number(one.compressed_bytes);
  into.number(one.plain_bytes);
  into.end();
}

void write(record_writer& into, const attachment_index& one) {
  into.begin(opcode::attachment_index);
  into.number(one.offset);
  into.number(one.bytes);
  into.number(one.logged_ns);
  into.number(one.created_ns);
  into.number(one.data_bytes);
  into.text(one.name);
  into.text(one.media_type);
  into.end();
}

void write(record_writer& into, const metadata_index& one) {
  into.begin(opcode::metadata_index);
  into.number(one.offset);
  into.number(one.bytes);
  into.text(one.name);
  into.end();
}

void write(record_writer& into, const statistics& one, std::size_t schemas, std::size_t channels) {
  into.begin(opcode::statistics);
  into.number(one.messages);
  into.number(static_cast<std::uint16_t>(schemas));
  into.number(static_cast<std::uint32_t>(channels));
  into.number(one.attachments);
  into.number(one.metadata);
  into.number(one.chunks);
  into.time(one.times);
  into.list([&] {
    for (const auto& [channel, count] : one.messages_of) {
      into.number(channel);
      into.number(count);
    }
  });
  into.end();
}

void write_header(record_writer& into, std::string_view profile, std::string_view program) {
  into.begin(opcode::header);
  into.text(profile);
  into.text(program);
  into.end();
}

void write_metadata(record_writer& into, std::string_view name, const text_map& values) {
  into.begin(opcode::metadata);
  into.text(name);
  into.map(values);
  into.end();
}

void write_data_end(record_writer& into) {
  into.begin(opcode::data_end);
  into.number(std::uint32_t{0}); // no checksum of all: each chunk has its own
  into.end();
}

void write_end(std::string& into, std::uint64_t at, const summary& all) {
  record_writer out{into};
  write_data_end(out);
  const std::uint64_t begin = at + into.size();
  struct group {
    opcode of;
    std::uint64_t offset;
    std::uint64_t bytes;
  };
  std::vector<group> groups;
  const auto add = [&](opcode of, auto&& write_all) {
    const std::size_t from = into.size();
    write_all();
    if (into.size() != from) groups.push_back({of, at + from, into.size() - from});
  };
  add(opcode::schema, [&] {
    for (const auto& [id, one] : all.schemas) write(out, one);
  });
  add(opcode::channel, [&] {
    for (const auto& [id, one] : all.channels) write(out, one);
  });
  add(opcode::statistics, [&] { write(out, all.counts, all.schemas.size(), all.channels.size()); });
  add(opcode::chunk_index, [&] {
    for (const chunk_index& one : all.chunks) write(out, one);
  });
  add(opcode::attachment_index, [&] {
    for (const attachment_index& one : all.attachments) write(out, one);
  });
  add(opcode::metadata_index, [&] {
    for (const metadata_index& one : all.metadata) write(out, one);
  });
  const std::uint64_t offsets = at + into.size();
  for (const group& one : groups) {
    out.begin(opcode::summary_offset);
    out.number(static_cast<std::uint8_t>(one.of));
    out.number(one.offset);
    out.number(one.bytes);
    out.end();
  }
  out.number(static_cast<std::uint8_t>(opcode::footer));
  out.number(std::uint64_t{footer_bytes}); // the checksum covers it
  out.number(begin);
  out.number(offsets);
  out.number(check_sum(std::string_view{into}.substr(begin - at)));
  into.append(magic);
}

} // namespace rowe::mcap
