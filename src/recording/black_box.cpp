// SPDX-License-Identifier: Apache-2.0
#include "recording/black_box.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <utility>

#include <unistd.h>

#include "recording/losses.hpp"

namespace rowe::recording {
namespace {

constexpr rt::duration chunk_time = std::chrono::milliseconds{150};
constexpr std::size_t chunk_bytes = 1 << 20;
constexpr std::size_t channels_max = 65'535;
constexpr std::size_t name_bytes_max = 40; // of the robot's, in the names of files
constexpr int longest = 12;                // times `after`, a file goes on at most
constexpr std::size_t notes_max = 100;     // of what happened while a file was written
constexpr std::string_view cause_names[] = {"stop", "lease", "asked"};

recording_options in_a_folder(recording_options chosen) {
  if (!chosen.path.ends_with('/')) chosen.path += '/';
  chosen.black_box.bytes = std::max<std::size_t>(chosen.black_box.bytes, 1 << 20);
  return chosen;
}

} // namespace

black_box::black_box(recording_options chosen)
    : chosen_{in_a_folder(std::move(chosen))},
      chunk_{chosen_.packed},
      losses_{.name = std::string{losses_topic},
              .type = std::string{losses_type},
              .schema = std::string{losses_schema}} {}

bool black_box::begin(rt::time_point now) {
  now_ = now;
  std::error_code wrong;
  std::filesystem::create_directories(chosen_.path, wrong);
  if (wrong) fault_ = chosen_.path + ": " + wrong.message();
  if (!wrong && ::access(chosen_.path.c_str(), W_OK) != 0)
    fault_ = chosen_.path + ": " + std::generic_category().message(errno);
  if (!fault_.empty()) return false;
  for (const std::string_view what : cause_names)
    for (const recorded_file& one : names_of(what).there())
      if (!has_end(one.path)) unended_.push_back(one.path);
  return true;
}

// ---- messages

void black_box::set_topic(std::uint32_t number, std::string name, std::string type, std::string schema) {
  if (topics_.size() <= number) topics_.resize(std::size_t{number} + 1);
  topic& its = topics_[number];
  if (its.name == name && its.type == type && its.schema == schema) return;
  topic made;
  made.name = std::move(name);
  made.type = std::move(type);
  made.schema = std::move(schema);
  its = std::move(made);
}

// Peers can make up topics: what describes them has its share of the memory. Where that is used up, what no
// retained message needs is forgotten.
void black_box::give_channel(topic& to) {
  if (names_bytes_ > chosen_.black_box.bytes / 8 || channels_.size() == channels_max) forget_unused();
  const bool has_schema = !to.type.empty() || !to.schema.empty();
  mcap::schema its{.name = to.type.empty() ? to.name : to.type,
                   .encoding = "jsonschema",
                   .data = to.schema.empty() ? std::string{any_schema} : to.schema};
  mcap::schema_number schema = 0;
  if (has_schema) {
    std::string key = its.name + '\n' + its.data;
    if (const auto known = schemas_.find(key); known != schemas_.end()) {
      schema = known->second.id;
    } else {
      its.id = schema = static_cast<mcap::schema_number>(schemas_.size() + 1);
      if (file_) file_->writes->copy(its);
      names_bytes_ += 2 * key.size() + 200;
      schemas_.emplace(std::move(key), std::move(its));
    }
  }
  std::string key = to.name + '\n' + std::to_string(schema);
  if (const auto known = channels_.find(key); known != channels_.end()) {
    to.channel = known->second.id;
    return;
  }
  mcap::channel made{.id = static_cast<mcap::channel_number>(channels_.size() + 1),
                     .schema = schema,
                     .topic = to.name,
                     .encoding = "json"};
  if (file_) file_->writes->copy(made);
  names_bytes_ += 2 * key.size() + 200;
  const mcap::channel_number id = made.id;
  channels_.emplace(std::move(key), std::move(made));
  to.channel = id;
}

// Numbers would be given again to others, so no file goes on beyond this, and what is retained begins anew: a
// peer has used up what describes topics. What was retained is written first, if it is evidence: a file that
// is open is ended, with all that came.
void black_box::forget_unused() {
  end_chunk();
  if (file_) end_file();
  for (const piece& one : pieces_) lost_ += one.messages.size();
  pieces_.clear();
  bytes_ = names_bytes_ = 0;
  schemas_.clear();
  channels_.clear();
  for (topic& one : topics_) one.channel = 0;
  losses_.channel = 0;
}

void black_box::add_message(topic& of, std::string_view json, std::int64_t logged_ns,
                            std::int64_t published_ns) {
  if (of.channel == 0) give_channel(of);
  const auto as_time = [](std::int64_t ns) {
    return static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0));
  };
  chunk_.add({.channel = of.channel,
              .sequence = of.sequence++,
              .logged_ns = as_time(logged_ns),
              .published_ns = as_time(published_ns != 0 ? published_ns : logged_ns),
              .data = json});
  if (chunk_.bytes() >= chunk_bytes) end_chunk();
}

void black_box::add(std::uint32_t number, std::string_view json, std::int64_t logged_ns,
                    std::int64_t published_ns) {
  if (number >= topics_.size()) { // there was no memory for what describes it
    ++lost_;
    return;
  }
  topic& of = topics_[number];
  add_message(of, json, logged_ns, published_ns);
  const auto happened = triggers_.in(of.name, json);
  if (!happened) return;
  if (*happened == "stop" && chosen_.black_box.on_stop) begin_file("stop", json);
  if (*happened == "lease" && chosen_.black_box.on_lease) begin_file("lease", json);
}

void black_box::note_lost(std::uint32_t number, std::uint64_t count, std::int64_t logged_ns) {
  if (number >= topics_.size()) return;
  add_message(losses_, loss_text(topics_[number].name, count), logged_ns, logged_ns);
}

void black_box::end_chunk() {
  if (chunk_.empty()) return;
  piece made;
  made.index = chunk_.finish(made.record, 0, made.messages);
  made.record.resize(made.index.bytes); // without its message index, which is made anew in each file
  made.record.shrink_to_fit();          // compressing takes room for what does not shrink
  made.messages.shrink_to_fit();
  made.index.indexes = {};
  if (file_) {
    file_->writes->copy(made.index, made.record, made.messages);
    if (!file_->writes->writes() || (chosen_.sync && !file_->to.sync())) end_file();
  }
  bytes_ += made.bytes();
  pieces_.push_back(std::move(made));
  drop_oldest();
}

void black_box::drop_oldest() {
  const auto before = static_cast<std::uint64_t>(chosen_.black_box.before.count());
  const std::uint64_t newest = pieces_.back().index.times.latest_ns;
  while (pieces_.size() > 1 &&
         (bytes_ > chosen_.black_box.bytes || pieces_.front().index.times.latest_ns + before < newest)) {
    bytes_ -= pieces_.front().bytes();
    pieces_.pop_front();
  }
}

// ---- files

void black_box::snapshot(std::string_view cause) { begin_file("asked", cause); }

file_names black_box::names_of(std::string_view what) const {
  return {chosen_.path, chosen_.name.substr(0, name_bytes_max) + "-" + std::string{what}};
}

bool black_box::open_file(std::string_view what) {
  const file_names names = names_of(what);
  auto there = names.there();
  for (std::size_t i = 0; i < there.size() && there.size() - i >= std::max(chosen_.black_box.files_max, 1U);
       ++i)
    if (::unlink(there[i].path.c_str()) == 0) ++deleted_;
  const std::int64_t begin_ns = wall_clock_ns();
  for (std::uint32_t attempt = 0; attempt < 1000; ++attempt) {
    const rt::time_point until = rt::deadline_after(now_, chosen_.black_box.after);
    const rt::time_point latest = rt::deadline_after(now_, longest * chosen_.black_box.after);
    file_.emplace(names.name(begin_ns, attempt), until, latest, std::string{what});
    if (file_->to.open(file_->path, mcap::file_sink::access::create)) return true;
    if (file_->to.error() != EEXIST) break;
  }
  fault_ = file_->path + ": " + file_->to.why();
  file_.reset();
  return false;
}

// A stop counts for more than what came before it: its files are kept apart.
void black_box::rename_to(std::string_view what) {
  const file_names names = names_of(what);
  (void)names.there(); // names are not before these
  for (std::uint32_t attempt = 0; attempt < 1000; ++attempt) {
    const std::string path = names.name(wall_clock_ns(), attempt);
    if (::link(file_->path.c_str(), path.c_str()) != 0) {
      if (errno == EEXIST) continue;
      return; // it keeps its name
    }
    ::unlink(file_->path.c_str());
    last_path_ = file_->path = path;
    file_->what = what;
    return;
  }
}

void black_box::add_notes(std::string_view what, std::string_view cause) {
  mcap::text_map notes{chosen_.metadata.begin(), chosen_.metadata.end()};
  notes.insert_or_assign("happened", std::string{what});
  notes.insert_or_assign("cause", std::string{cause});
  if (!chosen_.name.empty()) notes.insert_or_assign("name", chosen_.name);
  if (file_->writes->written().metadata.size() < notes_max) file_->writes->add_metadata("rowe", notes);
}

// What happens while a file is being written makes that one go on for longer.
void black_box::begin_file(std::string_view what, std::string_view cause) {
  if (file_) {
    file_->until = std::min(rt::deadline_after(now_, chosen_.black_box.after), file_->latest);
    if (what == "stop" && file_->what != "stop") rename_to(what);
    return add_notes(what, cause);
  }
  end_chunk();
  if (!open_file(what)) return;
  fault_.clear();
  ++files_;
  last_path_ = file_->path;
  file_->writes.emplace(file_->to, mcap::writer_options{.how = chosen_.packed, .program = "rowe"});
  add_notes(what, cause);
  for (const auto& [key, one] : schemas_) file_->writes->copy(one);
  for (const auto& [key, one] : channels_) file_->writes->copy(one);
  for (const piece& one : pieces_) file_->writes->copy(one.index, one.record, one.messages);
  if (!file_->writes->writes()) end_file();
}

void black_box::end_file() {
  if (file_->writes->writes()) file_->writes->end();
  std::uint64_t bytes = file_->writes->bytes();
  if (!file_->writes->writes()) {
    fault_ = file_->path + ": " + file_->to.why();
    const mcap::summary& whole = file_->writes->written();
    bytes = file_->writes->whole_bytes();
    (void)file_->to.truncate(bytes); // else there is more behind it, which a reader leaves out
    mcap::writer ends{file_->to, {}, bytes, whole};
    ends.end();
    if (!ends.writes()) (void)file_->to.truncate(bytes);
  }
  // A file of evidence is worth the wait.
  if (!file_->to.close() && fault_.empty()) fault_ = file_->path + ": " + file_->to.why();
  written_messages_ += file_->writes->written().counts.messages;
  written_bytes_ += bytes;
  file_.reset();
}

void black_box::tend(rt::time_point now) {
  now_ = now;
  if (now >= chunk_due_) {
    end_chunk();
    chunk_due_ = now + chunk_time;
  }
  if (!file_ || now < file_->until) return;
  end_chunk();
  if (file_) end_file(); // the disk took the chunk
}

bool black_box::flush() {
  end_chunk();
  return fault_.empty();
}

bool black_box::close() {
  end_chunk();
  if (file_) end_file();
  return fault_.empty();
}

void black_box::describe(recording_figures& into) const {
  into.path = last_path_;
  into.files = files_;
  into.deleted = deleted_;
  into.messages = written_messages_ + (file_ ? file_->writes->written().counts.messages : 0);
  into.bytes = written_bytes_ + (file_ ? file_->writes->bytes() : 0);
  into.retained = bytes_ + names_bytes_ + chunk_.bytes();
  into.lost += lost_;
  into.disk_free = disk_free(chosen_.path);
  into.fault = fault_;
}

} // namespace rowe::recording
