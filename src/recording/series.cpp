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
    : chosen_{std::move(chosen)},
      names_{chosen_.path, chosen_.name},
      losses_{.name = std::string{losses_topic},
              .type = std::string{losses_type},
              .schema = std::string{losses_schema}} {}

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
  for (std::uint32_t i = names_.in_folder() ? 0 : attempts_; i < attempts_max; ++i) {
    attempts_ = i + 1;
    if (open_one(names_.name(begin_ns, i), now)) return true;
    if (file_->to.error() != EEXIST || (is_first && !names_.in_folder())) break;
  }
  fault_ = file_->path + ": " + file_->to.why();
  file_.reset();
  return false;
}

bool series::open_one(const std::string& path, rt::time_point now) {
  file_.emplace(path, now);
  if (!file_->to.open(path, mcap::file_sink::access::create)) return false;
  file_->writes.emplace(file_->to, mcap::writer_options{.how = chosen_.packed, .program = "rowe"});
  mcap::text_map notes{chosen_.metadata.begin(), chosen_.metadata.end()};
  if (!chosen_.name.empty()) notes.insert_or_assign("name", chosen_.name);
  file_->writes->add_metadata("rowe", notes);
  if (!file_->writes->writes()) {
    ::unlink(path.c_str());
    return false;
  }
  ++files_;
  last_path_ = path;
  fault_.clear();
  for (topic& one : topics_) one.channel = 0;
  losses_.channel = 0;
  return true;
}

void series::end_file() {
  file_->writes->end();
  if (!file_->writes->writes() || !file_->to.close(chosen_.sync)) return lose_file();
  lost_ += file_->added - file_->writes->messages(); // none, but where there was no memory
  messages_ += file_->writes->messages();
  bytes_ += file_->writes->bytes();
  ended_.push_back({file_->path, file_->writes->bytes()});
  file_.reset();
}

// The disk takes no more. What is whole stays so, and gets an end if there is room for that.
void series::lose_file() {
  fault_ = file_->path + ": " + file_->to.why();
  const mcap::summary& whole = file_->writes->written();
  std::uint64_t bytes = file_->writes->whole_bytes();
  lost_ += file_->added - whole.counts.messages;
  (void)file_->to.truncate(bytes); // else there is more behind it, which a reader leaves out
  mcap::writer ends{file_->to, {}, bytes, whole};
  ends.end();
  if (ends.writes())
    bytes = ends.bytes();
  else
    (void)file_->to.truncate(bytes);
  (void)file_->to.close(chosen_.sync); // there is a fault already
  messages_ += whole.counts.messages;
  bytes_ += bytes;
  ended_.push_back({file_->path, bytes});
  file_.reset();
}

// Until all files together are within their limit, and there is room on a disk that was full.
void series::delete_oldest() {
  std::uint64_t all = file_ ? file_->writes->bytes() : 0;
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
  const bool has_bytes = chosen_.split_bytes != 0 && file_->writes->bytes() >= chosen_.split_bytes;
  const bool has_time = chosen_.split_time > rt::duration{0} && now - file_->began >= chosen_.split_time;
  const bool has_chunks = file_->writes->written().chunks.size() >= chunks_max ||
                          file_->writes->index_entries() >= index_entries_max;
  if (!has_bytes && !has_time && !has_chunks) return;
  end_file();
  if (fault_.empty()) (void)open_next(now); // fault_ says what is wrong
}

// What no file had room for, in the first one that has.
void series::say_lost() {
  const std::int64_t now_ns = wall_clock_ns();
  for (topic& one : topics_) {
    if (one.unsaid == 0 || !file_) continue;
    write(losses_, loss_text(one.name, std::exchange(one.unsaid, 0)), now_ns, now_ns);
  }
}

// ---- messages

void series::set_topic(std::uint32_t number, std::string name, std::string type, std::string schema) {
  if (topics_.size() <= number) topics_.resize(std::size_t{number} + 1);
  topic& its = topics_[number];
  if (its.name == name && its.type == type && its.schema == schema) return;
  topic made;
  made.name = std::move(name);
  made.type = std::move(type);
  made.schema = std::move(schema);
  its = std::move(made);
}

bool series::give_channel(topic& to) {
  mcap::schema_number schema = 0;
  if (!to.type.empty() || !to.schema.empty()) {
    const auto added = file_->writes->add_schema(to.type.empty() ? to.name : to.type, "jsonschema",
                                                 to.schema.empty() ? any_schema : to.schema);
    if (!added) return false;
    schema = *added;
  }
  const auto added = file_->writes->add_channel(schema, to.name, "json");
  if (added) to.channel = *added;
  return added.has_value();
}

void series::write(topic& of, std::string_view json, std::int64_t logged_ns, std::int64_t published_ns) {
  if (of.channel == 0 && !give_channel(of)) { // a file has no more than 65 535
    const rt::time_point began = file_->began;
    end_file();
    if (!fault_.empty() || !open_next(began) || !give_channel(of)) {
      ++lost_;
      ++of.unsaid;
      return;
    }
  }
  file_->writes->add({.channel = of.channel,
                      .sequence = of.sequence++,
                      .logged_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(logged_ns, 0)),
                      .published_ns = static_cast<std::uint64_t>(
                          std::max<std::int64_t>(published_ns != 0 ? published_ns : logged_ns, 0)),
                      .data = json});
  ++file_->added;
  if (!file_->writes->writes()) lose_file();
}

void series::add(std::uint32_t number, std::string_view json, std::int64_t logged_ns,
                 std::int64_t published_ns) {
  if (number >= topics_.size()) { // there was no memory for what describes it
    ++lost_;
    return;
  }
  if (!file_) {
    ++lost_;
    ++topics_[number].unsaid;
    return;
  }
  write(topics_[number], json, logged_ns, published_ns);
}

void series::note_lost(std::uint32_t number, std::uint64_t count, std::int64_t logged_ns) {
  if (number >= topics_.size()) return;
  if (!file_) {
    topics_[number].unsaid += count;
    return;
  }
  write(losses_, loss_text(topics_[number].name, count), logged_ns, logged_ns);
}

void series::end_chunk() {
  if (file_->writes->gathered_bytes() == 0) return;
  file_->writes->end_chunk();
  if (!file_->writes->writes() || (chosen_.sync && !file_->to.sync())) lose_file();
}

void series::tend(rt::time_point now) {
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
  into.messages = messages_ + (file_ ? file_->writes->written().counts.messages : 0);
  into.bytes = bytes_ + (file_ ? file_->writes->bytes() : 0);
  into.lost += lost_;
  into.disk_free = disk_free(names_.folder());
  into.fault = fault_;
}

} // namespace rowe::recording
