// SPDX-License-Identifier: Apache-2.0
#include "identities.hpp"

#include <algorithm>

#include "../console.hpp"

namespace rowe::tools {
namespace {

constexpr std::string_view blanks = " \t";

std::string_view trimmed(std::string_view text) noexcept {
  const std::size_t begin = text.find_first_not_of(blanks);
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin);
}

// Goes through a text and knows what each line begins in: the middle of a string or of an array, or neither.
class line_reader {
 public:
  explicit line_reader(std::string_view text) noexcept : text_{text} {}

  // The next line, without its end; false after the last.
  bool next() noexcept {
    if (at_ >= text_.size()) return false;
    ++number_;
    begin_ = at_;
    free_ = string_.empty() && depth_ == 0;
    while (at_ < text_.size() && text_[at_] != '\n') step();
    if (string_.size() == 1) string_ = {}; // a string of one line that does not end there: not TOML
    end_ = at_;
    if (at_ < text_.size()) ++at_;
    return true;
  }

  bool is_free() const noexcept { return free_; } // begins neither in a string nor in an array
  bool ended_in_order() const noexcept { return string_.empty() && depth_ == 0; }
  std::string_view line() const noexcept { return text_.substr(begin_, end_ - begin_); }
  std::size_t number() const noexcept { return number_; }
  std::size_t begin() const noexcept { return begin_; }
  std::size_t behind() const noexcept { return at_; } // its end, line break and all

 private:
  bool has(std::string_view what) const noexcept { return text_.substr(at_).starts_with(what); }

  void step() noexcept {
    if (!string_.empty()) {
      in_string();
    } else if (text_[at_] == '#') {
      while (at_ < text_.size() && text_[at_] != '\n') ++at_;
    } else if (has(R"(""")") || has("'''")) {
      string_ = text_.substr(at_, 3);
      at_ += 3;
    } else if (text_[at_] == '"' || text_[at_] == '\'') {
      string_ = text_.substr(at_++, 1);
    } else {
      if (text_[at_] == '[' || text_[at_] == '{') ++depth_;
      if ((text_[at_] == ']' || text_[at_] == '}') && depth_ > 0) --depth_;
      ++at_;
    }
  }

  void in_string() noexcept {
    if (text_[at_] == '\\' && string_[0] == '"') {
      at_ += at_ + 1 < text_.size() && text_[at_ + 1] != '\n' ? 2U : 1U;
    } else if (has(string_)) {
      at_ += string_.size();
      while (string_.size() == 3 && at_ < text_.size() && text_[at_] == string_[0]) ++at_; // """" ends in one
      string_ = {};
    } else {
      ++at_;
    }
  }

  std::string_view text_;
  std::string_view string_; // the quotes that end the one we are in
  std::size_t at_ = 0;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t number_ = 0;
  std::size_t depth_ = 0;
  bool free_ = true;
};

// "identity" of `[[ identity ]]  # who`, whose second bracket is `array`; nothing where it is no header.
std::optional<std::string> header_of(std::string_view line, bool& array) {
  line = trimmed(line);
  if (!line.starts_with('[')) return std::nullopt;
  array = line.starts_with("[[");
  const std::size_t from = array ? 2 : 1;
  std::string name;
  for (const char c : trimmed(line.substr(from, line.find(']') - from))) {
    if (blanks.find(c) == blanks.npos && c != '"' && c != '\'') name += c;
  }
  return name;
}

struct key_and_value {
  std::string key;
  std::string_view value; // up to the end of the line
};

std::optional<key_and_value> pair_of(std::string_view line) {
  const std::size_t equals = line.find('=');
  const std::string_view left = trimmed(line.substr(0, equals));
  if (equals == line.npos || left.empty() || left.starts_with('#')) return std::nullopt;
  const bool quoted = left.size() >= 2 && (left.front() == '"' || left.front() == '\'');
  return key_and_value{std::string{quoted ? left.substr(1, left.size() - 2) : left},
                       trimmed(line.substr(equals + 1))};
}

// A string on one line without escapes; nothing where the value is something else.
std::optional<std::string> plain_string(std::string_view value) {
  if (value.empty() || (value[0] != '"' && value[0] != '\'')) return std::nullopt;
  const std::size_t end = value.find(value[0], 1);
  if (end == value.npos || end == 1) return std::nullopt;
  const std::string_view inside = value.substr(1, end - 1);
  const std::string_view after = trimmed(value.substr(end + 1));
  if (inside.find('\\') != inside.npos || !(after.empty() || after.starts_with('#'))) return std::nullopt;
  return std::string{inside};
}

std::string set(identity& who, const key_and_value& pair) {
  if (pair.key == "token_in_url") {
    who.token_in_url = pair.value.starts_with("true");
    return {};
  }
  std::string* const into = pair.key == "name"           ? &who.name
                            : pair.key == "role"         ? &who.role
                            : pair.key == "token_sha256" ? &who.token_sha256
                            : pair.key == "certificate"  ? &who.certificate
                                                         : nullptr;
  if (into == nullptr) return {};
  const auto value = plain_string(pair.value);
  if (!value) return joined(pair.key, " is not a plain string: ", printable(pair.value));
  *into = *value;
  return {};
}

} // namespace

std::string toml_of(const identity& one) {
  const auto line = [](std::string_view key, const std::string& value) {
    return value.empty() ? "" : joined(key, " = \"", value, "\"\n");
  };
  return joined("[[identity]]\n", line("name", one.name), line("role", one.role),
                line("token_sha256", one.token_sha256), one.token_in_url ? "token_in_url = true\n" : "",
                line("certificate", one.certificate));
}

std::optional<identities_text> identities_text::read(std::string toml, std::string& wrong) {
  identities_text made{std::move(toml)};
  wrong = made.find();
  if (!wrong.empty()) return std::nullopt;
  return made;
}

std::string identities_text::find() {
  blocks_.clear();
  roles_.clear();
  std::string table; // the one we are in
  line_reader lines{text_};
  const auto at_line = [&](std::string_view what) { return joined("line ", lines.number(), ": ", what); };
  while (lines.next()) {
    const bool inside = table == "identity";
    if (!lines.is_free()) { // a value of several lines goes on
      if (inside) blocks_.back().end = lines.behind();
      continue;
    }
    bool array = false;
    if (const auto name = header_of(lines.line(), array)) {
      table = *name;
      const bool identities = table == "identity" || table.starts_with("identity.");
      if (identities && !(array && table == "identity"))
        return at_line("an identity is a table [[identity]], and has none of its own");
      if (table == "identity") blocks_.push_back({{}, lines.begin(), lines.behind()});
      if (table == "role" && array) roles_.emplace_back();
      continue;
    }
    const auto pair = pair_of(lines.line());
    if (!pair) continue;
    if (table.empty() && (pair->key == "identity" || pair->key.starts_with("identity.")))
      return at_line("an identity is a table [[identity]], not a value");
    if (table == "role" && pair->key == "name" && !roles_.empty())
      roles_.back().name = plain_string(pair->value).value_or("");
    if (!inside) continue;
    blocks_.back().end = lines.behind();
    if (const std::string wrong = set(blocks_.back().who, *pair); !wrong.empty()) return at_line(wrong);
  }
  if (!lines.ended_in_order()) return "a string or an array does not end";
  return {};
}

std::vector<identity> identities_text::all() const {
  std::vector<identity> who;
  for (const block& one : blocks_) who.push_back(one.who);
  return who;
}

std::string identities_text::add(const identity& one) {
  access_options asked{.roles = roles_, .identities = all()};
  asked.identities.push_back(one);
  if (std::string wrong = check_access(asked); !wrong.empty()) return wrong;
  if (!text_.empty() && !text_.ends_with('\n')) text_ += '\n';
  if (!text_.empty()) text_ += '\n';
  text_ += toml_of(one);
  return find();
}

bool identities_text::remove(std::string_view name) {
  const auto found =
      std::find_if(blocks_.begin(), blocks_.end(), [&](const block& b) { return b.who.name == name; });
  if (found == blocks_.end()) return false;
  std::size_t begin = found->begin;
  // With it goes the empty line above, so that adding and removing in turn leaves nothing.
  if (begin >= 2 && text_[begin - 1] == '\n' && text_[begin - 2] == '\n') --begin;
  text_.erase(begin, found->end - begin);
  return find().empty();
}

} // namespace rowe::tools
