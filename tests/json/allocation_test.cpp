// SPDX-License-Identifier: Apache-2.0
// Nothing allocates after set-up. This program's malloc counts; the C++ heap and every library of the process
// come through it.
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <rowe/json_value.hpp>
#include <rowe/ros.hpp>

#include "decodable.hpp"
#include "encoded.hpp"
#include "padded.hpp"
#include "rt/sanitized.hpp"
#include "rt/seed.hpp"
#include "texts.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/decoder.hpp"
#include "json/structs/encoder.hpp"
#include "json/writing/writer.hpp"

namespace {
std::atomic<std::uint64_t> allocations{0}; // relaxed: read by the one thread that counts
} // namespace

#ifndef ROWE_TEST_SANITIZED
extern "C" {
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* at, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);

void* malloc(std::size_t bytes) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(count, bytes);
}
void* realloc(void* at, std::size_t bytes) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(at, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_memalign(alignment, bytes);
}
}
#endif

namespace rowe::json {
namespace {

using tests::concat;
using tests::padded;
using tests::repeat;

// What `work` allocates.
template <class Work>
std::uint64_t counted(Work work) {
  const std::uint64_t before = allocations.load(std::memory_order_relaxed);
  work();
  return allocations.load(std::memory_order_relaxed) - before;
}

class allocation : public ::testing::Test {
 protected:
  void SetUp() override {
#ifdef ROWE_TEST_SANITIZED
    GTEST_SKIP() << "the sanitizer owns the heap";
#endif
    const std::uint64_t made = counted([] {
      char* volatile kept = new char[4096]; // volatile, or the compiler leaves both out
      delete[] kept;
    });
    ASSERT_GT(made, 0u) << "the count does not count";
  }
};

// Texts of all sizes up to `bytes_max`, valid and not.
std::vector<padded> texts(std::uint64_t s, std::size_t bytes_max) {
  std::mt19937_64 random{s};
  std::vector<padded> all;
  for (const std::string_view text : {"", "{}", "nul", "\"\\ud800\"", "\"\xff\"", "[1,18446744073709552000]",
                                      "[1e400]", "{\"a\":{\"b\":[1,2.5,\"c\\n\"]}}"}) {
    all.emplace_back(text);
  }
  for (std::size_t bytes = 8; bytes <= bytes_max; bytes *= 2) {
    std::string numbers = "[", strings = "[", deep(bytes / 2, '[');
    while (numbers.size() < bytes - 8) numbers += std::to_string(random() >> random() % 64) + ",";
    while (strings.size() < bytes - 8) strings += "\"\\n\\u00e9\",";
    numbers.resize(bytes - 2);
    all.emplace_back(numbers + "0]");
    all.emplace_back(numbers + "0,");
    strings.resize(bytes - 3);
    all.emplace_back(strings + "\"]");
    all.emplace_back(concat({"[\"", repeat("a", bytes - 4), "\"]"}));
    all.emplace_back(concat({"[", repeat("1", bytes - 2), "]"})); // one number of so many digits
    all.emplace_back(repeat("[", bytes - 2) + "]]");
    all.emplace_back(deep);
    all.emplace_back(std::string(bytes + 1, ' '));
  }
  all.emplace_back(std::string(bytes_max + 1, ' '));
  return all;
}

TEST_F(allocation, never_happens_in_a_million_validations_of_all_sizes) {
  const tests::test_seed s;
  constexpr std::size_t bytes_max = 16 * 1024;
  const std::vector<padded> all = texts(s, bytes_max);
  reader r = reader::create(bytes_max).value();
  std::size_t accepted = 0, refused = 0;
  const std::uint64_t made = counted([&] {
    for (std::size_t i = 0; i < 1'000'000; ++i) {
      // Mostly short ones, each long one a few times.
      const padded& p = all[i % (i % 64 == 0 ? all.size() : 24)];
      r.validate(p.text()) ? ++accepted : ++refused;
    }
  });
  EXPECT_EQ(made, 0u);
  EXPECT_GT(accepted, 1000u);
  EXPECT_GT(refused, 1000u);
}

TEST_F(allocation, never_happens_in_walking_and_reading) {
  const std::string text =
      R"({"op":"publish","topic":"\/odom","msg":{"x":0.1234567890123456789,"y":[1,2,3],"z":1e-400,"n":)" +
      std::string(4000, '7') + "e-3990}}";
  const std::uint64_t made = counted([&] {
    for (int i = 0; i < 1000; ++i) {
      std::array<char, 64> scratch;
      object_walk walk{text};
      for (member m; walk.next(m);) (void)to_string(m.what, scratch);
      object_walk inside{find(text, "msg")->raw};
      for (member m; inside.next(m);) (void)to_double(m.what);
    }
  });
  EXPECT_EQ(made, 0u);
}

TEST_F(allocation, never_happens_in_writing_and_encoding) {
  const encoder e = encoder::compile(describe<ros::odometry>()).value();
  std::vector<char> buffer(2 * e.bytes_max() + 1000);
  std::mt19937_64 random{1};
  std::normal_distribution<double> metres;
  const std::uint64_t made = counted([&] {
    for (int i = 0; i < 10'000; ++i) {
      ros::odometry o;
      o.header.frame_id = "odom \xff";
      o.pose.pose.position = {metres(random), metres(random), 1e300};
      for (double& c : o.pose.covariance) c = metres(random);
      writer w{buffer};
      w.begin_object();
      w.key("msg");
      e.encode(&o, w);
      w.key("again");
      e.encode(&o, w);
      w.key("é");
      w.string("\n\xff");
      w.end_object();
      ASSERT_FALSE(w.overflowed());
    }
  });
  EXPECT_EQ(made, 0u);
}

TEST_F(allocation, never_happens_in_reading_by_paths_and_by_schemas) {
  const std::string text = R"({"a":[{"x":1,"y":-2.5,"z":"\u00e4"}],"b":{"x":"far","y":1}})";
  const json_value v = json_value::parse(text).value();
  double sum = 0;
  std::size_t refused = 0;
  std::array<char, json_error::message_bytes_max> buffer;
  const std::uint64_t made = counted([&] {
    for (int i = 0; i < 10'000; ++i) {
      if (const auto p = v.as<tests::point>("a[0]")) sum += p->x;
      if (const auto p = v.as<tests::point>("b"); !p) refused += p.error().message(buffer).size();
      if (const auto y = v.get<double>("a[0].y")) sum += *y;
      if (const auto z = v.get<double>("a[0].z"); !z) refused += z.error().message(buffer).size();
      if (const auto z = v.get<fixed_string<2>>("a[0].z")) sum += static_cast<double>(z->size());
      for (const auto [name, value] : v.members()) sum += name.says("a") ? 1 : 0;
    }
  });
  EXPECT_EQ(made, 0u);
  EXPECT_EQ(sum, 10'000 * (1 - 2.5 + 2 + 1));
  EXPECT_GT(refused, 10'000u * 2 * 30);
}

TEST_F(allocation, never_happens_in_decoding) {
  const decoder d = decoder::compile(describe<tests::everything>()).value();
  tests::everything object;
  object.text = "\n\t";
  object.much_count = 200;
  object.much[7] = 0.1234567890123456;
  const std::string text = tests::encoded(object);
  ASSERT_TRUE(d.decode(text, &object));
  std::string faulty = text; // each with another error, at another place
  std::size_t refused = 0;
  const std::uint64_t made = counted([&] {
    for (std::size_t i = 0; i < 10'000; ++i) {
      char& changed = faulty[1 + i % (faulty.size() - 2)];
      const char was = changed;
      changed = i % 2 == 0 ? '9' : 'n';
      if (!d.decode(faulty, &object)) ++refused;
      changed = was;
      if (!d.decode(text, &object)) return;
    }
  });
  EXPECT_EQ(made, 0u);
  EXPECT_GT(refused, 1000u);
}

TEST_F(allocation, never_happens_with_names_of_enums_and_times) {
  const encoder e = encoder::compile(describe<tests::anything>()).value();
  const decoder d = decoder::compile(describe<tests::anything>()).value();
  std::string buffer(e.bytes_max(), '\0');
  constexpr std::string_view good =
      R"({"stance":"sitting","stances":["standing",-3],"rank":"most","age_s":1.5,"laps":[0.25,7]})";
  constexpr std::string_view faulty = R"({"stances":["standing","flying"],"age_s":1.5})";
  std::size_t read = 0, refused = 0;
  const std::uint64_t made = counted([&] {
    for (int i = 0; i < 10'000; ++i) {
      tests::anything object;
      decoder::diagnosis why;
      std::array<char, decoder::diagnosis::text_bytes_max> words;
      if (!d.decode(faulty, &object, &why) && !why.text(words).empty()) ++refused;
      if (d.decode(good, &object)) ++read;
      writer w{buffer};
      e.encode(&object, w);
    }
  });
  EXPECT_EQ(made, 0u);
  EXPECT_EQ(read, 10'000u);
  EXPECT_EQ(refused, 10'000u);
}

} // namespace
} // namespace rowe::json
