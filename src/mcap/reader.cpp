// SPDX-License-Identifier: Apache-2.0
#include "mcap/reader.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "mcap/check_sum.hpp"

namespace rowe::mcap {
namespace {

// A summary that is longer is not read: the file is looked through instead.
constexpr std::uint64_t summary_bytes_max = std::uint64_t{1} << 30;
// Of one record of it.
constexpr std::uint64_t metadata_bytes_max = std::uint64_t{16} << 20;
// As many schemas and channels as there can be; what has more is looked through as fast.
constexpr int unlisted_records_max = 2 * 65535;

} // namespace

bool reader::open(const std::function<void(std::uint64_t)>& on_progress) {
  has_summary_ = read_summary();
  if (!has_summary_) {
    findings found = scan(from_, {.on_progress = on_progress});
    wrong_ = std::move(found.wrong);
    if (!wrong_.empty()) return false;
    head_ = std::move(found.head);
    all_ = std::move(found.all);
    damaged_ = std::move(found.damaged);
    for (const loose_messages& one : found.loose)
      pieces_.push_back({.times = one.times, .offset = one.offset, .bytes = one.bytes});
  }
  for (const chunk_index& one : all_.chunks) {
    pieces_.push_back({.times = one.times, .offset = one.offset, .bytes = one.bytes, .is_chunk = true});
    for (const auto& [channel, offset] : one.indexes) pieces_.back().channels.push_back(channel);
  }
  std::stable_sort(pieces_.begin(), pieces_.end(), [](const piece& a, const piece& b) {
    return std::pair{a.times.earliest_ns, a.offset} < std::pair{b.times.earliest_ns, b.offset};
  });
  select({});
  return true;
}

// ---- the summary

bool reader::read_summary() {
  const std::uint64_t bytes = from_.bytes();
  constexpr std::size_t tail_bytes = record_head_bytes + footer_bytes + magic.size();
  std::string text(tail_bytes, '\0');
  if (bytes < magic.size() + tail_bytes || !from_.read(bytes - tail_bytes, text)) return false;
  std::string_view tail{text};
  const auto record = next_record(tail);
  if (!record || record->what != opcode::footer || tail != magic) return false;
  const auto found = read_footer(record->content);
  const std::uint64_t begin = found ? found->summary_at : 0;
  if (begin < magic.size() || begin > bytes - tail_bytes) return false;
  const std::uint64_t length = bytes - magic.size() - sizeof found->check_sum - begin;
  if (length > summary_bytes_max) return false;
  std::string records(static_cast<std::size_t>(length), '\0');
  if (!from_.read(begin, records)) return false;
  if (found->check_sum != 0 && found->check_sum != check_sum(records)) return false;
  // The header stands behind the magic.
  std::string front(static_cast<std::size_t>(std::min<std::uint64_t>(bytes, 4096)), '\0');
  if (!from_.read(0, front) || !front.starts_with(magic)) return false;
  std::string_view behind = std::string_view{front}.substr(magic.size());
  if (const auto first = next_record(behind); first && first->what == opcode::header) {
    if (auto read = read_header(first->content)) head_ = *std::move(read);
  }
  const std::string_view without_footer =
      std::string_view{records}.substr(0, static_cast<std::size_t>(bytes - tail_bytes - begin));
  if (read_summary_records(without_footer) && lists_all_until(begin)) return true;
  all_ = {};
  return false;
}

// False: they are damaged, or do not say all that there is.
bool reader::read_summary_records(std::string_view records) {
  bool counted = false;
  while (!records.empty()) {
    const auto one = next_record(records);
    if (!one) return false;
    if (one->what == opcode::schema) {
      auto read = read_schema(one->content);
      if (!read) return false;
      all_.schemas.insert_or_assign(read->id, *std::move(read));
    } else if (one->what == opcode::channel) {
      auto read = read_channel(one->content);
      if (!read) return false;
      all_.channels.insert_or_assign(read->id, *std::move(read));
    } else if (one->what == opcode::chunk_index) {
      auto read = read_chunk_index(one->content);
      if (!read || !is_sound(*read)) return false;
      all_.chunks.push_back(*std::move(read));
    } else if (one->what == opcode::attachment_index) {
      auto read = read_attachment_index(one->content);
      if (!read) return false;
      all_.attachments.push_back(*std::move(read));
    } else if (one->what == opcode::metadata_index) {
      auto read = read_metadata_index(one->content);
      if (!read) return false;
      all_.metadata.push_back(*std::move(read));
    } else if (one->what == opcode::statistics) {
      auto read = read_statistics(one->content);
      if (!read) return false;
      all_.counts = *std::move(read);
      counted = true;
    }
  }
  return counted && says_all();
}

// Whether the summary lists all that it counts, and describes the channels that have messages: else it cannot
// take the place of looking through the file.
bool reader::says_all() const {
  const statistics& counts = all_.counts;
  if (all_.chunks.size() != counts.chunks || all_.attachments.size() != counts.attachments ||
      all_.metadata.size() != counts.metadata)
    return false;
  return std::all_of(counts.messages_of.begin(), counts.messages_of.end(), [this](const auto& one) {
    if (one.second == 0) return true;
    const auto of = all_.channels.find(one.first);
    return of != all_.channels.end() && (of->second.schema == 0 || all_.schemas.contains(of->second.schema));
  });
}

// Whether all messages in front of the summary lie in the chunks that it lists: other messages are in no
// list. What lies between all that it lists is little: what describes channels.
bool reader::lists_all_until(std::uint64_t end) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> listed{{end, 0}}; // offsets and bytes
  for (const chunk_index& one : all_.chunks) listed.emplace_back(one.offset, one.bytes + one.indexes_bytes);
  for (const attachment_index& one : all_.attachments) listed.emplace_back(one.offset, one.bytes);
  for (const metadata_index& one : all_.metadata) listed.emplace_back(one.offset, one.bytes);
  std::sort(listed.begin(), listed.end());
  std::uint64_t at = magic.size();
  int records_left = unlisted_records_max;
  std::string head(record_head_bytes, '\0');
  for (const auto& [offset, bytes] : listed) {
    if (offset > end) return false;
    while (at < offset) {
      if (--records_left < 0 || !from_.read(at, head)) return false;
      field_reader fields{head};
      const auto what = static_cast<opcode>(fields.number<std::uint8_t>());
      const auto content_bytes = fields.number<std::uint64_t>();
      if (what == opcode::message || what == opcode::chunk || content_bytes > end - at) return false;
      at += record_head_bytes + content_bytes;
    }
    if (at != offset || bytes > end - at) return false;
    at += bytes;
  }
  return true;
}

bool reader::is_sound(const chunk_index& one) const noexcept {
  return one.offset >= magic.size() && one.bytes >= record_head_bytes && one.offset <= from_.bytes() &&
         one.bytes <= from_.bytes() - one.offset && one.bytes <= chunk_bytes_max;
}

bool reader::read_metadata(const metadata_index& at, text_map& into) {
  if (at.bytes > metadata_bytes_max) return false;
  std::string text(static_cast<std::size_t>(at.bytes), '\0');
  if (!from_.read(at.offset, text)) return false;
  std::string_view from{text};
  const auto record = next_record(from);
  if (!record || record->what != opcode::metadata) return false;
  auto read = mcap::read_metadata(record->content);
  if (read) into = std::move(read->second);
  return read.has_value();
}

// ---- messages

void reader::select(selection wanted) {
  wanted_ = std::move(wanted);
  next_piece_ = 0;
  opened_.clear();
}

bool reader::wants(const piece& one) const {
  if (one.times.latest_ns < wanted_.begin_ns || one.times.earliest_ns > wanted_.end_ns) return false;
  if (wanted_.channels.empty() || one.channels.empty()) return true;
  return std::any_of(one.channels.begin(), one.channels.end(),
                     [this](channel_number each) { return wanted_.channels.contains(each); });
}

const message* reader::next() {
  const auto earliest = [this] {
    return std::min_element(opened_.begin(), opened_.end(), [](const open_piece& a, const open_piece& b) {
      return std::pair{a.next_ns(), a.offset} < std::pair{b.next_ns(), b.offset};
    });
  };
  std::erase_if(opened_, [](const open_piece& one) { return one.at == one.messages.size(); });
  auto at = earliest();
  while (next_piece_ < pieces_.size() &&
         (at == opened_.end() || pieces_[next_piece_].times.earliest_ns <= at->next_ns())) {
    open_piece_at(next_piece_++);
    at = earliest();
  }
  if (at == opened_.end()) return nullptr;
  const placed_message& placed = at->messages[at->at++];
  std::string_view from = std::string_view{at->records}.substr(placed.offset);
  current_ = *read_message(next_record(from)->content); // it was read before
  return &current_;
}

void reader::open_piece_at(std::size_t number) {
  const piece& one = pieces_[number];
  if (!wants(one)) return;
  open_piece made{.offset = one.offset, .records = {}, .messages = {}};
  std::string why = load(one, made.records);
  if (why.empty() && !list_messages(made.records, made.messages)) why = "the records of a chunk are damaged";
  const auto in_memory = std::accumulate(
      opened_.begin(), opened_.end(), std::size_t{0},
      [](std::size_t so_far, const open_piece& each) { return so_far + each.records.size(); });
  if (why.empty() && in_memory != 0 && in_memory + made.records.size() > overlap_bytes_max_)
    why = "more chunks overlap in time than fit into memory";
  if (!why.empty()) {
    const auto same = [&](const damage& known) { return known.offset == one.offset; };
    if (std::none_of(damaged_.begin(), damaged_.end(), same))
      damaged_.push_back({one.offset, one.bytes, std::move(why)});
    return;
  }
  std::erase_if(made.messages, [this](const placed_message& each) {
    const bool in_time = each.logged_ns >= wanted_.begin_ns && each.logged_ns <= wanted_.end_ns;
    return !in_time || (!wanted_.channels.empty() && !wanted_.channels.contains(each.channel));
  });
  if (made.messages.empty()) return;
  std::stable_sort(made.messages.begin(), made.messages.end(),
                   [](const auto& a, const auto& b) { return a.logged_ns < b.logged_ns; });
  opened_.push_back(std::move(made));
}

// Empty: `records` are those of the piece; else why not.
std::string reader::load(const piece& one, std::string& records) {
  std::string& into = one.is_chunk ? packed_ : records;
  into.resize(static_cast<std::size_t>(one.bytes));
  if (!from_.read(one.offset, into)) return "it cannot be read";
  if (!one.is_chunk) return {};
  std::string_view from{packed_};
  const auto chunk = next_record(from);
  if (!chunk || chunk->what != opcode::chunk) return "there is no chunk where the summary says";
  return unpack_chunk(chunk->content, unpacks_, records);
}

} // namespace rowe::mcap
