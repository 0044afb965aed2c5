// SPDX-License-Identifier: Apache-2.0
#include "recording/series.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <utility>

#include <unistd.h>

#include "recording/losses.hpp"

namespace rowe::recording {
series::series(recording_options chosen)
    : chosen_{std::move(chosen)}, names_{chosen_.path, chosen_.name}, losses_{losses()} {}

// ---- files

bool series::begin(rt::time_point now) {
  if (names_.in_folder()) {
    std::error_code wrong;
    std::filesystem::create_directories(names_.folder(), wrong);
    if (wrong) {
      fault_ = names_.folder() + ": " + wrong.message();
      return false;
    }
    ended_ = names_.there();
    for (const recorded_file& one : ended_)
      if (!has_end(one.path)) unended_.push_back(one.path);
  }
  return open_next(now);
}

bool series::open_next(rt::time_point now) {
  // In a folder the time makes a name new; a file's path is the first one's name, and the next are numbered.
  constexpr std::uint32_t attempts_max = 100'000;
  const std::int64_t begin_ns = wall_clock_ns();
  const bool is_first = files_ == 0;
  mcap::text_map notes{chosen_.metadata.begin(), chosen_.metadata.end()};
  if (!chosen_.name.empty()) notes.insert_or_assign("name", chosen_.name);
  for (std::uint32_t i = names_.in_folder() ? 0 : attempts_; i < attempts_max; ++i) {
    attempts_ = i + 1;
    file_.emplace(names_.name(begin_ns, i), chosen_.packed);
    if (file_->open(notes)) break;
    if (file_->is_there() && (!is_first || names_.in_folder())) continue;
    fault_ = file_->why();
    file_.reset();
    return false;
  }
  if (!file_) return false;
  began_ = now;
  added_ = 0;
  ++files_;
  last_path_ = file_->path();
  fault_.clear();
  for (described_topic& one : topics_) one.channel = 0;
  losses_.channel = 0;
  return true;
}

void series::end_file() {
  fault_ = file_->end(chosen_.sync);
  lost_ += added_ - file_->messages();
  messages_ += file_->messages();
  bytes_ += file_->bytes();
  ended_.push_back({file_->path(), file_->bytes()});
  file_.reset();
}

// Until all files together are within their limit, and there is room on a disk that was full.
void series::delete_oldest() {
  std::uint64_t all = file_ ? file_->bytes() : 0;
  for (const recorded_file& one : ended_) all += one.bytes;
  while (!ended_.empty()) {
    const bool too_many = all > chosen_.total_bytes;
    const bool too_full = !file_ && disk_free(names_.folder()) < disk_free_min;
    if (!too_many && !too_full) return;
    const bool gone = ::unlink(ended_.front().path.c_str()) == 0;
    if (!gone && errno != ENOENT) return; // it may be possible later
    deleted_ += gone ? 1U : 0U;
    all -= ended_.front().bytes;
    ended_.erase(ended_.begin());
  }
}

void series::split_if_due(rt::time_point now) {
  const bool has_bytes = chosen_.split_bytes != 0 && file_->bytes() >= chosen_.split_bytes;
  const bool has_time = chosen_.split_time > rt::duration{0} && now - began_ >= chosen_.split_time;
  const bool has_chunks = file_->writes().written().chunks.size() >= chunks_max ||
                          file_->writes().index_entries() >= index_entries_max;
  if (!has_bytes && !has_time && !has_chunks) return;
  end_file();
  if (fault_.empty()) (void)open_next(now); // fault_ says what is wrong
}

// What no file had room for, in the first one that has.
void series::say_lost() {
  const std::int64_t now_ns = wall_clock_ns();
  for (described_topic& one : topics_) {
    if (one.unsaid == 0 || !file_) continue;
    write(losses_, loss_text(one.name, std::exchange(one.unsaid, 0)), now_ns, now_ns);
  }
}

// ---- messages

void series::set_topic(std::uint32_t number, std::string name, std::string type, std::string schema) {
  topics_.set(number, std::move(name), std::move(type), std::move(schema));
}

bool series::give_channel(described_topic& to) {
  mcap::schema_number schema = 0;
  if (to.has_schema()) {
    const auto added = file_->writes().add_schema(to.schema_name(), "jsonschema", to.schema_text());
    if (!added) return false;
    schema = *added;
  }
  const auto added = file_->writes().add_channel(schema, to.name, "json");
  if (added) to.channel = *added;
  return added.has_value();
}

void series::write(described_topic& of, std::string_view json, std::int64_t logged_ns,
                   std::int64_t published_ns) {
  if (of.channel == 0 && !give_channel(of)) { // a file has no more than 65 535
    end_file();
    if (!fault_.empty() || !open_next(began_) || !give_channel(of)) {
      ++lost_;
      ++of.unsaid;
      return;
    }
  }
  file_->writes().add(of.next(json, logged_ns, published_ns));
  ++added_;
  if (!file_->works()) end_file();
}

void series::add(std::uint32_t number, std::string_view json, std::int64_t logged_ns,
                 std::int64_t published_ns) {
  described_topic* const of = topics_.find(number);
  if (of != nullptr && file_) return write(*of, json, logged_ns, published_ns);
  ++lost_;
  if (of != nullptr) ++of->unsaid;
}

void series::note_lost(std::uint32_t number, std::uint64_t count, std::int64_t logged_ns) {
  described_topic* const of = topics_.find(number);
  if (of == nullptr) return;
  if (file_)
    write(losses_, loss_text(of->name, count), logged_ns, logged_ns);
  else
    of->unsaid += count;
}

void series::end_chunk() {
  if (file_->writes().gathered_bytes() == 0) return;
  file_->writes().end_chunk();
  if (!file_->works() || (chosen_.sync && !file_->sync())) end_file();
}

void series::tend(rt::time_point now, bool) {
  if (!file_) {
    if (!waits_for_room() || now < retry_at_) return;
    retry_at_ = now + retry_time;
    delete_oldest();
    if (disk_free(names_.folder()) >= disk_free_min && open_next(now)) say_lost(); // else fault_ says why not
    return;
  }
  if (now >= chunk_due_) {
    end_chunk();
    chunk_due_ = now + chunk_time;
  }
  if (file_) split_if_due(now);
  if (file_ && chosen_.total_bytes != 0) delete_oldest();
}

bool series::flush() {
  if (file_) end_chunk();
  return fault_.empty();
}

bool series::close() {
  if (file_) end_file();
  return fault_.empty();
}

void series::describe(recording_figures& into) const {
  into.path = last_path_;
  into.files = files_;
  into.deleted = deleted_;
  into.messages = messages_ + (file_ ? file_->messages() : 0);
  into.bytes = bytes_ + (file_ ? file_->bytes() : 0);
  into.lost += lost_;
  into.disk_free = disk_free(names_.folder());
  into.fault = fault_;
}

} // namespace rowe::recording
