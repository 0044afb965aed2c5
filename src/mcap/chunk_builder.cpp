// SPDX-License-Identifier: Apache-2.0
#include "mcap/chunk_builder.hpp"

#include <algorithm>
#include <new>
#include <utility>

#include "mcap/check_sum.hpp"
#include "mcap/record_writer.hpp"

namespace rowe::mcap {

void chunk_builder::add(const message& one) {
  const std::size_t before = gathered_.size();
  placed_.push_back({one.channel, one.logged_ns, before});
  try {
    record_writer into{gathered_};
    write(into, one);
  } catch (const std::bad_alloc&) {
    gathered_.resize(before);
    placed_.pop_back();
    throw;
  }
  times_.add(one.logged_ns);
}

void chunk_builder::drop() noexcept {
  gathered_.clear();
  placed_.clear();
  times_ = {};
}

chunk_index chunk_builder::finish(std::string& into, std::uint64_t offset,
                                  std::vector<placed_message>& messages) {
  chunk_index index{.times = times_,
                    .offset = offset,
                    .compression = std::string{name_of(packs_.how())},
                    .plain_bytes = gathered_.size()};
  const std::size_t begin = into.size();
  record_writer out{into};
  out.begin(opcode::chunk);
  out.time(times_);
  out.number(index.plain_bytes);
  out.number(check_sum(gathered_));
  out.text(index.compression);
  const std::size_t length_at = into.size();
  out.number(std::uint64_t{0});
  packs_.append(into, gathered_);
  index.compressed_bytes = into.size() - length_at - sizeof(std::uint64_t);
  out.patch(length_at, index.compressed_bytes);
  out.end();
  index.bytes = into.size() - begin;
  messages = std::exchange(placed_, {});
  drop();
  append_indexes(into, index, messages, offset + index.bytes);
  return index;
}

void chunk_builder::append_indexes(std::string& into, chunk_index& of, std::vector<placed_message>& messages,
                                   std::uint64_t offset) {
  std::stable_sort(messages.begin(), messages.end(), [](const placed_message& a, const placed_message& b) {
    return std::pair{a.channel, a.logged_ns} < std::pair{b.channel, b.logged_ns};
  });
  const std::size_t begin = into.size();
  record_writer out{into};
  for (auto first = messages.begin(); first != messages.end();) {
    const auto last = std::find_if(
        first, messages.end(), [first](const placed_message& one) { return one.channel != first->channel; });
    of.indexes.emplace_back(first->channel, offset + into.size() - begin);
    out.begin(opcode::message_index);
    out.number(first->channel);
    out.list([&] {
      for (; first != last; ++first) {
        out.number(first->logged_ns);
        out.number(first->offset);
      }
    });
    out.end();
  }
  of.indexes_bytes = into.size() - begin;
}

} // namespace rowe::mcap
