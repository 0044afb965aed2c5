// SPDX-License-Identifier: Apache-2.0
//
// ThreadSanitizer does not see moodycamel's stand-alone fences, and gcc warns about it. These fences order a
// producer's use of a block after its use by takers. Here the numbers do that as well: only the thread that
// holds a slot uses the slot's producer, and that thread has acquired the slot, by operations that the
// sanitizer sees, from the number's last taker.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wtsan"
#endif
#include "service/threads/number_queue.hpp"

#include <cassert>
#include <memory>
#include <utility>

#include <concurrentqueue/concurrentqueue.h>

namespace rowe::service {

// Named, because a type of the header's is made of it.
namespace queue_memory {

// The memory that moodycamel's queue gets while it is set up: a piece of the arena. At all other times there
// is none, so the queue cannot allocate.
struct memory_piece {
  std::byte* next;
  std::byte* end;
};
constinit thread_local memory_piece* source = nullptr;

constexpr std::size_t piece_alignment = alignof(std::max_align_t);
constexpr std::size_t rounded(std::size_t bytes) noexcept {
  return (bytes + piece_alignment - 1) / piece_alignment * piece_alignment;
}

struct queue_traits : moodycamel::ConcurrentQueueDefaultTraits {
  static const std::size_t BLOCK_SIZE = 2; // the smallest there is; a producer holds one number at most
  static const std::size_t EXPLICIT_INITIAL_INDEX_SIZE = 2;         // likewise, in blocks
  static const std::size_t INITIAL_IMPLICIT_PRODUCER_HASH_SIZE = 0; // no producers but those made at set-up

  static void* malloc(std::size_t bytes) noexcept {
    if (source == nullptr || rounded(bytes) > static_cast<std::size_t>(source->end - source->next))
      return nullptr;
    return std::exchange(source->next, source->next + rounded(bytes));
  }
  static void free(void*) noexcept {} // the arena's memory goes with the arena
};

} // namespace queue_memory

namespace {

using queue_memory::memory_piece, queue_memory::piece_alignment, queue_memory::source;
using queue = moodycamel::ConcurrentQueue<std::uint32_t, queue_memory::queue_traits>;

// Makes the producer of one slot, with its first block. That block is enough for ever: only the thread that
// took the number puts it again, and taking leaves the block empty, so the producer can use it again.
void make_producer(queue& of, moodycamel::ProducerToken* at, std::uint32_t slot) noexcept {
  std::construct_at(at, of);
  [[maybe_unused]] const bool there = at->valid() && of.enqueue(*at, slot);
  assert(there); // else the sum in bytes_per_producer() is wrong
}

// The bytes of one producer. It makes one to find out, because moodycamel does not say.
std::size_t bytes_per_producer() noexcept {
  constexpr std::size_t enough = 4096;
  alignas(piece_alignment) std::byte memory[enough];
  memory_piece piece{memory, memory + enough};
  source = &piece;
  {
    queue measured{0};
    alignas(moodycamel::ProducerToken) std::byte token[sizeof(moodycamel::ProducerToken)];
    auto* const producer = reinterpret_cast<moodycamel::ProducerToken*>(token);
    make_producer(measured, producer, 0);
    std::destroy_at(producer);
  }
  source = nullptr;
  return static_cast<std::size_t>(piece.next - memory);
}

} // namespace

struct number_queue::storage {
  queue numbers{0};
  moodycamel::ProducerToken* producers;
};

std::size_t number_queue::footprint_bytes(std::uint32_t slots) noexcept {
  return rt::arena::bytes_for<storage>() + rt::arena::bytes_for<moodycamel::ProducerToken>(slots) +
         rt::arena::bytes_for(bytes_per_producer() * slots);
}

number_queue::number_queue(rt::arena& memory, std::uint32_t slots) noexcept {
  const std::span<std::byte> place = memory.carve_bytes(sizeof(storage));
  const auto tokens = memory.carve_bytes(sizeof(moodycamel::ProducerToken) * slots);
  const auto producers = memory.carve_bytes(bytes_per_producer() * slots);
  assert(!place.empty() && (slots == 0 || !producers.empty())); // footprint_bytes() is the sum
  memory_piece piece{producers.data(), producers.data() + producers.size()};
  source = &piece;
  in_ = ::new (static_cast<void*>(place.data()))
      storage{.producers = reinterpret_cast<moodycamel::ProducerToken*>(tokens.data())};
  for (std::uint32_t slot = 0; slot != slots; ++slot)
    make_producer(in_->numbers, in_->producers + slot, slot);
  source = nullptr;
}

void number_queue::put(std::uint32_t slot) noexcept {
  [[maybe_unused]] const bool put = in_->numbers.try_enqueue(in_->producers[slot], slot);
  assert(put); // else the slot was put twice
}

bool number_queue::take(std::uint32_t& slot) noexcept { return in_->numbers.try_dequeue(slot); }

std::size_t number_queue::take_all(std::span<std::uint32_t> into) noexcept {
  return into.empty() ? 0 : in_->numbers.try_dequeue_bulk(into.data(), into.size());
}

bool number_queue::has_any() const noexcept { return in_->numbers.size_approx() != 0; }

bool number_queue::sees_each_once(std::vector<bool>& seen, std::size_t& count) {
  std::vector<std::uint32_t> found(seen.size() + 1);
  count = take_all(found);
  found.resize(count);
  bool right = count <= seen.size();
  for (const std::uint32_t slot : found) {
    right = right && slot < seen.size() && !seen[slot];
    if (!right) break;
    seen[slot] = true;
    put(slot);
  }
  return right;
}

} // namespace rowe::service
