// SPDX-License-Identifier: Apache-2.0
// Clients in a process of their own, so that what they take of memory is not the server's. They connect when
// they are told to, and stay.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "net/base/descriptor.hpp"
#include "tls_client.hpp"

namespace rowe::bench {

class distant_clients {
 public:
  // Only where there is no other thread. `version` 0: no TLS.
  explicit distant_clients(int version) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) return;
    end_.reset(ends[0]);
    const net::descriptor theirs{ends[1]};
    child_ = ::fork();
    if (child_ != 0) return;
    end_.reset();
    serve(theirs.get(), version);
    ::_exit(0);
  }
  distant_clients(const distant_clients&) = delete;
  distant_clients& operator=(const distant_clients&) = delete;
  ~distant_clients() {
    end_.reset(); // it ends with that
    if (child_ > 0) ::waitpid(child_, nullptr, 0);
  }

  void open(std::uint16_t port, int count) {
    const order wanted{port, count};
    good_ = good_ && ::send(end_.get(), &wanted, sizeof wanted, MSG_NOSIGNAL) == sizeof wanted;
  }
  // Whether all are open that were asked for, or one failed; then good() is false.
  bool are_open() {
    bool all = false;
    const ssize_t got = ::recv(end_.get(), &all, sizeof all, MSG_DONTWAIT);
    if (got < 0 && errno == EAGAIN) return !good_;
    good_ = good_ && got == sizeof all && all;
    return true;
  }
  bool good() const { return good_; }

 private:
  struct order {
    std::uint16_t port;
    int count;
  };

  static void serve(int end, int version) {
    const ssl_context with = version != 0 ? client_context(version) : nullptr;
    std::vector<std::unique_ptr<tls_client>> open;
    order wanted{};
    while (::recv(end, &wanted, sizeof wanted, 0) == sizeof wanted) {
      bool all = true;
      for (int i = 0; all && i < wanted.count; ++i) {
        open.push_back(std::make_unique<tls_client>(wanted.port, with.get()));
        tls_client& one = *open.back();
        all = one.ok() && one.shake() && one.ask_for_upgrade(wanted.port) && one.take_answer();
      }
      (void)::send(end, &all, sizeof all, MSG_NOSIGNAL); // else nobody is there any more
    }
  }

  net::descriptor end_;
  pid_t child_ = -1;
  bool good_ = true;
};

} // namespace rowe::bench
