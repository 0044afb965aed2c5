// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/histogram.hpp>

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstring>

namespace rowe::rt {
namespace {

// One line of text in the making. Numbers are written without the locale, right-aligned; what does not fit is
// cut.
class line {
 public:
  line& text(std::string_view piece, std::size_t width = 0) {
    if (piece.size() < width) fill(' ', width - piece.size());
    const std::size_t bytes = std::min(piece.size(), sizeof text_ - used_);
    std::memcpy(text_ + used_, piece.data(), bytes);
    used_ += bytes;
    return *this;
  }
  line& fill(char with, std::size_t times) {
    const std::size_t count = std::min(times, sizeof text_ - used_);
    std::memset(text_ + used_, with, count);
    used_ += count;
    return *this;
  }
  line& number(std::uint64_t value, std::size_t width) {
    char digits[20];
    const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
    return text({digits, static_cast<std::size_t>(end - digits)}, width);
  }
  line& number(double value, int decimals, std::size_t width) {
    char digits[64];
    const auto end = std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, decimals);
    return text(end.ec == std::errc{} ? std::string_view{digits, static_cast<std::size_t>(end.ptr - digits)}
                                      : "?",
                width);
  }
  // "1.02 µs": three figures and the unit in which they are readable; `width` columns.
  line& time(std::uint64_t ns, std::size_t width) {
    static constexpr std::size_t unit_columns = 3;
    static constexpr std::string_view units[] = {" ns", " µs", " ms", " s "};
    auto value = static_cast<double>(ns);
    std::size_t unit = 0;
    for (; value >= 1000 && unit + 1 < std::size(units); ++unit) value /= 1000;
    const int decimals = unit == 0 || value >= 100 ? 0 : value >= 10 ? 1 : 2;
    return number(value, decimals, width - unit_columns).text(units[unit]);
  }
  std::string_view view() const { return {text_, used_}; }

 private:
  char text_[160];
  std::size_t used_ = 0;
};

std::uint64_t total_of(std::span<const counter> counters) noexcept {
  std::uint64_t total = 0;
  for (const counter& c : counters) total += c.get();
  return total;
}

} // namespace

void histogram::clear() noexcept {
  for (counter& c : counters_) c.set(0);
  for (counter* c : {&count_, &sum_, &saturated_, &max_}) c->set(0);
  min_.set(~std::uint64_t{0});
}

bool histogram::add(const histogram& other) noexcept {
  if (other.precision_bits_ != precision_bits_) return false;
  std::uint64_t added = 0;
  for (std::size_t index = 0; index < counters_.size(); ++index) {
    const std::uint64_t more = other.counters_[index].get();
    counters_[index].add(more);
    added += more;
  }
  count_.add(added);
  sum_.add(other.sum_.get());
  saturated_.add(other.saturated_.get());
  min_.set(std::min(min_.get(), other.min_.get()));
  max_.set(std::max(max_.get(), other.max_.get()));
  return true;
}

duration histogram::percentile(double percent) const noexcept {
  duration found;
  percentiles({&percent, 1}, {&found, 1});
  return found;
}

void histogram::percentiles(std::span<const double> percents, std::span<duration> into) const noexcept {
  assert(into.size() == percents.size());
  // The counters' own sum, not count(): beside a recording thread only this one is reached for certain.
  const std::uint64_t total = total_of(counters_);
  std::size_t index = 0;
  std::uint64_t passed = counters_.front().get(); // of the values up to those of counter `index`
  for (std::size_t i = 0; i < percents.size(); ++i) {
    const double share = std::min(std::max(percents[i], 0.0), 100.0) / 100;
    const auto rank = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(total)));
    const std::uint64_t wanted = std::min(std::max<std::uint64_t>(rank, 1), total);
    while (passed < wanted && index + 1 < counters_.size()) passed += counters_[++index].get();
    into[i] = total == 0 ? duration::zero()
                         : std::min(duration{signed_of(highest_of(index, precision_bits_))}, max());
  }
}

void histogram::write_percentiles(put write, void* sink, duration unit) const {
  const auto scale = static_cast<double>(unit.count());
  const auto say = [&](const line& l) { write(sink, l.view()); };
  say(line{}
          .text("Value", 12)
          .text("Percentile", 15)
          .text("TotalCount", 11)
          .text("1/(1-Percentile)", 17)
          .text("\n\n"));

  const std::uint64_t total = total_of(counters_);
  std::uint64_t passed = 0;
  double level = 0; // the share of all values, from 0 to 1, that the next line must reach
  for (std::size_t index = 0; index < counters_.size() && passed < total; ++index) {
    const std::uint64_t here = counters_[index].get();
    if (here == 0) continue;
    passed = std::min(passed + here, total); // a recording thread may have added meanwhile
    const double value = highest_within(index) / scale;
    const double reached = static_cast<double>(passed) / static_cast<double>(total);
    // Five lines for every halving of what is left. The last counter reaches 1, which no halving does: one
    // line for the level where it begins, and one for the end, which has no fourth column.
    for (bool more = true; more && level <= reached;) {
      line l;
      l.number(value, 3, 12)
          .number(level, 12, 15)
          .number(passed, 11)
          .number(1 / (1 - level), 2, 15)
          .text("\n");
      say(l);
      level += 1 / (5 * std::exp2(std::floor(std::log2(1 / (1 - level))) + 1));
      more = passed < total;
    }
    if (passed == total) say(line{}.number(value, 3, 12).number(1.0, 12, 15).number(total, 11).text("\n"));
  }
  const auto foot = [&](std::string_view left, double a, std::string_view right, double b, int decimals) {
    say(line{}.text(left).number(a, decimals, 12).text(right).number(b, decimals, 12).text("]\n"));
  };
  const auto [mean_ns, deviation_ns] = mean_and_deviation();
  foot("#[Mean    = ", mean_ns / scale, ", StdDeviation   = ", deviation_ns / scale, 3);
  line greatest;
  greatest.text("#[Max     = ").number(static_cast<double>(max().count()) / scale, 3, 12);
  say(greatest.text(", Total count    = ").number(total, 12).text("]\n"));
  foot("#[Buckets = ", static_cast<double>(counters_.size() >> precision_bits_),
       ", SubBuckets     = ", std::exp2(precision_bits_), 0);
}

double histogram::highest_within(std::size_t index) const noexcept {
  return std::min(static_cast<double>(highest_of(index, precision_bits_)),
                  static_cast<double>(max().count()));
}

histogram::moments histogram::mean_and_deviation() const noexcept {
  const std::uint64_t total = total_of(counters_);
  if (total == 0) return {};
  const double mean = static_cast<double>(sum_.get()) / static_cast<double>(total);
  double squares = 0;
  for (std::size_t index = 0; index < counters_.size(); ++index) {
    const double middle =
        (static_cast<double>(lowest_of(index, precision_bits_)) + highest_within(index)) / 2;
    squares += (middle - mean) * (middle - mean) * static_cast<double>(counters_[index].get());
  }
  return {mean, std::sqrt(squares / static_cast<double>(total))};
}

void histogram::write_bars(put write, void* sink) const {
  std::array<std::uint64_t, 65> octaves{}; // by the number of bits of the value
  for (std::size_t index = 0; index < counters_.size(); ++index) {
    octaves[static_cast<std::size_t>(std::bit_width(lowest_of(index, precision_bits_)))] +=
        counters_[index].get();
  }
  const std::uint64_t total = total_of(counters_);
  const auto used = [](std::uint64_t n) { return n != 0; };
  const auto first = std::find_if(octaves.begin(), octaves.end(), used);
  const auto end = std::find_if(octaves.rbegin(), octaves.rend(), used).base();
  const double most = std::log1p(static_cast<double>(*std::max_element(octaves.begin(), octaves.end())));
  constexpr std::size_t bar_columns = 40;
  if (first < end)
    write(sink, "     from |      bar: logarithm of the count       |      count      share\n");
  for (auto octave = first; octave < end; ++octave) {
    const auto bits = static_cast<unsigned>(octave - octaves.begin());
    const std::uint64_t from = bits == 0 ? 0 : std::uint64_t{1} << (bits - 1);
    const double share = *octave == 0 ? 0 : std::log1p(static_cast<double>(*octave)) / most;
    const auto bar = std::min(static_cast<std::size_t>(std::ceil(share * bar_columns)), bar_columns);
    const line text = line{}
                          .time(from, 9)
                          .text(" |")
                          .fill('#', bar)
                          .fill(' ', bar_columns - bar)
                          .text("|")
                          .number(*octave, 11)
                          .number(100 * static_cast<double>(*octave) / static_cast<double>(total), 4, 10)
                          .text(" %\n");
    write(sink, text.view());
  }
}

} // namespace rowe::rt
