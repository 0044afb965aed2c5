// SPDX-License-Identifier: Apache-2.0
// Messages in rosbridge's fragments, for tests: cut into them, and put together again as clients do.
#pragma once
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "json/reading/reader.hpp"
#include "json/text/utf8.hpp"
#include "json/writing/writer.hpp"

namespace fragments {

// A JSON string that says the text.
inline std::string quoted(std::string_view text) {
  std::string made(2 + 6 * text.size(), ' ');
  rowe::json::writer out{std::span<char>{made}};
  out.string(text);
  made.resize(out.bytes());
  return made;
}

inline std::string fragment(std::string_view id, std::string_view data, std::size_t number,
                            std::string_view total) {
  return R"({"op":"fragment","id":)" + std::string{id} + R"(,"data":)" + quoted(data) + R"(,"num":)" +
         std::to_string(number) + R"(,"total":)" + std::string{total} + "}";
}

// The bytes from one place to another, each moved back to where a character begins.
inline std::string_view between(std::string_view text, std::size_t from, std::size_t to) {
  const std::size_t begin = rowe::json::utf8_prefix(text, from).size();
  return text.substr(begin, rowe::json::utf8_prefix(text, to).size() - begin);
}

// A text in fragments of about so many bytes. As the reference server writes them: with a fraction in
// `total`.
inline std::vector<std::string> cut(std::string_view text, std::size_t bytes, std::string_view id = R"("m")",
                                    bool as_reference = false) {
  const std::size_t count = (text.size() + bytes - 1) / bytes;
  const std::string total =
      as_reference ? std::to_string(static_cast<double>(text.size() - 1) / static_cast<double>(bytes) + 1)
                   : std::to_string(count);
  std::vector<std::string> made;
  for (std::size_t i = 0; i < count; ++i)
    made.push_back(fragment(id, between(text, i * bytes, (i + 1) * bytes), i, total));
  return made;
}

// Puts one message after the other together, each of whose fragments comes in its order; other messages pass.
class reassembly {
 public:
  std::string wrong;                // empty: nothing was
  std::size_t longest = 0;          // bytes of a fragment's data
  std::vector<std::string> between; // what came between fragments

  std::optional<std::string> take(std::string_view text) {
    if (!text.starts_with(R"({"op":"fragment")")) {
      if (number_ != 0) between.emplace_back(text);
      return std::string{text};
    }
    std::string padded{text};
    padded.append(64, ' ');
    if (!reader_) reader_ = rowe::json::reader::create(128 * 1024, 64).value();
    if (!reader_->validate(std::string_view{padded}.substr(0, text.size()))) {
      wrong = "no JSON: " + std::string{text};
      return std::nullopt;
    }
    const rowe::json::document all = reader_->last();
    const auto number = rowe::json::to_integer(*rowe::json::find(all, "num"));
    const auto total = rowe::json::to_integer(*rowe::json::find(all, "total"));
    const std::string id{rowe::json::find(all, "id")->raw};
    std::string scratch(text.size(), ' ');
    const std::string data{*rowe::json::to_string(*rowe::json::find(all, "data"), scratch)};
    if (!number || !total || *number != number_ || (number_ != 0 && (id != id_ || *total != total_)))
      wrong = "another fragment is due: " + std::string{text};
    id_ = id;
    total_ = *total;
    longest = std::max(longest, data.size());
    whole_ += data;
    if (++number_ != total_) return std::nullopt;
    number_ = 0;
    return std::exchange(whole_, {});
  }
  bool under_way() const { return number_ != 0; }

 private:
  std::optional<rowe::json::reader> reader_;
  std::string id_, whole_;
  std::int64_t number_ = 0, total_ = 0;
};

} // namespace fragments
