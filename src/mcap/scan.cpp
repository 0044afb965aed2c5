// SPDX-License-Identifier: Apache-2.0
#include "mcap/scan.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "mcap/check_sum.hpp"

namespace rowe::mcap {
namespace {

constexpr std::size_t window_bytes = std::size_t{1} << 20;
constexpr std::uint64_t loose_bytes_max = std::uint64_t{4} << 20; // of one run of messages

// A file through a window, so that small records cost no call of their own.
class window {
 public:
  explicit window(source& from) noexcept : from_{from}, bytes_{from.bytes()} {}

  std::uint64_t bytes() const noexcept { return bytes_; }
  // `count` bytes from `at` on, valid until the next call; fewer at the end of the file, or if it fails.
  std::string_view look(std::uint64_t at, std::uint64_t count) {
    if (at >= bytes_) return {};
    count = std::min(count, bytes_ - at);
    if (at < at_ || at + count > at_ + held_.size()) {
      held_.resize(
          static_cast<std::size_t>(std::min(std::max<std::uint64_t>(count, window_bytes), bytes_ - at)));
      at_ = at;
      if (!from_.read(at, held_)) {
        held_.clear();
        failed_ = true;
        return {};
      }
    }
    return std::string_view{held_}.substr(static_cast<std::size_t>(at - at_),
                                          static_cast<std::size_t>(count));
  }
  bool failed() const noexcept { return failed_; }

 private:
  source& from_;
  std::uint64_t bytes_;
  std::uint64_t at_ = 0;
  std::string held_;
  bool failed_ = false;
};

// Whether a record's content may be that of a chunk: its lengths fit each other, and its compression has a
// name. The begin of it is enough.
bool fits_chunk(std::string_view content, std::uint64_t content_bytes) noexcept {
  const auto read = read_chunk_head(content);
  return read && compression_named(read->first.compression) &&
         content_bytes == read->second + read->first.packed_bytes;
}
bool fits_chunk(std::string_view content) noexcept { return fits_chunk(content, content.size()); }

// Whether a chunk may begin here, `left` bytes before the end of the file.
bool may_be_chunk(std::string_view bytes, std::uint64_t left) noexcept {
  field_reader head{bytes};
  const bool says_so = head.number<std::uint8_t>() == static_cast<std::uint8_t>(opcode::chunk);
  const auto content_bytes = head.number<std::uint64_t>();
  return says_so && head.whole() && left >= record_head_bytes && content_bytes <= left - record_head_bytes &&
         fits_chunk(head.rest(), content_bytes);
}

class scanner {
 public:
  scanner(source& from, const scan_visitor& tell) : file_{from}, tell_{tell} {}

  findings run() {
    if (file_.look(0, magic.size()) != magic) {
      found_.wrong = file_.failed() ? "it cannot be read" : "it does not begin as a recording (MCAP 0) does";
      return std::move(found_);
    }
    at_ = found_.whole_until = magic.size();
    while (at_ < file_.bytes() && !ended_ && !file_.failed()) {
      if (tell_.on_progress) tell_.on_progress(at_);
      step();
    }
    if (file_.failed()) found_.wrong = "it cannot be read from byte " + std::to_string(at_) + " on";
    if (!ended_ && found_.damaged.empty() && at_ > found_.whole_until)
      found_.damaged.push_back({found_.whole_until, at_ - found_.whole_until, "it ends here"});
    found_.all.counts.chunks = static_cast<std::uint32_t>(found_.all.chunks.size());
    found_.all.counts.attachments = static_cast<std::uint32_t>(found_.all.attachments.size());
    found_.all.counts.metadata = static_cast<std::uint32_t>(found_.all.metadata.size());
    return std::move(found_);
  }

 private:
  void step() {
    field_reader head{file_.look(at_, record_head_bytes)};
    const auto what = head.number<std::uint8_t>();
    const auto content_bytes = head.number<std::uint64_t>();
    const std::uint64_t left = file_.bytes() - at_;
    if (!head.whole()) return skip_damage(left, "a record is cut off");
    if (what == 0) return skip_damage(1, "there is no record");
    if (content_bytes > left - record_head_bytes) return skip_damage(1, "a record is longer than the file");
    const std::uint64_t bytes = record_head_bytes + content_bytes;
    if (content_bytes > chunk_bytes_max) return skip_damage(1, "a record is longer than 1 GiB");
    const std::string_view whole = file_.look(at_, bytes);
    if (whole.size() != bytes) return; // it cannot be read
    take(static_cast<opcode>(what), whole);
  }

  void take(opcode what, std::string_view whole) {
    const std::string_view content = whole.substr(record_head_bytes);
    bool good = true;
    switch (what) {
    case opcode::header: {
      auto read = read_header(content);
      good = read.has_value();
      if (good) found_.head = *std::move(read);
      found_.has_head = good || found_.has_head;
      break;
    }
    case opcode::schema:
    case opcode::channel: good = describe(what, content); break;
    case opcode::message: good = take_loose(content, whole.size()); break;
    case opcode::chunk: return take_chunk(whole, content);
    case opcode::attachment: good = take_attachment(whole, content); break;
    case opcode::metadata: good = take_metadata(whole, content); break;
    case opcode::message_index: good = take_message_index(content, whole.size()); break;
    case opcode::data_end:
      good = content.size() == data_end_bytes;
      data_ended_ = data_ended_ || good;
      break;
    case opcode::footer:
      good = content.size() == footer_bytes && at_ + whole.size() + magic.size() == file_.bytes();
      if (good) return take_footer(whole.size());
      break;
    // All of this is found anew.
    case opcode::chunk_index: good = read_chunk_index(content).has_value(); break;
    case opcode::attachment_index: good = read_attachment_index(content).has_value(); break;
    case opcode::statistics: good = read_statistics(content).has_value(); break;
    case opcode::metadata_index: good = read_metadata_index(content).has_value(); break;
    case opcode::summary_offset: good = content.size() == summary_offset_bytes; break;
    default:
      good = !fits_chunk(content) && !swallows_chunk(whole.size());
      found_.unknown_records += good ? 1 : 0;
    }
    if (!good) return skip_damage(1, "a record says what it cannot");
    at_ += whole.size();
    if (!data_ended_) found_.whole_until = at_;
  }

  bool describe(opcode what, std::string_view content) {
    if (what == opcode::schema) {
      auto read = read_schema(content);
      if (!read) return false;
      const auto [at, is_new] = found_.all.schemas.try_emplace(read->id, *read);
      if (is_new && tell_.on_schema) tell_.on_schema(at->second);
      return true;
    }
    auto read = read_channel(content);
    if (!read) return false;
    const auto [at, is_new] = found_.all.channels.try_emplace(read->id, *read);
    if (is_new && tell_.on_channel) tell_.on_channel(at->second);
    return true;
  }

  void count(channel_number channel, std::uint64_t logged_ns) {
    ++found_.all.counts.messages;
    found_.all.counts.times.add(logged_ns);
    ++found_.all.counts.messages_of[channel];
    if (!found_.all.channels.contains(channel)) ++found_.unknown_messages;
  }

  bool take_loose(std::string_view content, std::size_t bytes) {
    const auto read = read_message(content);
    if (!read) return false;
    if (found_.loose.empty() || found_.loose.back().offset + found_.loose.back().bytes != at_ ||
        found_.loose.back().bytes > loose_bytes_max)
      found_.loose.push_back({.offset = at_});
    loose_messages& run = found_.loose.back();
    run.bytes += bytes;
    run.times.add(read->logged_ns);
    ++run.count;
    count(read->channel, read->logged_ns);
    if (tell_.on_loose_message) tell_.on_loose_message(*read);
    return true;
  }

  void take_chunk(std::string_view whole, std::string_view content) {
    // A length that does not fit may hide other chunks.
    if (!fits_chunk(content)) return skip_damage(1, "the lengths of a chunk do not fit each other");
    std::string why = unpack_chunk(content, unpacks_, records_);
    placed_.clear();
    // What it describes is told only when all of it is whole.
    if (why.empty() && !list_messages(records_, placed_)) why = "the records of a chunk are damaged";
    if (!why.empty()) {
      found_.damaged.push_back({at_, whole.size(), std::move(why)});
      at_ += whole.size();
      return;
    }
    scan_visitor inner;
    inner.on_schema = [this](const schema& one) { add(found_.all.schemas, one, tell_.on_schema); };
    inner.on_channel = [this](const channel& one) { add(found_.all.channels, one, tell_.on_channel); };
    std::vector<placed_message> again;
    (void)list_messages(records_, again, inner);
    const auto head = read_chunk_head(content);
    chunk_index index{.offset = at_,
                      .bytes = whole.size(),
                      .compression = std::string{head->first.compression},
                      .compressed_bytes = head->first.packed_bytes,
                      .plain_bytes = head->first.plain_bytes};
    std::set<channel_number> channels;
    for (const placed_message& one : placed_) {
      index.times.add(one.logged_ns);
      count(one.channel, one.logged_ns);
      if (channels.insert(one.channel).second) index.indexes.emplace_back(one.channel, 0);
    }
    if (tell_.on_chunk) tell_.on_chunk(index, whole, placed_);
    found_.all.chunks.push_back(std::move(index));
    at_ += whole.size();
    found_.whole_until = at_;
  }
  template <class Map, class One, class Tell>
  static void add(Map& all, const One& one, const Tell& tell) {
    if (all.try_emplace(one.id, one).second && tell) tell(one);
  }

  bool take_attachment(std::string_view whole, std::string_view content) {
    field_reader from{content};
    attachment_index index{.offset = at_, .bytes = whole.size()};
    index.logged_ns = from.number<std::uint64_t>();
    index.created_ns = from.number<std::uint64_t>();
    index.name = from.text();
    index.media_type = from.text();
    index.data_bytes = from.number<std::uint64_t>();
    (void)from.bytes(index.data_bytes);
    const auto sum = from.number<std::uint32_t>();
    if (!from.whole()) return false;
    if (sum != 0 && sum != check_sum(content.substr(0, content.size() - from.rest().size() - sizeof sum)))
      return false;
    if (tell_.on_attachment) tell_.on_attachment(index, whole);
    found_.all.attachments.push_back(std::move(index));
    return true;
  }
  bool take_metadata(std::string_view whole, std::string_view content) {
    auto read = read_metadata(content);
    if (!read) return false;
    metadata_index index{.offset = at_, .bytes = whole.size(), .name = std::move(read->first)};
    if (tell_.on_metadata) tell_.on_metadata(index, whole);
    found_.all.metadata.push_back(std::move(index));
    return true;
  }
  void take_footer(std::size_t bytes) {
    at_ += bytes;
    ended_ = true;
    found_.ended = file_.look(at_, magic.size()) == magic;
  }

  // Of the chunk in front of it.
  bool take_message_index(std::string_view content, std::uint64_t bytes) {
    field_reader from{content};
    const auto channel = from.number<channel_number>();
    const std::string_view entries = from.text();
    if (!from.whole() || !from.rest().empty() || entries.size() % (2 * sizeof(std::uint64_t)) != 0)
      return false;
    if (found_.all.chunks.empty()) return true;
    chunk_index& of = found_.all.chunks.back();
    if (of.offset + of.bytes + of.indexes_bytes != at_) return true;
    for (auto& [indexed, offset] : of.indexes) offset = indexed == channel ? at_ : offset;
    of.indexes_bytes += bytes;
    return true;
  }
  // A record whose kind or length is damaged may seem to hold what stands behind it.
  bool swallows_chunk(std::uint64_t bytes) { return next_chunk(at_ + 1, at_ + bytes) < at_ + bytes; }

  // Goes on with the next chunk, or to the end of the file.
  void skip_damage(std::uint64_t at_least, std::string why) {
    const std::uint64_t begin = at_;
    at_ = next_chunk(begin + at_least, file_.bytes());
    found_.damaged.push_back({begin, at_ - begin, std::move(why)});
  }
  // Where one begins before `end`, or `end`.
  std::uint64_t next_chunk(std::uint64_t from, std::uint64_t end) {
    constexpr std::size_t head_bytes = record_head_bytes + chunk_head_bytes_min + 8;
    while (from < end) {
      const std::string_view here = file_.look(from, std::min<std::uint64_t>(window_bytes, end - from));
      if (here.empty()) break;
      const std::size_t found = here.find(static_cast<char>(opcode::chunk));
      if (found == here.npos) {
        from += here.size();
        continue;
      }
      from += found;
      if (may_be_chunk(file_.look(from, head_bytes), file_.bytes() - from)) return from;
      ++from;
    }
    return end;
  }

  window file_;
  const scan_visitor& tell_;
  findings found_;
  decompressor unpacks_;
  std::string records_;
  std::vector<placed_message> placed_;
  std::uint64_t at_ = 0;
  bool data_ended_ = false;
  bool ended_ = false;
};

} // namespace

findings scan(source& from, const scan_visitor& tell) { return scanner{from, tell}.run(); }

std::string unpack_chunk(std::string_view content, decompressor& by, std::string& records) {
  const auto read = read_chunk_head(content);
  if (!read) return "a chunk is cut off";
  const auto& [head, head_bytes] = *read;
  const auto how = compression_named(head.compression);
  if (!how) return "a chunk is compressed by `" + std::string{head.compression} + "`; lz4 and zstd are known";
  if (head.plain_bytes > chunk_bytes_max)
    return "a chunk has " + std::to_string(head.plain_bytes) + " bytes; the limit is " +
           std::to_string(chunk_bytes_max);
  const std::string_view packed = content.substr(head_bytes);
  if (packed.size() < head.packed_bytes) return "a chunk is cut off";
  if (!by.unpack(*how, packed.substr(0, static_cast<std::size_t>(head.packed_bytes)), head.plain_bytes,
                 records))
    return "a chunk cannot be decompressed";
  if (head.plain_check_sum != 0 && head.plain_check_sum != check_sum(records))
    return "a chunk's checksum is not that of what is in it";
  return {};
}

bool list_messages(std::string_view records, std::vector<placed_message>& into, const scan_visitor& tell) {
  for (std::string_view rest = records; !rest.empty();) {
    const std::size_t at = records.size() - rest.size();
    const auto one = next_record(rest);
    if (!one || one->what == opcode{}) return false;
    if (one->what == opcode::message) {
      const auto read = read_message(one->content);
      if (!read) return false;
      into.push_back({read->channel, read->logged_ns, at});
    } else if (one->what == opcode::schema) {
      const auto read = read_schema(one->content);
      if (!read) return false;
      if (tell.on_schema) tell.on_schema(*read);
    } else if (one->what == opcode::channel) {
      const auto read = read_channel(one->content);
      if (!read) return false;
      if (tell.on_channel) tell.on_channel(*read);
    }
  }
  return true;
}

} // namespace rowe::mcap
