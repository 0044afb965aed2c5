// SPDX-License-Identifier: Apache-2.0
#include "failures/injection.hpp"

#include <dlfcn.h>
#include <execinfo.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <atomic>
#include <iterator>
#include <string_view>

namespace failures {
namespace {

// Sequentially consistent throughout: nothing here is measured.
constinit std::atomic<kind> armed{kind::none};
constinit std::atomic<std::uint64_t> calls{0};
constinit std::atomic<std::uint64_t> failing{0};
constinit std::atomic<failure*> noted{nullptr};
constinit std::atomic<std::uint16_t> spared_port{0};

// malloc looks at it: no constructor, and the model that needs no call into the loader.
constinit thread_local bool exempt [[gnu::tls_model("initial-exec")]] = false;

// The one of libraries_that_do_not_recover that is calling, or nullptr.
const char* within() noexcept {
  void* frames[48];
  const int count = ::backtrace(frames, static_cast<int>(std::size(frames)));
  for (int i = 0; i < count; ++i) {
    Dl_info where{};
    if (::dladdr(frames[i], &where) == 0) continue;
    const std::string_view path = where.dli_fname != nullptr ? where.dli_fname : "";
    const std::string_view file = path.substr(path.rfind('/') + 1);
    const std::string_view function = where.dli_sname != nullptr ? where.dli_sname : "";
    for (const char* const name : libraries_that_do_not_recover)
      if (file.starts_with(name) || function.starts_with(name)) return name;
  }
  return nullptr;
}

} // namespace

void arm(kind which, std::uint64_t n) noexcept {
  exempt = true;
  calls = 0;
  failing = n;
  armed = which;
}

std::uint64_t disarm() noexcept {
  armed = kind::none;
  return calls;
}

void keep_failure_in(failure& place) noexcept {
  void* frame[1];
  (void)::backtrace(frame, 1); // the first one loads a library
  noted = &place;
}

void spare_connection_of(std::uint16_t peer_port) noexcept { spared_port = peer_port; }

in_the_library::in_the_library() noexcept { exempt = false; }
in_the_library::~in_the_library() { exempt = true; }

bool fails(kind which, const char* call) noexcept {
  if (armed.load() != which || exempt) return false;
  if (++calls != failing.load()) return false;
  exempt = true; // looking does not count
  noted.load()->call = call;
  noted.load()->within = within();
  exempt = false;
  return true;
}

bool spared(int descriptor) noexcept {
  if (armed.load() != kind::system_calls || exempt || spared_port.load() == 0) return false;
  sockaddr_in peer{};
  socklen_t bytes = sizeof peer;
  if (::getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &bytes) != 0) return false;
  return peer.sin_family == AF_INET && ntohs(peer.sin_port) == spared_port.load();
}

} // namespace failures
