// SPDX-License-Identifier: Apache-2.0
// The only use of libwebsockets: for handshakes and pages. There is one context for a transport. Every socket
// that it gets is a *duplicate* of one that we keep. To end its part in a connection, we make it close the
// duplicate. So it never owns a socket alone.
//
// The callbacks only set members of a `lws_watch` (and write a page); everything that ends a wsi runs outside
// of them. The end of a wsi is LWS_CALLBACK_WSI_DESTROY and nothing else: lws_adopt_socket_vhost_readbuf()
// may return nullptr with the wsi alive, and a client that waits for its answer may end without any error
// callback.
//
// Service thread, but open() and the destructor. What libwebsockets does in here allocates from a heap of its
// own, of a fixed size (net/lws/lws_memory.hpp); it does so per handshake and page, never per message. A
// server checks the free memory before each of them, because libwebsockets does not handle every failed
// allocation. A client makes one attempt at a time, and there is always memory for one.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include <rowe/result.hpp>

#include "net/base/descriptor.hpp"
#include "net/lws/lws_memory.hpp"
#include "service/base/transport.hpp"
#include "wire/http/http_request.hpp"

struct lws;
struct lws_context;
struct lws_vhost;

namespace rowe::net {

// What we know of a socket while libwebsockets has its duplicate. It must not move until `wsi` is nullptr.
struct lws_watch {
  lws* wsi = nullptr;                // nullptr again once it is destroyed
  int duplicate = -1;                // the number libwebsockets knows
  bool established = false;          // the upgrade is done
  bool answered = false;             // server: a page was written, at least into libwebsockets' buffer
  bool asked = false;                // client: our request is on its way
  bool starved = false;              // server: there was no memory left for it
  bool in_pieces = false;            // server: the page that was asked for is written in pieces
  std::span<const std::byte> rest{}; // server: of a page that is written in pieces, what is not written yet

  // Server: what to answer; valid while adopt() runs.
  const wire::http_judgement* judgement = nullptr;
  const service::http_answer* answer = nullptr; // none: an upgrade

  // Client: what to send; the subprotocol the other side chose; why libwebsockets gave up.
  std::string_view authorization{};
  std::array<char, 64> subprotocol{};
  std::array<char, 96> diagnostic{};
};

struct lws_client_target {
  const char* address = nullptr; // numeric
  std::uint16_t port = 0;
  const char* host = nullptr; // for the Host header
  const char* path = nullptr;
  const char* subprotocols = nullptr; // a list with commas, or nullptr
  std::string_view authorization{};   // the value of that header, or empty. Outlives the attempt
};

enum class lws_role : std::uint8_t { server, client };

class lws_host {
 public:
  // `sockets_max`: how many may be with libwebsockets at once. `memory_bytes`: all that it gets.
  // errc::no_memory when no context can be had.
  static result<std::unique_ptr<lws_host>> open(lws_role role, std::span<const std::string_view> subprotocols,
                                                std::uint32_t sockets_max, std::size_t memory_bytes);
  ~lws_host();
  lws_host(const lws_host&) = delete;
  lws_host& operator=(const lws_host&) = delete;

  // Server: hands over a duplicate and the whole request. Afterwards one of
  //   watch.established: upgraded, and libwebsockets has let go;
  //   watch.wsi:         a page that is not written whole: drive() it whenever the socket is writable;
  //   watch.answered:    a page that is;
  //   watch.starved:     no memory was left, and nothing was answered;
  //   nothing of these:  libwebsockets refused, without an answer.
  void adopt(lws_watch& watch, descriptor duplicate, std::string_view request) noexcept;

  // Client: begins to connect. False when that failed at once. Else watch.duplicate is libwebsockets' socket:
  // the caller duplicates it, and drives when it is writable until watch.asked.
  bool connect(lws_watch& watch, const lws_client_target& target) noexcept;
  // Client: libwebsockets reads `header` as the other side's whole answer, and lets go. True when upgraded.
  bool take_answer(lws_watch& watch, std::string_view header) noexcept;

  // Tells libwebsockets that its duplicate may be written to; watch.wsi is nullptr if that ended it.
  void drive(lws_watch& watch) noexcept;
  // Makes libwebsockets forget the socket and close its duplicate. The peer is sent nothing.
  void let_go(lws_watch& watch) noexcept;

  // libwebsockets' timers and housekeeping; never waits.
  void turn() noexcept;

  const fixed_heap& heap() const noexcept { return memory_.heap(); }

 private:
  struct tables; // the only thing here that needs libwebsockets' header
  lws_host(std::unique_ptr<tables> owned, lws_memory memory) noexcept;
  void service(lws_watch& watch, short events, short found) noexcept;
  void bind(lws_watch& watch, lws* wsi) noexcept;

  std::unique_ptr<tables> tables_;
  lws_memory memory_;
  lws_context* context_ = nullptr;
  lws_vhost* vhost_ = nullptr;
  lws_watch* current_ = nullptr; // whose wsi is being made; later its wsi names it
};

} // namespace rowe::net
