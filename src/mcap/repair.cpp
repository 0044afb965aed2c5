// SPDX-License-Identifier: Apache-2.0
#include "mcap/repair.hpp"

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <utility>
#include <vector>

#include <unistd.h>

#include "mcap/files.hpp"
#include "mcap/reader.hpp"

namespace rowe::mcap {
namespace {

bool is_indexed(const chunk_index& one) noexcept {
  return std::all_of(one.indexes.begin(), one.indexes.end(),
                     [](const auto& each) { return each.second != 0; });
}

std::string repaired_name(std::string_view path) {
  constexpr std::string_view ending = ".mcap";
  if (path.ends_with(ending)) path.remove_suffix(ending.size());
  return std::string{path} + ".repaired.mcap";
}

class repairer {
 public:
  repairer(const std::string& path, const std::function<void(std::uint64_t, std::uint64_t)>& on_progress)
      : path_{path}, on_progress_{on_progress} {}

  repair_result run() {
    file_source from;
    if (!from.open(path_)) return failed(from.why());
    // The chunk found last, whose index may be missing.
    const scan_visitor tell{.on_chunk = [this](const auto&, auto, const auto& all) { last_messages_ = all; },
                            .on_progress = progress(from)};
    done_.found = scan(from, tell);
    if (!done_.found.wrong.empty()) return failed(done_.found.wrong);
    if (done_.found.ended && done_.found.damaged.empty()) {
      if (read_back(path_)) {
        done_.was_whole = true;
        return finished(path_);
      }
      done_.wrong.clear(); // it has no summary, or a wrong one
    }
    return lacks_its_end_only() ? append_end() : copy_whole_parts(from);
  }

 private:
  repair_result failed(std::string why) {
    done_.wrong = std::move(why);
    return std::move(done_);
  }
  repair_result finished(std::string path) {
    done_.path = std::move(path);
    done_.messages = done_.found.all.counts.messages;
    return std::move(done_);
  }
  std::function<void(std::uint64_t)> progress(const file_source& from) const {
    if (!on_progress_) return {};
    return [this, of = from.bytes()](std::uint64_t bytes) { on_progress_(bytes, of); };
  }

  bool lacks_its_end_only() const {
    const findings& found = done_.found;
    const bool damaged_before =
        std::any_of(found.damaged.begin(), found.damaged.end(),
                    [&](const damage& one) { return one.offset < found.whole_until; });
    const auto& chunks = found.all.chunks;
    const bool indexed = chunks.empty() || std::all_of(chunks.begin(), chunks.end() - 1, is_indexed);
    return found.has_head && !damaged_before && found.loose.empty() && indexed;
  }

  repair_result append_end() {
    summary& all = done_.found.all;
    std::uint64_t end = done_.found.whole_until;
    const bool index_last = !all.chunks.empty() && !is_indexed(all.chunks.back());
    if (index_last) end = all.chunks.back().offset + all.chunks.back().bytes;
    file_sink to;
    if (!to.open(path_, file_sink::access::extend) || !to.truncate(end)) return failed(to.why());
    writer ends{to, {}, end, all};
    if (index_last) ends.index_last_chunk(last_messages_);
    ends.end();
    if (!ends.writes() || !to.close()) return failed(to.why());
    done_.in_place = true;
    return read_back(path_) ? finished(path_) : failed(done_.wrong);
  }

  repair_result copy_whole_parts(file_source& from) {
    const std::string path = repaired_name(path_);
    const std::string unfinished = path + ".unfinished";
    file_sink to;
    if (!to.open(unfinished, file_sink::access::replace)) return failed(unfinished + ": " + to.why());
    writer copies{to, {.profile = done_.found.head.profile, .program = done_.found.head.program}};
    const scan_visitor tell{
        .on_schema = [&](const schema& one) { copies.copy(one); },
        .on_channel = [&](const channel& one) { copies.copy(one); },
        .on_chunk = [&](const chunk_index& of, std::string_view whole,
                        const auto& messages) { copies.copy(of, whole, messages); },
        .on_loose_message = [&](const message& one) { copies.add(one); },
        .on_attachment = [&](const attachment_index& of, std::string_view whole) { copies.copy(of, whole); },
        .on_metadata = [&](const metadata_index& of, std::string_view whole) { copies.copy(of, whole); },
        .on_progress = progress(from)};
    (void)scan(from, tell);
    copies.end();
    if (!copies.writes() || !to.close()) {
      const std::string why = to.why();
      ::unlink(unfinished.c_str());
      return failed(unfinished + ": " + why);
    }
    if (!read_back(unfinished)) return failed(done_.wrong);
    if (std::rename(unfinished.c_str(), path.c_str()) != 0) return failed(path + ": it cannot be renamed");
    return finished(path);
  }

  // Whether the file has a summary, and holds by that what was found.
  bool read_back(const std::string& path) {
    file_source from;
    if (!from.open(path)) {
      done_.wrong = from.why();
      return false;
    }
    reader reads{from};
    std::uint64_t messages = 0;
    if (reads.open() && reads.has_summary())
      while (reads.next() != nullptr) ++messages;
    if (reads.has_summary() && reads.damaged().empty() && messages == done_.found.all.counts.messages)
      return true;
    done_.wrong = "read back, " + path + " holds " + std::to_string(messages) + " messages of " +
                  std::to_string(done_.found.all.counts.messages);
    return false;
  }

  const std::string& path_;
  const std::function<void(std::uint64_t, std::uint64_t)>& on_progress_;
  repair_result done_;
  std::vector<placed_message> last_messages_;
};

} // namespace

repair_result repair(const std::string& path,
                     const std::function<void(std::uint64_t bytes, std::uint64_t of)>& on_progress) {
  return repairer{path, on_progress}.run();
}

} // namespace rowe::mcap
