// SPDX-License-Identifier: Apache-2.0
// A rosbridge text with what became of it.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <gtest/gtest.h>

#include "wire/rosbridge/rosbridge.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire::rosbridge {

inline constexpr name_limits limits{.name_bytes_max = 32, .id_bytes_max = 64};

// The text lies in a block with the tailroom that validation wants.
class decoded {
 public:
  explicit decoded(std::string text) : bytes_{text.size()}, text_{std::move(text) + std::string(64, '\xff')} {
    auto reader = json::reader::create(4096);
    EXPECT_TRUE(reader->validate(view())) << view();
    wrong_ = decode(view(), scratch_, limits, request_);
  }

  const request& operator*() const {
    EXPECT_FALSE(wrong_) << view() << ": " << diagnostic();
    return request_;
  }
  const request* operator->() const { return &**this; }
  std::string diagnostic() const {
    std::array<char, refusal::text_bytes_max> buffer{};
    return wrong_ ? std::string{wrong_->text(buffer)} : "it is not refused";
  }

 private:
  std::string_view view() const { return std::string_view{text_}.substr(0, bytes_); }

  std::size_t bytes_;
  std::string text_;
  std::array<char, scratch_bytes(limits)> scratch_{};
  request request_;
  std::optional<refusal> wrong_;
};

inline decoded read(std::string text) { return decoded{std::move(text)}; }
inline std::string diagnostic_for(std::string text) { return read(std::move(text)).diagnostic(); }

struct wrong {
  const char* text;
  const char* diagnostic;
};
inline void expect_refused(std::span<const wrong> table) {
  for (const wrong& row : table) EXPECT_EQ(diagnostic_for(row.text), row.diagnostic) << row.text;
}

} // namespace rowe::wire::rosbridge
