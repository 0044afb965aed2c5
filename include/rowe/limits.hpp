// SPDX-License-Identifier: Apache-2.0
// Every limit of an endpoint, in one place. All memory is a product of these, taken and locked when the
// endpoint opens; nothing grows afterwards. What does not fit is refused, or dropped and counted.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <rowe/result.hpp>

namespace rowe {

// Whether connections are encrypted, which takes memory.
enum class transport_security : std::uint8_t { none, tls };

// The defaults stay below 8 MiB together, Debian's limit on locked memory for ordinary users.
struct limits {
  // Peers.
  // The last two connections and handshakes are reserved for the stop (docs/stop.md); one, if the limit is 2
  // or 3.
  std::uint32_t connections_max = 40;            // established connections; one more is answered 503
  std::uint32_t connections_per_address_max = 8; // from one address (a /64 of IPv6) that is not loopback
  std::uint32_t handshakes_max = 32; // sockets not yet upgraded; one more takes the oldest silent one's place
  std::size_t handshake_bytes = 96 * 1024;        // all the memory for answering them, and for pages
  std::uint32_t message_bytes_max = 60 * 1024;    // one inbound message that is no long one
  std::uint32_t fragments_max = 1024;             // of one inbound message
  std::uint32_t depth_max = 64;                   // nesting of one inbound message
  std::uint32_t messages_per_second_max = 50'000; // of one peer; what is beyond it is dropped, and a peer
                                                  // that goes on for 5 s is disconnected (1008). 0: none
  std::uint32_t refusals_per_second_max = 20;     // of one peer that are answered, likewise; 0: no limit

  // Long messages (docs/long-messages.md): topics' messages, and calls between peers, that are longer than
  // message_bytes_max. One that is longer than long_message_bytes_max ends its connection (1009). Their texts
  // have memory of their own, the product of the two limits, which is not locked and is touched only as it is
  // used. With 0 bytes, or no more than message_bytes_max, there are none.
  std::uint32_t long_message_bytes_max = 1024 * 1024;
  std::uint32_t long_slots = 8; // such messages on their way out at once

  // Topics.
  std::uint32_t topics_max = 160;
  std::uint32_t topic_bytes_max = 128;                  // a topic's name; a type's name likewise
  std::uint32_t subscriptions_max = 1024;               // of all peers together
  std::uint32_t subscriptions_per_connection_max = 128; // of one peer
  std::uint32_t advertisements_per_connection_max = 64; // topics one peer advertises

  // Messages on their way out.
  std::uint32_t small_slots = 512; // encoded messages of up to small_slot_bytes that may exist at once
  std::uint32_t small_slot_bytes = 2 * 1024;
  std::uint32_t large_slots = 12;         // encoded messages of up to message_bytes_max
  std::uint32_t queue_depth_max = 256;    // messages queued for one peer on one topic; the oldest is dropped
  std::uint32_t queued_max = 16 * 1024;   // entries of all those queues together
  std::size_t latched_bytes = 256 * 1024; // the last values of latched topics; peers may have half of it

  // Services and calls.
  std::uint32_t services_max = 96;             // of this process and of all peers
  std::uint32_t calls_max = 128;               // in flight; this process has at most three quarters
  std::uint32_t calls_per_connection_max = 32; // asked by one peer and not answered yet

  std::uint32_t parameters_max = 32; // of this process

  // Threads that are not real-time (endpoint::send, receive, invoke, reply).
  std::uint32_t door_slots = 32;        // messages of theirs on the way out; as many on the way in
  std::uint32_t door_slot_bytes = 4096; // the longest of them, and the longest reply

  // Handles of this process.
  std::uint32_t handles_max = 64;
  // The rings and slots of all handles together. What no handle has is address space only.
  std::size_t handle_bytes = 8192 * 1024;
  std::uint32_t events_max = 256; // events nobody has asked for yet; a further one is counted

  // The bytes that an endpoint with these limits will take, besides those for long messages, which are
  // long_message_bytes_max times long_slots at most, and are not locked. With transport_security::tls those
  // are among them that TLS takes of the heap, at most: some for each connection and each handshake, as peers
  // come. They are not locked. Never allocates.
  std::size_t footprint_bytes(transport_security with = transport_security::none) const noexcept;

  // ---- limits by name, for programs that let their users choose

  // All names, such as "topics_max", in the order above. Never allocates.
  static std::span<const std::string_view> names() noexcept;

  // Sets the limit called `name` to a whole number written in decimal digits. Errors: bad_argument (there is
  // no such limit, or the value is no such number or out of its range). Then nothing is changed, and if `why`
  // is given, a diagnostic with the name, the value and the range is assigned to it. Set-up.
  status set(std::string_view name, std::string_view value, std::string* why = nullptr);

  // These limits, changed by the environment: ROWE_LIMITS_TOPICS_MAX=256 sets topics_max. The library itself
  // never reads it. Errors: as set(), also for a ROWE_LIMITS_... without a limit of that name; the diagnostic
  // names the variable. Set-up: no other thread may change the environment meanwhile.
  result<limits> with_environment(std::string* why = nullptr) const;
};

} // namespace rowe
