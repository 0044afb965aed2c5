// SPDX-License-Identifier: Apache-2.0
// Lines of JSON as recorded messages. The file is read through once: of each line stay its place, time and
// topic. So lines may stand in any order of time, and the file may be larger than the memory.
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <utility>

#include "../console.hpp"
#include "../interrupt.hpp"
#include "../text/json_values.hpp"
#include "../text/times.hpp"
#include "own_topics.hpp"
#include "recorded_messages.hpp"

namespace rowe::tools {
namespace {

constexpr std::size_t lines_between_reports = 4096;
constexpr std::uint64_t faults_most = 20;             // that are told one by one
constexpr std::uint64_t line_bytes_most = 64U << 20U; // what is longer, nobody takes as a message

struct kept_line {
  std::int64_t time_ns = 0;
  std::uint64_t offset = 0; // of the body in the file
  std::uint32_t bytes = 0;  // of the body
  std::uint32_t topic = 0;
};

class kept_lines final : public recorded_messages {
 public:
  explicit kept_lines(lines_options how) : how_{std::move(how)} {}

  // Empty: it is read. Else what is wrong.
  std::string open(const std::string& path, const opening_progress& on_progress) {
    file_.open(path, std::ios::binary);
    if (!file_.is_open()) return joined(printable(path), ": ", std::strerror(errno));
    file_.seekg(0, std::ios::end);
    const auto of = static_cast<double>(file_.tellg());
    file_.seekg(0);
    std::string line;
    std::uint64_t number = 0, offset = 0, wrong_lines = 0;
    while (const std::uint64_t bytes = next_line(line)) {
      ++number;
      const std::string wrong = take(line, offset);
      if (!wrong.empty() && ++wrong_lines <= faults_most)
        faults_.push_back(joined("line ", number, " ", wrong));
      offset += bytes;
      if (number % lines_between_reports != 0) continue;
      on_progress(static_cast<double>(offset) / of);
      if (interrupt::seen()) return joined(printable(path), ": interrupted");
    }
    if (wrong_lines > faults_most)
      faults_.push_back(joined(counted(wrong_lines - faults_most, "line"), " more cannot be taken"));
    if (timed_ != 0 && timed_ != lines_.size())
      return joined(printable(path), ": ", lines_.size() - timed_, " of ", counted(lines_.size(), "line"),
                    " have no \"time\"");
    if (lines_.empty())
      return joined(printable(path), ": no line is {\"topic\":NAME,\"msg\":BODY}",
                    faults_.empty() ? "" : joined("; ", faults_.front()));
    if (timed_ == 0) {
      if (!how_.rate_hz)
        return joined(printable(path), ": its lines have no \"time\": give a --rate, such as 10Hz");
      for (std::size_t i = 0; i < lines_.size(); ++i)
        lines_[i].time_ns = std::llround(static_cast<double>(i) * 1e9 / *how_.rate_hz);
    } else if (how_.rate_hz) {
      return joined(printable(path), ": its lines have times: --rate is a factor, such as 2x");
    }
    std::stable_sort(lines_.begin(), lines_.end(), [](const kept_line& one, const kept_line& other) {
      return one.time_ns < other.time_ns;
    });
    return {};
  }

  const std::vector<recorded_topic>& topics() const noexcept override { return topics_; }
  std::uint64_t messages() const noexcept override { return lines_.size(); }
  std::int64_t begin_ns() const noexcept override { return lines_.front().time_ns; }
  std::int64_t end_ns() const noexcept override { return lines_.back().time_ns; }
  std::size_t message_bytes_max() const override { return longest_; }

  void select(std::int64_t from_ns, std::int64_t until_ns, const std::vector<std::size_t>& topics) override {
    wanted_.assign(topics_.size(), topics.empty());
    for (const std::size_t one : topics) wanted_[one] = true;
    until_ns_ = until_ns;
    at_ = static_cast<std::size_t>(
        std::partition_point(lines_.begin(), lines_.end(),
                             [&](const kept_line& one) { return one.time_ns < from_ns; }) -
        lines_.begin());
  }
  std::optional<kept_message> next() override {
    while (at_ < lines_.size() && lines_[at_].time_ns < until_ns_) {
      const kept_line& one = lines_[at_++];
      if (!wanted_[one.topic]) continue;
      body_.resize(one.bytes);
      file_.clear();
      file_.seekg(static_cast<std::streamoff>(one.offset));
      if (!file_.read(body_.data(), static_cast<std::streamsize>(body_.size()))) {
        faults_.push_back(joined("cannot read ", counted(one.bytes, "byte"), " at byte ", one.offset));
        continue;
      }
      return kept_message{one.topic, one.time_ns, body_};
    }
    return std::nullopt;
  }
  std::vector<std::string> faults() override { return std::exchange(faults_, {}); }

 private:
  // Of one that is longer than anybody takes only so much that this shows. How many bytes it has, its end
  // among them; 0: there is none.
  std::uint64_t next_line(std::string& into) {
    std::streambuf& from = *file_.rdbuf();
    into.clear();
    for (std::uint64_t bytes = 0;;) {
      const auto next = from.sbumpc();
      if (next == std::streambuf::traits_type::eof()) return bytes;
      ++bytes;
      if (next == '\n') return bytes;
      if (into.size() <= line_bytes_most) into += static_cast<char>(next);
    }
  }

  // What is wrong with a line, to be read behind its number; empty: it is kept, or blank.
  std::string take(std::string_view line, std::uint64_t offset) {
    if (line.find_first_not_of(" \t\r") == line.npos) return {};
    if (line.size() > line_bytes_most) return joined("has more than ", line_bytes_most, " bytes");
    if (std::string wrong = object_fault(line); !wrong.empty()) return wrong;
    const json_value whole = read_json(line);
    std::string name = how_.topic;
    json_value body = whole;
    kept_line one;
    if (name.empty()) {
      const auto topic = whole.get<std::string>("topic");
      const auto message = whole.find("msg");
      if (!topic || !message || message->kind() != json_kind::object)
        return "is not {\"topic\":NAME,\"msg\":BODY}";
      name = *topic;
      body = *message;
      if (const auto time = whole.find("time")) {
        const auto ns = nanoseconds_of_member(*time);
        if (!ns) return "has a \"time\" that is neither seconds since 1970 nor in ISO 8601";
        one.time_ns = *ns;
        ++timed_;
      }
    }
    one.offset = offset + static_cast<std::uint64_t>(body.text().data() - line.data());
    one.bytes = static_cast<std::uint32_t>(body.text().size());
    one.topic = place_of(name);
    ++topics_[one.topic].messages;
    longest_ = std::max<std::size_t>(longest_, one.bytes);
    lines_.push_back(one);
    return {};
  }

  static std::optional<std::int64_t> nanoseconds_of_member(json_value time) {
    if (const auto seconds = time.get<double>()) {
      const bool fits = *seconds >= 0 && *seconds < static_cast<double>(INT64_MAX) / 1e9;
      return fits ? std::optional{std::llround(*seconds * 1e9)} : std::nullopt;
    }
    const auto text = time.get<std::string>();
    return text ? iso_time_of(*text) : std::nullopt;
  }

  std::uint32_t place_of(const std::string& name) {
    const auto [at, is_new] = places_.try_emplace(name, static_cast<std::uint32_t>(topics_.size()));
    if (is_new) {
      topics_.emplace_back();
      topics_.back().name = name;
      topics_.back().encoding = json_encoding;
    }
    return at->second;
  }

  lines_options how_;
  std::ifstream file_;
  std::vector<recorded_topic> topics_;
  std::map<std::string, std::uint32_t> places_;
  std::vector<kept_line> lines_;
  std::uint64_t timed_ = 0; // lines that have a time
  std::size_t longest_ = 0;
  std::vector<std::string> faults_;
  // Of select():
  std::vector<bool> wanted_;
  std::int64_t until_ns_ = 0;
  std::size_t at_ = 0;
  std::string body_;
};

} // namespace

std::unique_ptr<recorded_messages> open_lines(const std::string& path, const lines_options& how,
                                              std::string& why, const opening_progress& on_progress) {
  auto lines = std::make_unique<kept_lines>(how);
  why = lines->open(path, on_progress);
  if (!why.empty()) return nullptr;
  return lines;
}

} // namespace rowe::tools
