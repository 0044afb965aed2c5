// SPDX-License-Identifier: Apache-2.0
// Recordings for the readers of other makers, and what is in those of their writers (tests/web/clients):
//
//   mcap_samples write FOLDER    writes samples, and says what is in each, in the order in which it was
//   written mcap_samples read FILE...    says what is in each, messages in the order of their times
//   mcap_samples repair FILE...  repairs each, and says where what was saved is
//
// Data is said by how many bytes it has and their checksum.
#include <array>
#include <cinttypes>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

#include "mcap/check_sum.hpp"
#include "mcap/files.hpp"
#include "mcap/reader.hpp"
#include "mcap/repair.hpp"
#include "mcap/writer.hpp"

namespace {

namespace mcap = rowe::mcap;

// ---- what is said

std::string sum_of(std::string_view data) {
  return std::to_string(data.size()) + ":" + std::to_string(mcap::check_sum(data));
}
std::string pairs_of(const mcap::text_map& values) {
  std::string all;
  for (const auto& [name, value] : values) all.append(name).append("=").append(value).append(";");
  return all;
}

void say(const mcap::summary& all, const mcap::message& one) {
  const auto on = all.channels.find(one.channel);
  if (on == all.channels.end()) {
    std::printf("message on the unknown channel %u\n", static_cast<unsigned>(one.channel));
    return;
  }
  const mcap::channel& channel = on->second;
  const auto of = all.schemas.find(channel.schema);
  const std::string schema =
      of == all.schemas.end() ? std::to_string(channel.schema)
                              : of->second.name + " " + of->second.encoding + " " + sum_of(of->second.data);
  std::printf("message %s %s {%s} (%s) %" PRIu64 " %" PRIu64 " %" PRIu32 " %s\n", channel.topic.c_str(),
              channel.encoding.c_str(), pairs_of(channel.metadata).c_str(), schema.c_str(), one.logged_ns,
              one.published_ns, one.sequence, sum_of(one.data).c_str());
}
void say_metadata(std::string_view name, const mcap::text_map& values) {
  std::printf("metadata %.*s {%s}\n", static_cast<int>(name.size()), name.data(), pairs_of(values).c_str());
}

// ---- to write

// Compressible, but not to nothing.
std::string some_json(std::size_t bytes) {
  std::string text = R"({"text":")";
  std::uint32_t noise = 1;
  while (text.size() + 2 < bytes)
    text += static_cast<char>('a' + ((noise = noise * 1664525 + 1013904223) >> 29));
  return text + R"("})";
}

class sample {
 public:
  sample(const std::string& folder, const std::string& name, mcap::compression how,
         std::size_t chunk_bytes = 1000) {
    const std::string path = folder + "/" + name + ".mcap";
    if (!to_.open(path, mcap::file_sink::access::replace)) std::perror(path.c_str());
    std::printf("file %s\n", path.c_str());
    into_.emplace(to_, mcap::writer_options{
                           .how = how, .chunk_bytes = chunk_bytes, .profile = "sample", .program = "rowe"});
    const auto number = *into_->add_schema("test/Number", "jsonschema", R"({"type":"object"})");
    const auto other = *into_->add_schema("test/Größe", "ros2msg", "float64 value\n");
    channels_ = {*into_->add_channel(number, "/a", "json"),
                 *into_->add_channel(number, "/b", "json", {{"latched", "true"}, {"rate", "10"}}),
                 *into_->add_channel(other, "/größe", "cdr"), *into_->add_channel(0, "/no/schema", "")};
  }

  void add(std::size_t channel, std::uint64_t logged_ns, std::string_view data) {
    const mcap::message one{.channel = channels_[channel],
                            .sequence = sequence_++,
                            .logged_ns = logged_ns,
                            .published_ns = logged_ns - logged_ns % 1000,
                            .data = data};
    into_->add(one);
    say(into_->written(), one);
  }
  // On all channels in turn, from a time of today on.
  void add_some(std::uint64_t count, std::uint64_t first_ns = 1'760'000'000'123'456'789) {
    for (std::uint64_t n = 0; n < count; ++n)
      add(static_cast<std::size_t>(n % 4), first_ns + n * 1'000'001,
          some_json(12 + static_cast<std::size_t>(n) * 7 % 90));
  }
  void end_chunk() { into_->end_chunk(); }
  void add_metadata(std::string_view name, const mcap::text_map& values) {
    into_->add_metadata(name, values);
    say_metadata(name, values);
  }
  bool end() {
    into_->end();
    return into_->writes() && to_.close();
  }
  // As a program that was killed leaves it.
  bool cut_off() { return into_->writes() && to_.close(); }

 private:
  mcap::file_sink to_;
  std::optional<mcap::writer> into_;
  std::array<mcap::channel_number, 4> channels_{};
  std::uint32_t sequence_ = 0;
};

bool write_samples(const std::string& folder, mcap::compression how, const std::string& ending) {
  bool good = true;
  {
    sample many{folder, "many" + ending, how};
    many.add_some(100);
    many.add_metadata("robot", {{"name", "crawler"}, {"arms", "2"}});
    many.add_some(100, 1'760'000'001'000'000'000);
    many.add_metadata("nothing", {});
    good &= many.end();
  }
  {
    sample empty{folder, "empty" + ending, how};
    good &= empty.end();
  }
  {
    sample described{folder, "metadata_alone" + ending, how};
    described.add_metadata("robot", {{"name", "crawler"}});
    good &= described.end();
  }
  {
    sample large{folder, "large" + ending, how};
    large.add_some(3);
    large.add(1, 1'760'000'000'200'000'000, some_json(3'000'000));
    large.add(3, 1'760'000'000'300'000'000, "");
    large.add_some(3, 1'760'000'000'400'000'000);
    good &= large.end();
  }
  {
    sample default_chunks{folder, "default_chunks" + ending, how, mcap::writer_options{}.chunk_bytes};
    for (std::uint64_t n = 0; n < 100; ++n) default_chunks.add(n % 4, 1000 + n, some_json(50'000 + n));
    good &= default_chunks.end();
  }
  {
    // As by a clock that was set back, with equal times within a chunk and in two.
    sample overlapping{folder, "overlapping" + ending, how};
    for (const std::uint64_t first : {500U, 100U, 300U, 0U}) {
      std::size_t channel = 0;
      for (const std::uint64_t ns : {50U, 350U, 20U, 20U, 20U, 200U, 0U})
        overlapping.add(channel++ % 4, first + ns, some_json(30));
      overlapping.end_chunk();
    }
    good &= overlapping.end();
  }
  {
    sample cut{folder, "cut" + ending, how};
    cut.add_some(40);
    cut.add_metadata("robot", {{"name", "crawler"}});
    cut.add_some(40, 1'760'000'001'000'000'000);
    cut.end_chunk();
    good &= cut.cut_off();
  }
  return good;
}

int write(const std::string& folder) {
  bool good = write_samples(folder, mcap::compression::none, "");
  good &= write_samples(folder, mcap::compression::lz4, ".lz4");
  good &= write_samples(folder, mcap::compression::zstd, ".zstd");
  return good ? 0 : 1;
}

// ---- to read

// The content of the record that an index speaks of.
std::string content_of(mcap::source& from, mcap::opcode what, std::uint64_t offset, std::uint64_t bytes) {
  std::string whole(static_cast<std::size_t>(bytes), '\0');
  if (!from.read(offset, whole)) return {};
  std::string_view rest{whole};
  const auto found = mcap::next_record(rest);
  return found && found->what == what ? std::string{found->content} : std::string{};
}

bool read(const std::string& path) {
  std::printf("file %s\n", path.c_str());
  mcap::file_source from;
  if (!from.open(path)) {
    std::printf("wrong %s\n", from.why().c_str());
    return false;
  }
  mcap::reader reads{from};
  if (!reads.open()) {
    std::printf("wrong %s\n", reads.wrong().c_str());
    return false;
  }
  std::printf("header %s %s\nsummary %s\n", reads.head().profile.c_str(), reads.head().program.c_str(),
              reads.has_summary() ? "yes" : "no");
  while (const mcap::message* one = reads.next()) say(reads.all(), *one);
  for (const mcap::attachment_index& one : reads.all().attachments) {
    const std::string content = content_of(from, mcap::opcode::attachment, one.offset, one.bytes);
    mcap::field_reader fields{content};
    (void)fields.bytes(8 + 8);
    (void)fields.text();
    (void)fields.text();
    const std::string_view data = fields.bytes(fields.number<std::uint64_t>());
    std::printf("attachment %s %s %" PRIu64 " %" PRIu64 " %s\n", one.name.c_str(), one.media_type.c_str(),
                one.logged_ns, one.created_ns, sum_of(data).c_str());
  }
  for (const mcap::metadata_index& one : reads.all().metadata)
    if (const auto found =
            mcap::read_metadata(content_of(from, mcap::opcode::metadata, one.offset, one.bytes)))
      say_metadata(found->first, found->second);
  const mcap::statistics& counts = reads.all().counts;
  std::printf("counts %" PRIu64 " %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", counts.messages, counts.chunks,
              counts.attachments, counts.metadata);
  for (const mcap::damage& one : reads.damaged())
    std::printf("damaged %" PRIu64 " %" PRIu64 " %s\n", one.offset, one.bytes, one.why.c_str());
  return true;
}

bool repair(const std::string& path) {
  const mcap::repair_result done = mcap::repair(path);
  std::printf("file %s\n%s %s\n", path.c_str(), done.wrong.empty() ? "saved" : "wrong",
              done.wrong.empty() ? done.path.c_str() : done.wrong.c_str());
  return done.wrong.empty();
}

} // namespace

int main(int argc, char** argv) {
  const std::string_view verb = argc > 2 ? argv[1] : "";
  if (verb == "write" && argc == 3) return write(argv[2]);
  if (verb != "read" && verb != "repair") {
    std::fputs("usage: mcap_samples write FOLDER | read FILE... | repair FILE...\n", stderr);
    return 2;
  }
  bool good = true;
  for (int i = 2; i < argc; ++i) good &= verb == "read" ? read(argv[i]) : repair(argv[i]);
  return good ? 0 : 1;
}
