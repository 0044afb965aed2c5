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
constexpr std::size_t forget_bytes_min = 1 << 20; // of descriptions: fewer are not worth the look
constexpr std::size_t name_bytes_max = 40;        // of the robot's, in the names of files
constexpr int longest = 12;                       // times `after`, a file goes on at most
constexpr std::uint32_t attempts_max = 1000;
constexpr std::uint32_t asked_notes_max = 50; // of one file; a stop's are never left out
constexpr std::uint64_t asked_boxes_max = 4; // times what is in memory, a file that was asked for has at most
constexpr rt::duration retry_time = std::chrono::seconds{1};
constexpr std::string_view cause_names[] = {"stop", "lease", "asked"};

// What it takes in memory to describe a topic or a type, roughly.
constexpr std::size_t description_bytes(std::string_view key) noexcept { return 2 * key.size() + 200; }

recording_options in_a_folder(recording_options chosen) {
  if (!chosen.path.ends_with('/')) chosen.path += '/';
  chosen.black_box.bytes = std::max<std::size_t>(chosen.black_box.bytes, 1 << 20);
  return chosen;
}

} // namespace

black_box::black_box(recording_options chosen)
    : chosen_{in_a_folder(std::move(chosen))}, chunk_{chosen_.packed}, losses_{losses()} {}

bool black_box::begin(rt::time_point now) {
  now_ = now;
  forget_at_ = forget_bytes_min;
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
  topics_.set(number, std::move(name), std::move(type), std::move(schema));
}

mcap::schema_number black_box::give_schema(const described_topic& of) {
  if (!of.has_schema()) return 0;
  mcap::schema its{
      .name = std::string{of.schema_name()}, .encoding = "jsonschema", .data = std::string{of.schema_text()}};
  std::string key = its.name + '\n' + its.data;
  if (const auto known = schemas_.find(key); known != schemas_.end()) return known->second.id;
  const mcap::schema_number id = its.id = schema_numbers_.take();
  if (id == 0) return 0; // its messages are written all the same
  names_bytes_ += description_bytes(key);
  if (file_) file_->writes().copy(its);
  schemas_.emplace(std::move(key), std::move(its));
  return id;
}

// Peers can make up topics. What describes them counts as messages do: it pushes out the oldest. Numbers of
// what nobody needs are given again, but not while a file is open in which they mean something else.
bool black_box::give_channel(described_topic& to) {
  if (!file_) make_room_for_a_topic();
  const mcap::schema_number schema = give_schema(to);
  std::string key = to.name + '\n' + std::to_string(schema);
  if (const auto known = channels_.find(key); known != channels_.end()) {
    to.channel = known->second.id;
    return true;
  }
  const mcap::channel_number id = channel_numbers_.take();
  if (id == 0) return false;
  const mcap::channel made{.id = id, .schema = schema, .topic = to.name, .encoding = "json"};
  names_bytes_ += description_bytes(key);
  if (file_) file_->writes().copy(made);
  channels_.emplace(std::move(key), made);
  to.channel = id;
  return true;
}

void black_box::make_room_for_a_topic() {
  if (names_bytes_ < forget_at_ && channel_numbers_.has_free()) return;
  forget_unused();
  while (!channel_numbers_.has_free() && !pieces_.empty()) {
    drop_first();
    forget_unused();
  }
}

void black_box::forget_unused() {
  end_chunk();
  std::vector<bool> channels(number_pool::numbers), schemas(number_pool::numbers);
  for (const piece& one : pieces_)
    for (const mcap::channel_number each : one.channels) channels[each] = true;
  std::erase_if(channels_, [&](const auto& one) { return !channels[one.second.id]; });
  for (const auto& [key, one] : channels_) schemas[one.schema] = true;
  std::erase_if(schemas_, [&](const auto& one) { return !schemas[one.second.id]; });
  names_bytes_ = 0;
  for (const auto& [key, one] : channels_) names_bytes_ += description_bytes(key);
  for (const auto& [key, one] : schemas_) names_bytes_ += description_bytes(key);
  for (described_topic& one : topics_)
    if (!channels[one.channel]) one.channel = 0;
  if (!channels[losses_.channel]) losses_.channel = 0;
  channel_numbers_.set_taken(std::move(channels));
  schema_numbers_.set_taken(std::move(schemas));
  forget_at_ = std::max(2 * names_bytes_, forget_bytes_min);
}

void black_box::add_message(described_topic& of, std::string_view json, std::int64_t logged_ns,
                            std::int64_t published_ns) {
  if (of.channel == 0 && !give_channel(of)) { // 65 535 are in use, or were while a file is open
    ++lost_;
    return;
  }
  chunk_.add(of.next(json, logged_ns, published_ns));
  if (chunk_.bytes() >= chunk_bytes) end_chunk();
}

void black_box::add(std::uint32_t number, std::string_view json, std::int64_t logged_ns,
                    std::int64_t published_ns) {
  described_topic* const of = topics_.find(number);
  if (of == nullptr) {
    ++lost_;
    return;
  }
  add_message(*of, json, logged_ns, published_ns);
  const auto happened = triggers_.in(of->name, json);
  if (!happened) return;
  if (*happened == "stop" && chosen_.black_box.on_stop) begin_file("stop", json);
  if (*happened == "lease" && chosen_.black_box.on_lease) begin_file("lease", json);
}

void black_box::note_lost(std::uint32_t number, std::uint64_t count, std::int64_t logged_ns) {
  if (const described_topic* const of = topics_.find(number))
    add_message(losses_, loss_text(of->name, count), logged_ns, logged_ns);
}

void black_box::end_chunk() {
  if (chunk_.empty()) return;
  piece made;
  made.index = chunk_.finish(made.record, 0, made.messages);
  made.record.resize(made.index.bytes); // without its message index, which is made anew in each file
  made.record.shrink_to_fit();          // compressing takes room for what does not shrink
  made.messages.shrink_to_fit();
  for (const auto& [channel, offset] : std::exchange(made.index.indexes, {}))
    made.channels.push_back(channel);
  made.channels.shrink_to_fit();
  if (file_) {
    file_->writes().copy(made.index, made.record, made.messages);
    if (!file_->works() || (chosen_.sync && !file_->sync())) end_file();
  }
  bytes_ += made.bytes();
  pieces_.push_back(std::move(made));
  drop_oldest();
}

void black_box::drop_first() {
  bytes_ -= pieces_.front().bytes();
  pieces_.pop_front();
}

void black_box::drop_oldest() {
  const auto before = static_cast<std::uint64_t>(chosen_.black_box.before.count());
  const std::uint64_t newest = pieces_.back().index.times.latest_ns;
  while (pieces_.size() > 1 && (bytes_ + names_bytes_ > chosen_.black_box.bytes ||
                                pieces_.front().index.times.latest_ns + before < newest))
    drop_first();
}

// ---- files

void black_box::snapshot(std::string_view cause) { begin_file("asked", cause); }

file_names black_box::names_of(std::string_view what) const {
  return {chosen_.path, chosen_.name.substr(0, name_bytes_max) + "-" + std::string{what}};
}

// The names of these files, of which the oldest are deleted so that there may be one more.
file_names black_box::with_room_for_one(std::string_view what) {
  file_names names = names_of(what);
  const auto there = names.there();
  const std::size_t most = std::max(chosen_.black_box.files_max, 1U);
  for (std::size_t i = 0; i < there.size() && there.size() - i >= most; ++i)
    if (::unlink(there[i].path.c_str()) == 0) ++deleted_;
  return names;
}

// Who asks again and again leaves room for the file of a stop.
bool black_box::may_take_more_of_the_disk(std::string_view what) {
  if (what != "asked" || disk_free(chosen_.path) >= 2 * asked_boxes_max * chosen_.black_box.bytes)
    return true;
  fault_ = chosen_.path + ": too little room for a file that was asked for";
  return false;
}

bool black_box::open_file(std::string_view what, std::string_view cause) {
  if (!may_take_more_of_the_disk(what)) return false;
  const file_names names = with_room_for_one(what);
  const std::int64_t begin_ns = wall_clock_ns();
  for (std::uint32_t attempt = 0; attempt < attempts_max; ++attempt) {
    file_.emplace(names.name(begin_ns, attempt), chosen_.packed);
    if (file_->open(notes_of(what, cause))) return true;
    if (!file_->is_there()) break;
  }
  fault_ = file_->why();
  file_.reset();
  return false;
}

// A stop counts for more than what came before it: its files are kept apart.
void black_box::rename_to(std::string_view what) {
  const file_names names = with_room_for_one(what);
  const std::int64_t begin_ns = wall_clock_ns();
  for (std::uint32_t attempt = 0; attempt < attempts_max; ++attempt) {
    if (file_->rename(names.name(begin_ns, attempt))) {
      last_path_ = file_->path();
      what_ = what;
      return;
    }
    if (errno != EEXIST) return; // it keeps its name
  }
}

mcap::text_map black_box::notes_of(std::string_view what, std::string_view cause) const {
  mcap::text_map notes{chosen_.metadata.begin(), chosen_.metadata.end()};
  notes.insert_or_assign("happened", std::string{what});
  notes.insert_or_assign("cause", std::string{cause});
  if (!chosen_.name.empty()) notes.insert_or_assign("name", chosen_.name);
  return notes;
}

// What happens while a file is being written makes that one go on for longer. What follows a stop is in one
// file with it: where the present one must end before, it ends now, and another one begins.
void black_box::begin_file(std::string_view what, std::string_view cause) {
  until_ = rt::deadline_after(now_, chosen_.black_box.after);
  if (file_ && what == "stop" && until_latest_ < until_) {
    end_chunk();
    if (file_) end_file();
  }
  if (file_) return go_on(what, cause);
  end_chunk();
  if (!open_file(what, cause)) {
    if (what != "asked")
      wish_ = wish{std::string{what}, std::string{cause}, rt::deadline_after(now_, retry_time),
                   rt::deadline_after(now_, chosen_.black_box.before)};
    return;
  }
  wish_.reset();
  fault_.clear();
  ++files_;
  what_ = what;
  asked_notes_ = 0;
  last_path_ = file_->path();
  until_latest_ = rt::deadline_after(now_, longest * chosen_.black_box.after);
  for (const auto& [key, one] : schemas_) file_->writes().copy(one);
  for (const auto& [key, one] : channels_) file_->writes().copy(one);
  for (const piece& one : pieces_) file_->writes().copy(one.index, one.record, one.messages);
  if (!file_->works()) end_file();
}

void black_box::go_on(std::string_view what, std::string_view cause) {
  until_ = std::min(until_, until_latest_);
  if (what == "stop" && what_ != "stop") rename_to(what);
  if (what == "asked" && asked_notes_++ >= asked_notes_max) return;
  file_->writes().add_metadata("rowe", notes_of(what, cause));
}

void black_box::end_file() {
  fault_ = file_->end(true); // a file of evidence is worth the wait
  written_messages_ += file_->messages();
  written_bytes_ += file_->bytes();
  file_.reset();
}

void black_box::tend(rt::time_point now, bool drained) {
  now_ = now;
  if (now >= chunk_due_) {
    end_chunk();
    chunk_due_ = now + chunk_time;
  }
  if (wish_ && now >= wish_->next) {
    const wish again = *std::exchange(wish_, std::nullopt);
    if (now < again.until) begin_file(again.what, again.cause);
    if (wish_) wish_->until = again.until;
  }
  if (!file_ || !drained) return;
  const bool too_large = what_ == "asked" && file_->bytes() > asked_boxes_max * chosen_.black_box.bytes;
  if (now < until_ && !too_large) return;
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
  into.messages = written_messages_ + (file_ ? file_->messages() : 0);
  into.bytes = written_bytes_ + (file_ ? file_->bytes() : 0);
  into.retained = bytes_ + names_bytes_ + chunk_.bytes();
  into.lost += lost_;
  into.disk_free = disk_free(chosen_.path);
  into.fault = fault_;
}

} // namespace rowe::recording
