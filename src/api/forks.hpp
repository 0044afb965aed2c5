// SPDX-License-Identifier: Apache-2.0
// fork() copies a process that has one thread then, but has every socket, and the endpoints' memory is shared
// with the parent (rt/arena.hpp says why). A child that called a handle, or just returned from main(), would
// write where the parent's service thread reads. So each endpoint of a child refuses all calls (errc::forked)
// before fork() returns there.
//
// Only fork() of the C library is seen. vfork() and posix_spawn() need none of this, as their child may do
// nothing before exec(). Whoever calls clone() by itself must call exec() or _exit().
#pragma once

namespace rowe::detail {

class endpoint_state;

namespace forks {

// Any thread. From now on, or no longer, enter_child() is called for it. Waits for a fork() that is under
// way.
void watch(endpoint_state& one);
void forget(endpoint_state& one) noexcept;

} // namespace forks

} // namespace rowe::detail
