// SPDX-License-Identifier: Apache-2.0
// What a thread asks of the kernel and of the heap, counted: costs.cpp stands in front of the calls by which
// the transport reads, writes and waits, and in front of operator new.
#pragma once
#include <cstdint>

namespace rowe::bench::costs {

std::uint64_t calls() noexcept;       // of this thread: send, sendmsg, recv, epoll_wait, epoll_ctl and so on
std::uint64_t allocations() noexcept; // of this thread

} // namespace rowe::bench::costs
