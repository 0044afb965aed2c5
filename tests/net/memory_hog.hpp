// SPDX-License-Identifier: Apache-2.0
// Takes all the memory that a transport has for libwebsockets.
#pragma once
#include <libwebsockets.h>

#include "net/lws/lws_memory.hpp"
#include "support.hpp"

namespace rowe::net {

// What is given back, and all the rest, is taken while a page is answered: then it is lent to this thread.
class memory_hog {
 public:
  memory_hog(driver& drive, socket_transport& transport) {
    ::lws_set_allocator(&allocate);
    raw_socket client{transport.port()};
    EXPECT_TRUE(client.send(request(transport.port(), "/")));
    EXPECT_TRUE(drive.until([&] { return client.ended(); }));
    for (int i = 0; i < 10; ++i) drive.turn(); // until its socket is gone, too
    ::lws_set_allocator(&lws_memory::allocate);
  }

 private:
  static void* allocate(void* held, std::size_t bytes, const char* reason) {
    constexpr int most = 4096; // 16 MiB, in case that no memory is lent
    void* const got = lws_memory::allocate(held, bytes, reason);
    for (int i = 0; bytes == 0 && i < most && lws_memory::allocate(nullptr, 4096, reason) != nullptr; ++i)
      ;
    return got;
  }
};

} // namespace rowe::net
