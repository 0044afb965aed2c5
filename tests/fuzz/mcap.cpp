// SPDX-License-Identifier: Apache-2.0
// Recordings that anybody may have written. What is required: nothing is read that is not there, each message
// comes once and in the order of time, a file that can be looked through can be made whole, and what that
// saves is what was found.
#include <cstdint>
#include <string>
#include <string_view>

#include "fuzz/require.hpp"
#include "mcap/memory_file.hpp"
#include "mcap/scan.hpp"

namespace {

namespace mcap = rowe::mcap;
using memory_file::file;
using rowe::fuzz::require;

std::uint64_t read_all(mcap::reader& from) {
  std::uint64_t messages = 0;
  std::uint64_t last_ns = 0;
  while (const mcap::message* one = from.next()) {
    require(one->logged_ns >= last_ns, "messages come in the order of time");
    last_ns = one->logged_ns;
    ++messages;
  }
  return messages;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  file from;
  from.bytes_written.assign(data, data + bytes);
  mcap::reader reads{from};
  if (reads.open()) (void)read_all(reads);
  file to;
  mcap::writer copies{to, {}};
  const mcap::findings found = mcap::scan(
      from, {.on_schema = [&](const auto& one) { copies.copy(one); },
             .on_channel = [&](const auto& one) { copies.copy(one); },
             .on_chunk = [&](const auto& of, auto whole, const auto& all) { copies.copy(of, whole, all); },
             .on_loose_message = [&](const auto& one) { copies.add(one); },
             .on_attachment = [&](const auto& of, auto whole) { copies.copy(of, whole); },
             .on_metadata = [&](const auto& of, auto whole) { copies.copy(of, whole); }});
  if (!found.wrong.empty()) return 0;
  copies.end();
  mcap::reader again{to};
  require(again.open() && again.has_summary(), "what was copied is whole");
  require(again.all().counts.messages == found.all.counts.messages, "and holds what was found");
  require(read_all(again) == found.all.counts.messages && again.damaged().empty(), "all of it can be read");
  return 0;
}
